"""Template: the functions of an equation on parts of `work`, for the methods that run one
trajectory after the other.

The head supplies NSTATES, NGUARDS, NCONST, NDRIVE, GAPS_IN_TIME (whether a gap depends on time
otherwise than through the state), and prepare(p, c), drive(t, c, h, q), field(t, y, c, q, h, mode,
out), gaps(t, y, c, q, h, out), gap_rates(t, y, dy, c, q, h, out): c holds what depends on
parameters only, q what depends on time too, h what the clocks hold (clocks.py). The sides of the
contacts are the bits of `mode`, or those of the state at FROM_STATE.
"""

from saltus.kernels.lanes import spacing
from saltus.kernels.parts import part
from saltus.kernels.status import IMPACT_LAW, JUMP_LAW

#: As a mode: the right-hand side takes its sides from the given state.
FROM_STATE = -1
SMALLEST = 2.2250738585072014e-308


@inner
def drive_at(time, q, work):
    """Time-only values at a time, to `q`."""
    drive(time, part(work, C, NCONST), part(work, H, HELD * NCLOCKS), part(work, q, NDRIVE))


@inner
def rate_at(time, state, q, mode, out, work):
    """The right-hand side in a mode, to `out`."""
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    y, rate = part(work, state, NSTATES), part(work, out, NSTATES)
    field(time, y, c, part(work, q, NDRIVE), h, mode, rate)


@inner
def gaps_at(time, state, q, out, work):
    """All gaps, to `out`. A state at a stop hasn't passed it."""
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    gaps(time, part(work, state, NSTATES), c, part(work, q, NDRIVE), h, part(work, out, NGUARDS))
    if LAWS:
        for g in range(NGUARDS):
            if LAW[g] == IMPACT_LAW and work[out + g] == 0.0:
                work[out + g] = LAW_SIDE[g] * SMALLEST


@inner
def gap_rates_at(time, state, rate, q, out, work):
    """d/dt of all gaps where the state changes at `rate`, to `out`."""
    y, dy = part(work, state, NSTATES), part(work, rate, NSTATES)
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    gap_rates(time, y, dy, c, part(work, q, NDRIVE), h, part(work, out, NGUARDS))


@inner
def sides(at, work):
    """Mode bits: bit g is set where gap g is positive."""
    bits = 0
    for g in range(NGUARDS):
        if work[at + g] > 0.0:
            bits |= 1 << g
    return bits


@inner
def allowed(bits):
    """Mode bits with those of stops set to the allowed side, whatever rounding says."""
    if LAWS:
        for g in range(NGUARDS):
            if LAW[g] == IMPACT_LAW:
                bits = bits | 1 << g if LAW_SIDE[g] > 0.0 else bits & ~(1 << g)
    return bits


@inner
def leaps(g):
    """True if the state jumps at the boundary of a guard."""
    return LAW[g] == IMPACT_LAW or LAW[g] == JUMP_LAW


@inner
def waits(g, mode):
    """True if it jumps when the gap closes from the side that it has in a mode."""
    return leaps(g) and (mode >> g & 1 == 1) == (LAW_SIDE[g] > 0.0)


@inner
def strikes(work, g):
    """True if the gap closes, from LEFT to RIGHT, and the state jumps."""
    return leaps(g) and changes_sign(work, LEFT, RIGHT, g) and work[LEFT + g] * LAW_SIDE[g] > 0.0


# -- signs -----------------------------------------------------------------------------------------
@inner
def ulp(x):
    """Distance from |x| to the next larger double (MATLAB's eps(x))."""
    return spacing(abs(x))


@inner
def sign(x):
    """-1, 0 or 1."""
    return int(x > 0.0) - int(x < 0.0)


@inner
def changes_sign(work, one, other, g):
    """True if gap g has another sign at `other` than at `one`; zero is a sign of its own."""
    return sign(work[one + g]) != sign(work[other + g])


@inner
def any_sign_change(work, one, other):
    """True if any gap has another sign at `other` than at `one`."""
    changes = False
    for g in range(NGUARDS):
        changes |= changes_sign(work, one, other, g)
    return changes
