"""Template: layout of the work array of the methods that run one trajectory after the other.
codegen puts a generated head before it; it needs the sizes of that head only.
"""

import numpy as np

from saltus.kernels.clocks_layout import HELD, NUMBERS

# `work` is one array for everything, so that the compiler sees that its parts don't overlap and
# keeps them in registers (measured: a few per cent). Where its parts start: vectors of states - the
# ROWS of the method, the first of them the rate at the start of the step and the last the rate at
# its end; the states there, a point between them, the error estimate divided by h, zeros, a rate
# behind a jump of the state; where there are laws, five states at TOGETHER (see impacts.py) -
K1, K_END = 0, NSTATES * (ROWS - 1)
VECTORS, GAPS, DRIVES = ROWS + (11 if LAWS else 6), 9, 2
NODE, NEXT, POINT, ERROR, REST, BEHIND, TOGETHER = (NSTATES * (ROWS + row) for row in range(7))
TRIED, AT_FIRST, BY_GUARDS, WAY = (NSTATES * row for row in range(1, 5))
# gaps - at the ends of the step, the three of the root finder, their rates at a contact and those
# of a state at rest, before a jump of the state, their rates behind it -
AT_NODE, AT_NEXT, LEFT, RIGHT, TRY, RATE, RATE_AT_REST, BEFORE, RATE_BEHIND = (
    VECTORS * NSTATES + NGUARDS * row for row in range(GAPS)
)
# q at the time of a stage, last at the end of the step, and at any other; c.
Q_STAGE, Q = (VECTORS * NSTATES + GAPS * NGUARDS + NDRIVE * row for row in range(DRIVES))
C = VECTORS * NSTATES + GAPS * NGUARDS + DRIVES * NDRIVE
# Data of the clocks, and their numbers; the NUMBERS_OF_METHOD; MATRICES of states by states; the
# impact data of a law of contact; the time [s] between its boundary and the landing.
H = C + NCONST
N = H + HELD * NCLOCKS
S = N + (NUMBERS + 1) * NCLOCKS
M = S + NUMBERS_OF_METHOD
TOLD = M + MATRICES * NSTATES * NSTATES
LATE = TOLD + 2
WORK = LATE + 1


# Columns of `carry`, the data of a paused trajectory besides its state: time, start of the leg,
# next step length, contacts at one instant, the error estimates of all steps so far, summed for
# each state; of a multistep method (MULTISTEP is 1, not 0) its rows, numbers and matrices.
TIME, LEG, LENGTH, AT_ONCE, ERRORS = range(5)
PAST = ERRORS + NSTATES
CARRY = PAST + MULTISTEP * (ROWS * NSTATES + NUMBERS_OF_METHOD + MATRICES * NSTATES * NSTATES)
#: Most records of one step: an impact may carry the state over every other boundary.
STEP_RECORDS = NGUARDS * (NGUARDS if LAWS else 1)


def workspace():
    """The work array of one call of `propagate`; one for each thread."""
    return (np.zeros(WORK),)
