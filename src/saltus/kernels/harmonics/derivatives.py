"""Template: the derivatives of the integrals with respect to the coefficients of the signals."""

from __future__ import annotations

import math

#: A jump below this share of a force is rounding.
ROUNDING = 1e-12


@kernel
def write_product(integral, row, matrix):
    """The matrix f8[2H + 1, 2H + 1] that multiplies a series by a function and gives the series of
    the product, from the integrals f8[r, 4H + 1] of the function.
    """
    split = (len(matrix) - 1) // 2
    for p in range(split + 1):
        for q in range(split + 1):
            apart, both = integral[row, abs(p - q)], integral[row, p + q]
            matrix[p, q] = 0.5 * (apart + both)
            if p > 0 and q > 0:
                matrix[split + p, split + q] = 0.5 * (apart - both)
            if q > 0:  # cos p sin q, and sin q cos p
                sine = 0.5 * integral[row, 2 * split + p + q] if p + q > 0 else 0.0
                turned = 0.5 * integral[row, 2 * split + abs(q - p)] if p != q else 0.0
                matrix[p, split + q] = matrix[split + q, p] = sine + (turned if q > p else -turned)
    for q in range(len(matrix)):
        matrix[0, q] *= 0.5


@kernel
def derive_columns(matrix, times, rate, whole, force, first):
    """Add a matrix that multiplies the derivative of a series, ``times`` times, for one that
    multiplies the series.
    """
    split = (len(matrix) - 1) // 2
    for row in range(len(matrix)):
        if times == 0:
            whole[force, row, first] += matrix[row, 0]
        for k in range(1, split + 1):
            factor, a, b = 1.0, matrix[row, k], matrix[row, split + k]
            for _ in range(times):
                a, b = -b, a
                factor *= k * rate
            whole[force, row, first + k] += factor * a
            whole[force, row, first + split + k] += factor * b


@kernel
def gather(
    integrals, forced, moved, moving, signal, times, rate, rate_by, states, matrix, whole
):  # fmt: skip
    """Put the coefficients of forces and their derivatives together.

    integrals f8[r, 4H + 1]: of the m forces, then of the slopes of force forced[i] by state
    moved[i], of which the first ``moving`` states move. whole f8[m, 2H + 1, 1 + c (2H + 1) + e]:
    the coefficients, and their derivatives by the signals and by the states that don't move.
    """
    width, count = whole.shape[1], len(whole)
    split = (width - 1) // 2
    after = whole.shape[2] - len(rate_by)
    whole[:] = 0.0
    for m in range(count):
        for k in range(split + 1):
            whole[m, k, 0] = integrals[m, k] * (0.5 if k == 0 else 1.0)
            if k > 0:
                whole[m, split + k, 0] = integrals[m, 2 * split + k]
    for i in range(len(forced)):
        m, j, row = forced[i], moved[i], count + i
        if j >= moving:
            for k in range(split + 1):
                whole[m, k, after + j - moving] += integrals[row, k] * (0.5 if k == 0 else 1.0)
                if k > 0:
                    whole[m, split + k, after + j - moving] += integrals[row, 2 * split + k]
            continue
        write_product(integrals, row, matrix)
        derive_columns(matrix, times[j], rate, whole, m, 1 + signal[j] * width)
        if times[j] == 0:
            continue
        for k in range(width):
            by_rate = 0.0
            for q in range(width):
                by_rate += matrix[k, q] * states[j, q]
            for e in range(len(rate_by)):
                whole[m, k, after + e] += by_rate * times[j] * rate_by[e]


@kernel
def add_shifts(
    which, angle, slope, sides, instants, jumping, pace, p, signal, times, rate, rate_by, states,
    here, y, both, slopes, row, whole,
):  # fmt: skip
    """Add to the derivatives what the shifts of instants do at which forces jump."""
    count, width = len(whole), whole.shape[1]
    split, most, moving = (width - 1) // 2, (len(here) - 1) // 2, len(signal)
    after = whole.shape[2] - len(rate_by)
    for i in range(instants):
        if not jumping[which[i]]:
            continue
        write_basis(angle[i], most, here)
        write_states(states, here, y)
        forces(angle[i] * pace, y, p, sides[0, i], both[0])
        forces(angle[i] * pace, y, p, sides[1, i], both[1])
        gap_slopes(angle[i] * pace, y, p, sides[0, i], slopes)
        row[:] = 0.0
        first = which[i] * (moving + len(rate_by))
        for j in range(moving):
            own = slopes[first + j]
            if own == 0.0:
                continue
            start = 1 + signal[j] * width
            if times[j] == 0:
                row[start] += own
            for k in range(1, split + 1):
                factor, a, b = own, here[k], here[most + k]
                for _ in range(times[j]):
                    a, b = -b, a
                    factor *= k * rate
                row[start + k] += factor * a
                row[start + split + k] += factor * b
            for e in range(len(rate_by)):
                row[after + e] += own * times[j] * y[j] * rate_by[e]
        for e in range(len(rate_by)):
            row[after + e] += slopes[first + moving + e]
        for m in range(count):
            jump = both[0, m] - both[1, m]
            # a power of a depth isn't defined where rounding makes that negative, and doesn't jump
            if not abs(jump) > ROUNDING * max(abs(both[0, m]), abs(both[1, m])):
                continue
            for k in range(width):
                basis = here[k] if k <= split else here[most + k - split]
                share = -jump * basis / (math.pi * slope[i]) * (0.5 if k == 0 else 1.0)
                for column in range(1, whole.shape[2]):
                    whole[m, k, column] += share * row[column]
