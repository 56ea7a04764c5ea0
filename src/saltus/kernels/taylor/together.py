"""Template of the Taylor flow: several impacts at one instant, and starts on boundaries
that don't decide the motion. kernels/impacts.py compares their orders.
"""

from saltus.kernels.status import IMPACT_LAW, INVALID_RESTITUTION, NO_LAW, OK, SURFACE_LAW


@inner
def stands_on(lanes, lane, g, hits):
    """True if the state of a lane is at a stop: it comes there now, hasn't left it, or is held."""
    if LAW[g] != IMPACT_LAW:
        return False
    held = lanes.side[PARTNER[g], lane] > 0.0
    return (hits >> g) & 1 == 1 or lanes.fresh[g, lane] > 0.5 or held


@inner
def standing(lanes, lane, hits):
    """Bits of the stops at which the state of a lane is."""
    stops = 0
    for g in range(NGUARDS):
        stops |= (1 if stands_on(lanes, lane, g, hits) else 0) << g
    return stops


@inner
def begin_impacts(lanes, lane, slow):
    """The state of a lane and its clocks, as kernels/impacts.py takes them."""
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    show_clocks(lanes, lane, slow)


@inner
def orders(lanes, lane, batch, stops, slow):
    """Test that impacts on these stops have one outcome: OK, or the status that ends the motion."""
    begin_impacts(lanes, lane, slow)
    slow.out[OUT_DATED] = 0.0
    p, now = batch.param[lanes.memo[lane, WHO] * batch.stride], time_of_law(lanes, lane, batch)
    mode = mode_of(lanes, lane)
    return order_of_impacts(now, slow.state, p, slow.held, mode, stops, slow.out)


@kernel
def end_impacts(lanes, lane, batch, hits, slow):
    """Complete impacts that cause each other without end at one instant. Stops that don't close any
    more, or open for a time too short for the clock, are held where they are pressed, each by those
    that are held already. True if one closed.
    """
    begin_impacts(lanes, lane, slow)
    load_dates(lanes, lane, slow)
    rows, held, told, stops = slow.state, slow.held, slow.out, standing(lanes, lane, hits)
    now, mode = time_of_law(lanes, lane, batch), mode_of(lanes, lane)
    p = batch.param[lanes.memo[lane, WHO] * batch.stride]
    _, fastest = closing_of(now, rows, p, held, mode, stops, told)
    if fastest <= 0.0:
        return False
    least = CLOSED * fastest
    for i in range(NSTATES):
        lanes.probe_y[i, lane] = lanes.y[i, lane]
    status = take_impacts(now, rows, p, held, mode, mode, stops, False, least, told)
    if status == INVALID_RESTITUTION:
        lanes.memo[lane, FAULT] = INVALID_RESTITUTION
        return True
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]
    turn_over(lanes, lane, batch, mode_behind(lanes, lane, batch, -1, slow), slow)
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        if (stops >> g) & 1:
            if lanes.side[PARTNER[g], lane] > 0.0:
                loosen_one(lanes, lane, batch, g, mode_of(lanes, lane), slow)
            snap(lanes, lane, g)
    if TANGENT and mode_of(lanes, lane) != mode:
        end_impacts_of_tangent(lanes, lane, batch, mode, stops, least, slow)
    for look in range(NGUARDS * NGUARDS):
        g = look % NGUARDS
        if (stops >> g) & 1 and lanes.side[PARTNER[g], lane] < 0.0:
            rest_or_leave(lanes, lane, batch, g, FELT * fastest, slow)
    go_on_together(lanes, lane, batch, stops, slow)
    stick_at_once(lanes, lane, batch, slow)
    return True


@kernel
def end_impacts_of_tangent(lanes, lane, batch, before, stops, least, slow):
    """Let impacts that were completed act on the tangent anew, by the rates in the mode of the lane
    behind them: they have come out of mode `before`, and have released contacts or turned frictions
    (see strike_tangent).
    """
    for i in range(NSTATES):
        slow.state[i] = lanes.probe_y[i, lane]
    show_clocks(lanes, lane, slow)
    load_dates(lanes, lane, slow)
    now, after = time_of_law(lanes, lane, batch), mode_of(lanes, lane)
    p, rows = batch.param[lanes.memo[lane, WHO] * batch.stride], slow.state
    take_impacts(now, rows, p, slow.held, before, after, stops, False, least, slow.out)
    for i in range(NMOVED, NSTATES):
        lanes.y[i, lane] = slow.state[i]


@inner
def rest_or_leave(lanes, lane, batch, g, least, slow):
    """Hold a stop that neither closes nor opens, if it is pressed; else its gap and its rate are
    known to be zero.
    """
    face(lanes, lane, batch, g, slow)
    pressing, velocity = slow.gaps[NGUARDS + g], abs(slow.gaps[3 * NGUARDS + g])
    now = lanes.clock[TAU, lane] + abs(lanes.clock[BASE, lane])
    if pressing > 0.0 and velocity <= max(least, pressing * SHORTEST_FLIGHT * now):
        hold(lanes, lane, batch, g, 0.0, 0.0, slow)
    elif velocity <= least:
        lanes.fresh[g, lane] = 2.0
        ask_for_paradox(lanes, lane, g, slow)


@kernel
def go_on_together(lanes, lane, batch, stops, slow):
    """Take from stops whose gaps and rates are known to be zero what completed impacts have left of
    their rates, down to the rounding of their terms: it is that of the velocities before, and these
    may be much larger than the common one behind. What one gives off the others take, in turn.
    """
    away, rounds = True, 0
    while away and rounds < MOST_IMPACTS:
        away, rounds = False, rounds + 1
        for g in range(NGUARDS):
            rests = (stops >> g) & 1 == 1 and lanes.fresh[g, lane] > 1.5
            if not rests or lanes.side[PARTNER[g], lane] > 0.0:
                continue
            gaps_here(lanes, lane, batch, slow)
            if abs(slow.gaps[3 * NGUARDS + g]) > ROUNDING * slow.gaps[5 * NGUARDS + g]:
                away = True
                begin_impacts(lanes, lane, slow)
                now, who = time_of_law(lanes, lane, batch), lanes.memo[lane, WHO]
                p = batch.param[who * batch.stride]
                settle(now, slow.state, p, slow.held, mode_of(lanes, lane), g)
                for i in range(NMOVED):
                    lanes.y[i, lane] = slow.state[i]


@kernel
def strike_together(lanes, lane, batch, hits, slow):
    """Apply the impacts at the end of a step, one after the other. Returns the guards that are
    left.
    """
    stops, mode = standing(lanes, lane, hits), mode_of(lanes, lane)
    strikes = stops & hits != 0
    if strikes and stops & (stops - 1) != 0:
        outcome = orders(lanes, lane, batch, stops, slow)
        if outcome != OK:
            lanes.memo[lane, FAULT] = outcome
            return 0
    endless = strikes and lanes.run[BOUNCES, lane] >= MOST_STRIKES
    endless = endless and end_impacts(lanes, lane, batch, hits, slow)
    d, others = lanes.found[DELTA, lane], False
    for g in range(NGUARDS):
        if (hits >> g) & 1 and LAW[g] == IMPACT_LAW and lanes.side[g, lane] * LAW_SIDE[g] > 0.0:
            hits &= ~(1 << g)
            if others:
                gaps_here(lanes, lane, batch, slow)
            if others and slow.gaps[3 * NGUARDS + g] < 0.0:
                snap(lanes, lane, g)  # another impact has reversed it
            elif not endless:
                strike(lanes, lane, batch, g, gap_rate(lanes, lane, g, d), slow)
                others = True
    turned = mode ^ mode_of(lanes, lane)
    for g in range(NGUARDS):
        if LAW[g] == NO_LAW and (turned >> g) & 1:
            hits &= ~(1 << g)  # an impact has carried the state over it
    return hits


@kernel
def begins_uniquely(lanes, lane, batch, slow):
    """True if a lane starts on no surface from which both sides lead away."""
    gaps_here(lanes, lane, batch, slow)
    unique = True
    for g in range(NGUARDS):
        if LAW[g] == SURFACE_LAW and slow.gaps[g] == 0.0:
            leads_away = slow.gaps[2 * NGUARDS + g] > 0.0 and slow.gaps[PARTNER[g]] > 0.0
            unique = unique and not leads_away
    return unique
