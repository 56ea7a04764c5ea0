"""Template: what the work array of ode45 holds. codegen puts a generated head before it; it needs
the sizes of that head only.
"""

import numpy as np

from saltus.kernels.clocks_layout import HELD, NUMBERS

# `work` is one array for everything, so that the compiler sees that its parts don't overlap and
# keeps them in registers (measured: a few per cent). Where its parts start: vectors of states - the
# stages, the states at the ends of the step, a point between them, the error estimate divided by h,
# zeros -
VECTORS, GAPS, DRIVES = 12, 7, 6
K1, K2, K3, K4, K5, K6, K7, NODE, NEXT, POINT, ERROR, REST = (
    NSTATES * row for row in range(VECTORS)
)
# gaps - at the ends of the step, the three of the root finder, their rates at a contact and those
# of a state at rest -
AT_NODE, AT_NEXT, LEFT, RIGHT, TRY, RATE, RATE_AT_REST = (
    VECTORS * NSTATES + NGUARDS * row for row in range(GAPS)
)
# q at each stage time and at any other, and c.
Q2, Q3, Q4, Q5, Q6, Q = (VECTORS * NSTATES + GAPS * NGUARDS + NDRIVE * row for row in range(DRIVES))
C = VECTORS * NSTATES + GAPS * NGUARDS + DRIVES * NDRIVE
# What the clocks hold, and their numbers.
H = C + NCONST
N = H + HELD * NCLOCKS
WORK = N + (NUMBERS + 1) * NCLOCKS


# Columns of `carry`, what a paused trajectory needs besides its state: time, start of the leg, next
# step length, and the error estimates of all steps so far, added up for each state.
TIME, LEG, LENGTH, ERRORS = range(4)
CARRY = ERRORS + NSTATES
#: Records that one step may write at most.
STEP_RECORDS = NGUARDS


def workspace():
    """The memory that one call of `propagate` works in; one for each thread."""
    return (np.zeros(WORK),)
