"""Template: the equations of harmonic balance of one motion, and their derivative."""

from __future__ import annotations

#: Places of ``sizes``: degree of products of the forces and a harmonic, bends of the angle, known
#: instants (-1: they are to be found) and intervals.
DEGREE, BENT, INSTANTS, INTERVALS = 0, 1, 2, 3
#: Places of ``numbers``: rate of the angle [rad/s], time of the equations in a radian, factor of
#: the rates of the equations, whether that is the first state that doesn't move.
RATE, PACE, FACTOR, TIMED = 0, 1, 2, 3


@kernel
def respond(
    numbers, rate_by, turning, own, signals, response, by_rate, whole, moved, shift, residual,
    derivative,
):  # fmt: skip
    """Residual ``own X - L W`` and its derivative, L multiplying the amplitudes of the forces.

    response, by_rate f8[2, H + 1, c, m]: L, real and imaginary, and its derivative by the rate,
    times the rate; turning f8[e, u]: the states that don't move by the last unknowns.
    """
    count, width = signals.shape
    split, forces_, constants = (width - 1) // 2, len(whole), len(rate_by)
    after = 1 + count * width
    for a in range(count):
        for k in range(split + 1):
            moved[:] = 0.0
            shift[:] = 0.0
            for m in range(forces_):
                real, imaginary = response[0, k, a, m], response[1, k, a, m]
                slope, turned = by_rate[0, k, a, m], by_rate[1, k, a, m]
                if real == 0.0 and imaginary == 0.0:
                    continue
                other = split + k if k > 0 else 0
                if k == 0:
                    imaginary = turned = 0.0
                for column in range(whole.shape[2]):
                    c, s = whole[m, k, column], whole[m, other, column]
                    moved[0, column] += real * c + imaginary * s
                    moved[1, column] += real * s - imaginary * c
                c, s = whole[m, k, 0], whole[m, other, 0]
                shift[0] += slope * c + turned * s
                shift[1] += slope * s - turned * c
            for part in range(1 if k == 0 else 2):
                place = k + part * split
                row = a * width + place
                residual[row] = own[row] * signals[a, place] - moved[part, 0] / numbers[FACTOR]
                for column in range(count * width):
                    derivative[row, column] = -moved[part, 1 + column] / numbers[FACTOR]
                derivative[row, row] += own[row]
                for u in range(turning.shape[1]):
                    total = 0.0
                    for e in range(constants):
                        by = -moved[part, after + e] - shift[part] * rate_by[e]
                        if e == 0:
                            by += numbers[TIMED] * moved[part, 0] / numbers[FACTOR]
                        total += by * turning[e, u]
                    derivative[row, count * width + u] = total / numbers[FACTOR]


@entry
def balance(
    sizes, numbers, signals, constants, p, rate_by, turning, own, response, by_rate, signal, times,
    forced, moved_by, jumping, gap_numbers, level, slope, place, weigh, which, angle, rates, sides,
    begin, length, mode, residual, derivative, whole, states, gaps, around, value, integrals,
    matrix, here, y, out, both, slopes, row, moved, shift,
):  # fmt: skip
    """Fourier coefficients of the forces along a motion, and the equations of harmonic balance.

    In: signals f8[c, 2H + 1]; constants f8[e]; p: parameters; what :func:`gather`,
    :func:`respond`, :func:`cut` and :func:`integrate` say. Out: residual f8[c (2H + 1)], derivative
    f8[c (2H + 1), c (2H + 1) + u], whole f8[m, 2H + 1, 1 + c (2H + 1) + e]. Returns 0.
    """
    moving, rate = len(signal), numbers[RATE]
    write_series(signals, signal, times, rate, states)
    for e in range(len(constants)):
        y[moving + e] = constants[e]
    instants, intervals = sizes[INSTANTS], sizes[INTERVALS]
    if instants < 0:
        write_gaps(states, level, slope, numbers[PACE], p, around, y, value, gaps)
        instants, intervals = cut(
            gaps, gap_numbers, which, angle, rates, sides, begin, length, mode
        )
    integrate(
        begin, length, mode, intervals, instants == 0, sizes[DEGREE], sizes[BENT], numbers[PACE],
        states, p, place, weigh, here, y, out, integrals,
    )  # fmt: skip
    gather(integrals, forced, moved_by, moving, signal, times, rate, rate_by, states, matrix, whole)
    add_shifts(
        which, angle, rates, sides, instants, jumping, numbers[PACE], p, signal, times, rate,
        rate_by, states, here, y, both, slopes, row, whole,
    )  # fmt: skip
    respond(
        numbers, rate_by, turning, own, signals, response, by_rate, whole, moved, shift, residual,
        derivative,
    )  # fmt: skip
    return 0
