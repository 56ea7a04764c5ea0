"""Template: steps of MATLAB's ode45 and ode23, each as long as the error estimate of a pair of
Runge-Kutta formulas allows. Contacts are located on the dense output.

Rules of error control and step length: Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci.
Comput. 18 (1997). Sides are those of the state at every stage; a step that ends beyond a boundary
is cut there, and the method starts afresh from the contact with its default first step.

The head supplies RULES: the exponent of the step length rules, 1 / (order of the error estimate +
1); the err/RelTol below which the rule 1.25 (err/RelTol)^exponent <= 0.2 lets a step grow five
times, less a little; the least share of its length that a first failure leaves a step.

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); t_end end of
the trajectory; h = t_new - t; length what is asked for h; theta = AbsTol/RelTol; err the error
estimate on RelTol's scale. Times in s.
"""

from saltus.kernels.status import RUNNING

# Columns of `options` that are the method's own.
RTOL, ATOL = range(2)
# Entries of RULES.
POWER, TINY, LEAST_SHRINK = range(3)


@inner
def law_mode(i, batch):
    """The mode that the right-hand side is in."""
    return FROM_STATE


@inner
def settle_sides(i, t, batch, work):
    """Sides that the gaps at NODE alone don't tell: none here."""


@inner
def step(i, t, t_stop, t_leg, t_end, batch, work):
    """One accepted step: (t_new, h, whether it is fine, rejections). It isn't if not err <= rtol:
    NaN, or no step is short enough.
    """
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    shortest = 16.0 * ulp(t)
    length = min(longest_step(t_leg, t_end), max(shortest, batch.carry[i, LENGTH]))
    last = 1.1 * length >= t_stop - t
    if last:
        length = t_stop - t
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


@inner
def longest_step(t_leg, t_end):
    """A tenth of the leg's span."""
    return 0.1 * (t_end - t_leg)


@inner
def find_contact(i, t, t_new, t_leg, h, batch, work):
    """The first contact of a step: (its time, or the step's end; end and length of the step that it
    lies in; whether there is one; RUNNING).
    """
    gaps_at(t_new, NEXT, Q_STAGE, AT_NEXT, work)
    if any_sign_change(work, AT_NODE, AT_NEXT):
        t_hit, lands = odezero(t, t_new, t_leg, h, work)
        return t_hit, t_new, h, lands, RUNNING
    return t_new, t_new, h, False, RUNNING
