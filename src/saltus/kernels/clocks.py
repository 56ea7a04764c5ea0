"""Template: the clocks of a system, which are switches, remainders and tables that depend on time
only. codegen puts it after the generated head.

A clock divides time into pieces, numbered k in the order of time; `begin_of` is when piece k of
clock j begins, by a formula, so that no rounding adds up from piece to piece. The present piece of
each clock is a function of time alone: the last one that has begun, or will within a few ulp
(breaks of several clocks at one instant are one break). Steps end at breaks, so a step sees one
piece of each.

Symbols
-------
A time is a phase tau after a base (Taylor: the start of the period; ode45: zero). h holds HELD
numbers of each clock: its piece k, its side (+1/-1; switches), and for values the phase of the
piece's reference point and four coefficients: value = sum(c_i (tau - ref)^i). n holds NUMBERS
numbers of each clock, of parameters only. data: where each table begins; there its number of knots
and whether it repeats, the knots, then a reference point and four coefficients for each piece.

The head supplies NCLOCKS, the tuples CLOCK_KIND and CLOCK_TABLE, and numbers_of_clocks(p, n).
"""

import math

from saltus.kernels.clocks_layout import (
    C0,
    C1,
    C2,
    C3,
    CYCLE,
    HELD,
    LEVEL,
    NUMBERS,
    ON,
    PIECE,
    REF,
    TABLE,
    WAVE,
)
from saltus.kernels.trigonometry import turned

#: Times within this many ulp are one break (coincident contacts have the same limit).
SAME_BREAK = 10.0 * 2.220446049250313e-16


@kernel
def knot(data, j, i):
    """Knot i of the table of clock j."""
    return data[int(data[CLOCK_TABLE[j]]) + 2 + i]


@inner
def knots(data, j):
    """Number of knots of the table of clock j."""
    return int(data[int(data[CLOCK_TABLE[j]])])


@inner
def repeats(data, j):
    """True if the table of clock j is periodic."""
    return data[int(data[CLOCK_TABLE[j]]) + 1] > 0.5


@inner
def rate_of(j, n, data):
    """Cycles in a unit of time, of a clock that repeats; signed."""
    if CLOCK_KIND[j] == TABLE:
        return n[NUMBERS * j] / (knot(data, j, knots(data, j) - 1) - knot(data, j, 0))
    return n[NUMBERS * j]


@inner
def place_of(j, n, data):
    """Cycles at time zero, of a clock that repeats."""
    if CLOCK_KIND[j] == TABLE:
        return (n[NUMBERS * j + 1] - knot(data, j, 0)) / (
            knot(data, j, knots(data, j) - 1) - knot(data, j, 0)
        )
    return n[NUMBERS * j + 1]


@inner
def place_at_base(j, n):
    """Place of clock j in its cycle at the base, in cycles."""
    return n[NUMBERS * NCLOCKS + j]


@inner
def is_cyclic(j, data):
    """True if the pieces of clock j repeat."""
    return CLOCK_KIND[j] != LEVEL and (CLOCK_KIND[j] != TABLE or repeats(data, j))


@kernel
def on_from_to(j, n):
    """The part of a cycle in which a switch is on, (begin, end); begin >= end: never on; end -
    begin >= 1: always.
    """
    factor, shift = n[NUMBERS * j + 2], n[NUMBERS * j + 3]
    if factor == 0.0:
        return 0.0, (2.0 if shift > 0.0 else 0.0)
    level = -shift / abs(factor)
    if CLOCK_KIND[j] == WAVE:
        if abs(level) >= 1.0:
            return 0.0, (2.0 if level <= -1.0 else 0.0)
        begin = math.asin(level) / (2.0 * math.pi)
        end = 0.5 - begin
        return (begin, end) if factor > 0.0 else (begin + 0.5, end + 0.5)
    if factor > 0.0:
        return (level, 1.0) if level > 0.0 else (0.0, 2.0)
    return 0.0, (-level if -level < 1.0 else 2.0)


@kernel
def begin_of(j, k, n, base, data):
    """Phase at which piece k of clock j begins."""
    kind, rate = CLOCK_KIND[j], n[NUMBERS * j]
    if kind == LEVEL:
        if k < 1 or rate == 0.0:
            return -math.inf if k < 1 else math.inf
        return -n[NUMBERS * j + 1] / rate - base if k == 1 else math.inf
    if not is_cyclic(j, data):
        count = knots(data, j)
        if k < 1 or k > count or rate == 0.0:
            return -math.inf if k < 1 else math.inf
        x = knot(data, j, k - 1 if rate > 0.0 else count - k)
        return (x - n[NUMBERS * j + 1]) / rate - base
    rate = rate_of(j, n, data)
    if rate == 0.0:
        return -math.inf if k < 1 else math.inf
    at_base = place_at_base(j, n)
    speed, place = abs(rate), math.copysign(at_base, at_base * rate) if at_base != 0.0 else 0.0
    if kind == CYCLE:
        return (k - place) / speed
    if kind == TABLE:
        count = knots(data, j) - 1
        cycle = k // count
        first, last = knot(data, j, 0), knot(data, j, count)
        i = k - cycle * count
        share = (
            (knot(data, j, i) - first) / (last - first)
            if rate > 0.0
            else (last - knot(data, j, count - i)) / (last - first)
        )
        return (cycle + share - place) / speed
    begin, end = on_from_to(j, n)
    if not (begin < end < begin + 1.0):
        return -math.inf if k < 1 else math.inf
    if rate < 0.0:
        begin, end = -end, -begin
    cycle = k // 2
    return ((begin if k == 2 * cycle else end) + cycle - place) / speed


@kernel
def first_guess(j, tau, n, base, data):
    """A piece near the one that contains tau."""
    if begin_of(j, 1, n, base, data) == math.inf:
        return 0
    if is_cyclic(j, data):
        rate = rate_of(j, n, data)
        turns = math.floor(
            abs(rate) * tau + (place_at_base(j, n) if rate > 0.0 else -place_at_base(j, n))
        )
        if CLOCK_KIND[j] == CYCLE:
            return int(turns)
        if CLOCK_KIND[j] != TABLE:
            return 2 * int(turns)
        count = knots(data, j) - 1
        low, high = int(turns) * count, int(turns) * count + count - 1
    elif CLOCK_KIND[j] == LEVEL:
        return 0
    else:
        low, high = 0, knots(data, j)
    while low < high:  # begin_of(low) <= tau < begin_of(high + 1)
        middle = (low + high + 1) // 2
        if begin_of(j, middle, n, base, data) <= tau:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def hold_piece(j, k, n, base, data, h):
    """Write the data of piece k of clock j to h."""
    at, kind, rate = HELD * j, CLOCK_KIND[j], n[NUMBERS * j]
    h[at + PIECE] = k
    if kind == LEVEL:
        on = n[NUMBERS * j + 1] > 0.0 if rate == 0.0 else (k >= 1) == (rate > 0.0)
        h[at + ON] = 1.0 if on else -1.0
    elif kind != CYCLE and kind != TABLE:
        begin, end = on_from_to(j, n)
        if n[NUMBERS * j] == 0.0:
            y = n[NUMBERS * j + 1] - begin
            on = y - math.floor(y) < end - begin
        else:
            on = k % 2 == 0 if begin < end < begin + 1.0 else begin < end
        h[at + ON] = 1.0 if on else -1.0
    elif kind == CYCLE:
        h[at + REF] = begin_of(j, k if rate > 0.0 else k + 1, n, base, data) if rate != 0.0 else 0.0
        y = n[NUMBERS * j + 1]
        h[at + C0] = 0.0 if rate != 0.0 else n[NUMBERS * j + 3] * (y - math.floor(y))
        h[at + C1] = n[NUMBERS * j + 2]
    else:
        hold_polynomial(j, k, n, base, data, h)


@kernel
def hold_polynomial(j, k, n, base, data, h):
    """Write the polynomial of piece k of the table of clock j to h."""
    at, rate, offset, count = HELD * j, n[NUMBERS * j], n[NUMBERS * j + 1], knots(data, j)
    cycle = 0
    if repeats(data, j):
        count -= 1
        if rate == 0.0:
            length = knot(data, j, count) - knot(data, j, 0)
            offset -= length * math.floor((offset - knot(data, j, 0)) / length)
        else:
            cycle = k // count
            k -= cycle * count
        pieces = count
        shift = 1
    else:
        pieces = count + 1
        shift = 0
    if rate == 0.0:
        k = 0
        while k + 1 < pieces and knot(data, j, k + shift) <= offset:
            k += 1
    elif rate < 0.0:
        k = pieces - 1 - k
    first = int(data[CLOCK_TABLE[j]]) + 2 + knots(data, j) + 5 * k
    if rate == 0.0:
        s = offset - data[first]
        h[at + REF], h[at + C1], h[at + C2], h[at + C3] = 0.0, 0.0, 0.0, 0.0
        h[at + C0] = data[first + 1] + s * (
            data[first + 2] + s * (data[first + 3] + s * data[first + 4])
        )
        return
    if repeats(data, j):
        length = knot(data, j, count) - knot(data, j, 0)
        speed, place = (
            abs(rate) / length,
            place_at_base(j, n) if rate > 0.0 else -place_at_base(j, n),
        )
        share = (data[first] - knot(data, j, 0)) / length
        h[at + REF] = (cycle + (share if rate > 0.0 else 1.0 - share) - place) / speed
    else:
        h[at + REF] = (data[first] - offset) / rate - base
    power = 1.0
    for i in range(4):
        h[at + C0 + i] = data[first + 1 + i] * power
        power *= rate


@kernel
def place_clocks(p, origin, period, count, n, data):
    """Numbers of all clocks at the start of a period; time is origin + count * period + tau."""
    numbers_of_clocks(p, n)
    for j in range(NCLOCKS):
        n[NUMBERS * NCLOCKS + j] = 0.0
        if is_cyclic(j, data):
            turn = 2.0 * math.pi * rate_of(j, n, data)
            gained = turned(turn, period, count) + turned(turn, origin, 1)
            place = place_of(j, n, data)
            n[NUMBERS * NCLOCKS + j] = place - math.floor(place) + gained / (2.0 * math.pi)


@kernel
def set_clocks(tau, base, n, data, known, h):
    """Bring every clock to its piece at tau (from a guess, unless the pieces in h are known);
    return the next break.
    """
    until = tau + SAME_BREAK * (abs(tau) + abs(base))
    following = math.inf
    for j in range(NCLOCKS):
        k = int(h[HELD * j + PIECE]) if known else first_guess(j, tau, n, base, data)
        while begin_of(j, k + 1, n, base, data) <= until:
            k += 1
        while begin_of(j, k, n, base, data) > until:
            k -= 1
        hold_piece(j, k, n, base, data, h)
        following = min(following, begin_of(j, k + 1, n, base, data))
    return following
