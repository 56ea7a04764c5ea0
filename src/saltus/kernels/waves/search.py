"""Template: where sums of waves turn, and their smallest and largest values.

A leg is halved until bounds of its waves tell of each quantity in each part that it can't hold what
is looked for, or that it turns once at most there: Newton's method finds the place. A wave that is
slow in a part is followed by three derivatives, a fast one is bounded by its size.
"""

import math

from saltus.kernels.lanes import fma, load, splat


@inner
def see(goal, r, value, limits):
    """Put a value of a quantity into what has been found of it."""
    if goal == EXTREMES:
        limits[0, r], limits[1, r] = min(limits[0, r], value), max(limits[1, r], value)
    elif goal == LEAST:
        limits[0, 0] = min(limits[0, 0], abs(value))


@inner
def is_wanted(goal, r, value, room, limits):
    """True if a quantity that differs from a value by `room` at most can be what is looked for."""
    if goal == EXTREMES:
        return value - room < limits[0, r] or value + room > limits[1, r]
    return goal == TURNS or abs(value) - room <= limits[0, 0]


@kernel
def slope_and_bend(leg, row, time, w):
    """A quantity, its slope and its bend at a time of a leg."""
    move_to(leg, time, w)
    groups, work = w.sizes[GROUPS], w.work
    rate = 3 * groups * w.state[leg]
    value, slope, bend = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
    for g in range(groups):
        grows, turns = load(w.rates, rate + g, LANES), load(w.rates, rate + groups + g, LANES)
        a, b = load(w.quantities, row + g, LANES), load(w.quantities, row + groups + g, LANES)
        x, y = load(work, NOW * groups + g, LANES), load(work, (NOW + 1) * groups + g, LANES)
        x, y = fma(a, x, -(b * y)), fma(a, y, b * x)
        value = value + x
        x, y = fma(grows, x, -(turns * y)), fma(grows, y, turns * x)
        slope, bend = slope + x, bend + fma(grows, x, -(turns * y))
    return sum_of(value, w.sums), sum_of(slope, w.sums), sum_of(bend, w.sums)


@kernel
def turn_once(leg, row, low, high, w):
    """Time and value where a quantity turns in a part of a leg that holds one turn or none: by
    Newton's method inside a shrinking bracket. The time is NaN if there is none. A turn between two
    parts is one of the first.
    """
    _, first, _ = slope_and_bend(leg, row, low, w)
    value, last, _ = slope_and_bend(leg, row, high, w)
    if last == 0.0 and first != 0.0:
        return high, value
    if not first * last < 0.0:
        return math.nan, math.nan
    near, time = LAST * (high - low), 0.5 * (low + high)
    for _ in range(MOST_STEPS):
        now = time
        value, slope, bend = slope_and_bend(leg, row, now, w)
        if slope == 0.0:
            break
        if slope * first > 0.0:
            low = now
        else:
            high = now
        time = now - slope / bend if bend != 0.0 else math.inf
        inside = low <= time <= high
        if not inside:
            time = 0.5 * (low + high)
        enough = near if inside else 0.0
        if abs(time - now) <= max(SETTLED * (abs(now) + high - low), enough):
            break
    return time, value


@inner
def is_undecided(goal, r, row, half, w):
    """0 if a part can't hold what is looked for of a quantity, 1 if the quantity turns there once
    at most, 2 if that isn't known.
    """
    value = seen(row, SLOW, w)
    slope = seen(row, SLOW + 2, w)
    bend = seen(row, SLOW + 4, w)
    third = seen(row, SLOW + 6, w)
    way = abs(bend) * half + 0.5 * abs(third) * half * half
    room = (abs(slope) + 0.5 * abs(bend) * half + abs(third) * half * half / 6.0) * half
    room += bounded(row, REST, w)
    if not is_wanted(goal, r, value, room, w.limits):
        return 0
    left = bounded(row, REST + 1, w)
    if not abs(slope) <= way + left:
        return 0
    left = bounded(row, REST + 2, w)
    if abs(bend) > abs(third) * half + left:
        return 1
    sharp = bounded(row, SHARP, w)
    if left > NARROW * sharp:
        return 2
    return 1 if abs(bend) > ROUNDED * sharp else 0


@kernel
def search_leg(leg, goal, count, found, w):
    """Look through a leg, part by part. Returns how many turning points have been found."""
    opened, many, turning = w.opened, w.many, w.turning
    first = 3 * w.sizes[GROUPS] * count * w.state[leg]
    depth, place, parts = 0, 0, 1.0
    for r in range(count):
        opened[0, r] = r
    many[0] = count
    while True:
        half = 0.5 * w.length[leg] / parts
        middle = (2 * place + 1) * half
        move_to(leg, middle, w)
        bound_waves(leg, middle, half, w)
        left = 0
        for k in range(many[depth]):
            r = opened[depth, k]
            row = first + 3 * w.sizes[GROUPS] * r
            answer = is_undecided(goal, r, row, half, w)
            if answer == 2:
                opened[depth + 1, left] = r
                left += 1
            elif answer == 1:
                time, value = turn_once(leg, row, middle - half, middle + half, w)
                if not math.isnan(time):
                    see(goal, r, value, w.limits)
                    if goal == TURNS and found < turning.shape[0]:
                        turning[found, 0], turning[found, 1], turning[found, 2] = leg, r, time
                    found += 1
        if left > 0 and depth < DEEPEST:
            depth, place, parts = depth + 1, 2 * place, 2.0 * parts
            many[depth] = left
            continue
        while place % 2 == 1:
            depth, place, parts = depth - 1, place // 2, 0.5 * parts
        if depth == 0:
            return found
        place += 1


@entry
def search(
    sizes, rates, amplitudes, state, length, quantities, limits, turning, work, sums, opened, many,
):  # fmt: skip
    """Look through the legs of a motion.

    rates f8[3 S G, LANES]; amplitudes f8[3 p G, LANES]; state i8[p]; length f8[p] [s]; quantities
    f8[3 S R G, LANES]; limits f8[2, R] or f8[1, 1]; turning f8[n, 3]: leg, quantity, time since
    the leg began [s]; the rest to work with. Returns how many turning points were met: as many as
    there is room for stand in `turning`.
    """
    w = Waves(
        sizes, rates, amplitudes, state, length, quantities, limits, turning, work, sums, opened,
        many,
    )  # fmt: skip
    goal, groups, count, found = sizes[GOAL], sizes[GROUPS], sizes[QUANTITIES], 0
    for leg in range(sizes[FIRST], sizes[BEHIND] if goal == EXTREMES else sizes[FIRST]):
        first = 3 * groups * count * state[leg]
        for k in range(3):
            move_to(leg, 0.5 * k * length[leg], w)
            for r in range(count):
                see(goal, r, seen(first + 3 * groups * r, NOW, w), limits)
    for leg in range(sizes[FIRST], sizes[BEHIND]):
        found = search_leg(leg, goal, count, found, w)
    return found
