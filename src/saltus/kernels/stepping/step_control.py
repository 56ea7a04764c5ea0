"""Template: steps of MATLAB's ode45 and ode23, each as long as the error estimate of a pair of
Runge-Kutta formulas allows. Rules of error control and step length: Shampine & Reichelt, The MATLAB
ODE Suite, SIAM J. Sci. Comput. 18 (1997).

The head supplies RULES: the exponent of the step length rules, 1 / (order of the error estimate +
1); the err/RelTol below which the rule 1.25 (err/RelTol)^exponent <= 0.2 lets a step grow five
times, less a little; the least share of its length that a first failure leaves a step.

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); t_end end of
the trajectory; h = t_new - t; length what is asked for h; theta = AbsTol/RelTol; err the error
estimate on RelTol's scale. Times in s.
"""

# Entries of RULES.
POWER, TINY, LEAST_SHRINK = range(3)


@inner
def step(i, t, t_stop, t_leg, t_end, batch, work):
    """One accepted step: (t_new, h, True if it succeeded, rejections). It fails unless err <= rtol:
    for NaN, or if no step is short enough.
    """
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    length, shortest, last = length_asked(i, t, t_stop, t_leg, t_end, batch)
    rejections = 0
    while True:
        t_new = t_stop if last else t + length
        h = stages(t, length, t_new, FROM_STATE, work)
        err = length * error_norm(theta, work)
        if not err > rtol or length <= shortest:
            batch.carry[i, LENGTH] = next_length(length, err, rejections, rtol)
            return t_new, h, err <= rtol, rejections
        length = max(
            shortest,
            length * max(RULES[LEAST_SHRINK], 0.8 * (rtol / err) ** RULES[POWER])
            if rejections == 0
            else 0.5 * length,
        )
        last = False
        rejections += 1


@inner
def next_length(length, err, rejections, rtol):
    """Length of the step after an accepted one."""
    if rejections > 0:
        return length
    ratio = err / rtol
    if ratio < RULES[TINY]:
        return 5.0 * length
    shrink = 1.25 * ratio ** RULES[POWER]
    return length / shrink if shrink > 0.2 else 5.0 * length


@kernel
def begin_leg(i, t, t_end, batch, work):
    """Default length of the first step of a leg, from NODE and K1."""
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    norm = 0.0
    for j in range(NSTATES):
        norm = max(norm, abs(work[K1 + j] / max(abs(work[NODE + j]), theta)))
    rate = norm / (0.8 * rtol ** RULES[POWER])
    length = longest_step(t, t_end)
    if length * rate > 1.0:
        length = 1.0 / rate
    batch.carry[i, LENGTH] = max(length, 16.0 * ulp(t))
