"""Template of the modal flow: tangencies, and gaps within whose rounding a step ends.

A touch belongs to the step at whose end the gap stands within its rounding: the next one, which
begins there, doesn't note it again. It is exact if the gap is a polynomial of the time, as that of
a rigid body is, and zero there without an operation that rounds; a wave's e^{lambda t} is rounded,
and its zero is chance.
"""

from saltus.kernels.isolation import (
    MARGIN,
    MOST_TOUCHES,
    SAME_TOUCH,
    TOUCH_AT,
    TOUCH_GUARD,
    is_exact_zero,
    polynomial,
    rounding,
    turning_place,
)
from saltus.kernels.status import GAP_MARGIN, GRAZE, GRAZE_SHALLOW, GRAZES, UNRESOLVED

#: Longest way from a place on which a gap is looked at, as a part of the step.
BESIDE = 0.5


@kernel
def told_beside(degree, known, noise, place, way, m):
    """Distance from a place at which a gap, whose terms are in `p`, can be told from zero, behind
    it (way = 1) or before it (-1), with the sign of the gap there; 0: nowhere.
    """
    reach = 2.0**-48
    while reach <= BESIDE:
        x = place + way * reach
        value = polynomial(m.p, degree, x)
        for _ in range(known):
            value *= x
        if abs(value) > noise:
            return reach if value > 0.0 else -reach
        reach *= 2.0
    return 0.0


@kernel
def settle(g, degree, known, noise, crosses, touched, m):
    """Settle what rounding has to do with. A gap that is negative behind its crossing by no more
    than rounding has touched: the step ends where it can be told from zero again. One that is zero
    at the end of the step and falls on crosses there, one within rounding that turns about has
    touched. Returns whether it crosses, and the touches now held.
    """
    place = m.found[g, PLACE] if crosses else 1.0
    doubt = rounding(m.p, degree, known > 0, noise, place)
    value = polynomial(m.p, degree, place)
    if abs(value) > doubt:
        return crosses, touched
    before = told_beside(degree, known, doubt, place, -1.0, m)
    behind = told_beside(degree, known, doubt, place, 1.0, m)
    if before > 0.0 and behind > 0.0:
        m.out[MARGIN] = min(m.out[MARGIN], abs(value))
        m.found[g, DECIDED] = min(place + behind, 1.0)
        if crosses:
            place = min(turning_place(m.p, degree, place, place + behind, m.slopes), 1.0)
        return False, add_touch(g, place, touched, m)
    if not crosses and before > 0.0 and behind < 0.0 and value == 0.0:
        m.found[g, PLACE] = 1.0
        return True, touched
    return crosses, touched


@inner
def add_touch(g, place, touched, m):
    """Add a touch to the list, unless it is that of its last one; returns how many it holds."""
    last = min(touched, MOST_TOUCHES - 1) - 1
    again = last >= 0 and m.touches[last, TOUCH_GUARD] == g
    if again and place - m.touches[last, TOUCH_AT] < SAME_TOUCH:
        return last + 1
    m.touches[last + 1, TOUCH_AT], m.touches[last + 1, TOUCH_GUARD] = place, g
    return last + 2


@kernel
def note_touches(i, tau, h, until, modes, steady, batch, m):
    """Count and record the tangencies of a step up to a time of it, in the order of time."""
    count = int(m.found[0, TOUCHED])
    for _ in range(count):
        soonest = 0
        for j in range(1, count):
            if m.touches[j, TOUCH_AT] < m.touches[soonest, TOUCH_AT]:
                soonest = j
        d, g = m.touches[soonest, TOUCH_AT] * h, int(m.touches[soonest, TOUCH_GUARD])
        met = d <= until
        if not met and not stands_within(i, g, batch, m):
            met = ends_within(i, g, tau, until, modes, steady, batch, m)
        if met:
            note_touch(i, g, tau, min(d, until), h, modes, steady, batch, m)
        m.touches[soonest, TOUCH_AT] = 2.0


@inner
def stands_within(i, g, batch, m):
    """True if a gap is within its rounding where the step begins."""
    value, _ = here(i, g, batch, m)
    away = m.offset[int(batch.carry[i, SET]), g]
    return value <= ROUNDED * (m.stood[m.row_of[g], SIZE] + abs(away))


@kernel
def ends_within(i, g, tau, d, modes, steady, batch, m):
    """True if a gap is within its rounding a time d after tau."""
    r, side, which = m.row_of[g], side_of(g, batch.mode[i]), int(batch.carry[i, SET])
    away = side * m.offset[which, g]
    move(modes, d, 0, m)
    drive(i, tau + d, batch, m)
    value, _ = gap_of_moved(r, modes, steady, which, m)
    return side * m.sign_of[g] * value + away <= ROUNDED * (m.errors[r, 2] + abs(away))


@kernel
def note_touch(i, g, tau, d, h, modes, steady, batch, m):
    """Count and record one tangency at a time d of a step."""
    kind, r = GRAZE_SHALLOW, m.row_of[g]
    size = m.errors[r, 2]
    error = touch_error(i, g, d, h, modes, steady, batch, m)
    if touches_exactly(i, g, d, modes, steady, batch, m):
        kind = GRAZE
    m.errors[r, 2], m.found[0, FACTORS] = size, 0.0
    batch.counters[i, GRAZES if kind == GRAZE else UNRESOLVED] += 1
    batch.minima[i, GAP_MARGIN] = 0.0
    state_after(i, tau, d, modes, steady, batch, m)
    _, rate = gap_of_moved(r, modes, steady, int(batch.carry[i, SET]), m)
    side, rate = int(side_of(g, batch.mode[i])), m.sign_of[g] * rate
    record(i, g, tau + d, kind, side, rate, batch.mode[i], error, batch, m)


@kernel
def touches_exactly(i, g, d, modes, steady, batch, m):
    """True if a gap is a polynomial of the time, and zero a time d into the step without an
    operation that rounds.
    """
    which, r, side = int(batch.carry[i, SET]), m.row_of[g], side_of(g, batch.mode[i])
    follow_block(modes, 1.0, m)  # terms by seconds: by parts of the step they are rounded
    end_drives(which, 1.0, m)
    series_of(r, modes, steady, which, 1.0, 0, m)
    if m.errors[r, 3] != 0.0:
        return False
    value, away = side * m.sign_of[g] * m.q[r, 0], side * m.offset[which, g]
    terms_of(i, g, side, batch, m)
    known = known_zeros(i, g, batch)
    for k in range(known):
        m.p[k] = 0.0
    part = m.p[0] - value
    rounded = (value - (m.p[0] - part)) + (away - part)
    return (known > 0 or rounded == 0.0) and is_exact_zero(m.p, ORDER, d)


@kernel
def touch_error(i, g, d, h, modes, steady, batch, m):
    """Error of the time of a touch: the time around it in which the gap is within its rounding."""
    which, used, place = int(batch.carry[i, SET]), groups_of(modes, m), d / h
    follow_block(modes, h, m)
    end_drives(which, h, m)
    end_factors(modes, h, used, m)
    series_of(m.row_of[g], modes, steady, which, h, used, m)
    noise = terms_of(i, g, side_of(g, batch.mode[i]), batch, m)
    noise = 2.0 * rounding(m.p, ORDER, False, noise, 1.0)
    before = told_beside(ORDER, 0, noise, place, -1.0, m)
    behind = told_beside(ORDER, 0, noise, place, 1.0, m)
    longest = max(abs(before), abs(behind)) if before != 0.0 and behind != 0.0 else BESIDE
    return longest * h
