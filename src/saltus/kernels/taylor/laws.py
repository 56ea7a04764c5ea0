"""Template of the Taylor flow: laws of contact of one lane - impacts, jumps, contacts that
are held: at rest, stuck, sliding along a boundary.

A contact that is held has a guard of its own, the hold guard: on its positive side the equations
are the reduced ones, and its gap says how far the contact is from being released. So a guard is
watched only where it can act: a hold guard while the contact is held, the contact's own guard while
it isn't. docs/decisions/0040.
"""

import math

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.status import (
    CROSSING,
    HOLD,
    HOLD_LAW,
    IMPACT,
    IMPACT_LAW,
    INVALID_FRICTION,
    INVALID_RESTITUTION,
    JUMP_LAW,
    NO_LAW,
    PAINLEVE,
    RELEASE,
    SURFACE_LAW,
)


# -- which guards are watched ----------------------------------------------------------------------
@inner
def watch(lanes, lane):
    """Watch the guards that can act in the mode of a lane."""
    for g in range(NGUARDS):
        held = PARTNER[g] >= 0 and lanes.side[g if LAW[g] == HOLD_LAW else PARTNER[g], lane] > 0.0
        rubs = SUPPORT[g] < 0 or lanes.side[SUPPORT[g], lane] > 0.0
        lanes.side[WATCHED + g, lane] = 1.0 if rubs and held == (LAW[g] == HOLD_LAW) else 0.0


@inner
def base_of_law(lanes, lane, batch):
    """Start of the period as laws read the time. If the forcing repeats to the bit it is that of
    the first period, which is accurate to rounding after any number of periods.
    """
    if NCLOCKS == 0 and lanes.memo[lane, DRIFTS] == 0:
        return batch.origin[lanes.memo[lane, WHO]]
    return lanes.clock[BASE, lane]


@inner
def time_of_law(lanes, lane, batch):
    """The time as laws read it, see `base_of_law`."""
    return lanes.clock[TAU, lane] + base_of_law(lanes, lane, batch)


# -- contacts by their laws ------------------------------------------------------------------------
@kernel
def meet(lanes, lane, batch, g, rate, slow):
    """Apply the law of a guard to a contact; return True if it applies."""
    if LAW[g] == HOLD_LAW:
        release(lanes, lane, batch, g, slow)
        return True
    if LAW[g] == SURFACE_LAW:
        return caught(lanes, lane, batch, g, slow)
    if (LAW[g] == IMPACT_LAW or LAW[g] == JUMP_LAW) and lanes.side[g, lane] * LAW_SIDE[g] > 0.0:
        strike(lanes, lane, batch, g, rate, slow)
        return True
    return False


@kernel
def note(lanes, lane, batch, g, kind, direction, velocity, before, later, slow):
    """Count and record the effect of a law on the state in slow.state, `later` seconds after now.
    At the start of a run it is an initial condition, and no event.
    """
    if lanes.run[STARTING, lane] > 0.5:
        who = lanes.memo[lane, WHO]
        for m in range(batch.cursor[who]):
            batch.sample_mode[who, m] = mode_of(lanes, lane)
        return
    lanes.run[MET, lane] += 1.0
    if not recorded(lanes, lane, batch):
        return
    tau = lanes.clock[TAU, lane]
    error = CHATTER * later + 2.0e-16 * (tau + abs(lanes.clock[BASE, lane]))
    if velocity != 0.0:
        error = time_error(lanes, lane, g, velocity, tau)
    record(
        lanes,
        lane,
        batch,
        tau + later,
        g,
        direction,
        velocity,
        kind,
        before,
        mode_of(lanes, lane),
        error,
        slow.state,
    )


@inner
def carried_over(lanes, lane, g):
    """True if another jump has put the state beyond a boundary, so that it isn't on it."""
    near = TOLD * ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]
    at_once = lanes.found[DELTA, lane] == 0.0 and lanes.fresh[g, lane] < 0.5
    return at_once and abs(lanes.work[GAP_ROW + g, lane]) > near


@inner
def load_dates(lanes, lane, slow):
    """Show a jump the derivatives of this instant, if one has found them."""
    slow.out[OUT_DATED] = lanes.run[DATED, lane]
    for j in range(NCOLUMNS):
        slow.out[OUT_DATES + j] = lanes.run[DATES + j, lane]


@inner
def keep_dates(lanes, lane, slow):
    """Keep the derivatives of this instant for the jumps that follow: where impacts cause each
    other, their gaps and rates become as small as rounding.
    """
    lanes.run[DATED, lane] = 1.0
    for j in range(NCOLUMNS):
        lanes.run[DATES + j, lane] = slow.out[OUT_DATES + j]


@kernel
def strike(lanes, lane, batch, g, rate, slow):
    """Apply a jump of the state at a boundary that it may not pass. Rebounds too small to be
    followed end at rest.
    """
    who, mode, known = lanes.memo[lane, WHO], mode_of(lanes, lane), lanes.fresh[g, lane]
    if known < 0.5:  # it comes from within, no time after the start or later
        lanes.run[STARTING, lane] = 0.0
    if LAW[g] == IMPACT_LAW or not carried_over(lanes, lane, g):
        snap(lanes, lane, g)
    least = 0.0
    if lanes.run[STARTING, lane] > 0.5:
        gaps_here(lanes, lane, batch, slow)
        least = ROUNDING * slow.gaps[5 * NGUARDS + g]
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    show_clocks(lanes, lane, slow)
    load_dates(lanes, lane, slow)
    now, parameters = time_of_law(lanes, lane, batch), batch.param[who * batch.stride]
    reset(now, slow.state, parameters, slow.held, mode, mode, g, slow.out)
    restitution, closing = slow.out[0], slow.out[1]
    if closing <= least:
        closing = 0.0
    if not is_possible(g, slow.out):
        lanes.memo[lane, FAULT] = INVALID_RESTITUTION
        return
    if closing > 0.0:
        for i in range(NSTATES):
            lanes.probe_y[i, lane], lanes.y[i, lane] = lanes.y[i, lane], slow.state[i]
        behind = mode_behind(lanes, lane, batch, g, slow)
        keep_dates(lanes, lane, slow)
        for i in range(NSTATES):
            slow.state[i] = lanes.y[i, lane]
        velocity = rate * lanes.side[g, lane]
        if LAW[g] == IMPACT_LAW and restitution > 0.0:
            lanes.run[FLIPPED, lane] = int(lanes.run[FLIPPED, lane]) | (1 << g)
        lanes.run[SLOWEST, lane] = min(lanes.run[SLOWEST, lane], abs(rate))
        note(lanes, lane, batch, g, IMPACT, int(-lanes.side[g, lane]), velocity, mode, 0.0, slow)
        turn_over(lanes, lane, batch, behind, slow)
        loosen(lanes, lane, batch, g, closing, slow)
    if LAW[g] == JUMP_LAW:
        after_jump(lanes, lane, batch, g, slow)
    else:
        face(lanes, lane, batch, g, slow)
    if TANGENT and closing > 0.0 and mode_of(lanes, lane) != mode:
        strike_tangent(lanes, lane, batch, g, now, mode, slow)
    if LAW[g] == JUMP_LAW:
        stick_at_once(lanes, lane, batch, slow)
        return
    pressing, rebound = slow.gaps[NGUARDS + g], restitution * max(closing, 0.0)
    if pressing > 0.0:
        later = 0.0
        if rebound > 0.0:
            later = 2.0 * rebound / (pressing * (1.0 - restitution))
        if later <= too_short(lanes, lane, g, restitution) or is_hidden(
            lanes, lane, g, rebound, pressing
        ):
            hold(lanes, lane, batch, g, later, 0.0, slow)
    elif rebound <= 0.0 and known > 1.5:
        hold(lanes, lane, batch, g, 0.0, 1.0, slow)  # what presses it begins at zero
    elif rebound <= 0.0:
        lanes.fresh[g, lane] = 2.0  # it leaves at once: gap and rate are known to be zero
        ask_for_paradox(lanes, lane, g, slow)
        stick_at_once(lanes, lane, batch, slow)


@kernel
def mode_behind(lanes, lane, batch, struck, slow):
    """The mode after a jump, which may have carried the state over other boundaries, or off those
    that it was on.
    """
    mode, others = mode_of(lanes, lane), False
    for g in range(NGUARDS):
        others = others or (g != struck and (LAW[g] == NO_LAW or LAW[g] == SURFACE_LAW))
    if not others:
        return mode
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        plain = LAW[g] == NO_LAW or LAW[g] == SURFACE_LAW
        watched = lanes.side[WATCHED + g, lane] > 0.5
        if g != struck and plain and watched and slow.gaps[g] * lanes.side[g, lane] < 0.0:
            mode ^= 1 << g
        elif g != struck and LAW[g] == NO_LAW and not stands_at(lanes, lane, g, slow):
            lanes.fresh[g, lane] = 0.0
    return mode


@kernel
def turn_over(lanes, lane, batch, mode, slow):
    """Change the sides of the guards over whose boundaries a jump has carried the state."""
    for g in range(NGUARDS):
        before = mode_of(lanes, lane)
        if ((mode ^ before) >> g) & 1:
            lanes.side[g, lane], lanes.fresh[g, lane] = -lanes.side[g, lane], 0.0
            side = int(lanes.side[g, lane])
            note(lanes, lane, batch, g, CROSSING, side, 0.0, before, 0.0, slow)


@kernel
def face(lanes, lane, batch, g, slow):
    """Orient the surfaces on which the state is, if it is also at a stop, by the way in which it
    would leave the stop: their force then presses onto it. The gaps are in slow.gaps afterwards.
    """
    gaps_here(lanes, lane, batch, slow)
    for m in range(NGUARDS):
        free = LAW[m] == SURFACE_LAW and lanes.side[WATCHED + m, lane] > 0.5
        if free and slow.gaps[m] == 0.0:
            pressing = slow.gaps[NGUARDS + g]
            lanes.side[m, lane], lanes.fresh[m, lane] = -lanes.side[m, lane], 1.0
            gaps_here(lanes, lane, batch, slow)
            if slow.gaps[NGUARDS + g] <= pressing:
                lanes.side[m, lane] = -lanes.side[m, lane]
                gaps_here(lanes, lane, batch, slow)


@kernel
def feels(lanes, lane, g, struck, closing, slow):
    """True if a contact feels an impact: its gap opens or closes. The gaps are in slow.gaps."""
    if g == struck or PARTNER[g] < 0 or LAW[g] == HOLD_LAW:
        return False
    left = slow.gaps[3 * NGUARDS + g]
    return abs(left) > FELT * closing + ROUNDING * slow.gaps[5 * NGUARDS + g]


@kernel
def strike_tangent(lanes, lane, batch, g, now, before, slow):
    """Let a jump act on the tangent anew, by the rates in the mode of the lane: the jump has come
    out of mode `before`, and has released contacts or turned frictions.
    """
    for i in range(NSTATES):
        slow.state[i] = lanes.probe_y[i, lane]
    show_clocks(lanes, lane, slow)
    load_dates(lanes, lane, slow)
    p = batch.param[lanes.memo[lane, WHO] * batch.stride]
    reset(now, slow.state, p, slow.held, before, mode_of(lanes, lane), g, slow.out)
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]


@kernel
def loosen(lanes, lane, batch, struck, closing, slow):
    """Release the held contacts that feel the impact of another: their surfaces slide then, their
    stops are struck or left. A free stop whose gap and rate were known to be zero closes or opens
    now.
    """
    mode, others = mode_of(lanes, lane), False
    for g in range(NGUARDS):
        others = others or (g != struck and PARTNER[g] >= 0 and LAW[g] != HOLD_LAW)
    if not others:
        return
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        if feels(lanes, lane, g, struck, closing, slow):
            if (mode >> PARTNER[g]) & 1 == 0:
                if LAW[g] == IMPACT_LAW and lanes.fresh[g, lane] > 1.5:
                    lanes.fresh[g, lane] = 1.0
            else:
                loosen_one(lanes, lane, batch, g, mode, slow)
                mode = mode_of(lanes, lane)


@kernel
def loosen_one(lanes, lane, batch, g, mode, slow):
    """Release a held contact because of an impact. Needs slow.gaps."""
    left = slow.gaps[3 * NGUARDS + g]
    lanes.side[PARTNER[g], lane] = -1.0
    let_go(lanes, lane, batch, PARTNER[g], slow)
    if LAW[g] == SURFACE_LAW:
        lanes.side[g, lane] = 1.0 if left > 0.0 else -1.0
        lanes.fresh[g, lane] = 0.0
    else:
        lanes.side[g, lane], lanes.fresh[g, lane] = LAW_SIDE[g], 1.0
    watch(lanes, lane)
    note(lanes, lane, batch, PARTNER[g], RELEASE, -1, 0.0, mode, 0.0, slow)


@inner
def too_short(lanes, lane, g, restitution):
    """Duration of a chatter [s] below which it is completed: the remainder changes the acceleration
    by less than 1e-8, so the time of its end is accurate to rounding.

    The acceleration's own time scale is read from the series of the flight that has just ended.
    """
    row = GUARD_ROW[g]
    second = abs(lanes.work[row + 2, lane])
    third, fourth = abs(lanes.work[row + 3, lane]), abs(lanes.work[row + 4, lane])
    scale = max(lanes.run[END, lane], lanes.run[AHEAD, lane])
    if second < scale * third:
        scale = second / third
    if second < scale * scale * fourth:
        scale = math.sqrt(second / fourth)
    now = lanes.clock[TAU, lane] + abs(lanes.clock[BASE, lane])
    return max(CHATTER * (1.0 - restitution) * scale, 4.0e-16 * now)


@inner
def is_hidden(lanes, lane, g, rebound, pressing):
    """True if a flight stays within the rounding of its gap. Another boundary, such as the turning
    point of a state, may put a node into the flight: its height there is rounded, and rebounds
    wouldn't shrink any more.
    """
    height = 0.5 * rebound * rebound / pressing
    return NGUARDS > 2 and height <= ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]


@inner
def after_jump(lanes, lane, batch, g, slow):
    """Set the side of a guard beyond whose boundary the state has jumped."""
    gaps_here(lanes, lane, batch, slow)
    lanes.fresh[g, lane] = 0.0
    near = TOLD * ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]
    if abs(slow.gaps[g]) <= near:
        lanes.side[g, lane] = -lanes.side[g, lane]
        lanes.fresh[g, lane] = 1.0
        lanes.run[BOUNCES, lane] = 1.0  # should it turn back at once, nothing has happened
    elif slow.gaps[g] * lanes.side[g, lane] < 0.0:
        lanes.side[g, lane] = -lanes.side[g, lane]


# -- contacts that are held ------------------------------------------------------------------------
@kernel
def caught(lanes, lane, batch, g, slow):
    """True if both sides push onto the surface that a lane has reached, so that it is held there:
    the needed force is within its limit.
    """
    gap = lanes.work[GAP_ROW + g, lane]
    if lanes.found[DELTA, lane] == 0.0 and lanes.fresh[g, lane] < 0.5 and gap != 0.0:
        return False  # it jumped over the surface
    if lanes.fresh[g, lane] < 0.5:  # it comes from one side
        lanes.run[STARTING, lane] = 0.0
    snap(lanes, lane, g)
    gaps_here(lanes, lane, batch, slow)
    back_again = lanes.run[BOUNCES, lane] > 1.5 and (int(lanes.run[FLIPPED, lane]) >> g) & 1 == 1
    if slow.gaps[NGUARDS + g] == 0.0 and slow.gaps[2 * NGUARDS + g] == 0.0 and not back_again:
        # another contact may hold what this one could
        first = lanes.fresh[g, lane] != RIDDEN and lanes.run[BOUNCES, lane] <= 1.5
        return first and holds_any(lanes, lane)
    if slow.gaps[2 * NGUARDS + g] < 0.0 and slow.gaps[PARTNER[g]] > 0.0:
        hold(lanes, lane, batch, g, 0.0, 0.0, slow)
        return True
    if back_again:  # both sides push onto it as soon as time passes: its force begins at zero
        hold(lanes, lane, batch, g, 0.0, 2.0, slow)
    return back_again


@inner
def may_stick(lanes, lane, g, slow):
    """True if a lane stands on a surface whose force leads back to it. Needs slow.gaps."""
    free = LAW[g] == SURFACE_LAW and lanes.side[WATCHED + g, lane] > 0.5
    stands = slow.gaps[g] == 0.0 or stands_at(lanes, lane, g, slow)
    return free and stands and slow.gaps[2 * NGUARDS + g] < 0.0


@inner
def set_held(lanes, lane, which, side):
    """Give the hold guards of some surfaces (bits) a side."""
    for g in range(NGUARDS):
        if (which >> g) & 1:
            lanes.side[PARTNER[g], lane] = side
    watch(lanes, lane)


@kernel
def stick_at_once(lanes, lane, batch, slow):
    """Hold what static friction holds where a lane stands on surfaces: friction in motion may be
    too weak to lead back to them. At first all are held, without those that follow from others;
    then each is asked again and again whether its limit holds it beside the others.
    """
    gaps_here(lanes, lane, batch, slow)
    static, held = False, 0
    for g in range(NGUARDS):
        if may_stick(lanes, lane, g, slow):
            needed, most = slow.gaps[NGUARDS + g] ** 2, slow.gaps[2 * NGUARDS + g] ** 2
            static = static or slow.gaps[PARTNER[g]] + needed > (1.0 + SLOW_START) * most
    for g in range(NGUARDS if static else 0):
        set_held(lanes, lane, held, -1.0)
        gaps_here(lanes, lane, batch, slow)
        alone = slow.gaps[2 * NGUARDS + g]
        set_held(lanes, lane, held, 1.0)
        gaps_here(lanes, lane, batch, slow)
        if may_stick(lanes, lane, g, slow) and slow.gaps[2 * NGUARDS + g] < SLOW_START * alone:
            held |= 1 << g
            set_held(lanes, lane, held, 1.0)
    asked, before, rounds = held, -1, 0
    while held != before and rounds < 2 * NGUARDS:
        before, rounds = held, rounds + 1
        for g in range(NGUARDS):
            if (asked >> g) & 1:
                gaps_here(lanes, lane, batch, slow)
                holds = slow.gaps[PARTNER[g]] > 0.0
                held = held | (1 << g) if holds else held & ~(1 << g)
                set_held(lanes, lane, 1 << g, 1.0 if holds else -1.0)
                if not holds:
                    lanes.side[g, lane] = 1.0 if slow.gaps[NGUARDS + g] > 0.0 else -1.0
    set_held(lanes, lane, held, -1.0)
    for g in range(NGUARDS):
        if (held >> g) & 1:
            hold(lanes, lane, batch, g, 0.0, AT_REST, slow)


@inner
def holds_any(lanes, lane):
    """True if a contact of a lane is held."""
    held = False
    for g in range(NGUARDS):
        held = held or (LAW[g] == HOLD_LAW and lanes.side[g, lane] > 0.0)
    return held


@kernel
def gives_way(lanes, lane, batch, slow):
    """Release the held surfaces that lose their hold because the state came to another boundary:
    the equations reduced by them are no numbers. True if there is one.
    """
    if lanes.memo[lane, BROKEN] == 0 or not holds_any(lanes, lane):
        return False
    for g in range(NGUARDS):
        lanes.prior[PRIOR_ROWS * g + NEW, lane] = lanes.prior[PRIOR_ROWS * g + OLD, lane]
    lanes.memo[lane, BROKEN], lanes.memo[lane, DECIDED] = 0, 0
    found = False
    for g in range(NGUARDS):
        if LAW[g] == SURFACE_LAW and lanes.side[PARTNER[g], lane] > 0.0:
            gaps_here(lanes, lane, batch, slow)
            if slow.gaps[2 * NGUARDS + g] == 0.0:
                release(lanes, lane, batch, PARTNER[g], slow)
                found = True
    return found


@kernel
def strays(lanes, lane, batch, slow):
    """True if a held contact isn't on its boundary: its equations are wrong then."""
    if not holds_any(lanes, lane):
        return False
    gaps_here(lanes, lane, batch, slow)
    away = False
    for g in range(NGUARDS):
        held = PARTNER[g] >= 0 and LAW[g] != HOLD_LAW and lanes.side[PARTNER[g], lane] > 0.0
        near = KEPT * (lanes.prior[PRIOR_ROWS * g + NEW, lane] + slow.gaps[SIZES * NGUARDS + g])
        if held:  # where nothing can move the rounding of its acceleration does
            size = lanes.prior[PRIOR_ROWS * PARTNER[g] + NEW, lane]
            near += ROUNDING * size * lanes.run[END, lane] * lanes.run[END, lane]
        away = away or (held and not abs(slow.gaps[g]) <= near)
    return away


@kernel
def hold(lanes, lane, batch, g, later, known, slow):
    """Begin to hold a contact: state and tangent go onto its constraint, at most `later` [s] after
    now. Of the margin to its release so many zeros are known; AT_REST says that it was at rest.
    """
    who, before, h = lanes.memo[lane, WHO], mode_of(lanes, lane), PARTNER[g]
    lanes.side[h, lane], lanes.fresh[h, lane] = 1.0, max(known, 0.0)
    if known > 0.0:
        lanes.prior[PRIOR_ROWS * h + NEW, lane] = 0.0
    watch(lanes, lane)
    if LAW[g] == IMPACT_LAW:
        rub(lanes, lane, batch, h, slow)
    if TANGENT and LAW[g] == SURFACE_LAW and known == 0.0 and lanes.run[STARTING, lane] < 0.5:
        saltate(lanes, lane, batch, g, before, slow)
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    show_clocks(lanes, lane, slow)
    now = time_of_law(lanes, lane, batch)
    mode = mode_of(lanes, lane) & ~(1 << h)
    settle(now, slow.state, batch.param[who * batch.stride], slow.held, mode, g)
    if TANGENT and LAW[g] == IMPACT_LAW:
        settle_held(lanes, lane, batch, now, slow)
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]
    if LAW[g] == IMPACT_LAW:
        face(lanes, lane, batch, g, slow)
    note(lanes, lane, batch, h, HOLD, 1, 0.0, before, later, slow)
    if LAW[g] == IMPACT_LAW:
        gaps_here(lanes, lane, batch, slow)
        ask_for_paradox(lanes, lane, g, slow)


@kernel
def settle_held(lanes, lane, batch, now, slow):
    """Bring the tangent in slow.state onto the constraints of all stops at rest, where one begins
    to be held. What one of them takes off changes the velocities of others: all are asked in turn,
    until nothing changes.
    """
    held, mode = 0, mode_of(lanes, lane)
    for g in range(NGUARDS):
        held += LAW[g] == IMPACT_LAW and lanes.side[PARTNER[g], lane] > 0.0
    first, change, rounds = 0.0, math.inf, 0
    while held > 1 and change > SETTLED * first and rounds < MOST_SETTLED:
        for i in range(NSTATES):
            lanes.probe_y[i, lane] = slow.state[i]
        change, rounds = 0.0, rounds + 1
        for g in range(NGUARDS):
            if LAW[g] == IMPACT_LAW and lanes.side[PARTNER[g], lane] > 0.0:
                p = batch.param[lanes.memo[lane, WHO] * batch.stride]
                settle(now, slow.state, p, slow.held, mode & ~(1 << PARTNER[g]), g)
        for i in range(NMOVED, NSTATES):
            change += abs(slow.state[i] - lanes.probe_y[i, lane])
        first = max(first, change)


# -- friction of contacts --------------------------------------------------------------------------
@kernel
def rub(lanes, lane, batch, h, slow):
    """Direction in which a contact slides as it begins to be held; if it doesn't slide, the first
    step finds out whether it sticks.
    """
    for m in range(NGUARDS):
        if SUPPORT[m] == h:
            gaps_here(lanes, lane, batch, slow)
            slip, pull = slow.gaps[m], slow.gaps[NGUARDS + m]
            positive = slip > 0.0 or (slip == 0.0 and pull > 0.0)
            lanes.side[m, lane] = 1.0 if positive else -1.0
            lanes.fresh[m, lane] = 1.0 if slip == 0.0 else 0.0


@kernel
def ask_for_paradox(lanes, lane, g, slow):
    """Report the paradox of Painleve of a contact that begins to rest or leaves at once: while it
    slides, friction cancels the effect of its force. A contact that may stick will. Needs
    slow.gaps.
    """
    paradox = slow.gaps[2 * NGUARDS + g] <= 0.0
    for m in range(NGUARDS):
        if SUPPORT[m] == PARTNER[g] and slow.gaps[m] == 0.0:
            sticks = lanes.side[PARTNER[g], lane] < 0.0 or slow.gaps[PARTNER[m]] > 0.0
            paradox = paradox and not sticks
    if paradox:
        lanes.memo[lane, FAULT] = PAINLEVE


@inner
def pushes_on(lanes, lane, batch, now, slow):
    """True if a force of friction, or a coefficient of one that acts, is negative in slow.state."""
    show_clocks(lanes, lane, slow)
    p = batch.param[lanes.memo[lane, WHO] * batch.stride]
    levels(now, slow.state, p, slow.held, mode_of(lanes, lane), slow.out)
    return slow.out[0] < 0.0


@kernel
def pushes_on_at(lanes, lane, batch, d, slow):
    """The same test for the state a time d into the step."""
    state_at(lanes, lane, d, slow.state)
    now = lanes.run[START, lane] + d + base_of_law(lanes, lane, batch)
    return pushes_on(lanes, lane, batch, now, slow)


@kernel
def watch_friction(lanes, batch, slow):
    """End steps at the times at which a friction becomes negative, and the trajectories with them.
    Returns the bits of their lanes.
    """
    found = 0
    for lane in range(LANES):
        watched = lanes.run[ACTIVE, lane] > 0.5 and lanes.memo[lane, MAY_PUSH] == 1
        whole = lanes.clock[TAU, lane] - lanes.run[START, lane]
        if watched and crossing_guards(lanes, lane) != 0:
            whole *= JUST_BEFORE  # a friction that ends there is zero but for rounding
        for look in range(LOOKS if watched else 0):
            d = whole * ((look + 1) / LOOKS)
            if (found >> lane) & 1 == 0 and pushes_on_at(lanes, lane, batch, d, slow):
                turn_back(lanes, lane, batch, whole * (look / LOOKS), d, slow)
                found |= 1 << lane
    return found


@kernel
def turn_back(lanes, lane, batch, before, beyond, slow):
    """Return a lane to the time at which friction becomes negative, between two times into its
    step.
    """
    for _ in range(HALVINGS):
        middle = 0.5 * (before + beyond)
        if pushes_on_at(lanes, lane, batch, middle, slow):
            beyond = middle
        else:
            before = middle
    state_at(lanes, lane, beyond, slow.state)
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]
    lanes.clock[TAU, lane] = lanes.run[START, lane] + beyond
    lanes.memo[lane, FAULT] = INVALID_FRICTION


@kernel
def let_go(lanes, lane, batch, h, slow):
    """Release the friction of a contact that is held no longer."""
    before = mode_of(lanes, lane)
    for m in range(NGUARDS):
        if SUPPORT[m] == h and lanes.side[PARTNER[m], lane] > 0.0:
            lanes.side[PARTNER[m], lane] = -1.0
            note(lanes, lane, batch, PARTNER[m], RELEASE, -1, 0.0, before, 0.0, slow)


@kernel
def release(lanes, lane, batch, h, slow):
    """Release a held contact. If its force vanishes continuously, more than the gap is known to be
    zero; if it jumps, or falls from static to kinetic friction, its rate at most.
    """
    before, g = mode_of(lanes, lane), PARTNER[h]
    gaps_here(lanes, lane, batch, slow)
    if LAW[g] == IMPACT_LAW and slow.gaps[2 * NGUARDS + g] <= PARADOX:
        lanes.memo[lane, FAULT] = PAINLEVE
        return
    fades = lanes.found[DELTA, lane] > 0.0
    lanes.side[h, lane] = -1.0
    let_go(lanes, lane, batch, h, slow)
    if LAW[g] == SURFACE_LAW:
        needed, most = slow.gaps[NGUARDS + g], abs(slow.gaps[2 * NGUARDS + g])
        lanes.side[g, lane] = 1.0 if needed > 0.0 else -1.0
        starts_slowly = fades and abs(abs(needed) - most) <= SLOW_START * most
        lanes.fresh[g, lane] = 2.0 if starts_slowly else RIDDEN
    else:
        lanes.side[g, lane] = LAW_SIDE[g]
        lanes.fresh[g, lane] = 3.0 if fades else 2.0
        for m in range(NGUARDS):
            free = LAW[m] == SURFACE_LAW and lanes.side[WATCHED + m, lane] > 0.5
            if free and slow.gaps[m] == 0.0:
                lanes.fresh[m, lane] = 2.0 if fades else 1.0
            same = SNAP_STATE[m] == SNAP_STATE[g] and SNAP_STATE[g] >= 0
            if same and fades and LAW[m] == NO_LAW and lanes.fresh[m, lane] > 0.5:
                lanes.fresh[m, lane] = 3.0
    watch(lanes, lane)
    if lanes.run[CAUSE, lane] < 0.0:
        lanes.run[CAUSE, lane] = float(h)
    if TANGENT and fades:
        saltate(lanes, lane, batch, h, before, slow)
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    note(lanes, lane, batch, h, RELEASE, -1, 0.0, before, 0.0, slow)
    if LAW[g] == IMPACT_LAW:
        stick_at_once(lanes, lane, batch, slow)


# -- what rests at the start and at the end of a run -----------------------------------------------
@kernel
def noise_of_speed(lanes, lane, batch, g, slow):
    """Rounding of the velocity of a surface where a run begins or ends: of its terms, and of the
    time. Needs slow.gaps, and leaves those of a moment later there.
    """
    value, size = slow.gaps[g], slow.gaps[SIZES * NGUARDS + g]
    for j in range(NGUARDS):
        slow.gaps[j] = lanes.side[j, lane]
    now = lanes.clock[TAU, lane] + abs(lanes.clock[BASE, lane])
    look_at_gaps(lanes, lane, batch, 2.0 * SHORTEST_FLIGHT * now, slow)
    return ROUNDING * size + abs(slow.gaps[g] - value)


@kernel
def slides_on(lanes, lane, batch, slow):
    """Bits of the surfaces on which a run begins: their velocities are rounding. Needs slow.gaps,
    and leaves them.
    """
    on = 0
    for g in range(NGUARDS):
        size, moves = slow.gaps[SIZES * NGUARDS + g], SNAP_STATE[g] < 0
        if LAW[g] == SURFACE_LAW and moves and abs(slow.gaps[g]) <= KEPT * size:
            speed = abs(slow.gaps[g])
            noise = noise_of_speed(lanes, lane, batch, g, slow)
            on |= (1 if speed <= noise else 0) << g
            lanes.prior[PRIOR_ROWS * g + NEW, lane] = max(size, noise / ROUNDING)
            gaps_here(lanes, lane, batch, slow)
    return on


@kernel
def presses(lanes, lane, batch, g, slow):
    """1 if a stop at rest is pressed, -1 if it is pulled, by more than rounding, of the time too:
    its series says so then; else 0. Needs slow.gaps.
    """
    h = PARTNER[g]
    value, noise = slow.gaps[h], 4.0 * ROUNDING * slow.gaps[SIZES * NGUARDS + h]
    for j in range(NGUARDS):
        slow.gaps[j] = lanes.side[j, lane]
    now = lanes.clock[TAU, lane] + abs(lanes.clock[BASE, lane])
    look_at_gaps(lanes, lane, batch, 2.0 * SHORTEST_FLIGHT * now, slow)
    if min(value, slow.gaps[h]) > noise:
        return 1
    return -1 if max(value, slow.gaps[h]) < -noise else 0


@kernel
def rest_at_once(lanes, lane, batch, moves, slow):
    """Hold the stops that rest at the start of a run, each beside those that are held already; of
    the others their gaps and rates are known to be zero, and accelerations that are rounding. From
    exact rest what presses them may be the rounding of terms that cancel: the first step tells.
    """
    for look in range(NGUARDS * NGUARDS if moves else 0):
        g = look % NGUARDS
        free = LAW[g] == IMPACT_LAW and lanes.side[PARTNER[g], lane] < 0.0
        if free and lanes.fresh[g, lane] > 0.5:
            gaps_here(lanes, lane, batch, slow)
            if abs(slow.gaps[3 * NGUARDS + g]) <= ROUNDING * slow.gaps[5 * NGUARDS + g]:
                pressing = presses(lanes, lane, batch, g, slow)
                lanes.fresh[g, lane] = 3.0 if pressing == 0 else 2.0
                if pressing > 0:
                    snap(lanes, lane, g)
                    hold(lanes, lane, batch, g, 0.0, 0.0, slow)
