"""Template: what MATLAB's solvers have in common.

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

# Columns of `options` that these methods have.
RTOL, ATOL = range(2)


@inner
def law_mode(i, batch):
    """The mode that the right-hand side is in."""
    return FROM_STATE


@inner
def settle_sides(i, t, batch, work):
    """Sides that the gaps at NODE alone don't tell: none here."""


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
