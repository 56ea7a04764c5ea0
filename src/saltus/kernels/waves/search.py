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
def slope_and_bend(
    leg, row, time, rates, amplitudes, state, quantities, work, sums, groups
):  # fmt: skip
    """A quantity, its slope and its bend at a time of a leg."""
    move_to(leg, time, rates, amplitudes, state, work, groups)
    rate = 3 * groups * state[leg]
    value, slope, bend = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
    for g in range(groups):
        grows, turns = load(rates, rate + g, LANES), load(rates, rate + groups + g, LANES)
        a, b = load(quantities, row + g, LANES), load(quantities, row + groups + g, LANES)
        x, y = load(work, NOW * groups + g, LANES), load(work, (NOW + 1) * groups + g, LANES)
        x, y = fma(a, x, -(b * y)), fma(a, y, b * x)
        value = value + x
        x, y = fma(grows, x, -(turns * y)), fma(grows, y, turns * x)
        slope, bend = slope + x, bend + fma(grows, x, -(turns * y))
    return sum_of(value, sums), sum_of(slope, sums), sum_of(bend, sums)


@kernel
def turn_once(leg, row, low, high, rates, amplitudes, state, quantities, work, sums, groups):
    """Time and value where a quantity turns in a part of a leg that holds one turn or none: by
    Newton's method inside a shrinking bracket. The time is NaN if there is none. A turn between two
    parts is one of the first.
    """
    here = (rates, amplitudes, state, quantities, work, sums, groups)
    _, first, _ = slope_and_bend(leg, row, low, *here)
    value, last, _ = slope_and_bend(leg, row, high, *here)
    if last == 0.0 and first != 0.0:
        return high, value
    if not first * last < 0.0:
        return math.nan, math.nan
    near, time = LAST * (high - low), 0.5 * (low + high)
    for _ in range(MOST_STEPS):
        now = time
        value, slope, bend = slope_and_bend(leg, row, now, *here)
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
def is_undecided(
    goal, r, row, half, quantities, limits, work, sums, groups
):  # fmt: skip
    """0 if a part can't hold what is looked for of a quantity, 1 if the quantity turns there once
    at most, 2 if that isn't known.
    """
    value = seen(row, SLOW * groups, quantities, work, groups, sums)
    slope = seen(row, (SLOW + 2) * groups, quantities, work, groups, sums)
    bend = seen(row, (SLOW + 4) * groups, quantities, work, groups, sums)
    third = seen(row, (SLOW + 6) * groups, quantities, work, groups, sums)
    way = abs(bend) * half + 0.5 * abs(third) * half * half
    room = (abs(slope) + 0.5 * abs(bend) * half + abs(third) * half * half / 6.0) * half
    room += bounded(row, REST * groups, quantities, work, groups, sums)
    if not is_wanted(goal, r, value, room, limits):
        return 0
    left = bounded(row, (REST + 1) * groups, quantities, work, groups, sums)
    if not abs(slope) <= way + left:
        return 0
    left = bounded(row, (REST + 2) * groups, quantities, work, groups, sums)
    if abs(bend) > abs(third) * half + left:
        return 1
    sharp = bounded(row, SHARP * groups, quantities, work, groups, sums)
    if left > NARROW * sharp:
        return 2
    return 1 if abs(bend) > ROUNDED * sharp else 0


@kernel
def search_leg(
    leg, goal, count, found, rates, amplitudes, state, length, quantities, limits, turning, work,
    sums, opened, many, groups,
):  # fmt: skip
    """Look through a leg, part by part. Returns how many turning points have been found."""
    here = (rates, amplitudes, state, quantities, work, sums, groups)
    first, depth, place, parts = 3 * groups * count * state[leg], 0, 0, 1.0
    for r in range(count):
        opened[0, r] = r
    many[0] = count
    while True:
        half = 0.5 * length[leg] / parts
        middle = (2 * place + 1) * half
        move_to(leg, middle, rates, amplitudes, state, work, groups)
        bound_waves(leg, middle, half, rates, amplitudes, state, work, groups)
        left = 0
        for k in range(many[depth]):
            r = opened[depth, k]
            row = first + 3 * groups * r
            answer = is_undecided(goal, r, row, half, quantities, limits, work, sums, groups)
            if answer == 2:
                opened[depth + 1, left] = r
                left += 1
            elif answer == 1:
                time, value = turn_once(leg, row, middle - half, middle + half, *here)
                if not math.isnan(time):
                    see(goal, r, value, limits)
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
    goal, groups, count, found = sizes[GOAL], sizes[GROUPS], sizes[QUANTITIES], 0
    for leg in range(sizes[FIRST], sizes[BEHIND] if goal == EXTREMES else sizes[FIRST]):
        first = 3 * groups * count * state[leg]
        for k in range(3):
            move_to(leg, 0.5 * k * length[leg], rates, amplitudes, state, work, groups)
            for r in range(count):
                row = first + 3 * groups * r
                see(goal, r, seen(row, NOW * groups, quantities, work, groups, sums), limits)
    for leg in range(sizes[FIRST], sizes[BEHIND]):
        found = search_leg(
            leg, goal, count, found, rates, amplitudes, state, length, quantities, limits, turning,
            work, sums, opened, many, groups,
        )  # fmt: skip
    return found
