"""Template, 7 of 8 of the Taylor flow: several impacts at one instant, and starts on boundaries
that say nothing of the way.

Newton's law of impact is a law of one contact. Where several close at once the impacts are taken
one after the other until none closes; if what comes out depends on the order, the equations don't
say what happens. Brogliato, Nonsmooth Mechanics (2016), section 5.2.
"""

from saltus.kernels.status import (
    AMBIGUOUS_IMPACT,
    IMPACT_LAW,
    INVALID_RESTITUTION,
    SURFACE_LAW,
)


@inner
def stands_on(lanes, lane, g, hits):
    """Whether the state of a lane is at a stop: it comes there now, hasn't left it, or is held."""
    if LAW[g] != IMPACT_LAW:
        return False
    held = lanes.side[PARTNER[g], lane] > 0.0
    return (hits >> g) & 1 == 1 or lanes.fresh[g, lane] > 0.5 or held


@kernel
def closing_of(lanes, lane, batch, hits, slow):
    """How many of the stops at which a lane stands close, and the largest velocity at which one
    does; what rounding leaves of a velocity doesn't count beside it.
    """
    closing, fastest = 0, 0.0
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        if stands_on(lanes, lane, g, hits):
            fastest = max(fastest, slow.gaps[3 * NGUARDS + g])
    for g in range(NGUARDS):
        closes = stands_on(lanes, lane, g, hits) and slow.gaps[3 * NGUARDS + g] > FELT * fastest
        closing += 1 if closes else 0
    return closing, fastest


@kernel
def take_impacts(lanes, lane, batch, hits, backwards, least, slow):
    """The state in slow.state behind all impacts of this instant, in the order of the guards or
    against it, until none closes faster than `least`; the way that each state went is added to
    probe_rate behind NSTATES. Returns whether they come to an end.
    """
    now, mode = time_of_law(lanes, lane, batch), mode_of(lanes, lane)
    parameters = batch.param[lanes.memo[lane, WHO] * batch.stride]
    show_clocks(lanes, lane, slow)
    for _ in range(MOST_IMPACTS):
        for g in range(NGUARDS):
            slow.gaps[g] = lanes.side[g, lane]
        gaps(now, slow.state, parameters, slow.held, slow.gaps)
        struck = -1
        for place in range(NGUARDS):
            g = NGUARDS - 1 - place if backwards else place
            closes = stands_on(lanes, lane, g, hits) and slow.gaps[3 * NGUARDS + g] > least
            if closes and struck < 0:
                struck = g
        if struck < 0:
            return True
        for i in range(NSTATES):
            lanes.probe_y[i, lane] = slow.state[i]
        reset(now, slow.state, parameters, slow.held, mode, mode, struck, slow.out)
        if not is_restitution(slow.out[0]):
            lanes.memo[lane, FAULT] = INVALID_RESTITUTION
            return True
        for i in range(NSTATES):
            lanes.probe_rate[NSTATES + i, lane] += abs(slow.state[i] - lanes.probe_y[i, lane])
    return False


@inner
def is_restitution(e):
    """Whether a number can be a coefficient of restitution."""
    return -RESTITUTION_ROUNDING <= e <= 1.0 + RESTITUTION_ROUNDING


@kernel
def order_matters(lanes, lane, batch, hits, slow):
    """Where two or more stops close at once, whether their impacts lead to two states, taken in the
    order of the guards and against it. The tangent isn't asked.
    """
    closing, fastest = closing_of(lanes, lane, batch, hits, slow)
    if closing < 2:
        return False
    ends = True
    for i in range(NSTATES):
        lanes.probe_rate[NSTATES + i, lane] = 0.0
    for turn in range(2):
        for i in range(NSTATES):
            slow.state[i] = lanes.y[i, lane]
        ended = take_impacts(lanes, lane, batch, hits, turn == 1, ENDED * fastest, slow)
        ends = ends and ended
        for i in range(NSTATES if turn == 0 else 0):
            lanes.probe_rate[i, lane] = slow.state[i]
    apart = not ends
    for i in range(NMOVED):
        way, size = lanes.probe_rate[NSTATES + i, lane], abs(lanes.y[i, lane])
        difference = abs(slow.state[i] - lanes.probe_rate[i, lane])
        apart = apart or not difference <= FELT * (way + size)
    return apart


@kernel
def end_impacts(lanes, lane, batch, hits, slow):
    """Take all that is left of impacts which cause each other without end at one instant. Stops
    that don't close any more are held where they are pressed. Returns whether one closed.
    """
    _, fastest = closing_of(lanes, lane, batch, hits, slow)
    if fastest <= 0.0:
        return False
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    take_impacts(lanes, lane, batch, hits, False, CLOSED * fastest, slow)
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]
    for g in range(NGUARDS):
        if stands_on(lanes, lane, g, hits) and lanes.side[PARTNER[g], lane] < 0.0:
            snap(lanes, lane, g)
            gaps_here(lanes, lane, batch, slow)
            if abs(slow.gaps[3 * NGUARDS + g]) <= FELT * fastest:
                rest_or_leave(lanes, lane, batch, g, slow)
    return True


@inner
def rest_or_leave(lanes, lane, batch, g, slow):
    """A stop that neither closes nor opens is held if it is pressed; else its gap and its rate are
    known to be zero.
    """
    face(lanes, lane, batch, g, slow)
    if slow.gaps[NGUARDS + g] > 0.0:
        hold(lanes, lane, batch, g, 0.0, slow)
    else:
        lanes.fresh[g, lane] = 2.0
        ask_for_paradox(lanes, lane, g, slow)


@kernel
def strike_together(lanes, lane, batch, hits, slow):
    """The impacts at the end of a step, one after the other. Returns the guards that are left."""
    strikes, standing = False, 0
    for g in range(NGUARDS):
        strikes = strikes or (LAW[g] == IMPACT_LAW and (hits >> g) & 1 == 1)
        standing += 1 if stands_on(lanes, lane, g, hits) else 0
    if strikes and standing > 1 and order_matters(lanes, lane, batch, hits, slow):
        if lanes.memo[lane, FAULT] == 0:
            lanes.memo[lane, FAULT] = AMBIGUOUS_IMPACT
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
                snap(lanes, lane, g)  # another impact has turned it away
            elif not endless:
                strike(lanes, lane, batch, g, gap_rate(lanes, lane, g, d), slow)
                others = True
    return hits


@kernel
def begins_uniquely(lanes, lane, batch, slow):
    """Whether a lane starts on no surface from which both sides lead away."""
    gaps_here(lanes, lane, batch, slow)
    unique = True
    for g in range(NGUARDS):
        if LAW[g] == SURFACE_LAW and slow.gaps[g] == 0.0:
            leads_away = slow.gaps[2 * NGUARDS + g] > 0.0 and slow.gaps[PARTNER[g]] > 0.0
            unique = unique and not leads_away
    return unique
