"""Template: the Dormand-Prince pair of orders 5 and 4, its error estimate and its dense output, as
ode45 uses it.

codegen puts a generated head before this text and odezero.py and ode45.py behind it. Sources:
Dormand & Prince, J. Comput. Appl. Math. 6 (1980); dense output, Shampine, Math. Comp. 46 (1986).
Sums are taken from left to right and a stage is y + h*(sum), as MATLAB does it since it keeps each
stage in a variable of its own: the last digits depend on that.

The head supplies NSTATES, NGUARDS, NCONST, NDRIVE, GAPS_IN_TIME (whether a gap depends on time
otherwise than through the state), and prepare(p, c), drive(t, c, h, q), field(t, y, c, q, h, out),
gaps(t, y, c, q, h, out), gap_rates(t, y, dy, c, q, h, out): c holds what depends on parameters
only, q what depends on time too, h what the clocks hold (clocks.py).

Symbols
-------
t, t_new ends of a step; h its length; k_i stages, k_1 = k_7 of the step before; s place in the
step, 0 to 1; theta = AbsTol/RelTol.
"""

from saltus.kernels.parts import part

# The pair: times, stages, error estimate.
A2, A3, A4, A5 = 1 / 5, 3 / 10, 4 / 5, 8 / 9
B21 = 1 / 5
B31, B32 = 3 / 40, 9 / 40
B41, B42, B43 = 44 / 45, -56 / 15, 32 / 9
B51, B52, B53, B54 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
B61, B62, B63, B64, B65 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
B71, B73, B74, B75, B76 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E1, E3, E4, E5, E6, E7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
# Dense output: the weight of k_i at s is s^2 (D_i2 + s (D_i3 + D_i4 s)), and s more for i = 1.
D12, D13, D14 = -183 / 64, 37 / 12, -145 / 128
D32, D33, D34 = 1500 / 371, -1000 / 159, 1000 / 371
D42, D43, D44 = -125 / 32, 125 / 12, -375 / 64
D52, D53, D54 = 9477 / 3392, -729 / 106, 25515 / 6784
D62, D63, D64 = -11 / 7, 11 / 3, -55 / 28
D72, D73, D74 = 3 / 2, -4.0, 5 / 2


# -- the head's functions on parts of `work` -------------------------------------------------------
@inner
def drive_at(time, q, work):
    """Time-only values at a time, to `q`."""
    drive(time, part(work, C, NCONST), part(work, H, HELD * NCLOCKS), part(work, q, NDRIVE))


@inner
def rate_at(time, state, q, out, work):
    """The right-hand side, to `out`."""
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    field(time, part(work, state, NSTATES), c, part(work, q, NDRIVE), h, part(work, out, NSTATES))


@inner
def gaps_at(time, state, q, out, work):
    """All gaps, to `out`."""
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    gaps(time, part(work, state, NSTATES), c, part(work, q, NDRIVE), h, part(work, out, NGUARDS))


@inner
def gap_rates_at(time, state, rate, q, out, work):
    """d/dt of all gaps where the state changes at `rate`, to `out`."""
    y, dy = part(work, state, NSTATES), part(work, rate, NSTATES)
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    gap_rates(time, y, dy, c, part(work, q, NDRIVE), h, part(work, out, NGUARDS))


# -- one step --------------------------------------------------------------------------------------
@inner
def try_step(t, length, t_new, work):
    """The stages of a step of the length asked for, and its end at t_new; returns h = t_new - t,
    which rounding sets apart from length.
    """
    h = length
    drive_at(t + h * A2, Q2, work)
    drive_at(t + h * A3, Q3, work)
    drive_at(t + h * A4, Q4, work)
    drive_at(t + h * A5, Q5, work)
    drive_at(t + h, Q6, work)
    for i in range(NSTATES):
        work[POINT + i] = work[NODE + i] + h * (B21 * work[K1 + i])
    rate_at(t + h * A2, POINT, Q2, K2, work)
    for i in range(NSTATES):
        work[POINT + i] = work[NODE + i] + h * (B31 * work[K1 + i] + B32 * work[K2 + i])
    rate_at(t + h * A3, POINT, Q3, K3, work)
    for i in range(NSTATES):
        work[POINT + i] = work[NODE + i] + h * (
            B41 * work[K1 + i] + B42 * work[K2 + i] + B43 * work[K3 + i]
        )
    rate_at(t + h * A4, POINT, Q4, K4, work)
    for i in range(NSTATES):
        slope = B51 * work[K1 + i] + B52 * work[K2 + i] + B53 * work[K3 + i] + B54 * work[K4 + i]
        work[POINT + i] = work[NODE + i] + h * slope
    rate_at(t + h * A5, POINT, Q5, K5, work)
    for i in range(NSTATES):
        slope = (
            B61 * work[K1 + i]
            + B62 * work[K2 + i]
            + B63 * work[K3 + i]
            + B64 * work[K4 + i]
            + B65 * work[K5 + i]
        )
        work[POINT + i] = work[NODE + i] + h * slope
    rate_at(t + h, POINT, Q6, K6, work)
    if t_new != t + h:
        drive_at(t_new, Q6, work)
    h = t_new - t
    for i in range(NSTATES):
        slope = (
            B71 * work[K1 + i]
            + B73 * work[K3 + i]
            + B74 * work[K4 + i]
            + B75 * work[K5 + i]
            + B76 * work[K6 + i]
        )
        work[NEXT + i] = work[NODE + i] + h * slope
    rate_at(t_new, NEXT, Q6, K7, work)
    return h


@inner
def error_norm(theta, work):
    """Max norm of the error estimate, divided by h, on the scale of the states; NaN if any of it is
    NaN.
    """
    norm = 0.0
    for i in range(NSTATES):
        error = (
            E1 * work[K1 + i]
            + E3 * work[K3 + i]
            + E4 * work[K4 + i]
            + E5 * work[K5 + i]
            + E6 * work[K6 + i]
            + E7 * work[K7 + i]
        )
        work[ERROR + i] = error
        ratio = abs(error / max(max(abs(work[NODE + i]), abs(work[NEXT + i])), theta))
        if ratio > norm or ratio != ratio:
            norm = ratio
    return norm


@inner
def dense(time, t, h, work):
    """The state at a time inside the step, to POINT: a quartic."""
    s = (time - t) / h
    s2 = s * s
    w1 = s + s2 * (D12 + s * (D13 + D14 * s))
    w3 = s2 * (D32 + s * (D33 + D34 * s))
    w4 = s2 * (D42 + s * (D43 + D44 * s))
    w5 = s2 * (D52 + s * (D53 + D54 * s))
    w6 = s2 * (D62 + s * (D63 + D64 * s))
    w7 = s2 * (D72 + s * (D73 + D74 * s))
    for i in range(NSTATES):
        slope = (
            work[K1 + i] * w1
            + work[K3 + i] * w3
            + work[K4 + i] * w4
            + work[K5 + i] * w5
            + work[K6 + i] * w6
            + work[K7 + i] * w7
        )
        work[POINT + i] = work[NODE + i] + h * slope
