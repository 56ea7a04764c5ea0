"""Template: common parts of MATLAB's solvers.

Sides are those of the state wherever the right-hand side is evaluated. Contacts are located on the
dense output: a step that ends beyond a boundary is cut there, and the method starts afresh from the
contact with its default first step. Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput.
18 (1997).

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); t_end end of
the trajectory; h = t_new - t. Times in s.
"""

from saltus.kernels.status import RUNNING

# Columns of `options` of these methods.
RTOL, ATOL = range(2)


@inner
def law_mode(i, batch):
    """The mode of the right-hand side."""
    return FROM_STATE


@inner
def settle_sides(i, t, batch, work):
    """Sides that the gaps at NODE don't show: none here."""


@inner
def at_once(i, t, batch):
    """The time [s] within which odezero can't tell two contacts apart."""
    return RESOLUTION * ulp(t)


@inner
def least_state(i, batch):
    """The least size of every state for the control of errors."""
    return batch.options[i, ATOL] / batch.options[i, RTOL]


@inner
def longest_step(t_leg, t_end):
    """A tenth of the leg's span."""
    return 0.1 * (t_end - t_leg)


@inner
def length_asked(i, t, t_stop, t_leg, t_end, batch):
    """The first try of a step: (its length, the shortest that it may become, True if it ends at
    t_stop).
    """
    shortest = 16.0 * ulp(t)
    length = max(shortest, min(longest_step(t_leg, t_end), batch.carry[i, LENGTH]))
    last = 1.1 * length >= t_stop - t
    return t_stop - t if last else length, shortest, last


@inner
def find_contact(i, t, t_new, t_leg, h, batch, work):
    """The first contact of a step: (its time, or the step's end; end and length of the step that it
    lies in; True if there is one; RUNNING). A state that rebounds does so just before the boundary.
    """
    gaps_at(t_new, NEXT, Q_STAGE, AT_NEXT, work)
    if any_sign_change(work, AT_NODE, AT_NEXT):
        t_before, t_hit, lands = odezero(t, t_new, t_leg, h, work)
        if LAWS and rebounds(i, t_hit, t, h, batch, work):
            return t_before, t_new, h, True, RUNNING
        return t_hit, t_new, h, lands or (LAWS and any_strikes(work)), RUNNING
    return t_new, t_new, h, False, RUNNING


@kernel
def rebounds(i, t_hit, t, h, batch, work):
    """True if the state leaves a boundary that it has reached to the side from which it came: at a
    stop, or where a jump reverses it.
    """
    for g in range(NGUARDS):
        if strikes(work, g):
            dense(t_hit, t, h, work)
            drive_at(t_hit, Q, work)
            work[LATE] = 0.0
            behind = leap(i, g, t_hit, POINT, batch, work)
            if LAW[g] == IMPACT_LAW or (waits(g, behind) and lies_on(g, t_hit, work)):
                return True
    return False
