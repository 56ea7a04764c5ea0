"""Template: one step of an explicit Runge-Kutta method, its error estimate and its dense output,
from the tables of the head (codegen/tableaux.py).

The last stage is the rate at the end of the step, the first one of the next step. Sums are taken
from left to right and a stage is y + h*(sum), as MATLAB does it since it keeps each stage in a
variable of its own: the last digits depend on that. Entries that are zero are left out.

The head supplies STAGES and, stage by stage, STAGE_TIME, WEIGHT (a row of STAGES for each stage),
ERROR_WEIGHT and DENSE_WEIGHT: the weight of stage i at the place s of a step is s^2 (D_i0 + s (D_i1
+ D_i2 s)), and s more for the first.

Symbols
-------
t, t_new ends of a step; h its length; k_i stages; s place in the step, 0 to 1; theta =
AbsTol/RelTol.
"""


@inner
def toward(stage, h, out, work):
    """The state at which a stage is evaluated, to `out`."""
    for i in range(NSTATES):
        slope = WEIGHT[stage * STAGES] * work[K1 + i]
        for j in range(1, stage):
            weight = WEIGHT[stage * STAGES + j]
            if weight != 0.0:
                slope += weight * work[K1 + NSTATES * j + i]
        work[out + i] = work[NODE + i] + h * slope


@inner
def stages(t, length, t_new, mode, work):
    """The stages of a step of the given length, and its end at t_new, to NEXT; returns h = t_new -
    t, which differs from length by rounding.
    """
    time = t
    for stage in range(1, STAGES - 1):
        if stage == 1 or STAGE_TIME[stage] != STAGE_TIME[stage - 1]:
            time = t + length * STAGE_TIME[stage]
            drive_at(time, Q_STAGE, work)
        toward(stage, length, POINT, work)
        rate_at(time, POINT, Q_STAGE, mode, K1 + NSTATES * stage, work)
    if t_new != time:
        drive_at(t_new, Q_STAGE, work)
    h = t_new - t
    toward(STAGES - 1, h, NEXT, work)
    rate_at(t_new, NEXT, Q_STAGE, mode, K_END, work)
    return h


@inner
def error_norm(theta, work):
    """Max norm of the error estimate, divided by h, on the scale of the states; NaN if any of it is
    NaN.
    """
    norm = 0.0
    for i in range(NSTATES):
        error = ERROR_WEIGHT[0] * work[K1 + i]
        for j in range(1, STAGES):
            weight = ERROR_WEIGHT[j]
            if weight != 0.0:
                error += weight * work[K1 + NSTATES * j + i]
        work[ERROR + i] = error
        ratio = abs(error / max(max(abs(work[NODE + i]), abs(work[NEXT + i])), theta))
        if ratio > norm or ratio != ratio:
            norm = ratio
    return norm


@inner
def dense(time, t, h, work):
    """The state at a time inside the step, to POINT: a polynomial."""
    s = (time - t) / h
    s2 = s * s
    for j in range(STAGES):
        work[S + j] = s2 * (
            DENSE_WEIGHT[3 * j] + s * (DENSE_WEIGHT[3 * j + 1] + DENSE_WEIGHT[3 * j + 2] * s)
        )
    work[S] += s
    for i in range(NSTATES):
        slope = work[K1 + i] * work[S]
        for j in range(1, STAGES):
            if DENSE_WEIGHT[3 * j] != 0.0:
                slope += work[K1 + NSTATES * j + i] * work[S + j]
        work[POINT + i] = work[NODE + i] + h * slope
