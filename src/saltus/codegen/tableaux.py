"""The coefficients of Runge-Kutta methods, for the templates of kernels/stepping.

Every method's last stage is its rate at the end of the step, so the last row of weights is the
method itself. Interpolants are cubic or quartic polynomials that keep both ends and their rates.
"""

from __future__ import annotations

from collections.abc import Sequence

from saltus.codegen.head import Constant


def rooms(
    rows: int, numbers: int, *, matrices: int = 0, multistep: bool = False
) -> dict[str, Constant]:
    """Sizes of a method's work: vectors of states, numbers and matrices, and 1 if it is a multistep
    method (kernels/stepping/layout.py).
    """
    return {
        "ROWS": rows,
        "NUMBERS_OF_METHOD": numbers,
        "MATRICES": matrices,
        "MULTISTEP": int(multistep),
    }


def _tableau(
    times: Sequence[float],
    weights: Sequence[Sequence[float]],
    errors: Sequence[float],
    dense: Sequence[Sequence[float]],
    **more: Constant,
) -> dict[str, Constant]:
    """Rows padded with zeros, as the templates index them."""
    stages = len(times)
    rows = [(*row, *[0.0] * (stages - len(row))) for row in ((), *weights)]
    return {
        "STAGES": stages,
        **rooms(stages, stages),
        "STAGE_TIME": tuple(map(float, times)),
        "WEIGHT": tuple(float(weight) for row in rows for weight in row),
        "ERROR_WEIGHT": tuple(map(float, errors)),
        "DENSE_WEIGHT": tuple(float(d) for row in dense for d in (*row, *[0.0] * (3 - len(row)))),
        **more,
    }


#: Orders 5 and 4. Dormand & Prince, J. Comput. Appl. Math. 6 (1980); dense output: Shampine, Math.
#: Comp. 46 (1986). RULES of ode45: exponent; 0.16^5 = 1.048576e-4, less a little; least shrink.
DORMAND_PRINCE = _tableau(
    times=(0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1),
    weights=(
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    ),
    errors=(71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40),
    dense=(
        (-183 / 64, 37 / 12, -145 / 128),
        (),
        (1500 / 371, -1000 / 159, 1000 / 371),
        (-125 / 32, 125 / 12, -375 / 64),
        (9477 / 3392, -729 / 106, 25515 / 6784),
        (-11 / 7, 11 / 3, -55 / 28),
        (3 / 2, -4, 5 / 2),
    ),
    RULES=(1 / 5, 1.04e-4, 0.1),
)

#: Orders 3 and 2. Bogacki & Shampine, Appl. Math. Lett. 2 (1989). RULES of ode23, with 0.16^3 =
#: 4.096e-3.
BOGACKI_SHAMPINE = _tableau(
    times=(0, 1 / 2, 3 / 4, 1),
    weights=((1 / 2,), (0, 3 / 4), (2 / 9, 1 / 3, 4 / 9)),
    errors=(-5 / 72, 1 / 12, 1 / 9, -1 / 8),
    dense=((-4 / 3, 5 / 9), (1, -2 / 3), (4 / 3, -8 / 9), (-1, 1)),
    RULES=(1 / 3, 4.05e-3, 0.5),
)

#: Kutta's method of order 4 (Z. Math. Phys. 46 (1901)), beside (1/6, 1/3, 1/3, 0, 1/6), of order 3,
#: for the errors of contact times. Dense output: the cubic with the rates at both ends.
CLASSICAL = _tableau(
    times=(0, 1 / 2, 1 / 2, 1, 1),
    weights=((1 / 2,), (0, 1 / 2), (0, 0, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
    errors=(0, 0, 0, 1 / 6, -1 / 6),
    dense=((-3 / 2, 2 / 3), (1, -2 / 3), (1, -2 / 3), (1 / 2, -1 / 3), (-1, 1)),
)

#: Work of kernels/stepping/adams.py: the rate at both ends, 14 differences, a state; seven arrays
#: of 14, five numbers.
ADAMS = rooms(17, 103, multistep=True)
#: Work of kernels/stepping/ndf.py: the rate at both ends, seven differences, seven vectors; eleven
#: numbers and two matrices of 6 by 6; the Jacobian and its factors.
NDF = rooms(16, 83, matrices=2, multistep=True)
