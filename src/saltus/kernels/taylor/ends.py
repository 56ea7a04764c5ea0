"""Template of the Taylor flow: the end of a run. The state there is all that a run knows which goes
on from it, and that run takes what rounding hides for what holds. So what follows from a contact at
the instant of the end happens in this run, too, and the state is moved by rounding to where its
contacts are.
"""

import math

from saltus.kernels.status import (
    GRAZE_UNRESOLVED,
    HOLD_LAW,
    IMPACT_LAW,
    NO_LAW,
    OK,
    RESTING,
    RUNNING,
    SURFACE_LAW,
)


@kernel
def final_contacts(lanes, lane, batch, slow):
    """Report a gap that is exactly zero, or past zero by rounding, at the very end: once as an
    event there, or as a graze if it turns.
    """
    gaps_here(lanes, lane, batch, slow)
    d, met, past = lanes.found[DELTA, lane], 0, 0
    for g in range(NGUARDS):
        inside = slow.gaps[g] * lanes.side[g, lane]
        if LAWS and lanes.side[WATCHED + g, lane] < 0.5:
            continue
        if lanes.fresh[g, lane] < 0.5 and inside <= 0.0:
            if inside == 0.0 and gap_rate(lanes, lane, g, d) >= 0.0:
                note_touch(lanes, lane, batch, slow, g, d, lanes.run[START, lane])
            else:
                met |= 1 << g
                past |= is_past(lanes, lane, g, slow) << g
    if met != 0:
        note_arrival(lanes, lane)
    if LAWS and met & ~past != 0:
        met = strike_together(lanes, lane, batch, met & ~past, slow)
    for g in range(NGUARDS):
        if (past >> g) & 1:
            jump_over(lanes, lane, batch, g, gap_rate(lanes, lane, g, d), slow)
        elif (met >> g) & 1:
            rate = gap_rate(lanes, lane, g, d)
            if not (LAWS and meet(lanes, lane, batch, g, rate, slow)):
                land(lanes, lane, batch, g, rate, slow)


@kernel
def keep_sides(lanes, lane, batch, slow):
    """Move an end that rounding put on the other side of a boundary, by rounding, to the side on
    which the motion goes on: a run that begins there meets what this one hasn't met, and not again
    what it has. What slides isn't taken to stick there.
    """
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        watched = SNAP_STATE[g] < 0 and (not LAWS or lanes.side[WATCHED + g, lane] > 0.5)
        slides, free = watched and LAW[g] == SURFACE_LAW, LAW[g] == NO_LAW
        free = free or (LAW[g] == IMPACT_LAW and lanes.fresh[g, lane] < 0.5)
        if not slides and not (watched and free and lanes.fresh[g, lane] < RIDDEN):
            continue
        inside, least = slow.gaps[g] * lanes.side[g, lane], 0.0
        size = slow.gaps[SIZES * NGUARDS + g]
        if slides:
            least = 2.0 * noise_of_speed(lanes, lane, batch, g, slow)
            gaps_here(lanes, lane, batch, slow)
        if inside < least:
            wanted = max(2.0 * least, 2.0e-16 * size) - inside
            move_off(lanes, lane, batch, g, inside, wanted, slow)
            gaps_here(lanes, lane, batch, slow)


@kernel
def move_off(lanes, lane, batch, g, inside, wanted, slow):
    """Change the gap of a guard by the state that it depends on most, if that is rounding."""
    most, change = -1, 0.0
    for i in range(NSTATES):
        kept = lanes.y[i, lane]
        lanes.y[i, lane] = kept * (1.0 + ALTERED)
        effect = side_here(lanes, lane, batch, g, slow) - inside
        lanes.y[i, lane] = kept
        if abs(effect) > abs(change):
            most, change = i, effect
    if abs(wanted) < KEPT * abs(change):
        lanes.y[most, lane] *= 1.0 + ALTERED * wanted / change


@kernel
def side_here(lanes, lane, batch, g, slow):
    """Gap of a guard at the node, positive on its side."""
    gaps_here(lanes, lane, batch, slow)
    return slow.gaps[g] * lanes.side[g, lane]


@kernel
def end_rests(lanes, lane, batch, slow):
    """Release the stops at rest that a run which began here would find free: what presses them is
    rounding, and falls. Put the others, and what sticks, onto their constraints, twice: one takes
    the state off another by rounding.
    """
    d = lanes.found[DELTA, lane]
    for look in range(2 * NGUARDS):
        g = look % NGUARDS
        h = PARTNER[g]
        if LAW[g] != HOLD_LAW and h >= 0 and lanes.side[h, lane] > 0.0:
            gaps_here(lanes, lane, batch, slow)
            asked = LAW[g] == IMPACT_LAW and presses(lanes, lane, batch, g, slow) <= 0
            if asked and gap_rate(lanes, lane, h, d) < 0.0:
                release(lanes, lane, batch, h, slow)
                continue
            begin_impacts(lanes, lane, slow)
            now, who = time_of_law(lanes, lane, batch), lanes.memo[lane, WHO]
            mode, p = mode_of(lanes, lane) & ~(1 << h), batch.param[who * batch.stride]
            settle(now, slow.state, p, slow.held, mode, g)
            for i in range(NMOVED):
                lanes.y[i, lane] = slow.state[i]


@inner
def end_stretch(lanes, lane, batch, slow):
    """The end of a period, or of the run. Returns the status."""
    who = lanes.memo[lane, WHO]
    if lanes.memo[lane, COUNT] < batch.end_count[who]:
        landed_now = lanes.run[LANDED, lane] == lanes.clock[TAU, lane] + lanes.clock[BASE, lane]
        lanes.memo[lane, COUNT] += 1
        lanes.clock[TAU, lane] = 0.0
        set_period(lanes, lane, batch, slow)
        if landed_now:  # the same instant, as the new period rounds it
            lanes.run[LANDED, lane] = lanes.clock[BASE, lane]
        if lanes.run[DUE, lane] <= 0.0:
            write_samples(lanes, lane, batch, 0.0, slow)
    if (
        lanes.memo[lane, COUNT] < batch.end_count[who]
        or lanes.clock[TAU, lane] < batch.end_phase[who]
    ):
        return RUNNING
    final_contacts(lanes, lane, batch, slow)
    if LAWS:
        doubt_holds(lanes, lane, batch, slow)
    if LAWS and lanes.memo[lane, FAULT] != 0:
        return lanes.memo[lane, FAULT]
    return look_or_end(lanes, lane, batch, slow)


@inner
def look_or_end(lanes, lane, batch, slow):
    """Let a lane at its end look beyond it if it stands on a boundary; else end. Returns the
    status.
    """
    lanes.run[AHEAD, lane] = 0.0
    for g in range(NGUARDS):
        watched = not LAWS or lanes.side[WATCHED + g, lane] > 0.5
        if watched and lanes.fresh[g, lane] > 0.5:
            lanes.run[AHEAD, lane] = batch.period[lanes.memo[lane, WHO]]
    return RUNNING if lanes.run[AHEAD, lane] > 0.0 else finish(lanes, lane, batch, slow)


@inner
def hold_still(lanes):
    """Of the steps of lanes that look beyond their end keep what is met at once."""
    for lane in range(LANES):
        if lanes.run[AHEAD, lane] > 0.0:
            if lanes.found[DELTA, lane] > 0.0:
                lanes.found[WHICH, lane], lanes.memo[lane, HITS] = -1.0, 0
            lanes.found[DELTA, lane], lanes.found[TURNED, lane] = 0.0, math.inf


@kernel
def end_at_once(lanes, lane, batch, slow):
    """Land what the motion would cross at the end of its run, if it went on, and look again; end
    where there is nothing. What is wrong with the step beyond is left to who goes on. Returns the
    status.
    """
    broken = lanes.memo[lane, BROKEN] != 0 or lanes.memo[lane, FAULT] != 0
    hits = 0 if broken else crossing_guards(lanes, lane)
    lanes.memo[lane, BROKEN], lanes.memo[lane, FAULT] = 0, 0
    lanes.run[TAKEN, lane] -= 1.0  # no time has passed
    status = RUNNING
    if hits != 0:
        status = land_all(lanes, lane, batch, hits, slow)
    lanes.memo[lane, DECIDED] = 0
    if LAWS and lanes.memo[lane, FAULT] != 0:
        return lanes.memo[lane, FAULT]
    if status != RUNNING:
        return status
    if hits != 0:
        return look_or_end(lanes, lane, batch, slow)
    return finish(lanes, lane, batch, slow)


@kernel
def finish(lanes, lane, batch, slow):
    """End a run where nothing more happens. Returns the status."""
    lanes.run[AHEAD, lane] = 0.0
    if LAWS:
        end_rests(lanes, lane, batch, slow)
    keep_sides(lanes, lane, batch, slow)
    if LAWS and lanes.memo[lane, FAULT] != 0:
        return lanes.memo[lane, FAULT]
    for g in range(NGUARDS):
        if (lanes.memo[lane, ALWAYS] >> g) & 1 and LAW[g] == NO_LAW:
            return RESTING
    return GRAZE_UNRESOLVED if lanes.run[SHALLOW, lane] > 0.0 else OK


@kernel
def doubt_holds(lanes, lane, batch, slow):
    """Take the margins of held surfaces that are rounding for zero: a run that began here would
    find such a surface free if its margin falls.
    """
    for g in range(NGUARDS):
        if LAW[g] == SURFACE_LAW and lanes.side[PARTNER[g], lane] > 0.0:
            gaps_here(lanes, lane, batch, slow)
            if presses(lanes, lane, batch, g, slow) <= 0:
                lanes.fresh[PARTNER[g], lane] = 1.0
