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
def write_gaps(states, level, slope, gaps):
    """The series of gaps that are linear in the states."""
    for i in range(len(level)):
        gaps[i] = 0.0
        gaps[i, 0] = level[i]
        for j in range(len(states)):
            if slope[i, j] != 0.0:
                for k in range(gaps.shape[1]):
                    gaps[i, k] += slope[i, j] * states[j, k]


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
