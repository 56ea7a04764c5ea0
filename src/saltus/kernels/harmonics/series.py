"""Template: all zeros of truncated Fourier series, located to rounding.

A cell of the circle holds no zero where the series is larger than its slope and its largest second
derivative allow it to fall there, and at most one where the slope keeps its sign; other cells are
halved. Cells are shares i/2^depth of the circle, so that neighbours agree on the sign between them.
"""

from __future__ import annotations

import math

#: Halvings of the circle before the first look, and the most: what is left is rounding.
FIRST, DEEPEST = 3, 48
#: Steps of Newton's method, or halvings, by which a zero is located.
STEPS = 60
#: Length of the last step towards a zero, behind which there is rounding [rad].
LOCATED = 1e-9


@kernel
def along(series, row, angle):
    """Value of a series at an angle, and its slope."""
    split = (series.shape[1] - 1) // 2
    cosine, sine = math.cos(angle), math.sin(angle)
    c, s, value, slope = cosine, sine, series[row, 0], 0.0
    for k in range(1, split + 1):
        a, b = series[row, k], series[row, split + k]
        value += a * c + b * s
        slope += k * (b * c - a * s)
        c, s = c * cosine - s * sine, s * cosine + c * sine
    return value, slope


@kernel
def write_basis(angle, most, here):
    """One, the cosines and the sines up to a harmonic at an angle, f8[2 most + 1]."""
    here[0] = 1.0
    if most == 0:
        return
    here[1], here[most + 1] = math.cos(angle), math.sin(angle)
    known = 1
    while known < most:  # twice as many each time
        cosine, sine = here[known], here[most + known]
        for k in range(1, min(known, most - known) + 1):
            c, s = here[k], here[most + k]
            here[known + k] = c * cosine - s * sine
            here[most + known + k] = s * cosine + c * sine
        known *= 2


@kernel
def located(series, row, low, high, rising):
    """The zero between two angles of different signs, and the slope there, by Newton's method that
    stays between.
    """
    place, slope = 0.5 * (low + high), 0.0
    for _ in range(STEPS):
        value, slope = along(series, row, place)
        if value == 0.0:
            break
        if (value > 0.0) == rising:
            high = place
        else:
            low = place
        new = place - value / slope if slope != 0.0 else low - 1.0
        if not (low <= new <= high):
            new = 0.5 * (low + high)
        step = abs(new - place)
        place = new
        if step < LOCATED:
            break
    return place, slope


@kernel
def all_zeros(series, which, angle, slope):
    """Find the changes of sign of series on the circle.

    series f8[g, 2H + 1]; out, as many as fit: which i8[r], the series, ascending; angle f8[r] in
    [0, 2 pi], ascending for each; slope f8[r], over the angle. Returns how many.
    """
    split, found = (series.shape[1] - 1) // 2, 0
    for row in range(series.shape[0]):
        bend = 0.0
        for k in range(1, split + 1):
            bend += k * k * math.sqrt(series[row, k] ** 2 + series[row, split + k] ** 2)
        if not bend > 0.0:
            continue
        first = along(series, row, 0.0)[0] > 0.0
        left, depth, cell = first, FIRST, 0
        while cell < 1 << depth:
            half = math.pi / (1 << depth)
            middle = (2 * cell + 1) * half
            value, rate = along(series, row, middle)
            clear = abs(value) > abs(rate) * half + 0.5 * bend * half * half
            if not clear and abs(rate) <= bend * half and depth < DEEPEST:
                cell, depth = 2 * cell, depth + 1
                continue
            right = value > 0.0
            if not clear:
                last = cell + 1 == 1 << depth
                right = first if last else along(series, row, middle + half)[0] > 0.0
            if right != left and found < len(angle):
                which[found] = row
                angle[found], slope[found] = located(
                    series, row, middle - half, middle + half, right
                )
                found += 1
            left, cell = right, cell + 1
            while depth > FIRST and cell % 2 == 0:
                cell, depth = cell // 2, depth - 1
    return found
