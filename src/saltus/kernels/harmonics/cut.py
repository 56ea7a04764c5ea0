"""Template: a motion cut where it meets boundaries whose gaps are series."""

from __future__ import annotations

import math


@kernel
def write_series(signals, signal, times, rate, states):
    """The series of states, each a derivative of a signal."""
    split = (signals.shape[1] - 1) // 2
    for j in range(len(signal)):
        for k in range(signals.shape[1]):
            states[j, k] = signals[signal[j], k]
        for _ in range(times[j]):
            states[j, 0] = 0.0
            for k in range(1, split + 1):
                a, b = states[j, k], states[j, split + k]
                states[j, k], states[j, split + k] = rate * k * b, -rate * k * a


@kernel
def write_states(states, here, y):
    """States at an angle of which the basis is given, up to twice their harmonics or more."""
    split, most = (states.shape[1] - 1) // 2, (len(here) - 1) // 2
    for j in range(len(states)):
        even, odd = states[j, 0], 0.0
        for k in range(1, split + 1):
            even += states[j, k] * here[k]
            odd += states[j, split + k] * here[most + k]
        y[j] = even + odd


@kernel
def write_gaps(states, level, slope, pace, p, around, y, value, gaps):
    """The series of gaps: those that are linear in the states, and behind them others, read off at
    as many places as they have coefficients.
    """
    split, most = (states.shape[1] - 1) // 2, (gaps.shape[1] - 1) // 2
    gaps[:] = 0.0
    for i in range(len(level)):
        gaps[i, 0] = level[i]
        for j in range(len(states)):
            if slope[i, j] != 0.0:
                gaps[i, 0] += slope[i, j] * states[j, 0]
                for k in range(1, split + 1):
                    gaps[i, k] += slope[i, j] * states[j, k]
                    gaps[i, most + k] += slope[i, j] * states[j, split + k]
    for node in range(len(around) if len(value) > 0 else 0):
        angle = 2.0 * math.pi * node / len(around)
        write_basis(angle, most, around)
        write_states(states, around, y)
        gap_values(angle * pace, y, p, 0, value)
        for i in range(len(value)):
            row, share = len(level) + i, value[i] / len(around)
            gaps[row, 0] += share
            for k in range(1, len(around)):
                gaps[row, k] += 2.0 * share * around[k]


@kernel
def order(count, which, angle, slope):
    """Sort instants by their angles in [0, 2 pi)."""
    for i in range(count):
        here, number, rate = angle[i] % (2.0 * math.pi), which[i], slope[i]
        j = i
        while j > 0 and angle[j - 1] > here:
            angle[j], which[j], slope[j] = angle[j - 1], which[j - 1], slope[j - 1]
            j -= 1
        angle[j], which[j], slope[j] = here, number, rate


@kernel
def mode_at(gaps, numbers, angle):
    """Sides of the boundaries at an angle, as bits."""
    mode = 0
    for i in range(len(numbers)):
        if along(gaps, i, angle)[0] > 0.0:
            mode |= 1 << numbers[i]
    return mode


@kernel
def cut(gaps, numbers, which, angle, slope, sides, begin, length, mode):
    """Cut the circle at the zeros of gaps.

    gaps f8[g, 2H + 1]; numbers i8[g]: of the boundaries; out: the instants which i8[r], angle and
    slope f8[r], sides i8[2, r] before and behind; the intervals begin, length f8[p], mode i8[p].
    Returns how many instants, how many intervals.
    """
    instants = all_zeros(gaps, which, angle, slope)
    order(instants, which, angle, slope)
    count = 0
    for i in range(instants):
        if i == 0 or angle[i] > angle[i - 1]:
            begin[count] = angle[i]
            count += 1
        sides[1, i] = count - 1
    if instants == 0:
        begin[0], count = 0.0, 1
    for i in range(count):
        end = begin[i + 1] if i + 1 < count else begin[0] + 2.0 * math.pi
        length[i] = end - begin[i]
        mode[i] = mode_at(gaps, numbers, begin[i] + 0.5 * length[i])
    for i in range(instants):
        at = sides[1, i]
        sides[0, i], sides[1, i] = mode[at - 1 if at > 0 else count - 1], mode[at]
        which[i] = numbers[which[i]]
    return instants, count
