"""Template: contacts at which the state jumps - impacts, jumps - of the methods that run one
trajectory after the other. trajectory.py calls it after a step has landed on a contact.

A contact that is held isn't followed, so impacts that accumulate end the trajectory: when flights
have become too short, or too low, to be told from nothing. docs/decisions/0041.

Symbols
-------
g, m guards; t_hit the time of the contact; t_leg that of the contact before. Times in s.
"""

from saltus.kernels.status import (
    CROSSING,
    IMPACT,
    IMPACT_LAW,
    INVALID_RESTITUTION,
    JUMP_LAW,
    OK,
    RUNNING,
    SURFACE_LAW,
)

#: Successive flights too short to be resolved, after which impacts count as accumulating.
MOST_AT_ONCE = 20
ROUNDING = 2.220446049250313e-16
#: Four times the height of a flight below which rounding decides it, in units of the rounding of
#: its gap. Speed times duration is four times the height.
FLAT = 64.0


@kernel
def before_strikes(i, t_hit, t_leg, h, batch, work):
    """Prepare a jump of the state: the lateness of a contact that isn't located, and the count of
    flights that are too short.
    """
    if batch.options[i, LOCATE] == 0.0:
        for g in range(NGUARDS):
            work[TRY + g] += abs(h * work[RATE + g])
    else:
        count_at_once(i, t_hit, t_leg, batch, work)


@kernel
def count_at_once(i, t_hit, t_leg, batch, work):
    """Count the landings from which the state jumps after a flight that is too short."""
    flight, struck = t_hit - t_leg, False
    gap_roundings(i, t_hit, BEFORE, batch, work)
    for g in range(NGUARDS):
        if changes_sign(work, LEFT, RIGHT, g):
            rounding = work[BEFORE + g] + ROUNDING * abs(t_hit * work[RATE_AT_REST + g])
            far = abs(work[RATE + g]) * flight > FLAT * rounding
            if far and flight > at_once(i, t_hit, batch):
                batch.carry[i, AT_ONCE] = 0.0
                return
            struck |= strikes(work, g)
    if struck:
        batch.carry[i, AT_ONCE] += 1.0


@kernel
def gap_roundings(i, t_hit, out, batch, work):
    """Change of each gap by the rounding of the state in NEXT, to `out`."""
    for j in range(NSTATES):
        work[BEHIND + j] = ROUNDING * max(abs(work[NEXT + j]), least_state(i, batch))
    gap_changes(t_hit, out, work)


@kernel
def strike_all(i, t_hit, batch, work):
    """Apply the jumps of the state in NEXT: those of the gaps that close at t_hit, and those of
    boundaries over which another jump has carried it. Needs q at t_hit in Q.
    """
    have_an_order(i, t_hit, standing(i, t_hit, batch, work), NEXT, batch, work)
    struck = 0
    for _ in range(NGUARDS):
        for g in range(NGUARDS):
            runs = batch.status[i] == RUNNING
            if (
                runs
                and not struck >> g & 1
                and (strikes(work, g) or (struck != 0 and carried_past(i, g, t_hit, batch, work)))
            ):
                struck |= 1 << g
                strike(i, g, t_hit, True, batch, work)


@kernel
def standing(i, t_hit, batch, work):
    """Bits of the stops at which the state in NEXT is: beyond them, or indistinguishable from them
    by rounding or by the resolution of contact times.
    """
    gap_roundings(i, t_hit, BEFORE, batch, work)
    gaps_at(t_hit, NEXT, Q, AT_NEXT, work)
    stops, strikes_one = 0, False
    for g in range(NGUARDS):
        near = at_once(i, t_hit, batch) * abs(work[RATE + g]) + FLAT * work[BEFORE + g]
        stands = LAW[g] == IMPACT_LAW and work[AT_NEXT + g] * LAW_SIDE[g] <= near
        stops |= (1 if stands else 0) << g
        strikes_one |= LAW[g] == IMPACT_LAW and strikes(work, g)
    return stops if strikes_one else 0


@kernel
def have_an_order(i, time, stops, state, batch, work):
    """End the trajectory if impacts of one instant have no order, or an impossible one. Needs q in
    Q.
    """
    if stops & (stops - 1) == 0:
        return
    for j in range(NSTATES):
        work[TOGETHER + j] = work[state + j]
    rows, told = part(work, TOGETHER, 5 * NSTATES), part(work, TOLD, 2)
    p, h = batch.param[i * batch.stride], part(work, H, HELD * NCLOCKS)
    outcome = order_of_impacts(time, rows, p, h, batch.mode[i], stops, told)
    if outcome != OK:
        batch.status[i] = outcome


@inner
def carried_past(i, g, time, batch, work):
    """True if the jump before has carried the state over a boundary at which it jumps again."""
    beyond = work[AT_NEXT + g] * LAW_SIDE[g] < -told_from_zero(g, time, work)
    return waits(g, batch.mode[i]) and beyond and not changes_sign(work, LEFT, RIGHT, g)


@kernel
def strike(i, g, t_hit, told, batch, work):
    """Apply the law of guard g to the state in NEXT, if it closes: an impact, recorded if `told`.
    The gaps after it are in AT_NEXT.
    """
    before = batch.mode[i]
    after = leap(i, g, t_hit, NEXT, batch, work)
    if not is_possible(g, part(work, TOLD, 2)):
        batch.status[i] = INVALID_RESTITUTION
        return
    work[LATE] = abs(work[BEFORE + g] / work[RATE + g]) if work[RATE + g] != 0.0 else 0.0
    if not work[TOLD + 1] > 0.0:
        gaps_at(t_hit, NEXT, Q, AT_NEXT, work)
        return
    if TANGENT and after != before:
        reset_at(i, g, t_hit, NEXT, before, after, batch, work)
    else:
        for j in range(NSTATES):
            work[NEXT + j] = work[POINT + j]
    batch.mode[i] = after
    if told:
        direction = -1 if LAW_SIDE[g] > 0.0 else 1
        slowest(i, work[RATE + g], batch)
        note(i, g, t_hit, IMPACT, direction, work[RATE + g], before, before, batch, work)
        for m in range(NGUARDS):
            if m != g and (before ^ after) >> m & 1:
                side = 1 if after >> m & 1 else -1
                note(i, m, t_hit, CROSSING, side, 0.0, before, before ^ 1 << m, batch, work)


@inner
def reset_at(i, g, time, state, before, after, batch, work):
    """Apply the law of guard g to a state; restitution and closing velocity go to TOLD."""
    p, h = batch.param[i * batch.stride], part(work, H, HELD * NCLOCKS)
    reset(time, part(work, state, NSTATES), p, h, before, after, g, part(work, TOLD, 2))


@kernel
def leap(i, g, time, state, batch, work):
    """The state after the jump of guard g, to POINT, its gaps, to AT_NEXT, their rates, to
    RATE_BEHIND; returns the mode there. Needs q in Q.
    """
    mode = batch.mode[i]
    for j in range(NSTATES):
        work[POINT + j] = work[state + j]
    gaps_at(time, POINT, Q, BEFORE, work)
    reset_at(i, g, time, POINT, mode, mode, batch, work)
    gaps_at(time, POINT, Q, AT_NEXT, work)
    for m in range(NGUARDS):
        side, other = (1.0 if mode >> m & 1 else -1.0), m != g and not waits(m, mode)
        if other and not changes_sign(work, LEFT, RIGHT, m) and work[AT_NEXT + m] * side < 0.0:
            mode ^= 1 << m
    rate_at(time, POINT, Q, mode, BEHIND, work)
    gap_rates_at(time, POINT, BEHIND, Q, RATE_BEHIND, work)
    if LAW[g] == JUMP_LAW and not stays(g, time, work):
        mode ^= 1 << g
    return mode


@inner
def stays(g, time, work):
    """True if the state in POINT, after the jump of guard g, is on the side from which it came. On
    the boundary itself the rate of the gap decides.
    """
    decides = work[RATE_BEHIND + g] if lies_on(g, time, work) else work[AT_NEXT + g]
    return decides * LAW_SIDE[g] > 0.0


@inner
def lies_on(g, time, work):
    """True if a jump leaves the state on its own boundary."""
    return abs(work[AT_NEXT + g]) <= 2.0 * abs(work[BEFORE + g]) + told_from_zero(g, time, work)


@inner
def told_from_zero(g, time, work):
    """Least size of a gap after a jump that isn't zero: beyond its rounding, that of the time, and
    the distance of the landing from the boundary.
    """
    change, late = work[AT_NEXT + g] - work[BEFORE + g], 128.0 * ulp(time) + 2.0 * work[LATE]
    return late * abs(work[RATE_BEHIND + g]) + 8.0 * ROUNDING * abs(change)


@inner
def face(i, at, batch, work):
    """Give the gaps of laws the sign of the mode, where the right-hand side doesn't follow it: the
    state may have landed an ulp beyond a boundary that it leaves.
    """
    if LAWS and batch.options[i, LOCATE] != 0.0 and law_mode(i, batch) == FROM_STATE:
        for g in range(NGUARDS):
            side = 1.0 if batch.mode[i] >> g & 1 else -1.0
            if leaps(g) and not work[at + g] * side > 0.0:
                work[at + g] = side * SMALLEST


@kernel
def strike_at_start(i, t, t_end, batch, work):
    """Apply the impacts of a state that starts on a stop: initial conditions, which no table
    records.
    """
    struck, stops = False, 0
    for g in range(NGUARDS):
        work[LEFT + g], work[RIGHT + g] = 0.0, 0.0
        on_stop = LAW[g] == IMPACT_LAW and abs(work[AT_NODE + g]) <= SMALLEST
        stops |= (1 if on_stop else 0) << g
    have_an_order(i, t, stops, NODE, batch, work)
    for g in range(NGUARDS):
        if stops >> g & 1 and batch.status[i] == RUNNING:
            for j in range(NSTATES):
                work[NEXT + j] = work[NODE + j]
            strike(i, g, t, False, batch, work)
            for j in range(NSTATES):
                work[NODE + j] = work[NEXT + j]
            struck = True
    if struck:
        start_leg(i, t, t_end, True, batch, work)


@kernel
def is_held(i, t_hit, batch, work):
    """True if both sides push onto a surface that the state in NEXT has just reached. It would have
    to stay there, and a method without that mode would oscillate. Needs q at t_hit in Q.
    """
    held = False
    for g in range(NGUARDS):
        if LAW[g] == SURFACE_LAW and changes_sign(work, LEFT, RIGHT, g):
            rate_at(t_hit, NEXT, Q, batch.mode[i] | 1 << g, BEHIND, work)
            gap_rates_at(t_hit, NEXT, BEHIND, Q, RATE_BEHIND, work)
            above = work[RATE_BEHIND + g]
            rate_at(t_hit, NEXT, Q, batch.mode[i] & ~(1 << g), BEHIND, work)
            gap_rates_at(t_hit, NEXT, BEHIND, Q, RATE_BEHIND, work)
            below = work[RATE_BEHIND + g]
            held |= above < 0.0 and below > 0.0 and lies_there(i, g, t_hit, batch, work)
    return held


@kernel
def lies_there(i, g, t_hit, batch, work):
    """True if the state in NEXT lies on boundary g. A boundary that moves as another one changes
    sides is crossed without having been reached.
    """
    gap_roundings(i, t_hit, TRY, batch, work)
    gaps_at(t_hit, NEXT, Q, AT_NEXT, work)
    late = 128.0 * ulp(t_hit) * abs(work[RATE + g])
    lies = abs(work[AT_NEXT + g]) <= late + FLAT * work[TRY + g]
    face(i, AT_NEXT, batch, work)
    return lies


@kernel
def goes_past(i, t, batch, work):
    """True if a step without located contacts ends where the state jumps: beyond a stop and
    closing, or where the condition of a jump has become true. LEFT and RIGHT differ in sign there.
    """
    gaps_at(t, NEXT, Q_STAGE, AT_NEXT, work)
    mode, found, again = allowed(sides(AT_NEXT, work)), False, False
    for g in range(NGUARDS):
        was, now = work[AT_NODE + g] * LAW_SIDE[g], work[AT_NEXT + g] * LAW_SIDE[g]
        past = LAW[g] == JUMP_LAW and now < 0.0 and was > 0.0
        if past:
            mode ^= 1 << g
        if LAW[g] == IMPACT_LAW and now < 0.0:
            for j in range(NSTATES):
                work[POINT + j] = work[NEXT + j]
            reset_at(i, g, t, POINT, mode, mode, batch, work)
            past = work[TOLD + 1] > 0.0
            again |= past and was < 0.0
        work[LEFT + g] = LAW_SIDE[g] if past else 0.0
        work[RIGHT + g] = -work[LEFT + g]
        found |= past
    batch.mode[i] = mode
    if found:
        batch.carry[i, AT_ONCE] = batch.carry[i, AT_ONCE] + 1.0 if again else 0.0
    return found
