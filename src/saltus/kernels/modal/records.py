"""Template of the modal flow: drives that are polynomials of the time between breaks.

Each is a course: instants at which its pieces begin, and the coefficients of each piece in the time
since then. A course that repeats holds one cycle. Steps end at breaks, so a step sees one piece of
each. The piece is a function of the time alone: a run that is paused goes on with the same one.

Columns of `course`: first row, number of pieces, cycle [s] (0: it doesn't repeat), rows of
instants, the first piece that repeats: those before hold once. Rows of `pieces`: the instants, a
row of LANES of them after the other; then the coefficients of each piece, LANES in a row.
"""

import math

from saltus.kernels.trigonometry import turned

#: Times within this many ulp are one break.
SAME_BREAK = 10.0 * 2.220446049250313e-16
#: 2 pi.
TURN = 6.283185307179586


@kernel
def begin_courses(i, batch, m):
    """Times of the courses at the beginning of the trajectory's period, to BASE."""
    which = int(batch.carry[i, SET])
    for p in range(m.sizes[COURSES]):
        cycle = m.course[which, 5 * p + 2]
        if cycle == 0.0 or m.course[which, 5 * p + 4] > 0.0:
            place = batch.origin[i] + batch.count[i] * batch.period[i]
        else:
            rate = TURN / cycle
            gained = turned(rate, batch.origin[i], 1)
            gained += turned(rate, batch.period[i], batch.count[i])
            place = gained / rate
        m.record[p, BASE] = place


@kernel
def follow_courses(i, tau, batch, m):
    """Bring every course to its piece at a time of the period: where it begins, to SINCE, and ends,
    to UNTIL.
    """
    which = int(batch.carry[i, SET])
    base = batch.origin[i] + batch.count[i] * batch.period[i]
    until = tau + SAME_BREAK * (abs(tau) + abs(base))
    for p in range(m.sizes[COURSES]):
        first, count = int(m.course[which, 5 * p]), int(m.course[which, 5 * p + 1])
        cycle, place = m.course[which, 5 * p + 2], m.record[p, BASE]
        tail, shift = int(m.course[which, 5 * p + 4]), -place
        begin, low, high = number(m.pieces, first, tail), 0, count - 1
        if cycle > 0.0 and (tail == 0 or place + until >= begin):
            shift += cycle * math.floor((place + until - begin) / cycle)
            low = tail
        while low < high:  # the last piece that has begun
            middle = (low + high + 1) // 2
            if number(m.pieces, first, middle) + shift <= until:
                low = middle
            else:
                high = middle - 1
        if low + 1 < count:
            end = number(m.pieces, first, low + 1) + shift
        else:
            end = begin + cycle + shift if cycle > 0.0 else math.inf
        if end <= until:  # by rounding of the cycle
            low, shift = tail, shift + cycle
            end = begin + cycle + shift
            if tail + 1 < count:
                end = number(m.pieces, first, tail + 1) + shift
        m.record[p, SINCE] = number(m.pieces, first, low) + shift
        m.record[p, UNTIL] = end
        rows = m.sizes[TERMS] // LANES
        m.record[p, PIECE] = first + m.course[which, 5 * p + 3] + low * rows


@kernel
def next_break(m):
    """The next break of a course, as a time of the period [s]."""
    following = math.inf
    for p in range(m.sizes[COURSES]):
        following = min(following, m.record[p, UNTIL])
    return following


@kernel
def is_break(i, tau, batch, m):
    """True if a piece of a course has ended at a time of the period."""
    base = batch.origin[i] + batch.count[i] * batch.period[i]
    return next_break(m) <= tau + SAME_BREAK * (abs(tau) + abs(base))


@kernel
def courses_at(tau, m):
    """Value and derivatives of each course at a time of the period, to VALUE and behind."""
    for p in range(m.sizes[COURSES]):
        row, since, terms = int(m.record[p, PIECE]), tau - m.record[p, SINCE], m.sizes[TERMS]
        for k in range(terms):
            m.record[p, VALUE + k] = number(m.pieces, row, k)
        factorial = 1.0
        for k in range(terms):
            for j in range(terms - 2, k - 1, -1):
                m.record[p, VALUE + j] += since * m.record[p, VALUE + j + 1]
            m.record[p, VALUE + k] *= factorial
            factorial *= k + 1


@kernel
def add_course_series(first, at, h, m):
    """Add the courses' part of a row of gaps to its terms in `p`; returns its size over a time h.
    Its numbers stand in the rows from `first` on, from `at` on.
    """
    size, behind = 0.0, at + m.sizes[TERMS] * m.sizes[COURSES] + 1
    for p in range(m.sizes[COURSES]):
        for k in range(m.sizes[TERMS]):
            place, power, share = m.sizes[TERMS] * p + k, 1.0, 1.0
            factor, terms = (
                number(m.steady, first, at + place),
                number(m.steady, first, behind + place),
            )
            for j in range(m.sizes[TERMS] - k):
                part = m.record[p, VALUE + k + j] * power * share
                m.p[j] += factor * part
                size += terms * abs(part)
                power, share = power * h, share / (j + 1)
    return size


@kernel
def course_gap(first, at, m):
    """The courses' part of a gap and of its rate."""
    value, rate = 0.0, 0.0
    for p in range(m.sizes[COURSES]):
        for k in range(m.sizes[TERMS]):
            factor = number(m.steady, first, at + m.sizes[TERMS] * p + k)
            value += factor * m.record[p, VALUE + k]
            if k + 1 < m.sizes[TERMS]:
                rate += factor * m.record[p, VALUE + k + 1]
    return value, rate


@kernel
def course_way(first, at, h, m):
    """The most by which the courses' part of a row of gaps can change in a time h."""
    most = 0.0
    for p in range(m.sizes[COURSES]):
        for k in range(m.sizes[TERMS]):
            factor, power = abs(number(m.steady, first, at + m.sizes[TERMS] * p + k)), 1.0
            for j in range(1, m.sizes[TERMS] - k):
                power *= h / j
                most += factor * abs(m.record[p, VALUE + k + j]) * power
    return most
