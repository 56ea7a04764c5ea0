"""The interface between the generated head of an equation and the templates: sizes, tables, and
functions with their arguments.

The templates are compiled once, for every equation to come: they read sizes and tables from symbols
``saltus_NAME``, and call functions of these names. A new equation brings them (codegen/lane_ir.py).
With the JIT off, the head stands above the templates as plain Python.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

#: Types of arguments of a head's function: an array of doubles, a whole number, a double.
ARRAY, WHOLE, REAL = "ptr", "i64", "double"


@dataclass(frozen=True, eq=False)  # each stands for itself
class Interface:
    """The names that the head of one method supplies.

    Attributes
    ----------
    entry : str
        The one function that is called from outside.
    arguments : tuple of str
        Numba types of its arguments. ``float64[:, 4]`` is an array of four columns: the compiler
        knows them, so that it finds its rows without a product.
    layout : str
        The template that says what the work arrays hold, by the sizes alone; "" if there are none.
    templates : tuple of str
        The kernels that stand below the head and the layout, in this order: files of kernels/.
    sizes, flags : tuple of str
        Whole numbers and truth values that the head supplies.
    tables : mapping
        Content of each table, by name.
    functions : mapping
        Arguments of each function, by name.
    truths : tuple of str
        Functions that return a truth value; the others return nothing.
    """

    entry: str
    arguments: tuple[str, ...]
    layout: str
    templates: tuple[str, ...]
    sizes: tuple[str, ...]
    flags: tuple[str, ...]
    tables: MappingProxyType[str, str]
    functions: MappingProxyType[str, tuple[str, ...]]
    truths: tuple[str, ...]


_F1, _F2, _F3 = "float64[::1]", "float64[:, ::1]", "float64[:, :, ::1]"
_F4 = "float64[:, :, :, ::1]"
_I1, _I2 = "int64[::1]", "int64[:, ::1]"
#: Types of the first arguments of every `propagate`, in order: a batch (kernels/batch.py), and the
#: budget.
BATCH = (
    _F1, _F1, _F2, "int64", _F2, _I1, _F1, _I1, _I1, _F2, _I1, _I1, _F1, _I2, _F2,
    _I1, _F1, _I1, _F3, _I2, _I1, _I2, _F2, _I1, _F2, _F1, "int64",
)  # fmt: skip

_CLOCKS = {"numbers_of_clocks": (ARRAY, ARRAY)}
_JUMP = {"jump": (REAL, ARRAY, ARRAY, ARRAY, WHOLE, WHOLE, WHOLE)}
_DATED_JUMP = {"jump": (REAL, ARRAY, ARRAY, ARRAY, WHOLE, WHOLE, WHOLE, ARRAY)}
_RESET = {"reset": (REAL, ARRAY, ARRAY, ARRAY, WHOLE, WHOLE, WHOLE, ARRAY)}
_LEVELS = {"levels": (REAL, ARRAY, ARRAY, ARRAY, WHOLE, ARRAY)}
_SETTLE = {"settle": (REAL, ARRAY, ARRAY, ARRAY, WHOLE, WHOLE)}

#: Types of the arrays that the layouts' ``workspace()`` return.
_TAYLOR_WORK = (_F2,) * 14 + (_I2,) + (_F1, _F2, _F2, _F1, _F1, _F1, _F1, _F2, _F1, _F1)

TAYLOR = Interface(
    entry="propagate",
    arguments=BATCH + _TAYLOR_WORK,
    layout="taylor/layout",
    templates=("clocks", "taylor/singular", "taylor/crossings", "taylor/step", "taylor/contacts",
        "impacts", "taylor/laws", "taylor/together", "taylor/ends", "taylor/trajectories"),
    sizes=(
        "NSTATES", "NGUARDS", "ORDER", "NCONST", "NTURNS", "CLOCK_ROW", "GAP_ROW", "SCALE_ROW",
        "CALM_ROW", "ROWS", "NMOVED", "NSINGULAR", "NCOLUMNS",
        "NEWTON_DEGREE_1", "NEWTON_DEGREE_2", "NSERIES", "NCLOCKS",
    ),
    flags=("PROBED", "TANGENT", "LAWS", "LEVELS"),
    tables=MappingProxyType(
        dict.fromkeys(
            (
                "SERIES_ROW", "GUARD_ROW", "GUARD_SERIES", "SNAP_STATE", "SNAP_CONST",
                "SINGULAR_GUARD", "CLOCK_KIND",
                "CLOCK_TABLE", "LAW", "PARTNER", "SUPPORT",
            ),
            WHOLE,
        )
        | {"GUARD_SIGN": REAL, "LAW_SIDE": REAL}
    ),
    functions=MappingProxyType(
        {
            "constants": (ARRAY, ARRAY, WHOLE),
            "gaps": (REAL, ARRAY, ARRAY, ARRAY, ARRAY),
            "turns": (ARRAY, REAL, REAL, WHOLE, WHOLE, ARRAY),
            "jets": (ARRAY,) * 5,
            "rates": (ARRAY,) * 5,
            **_CLOCKS,
            **_DATED_JUMP,
            **_RESET,
            **_LEVELS,
            **_SETTLE,
        }
    ),
    truths=("turns",),
)  # fmt: skip

_OF_RATES = MappingProxyType(
    {
        "prepare": (ARRAY, ARRAY),
        "drive": (REAL, ARRAY, ARRAY, ARRAY),
        "field": (REAL,) + (ARRAY,) * 4 + (WHOLE, ARRAY),
        "gaps": (REAL,) + (ARRAY,) * 5,
        "gap_rates": (REAL,) + (ARRAY,) * 6,
        **_CLOCKS,
        **_JUMP,
        **_RESET,
        **_LEVELS,
    }
)
_TABLEAU = ("STAGE_TIME", "WEIGHT", "ERROR_WEIGHT", "DENSE_WEIGHT")


_MATLAB = ("odezero", "matlab")


def _one_by_one(
    templates: tuple[str, ...],
    *tables: str,
    sizes: tuple[str, ...] = (),
    functions: Mapping[str, tuple[str, ...]] = _OF_RATES,
) -> Interface:
    """The interface of a method that runs one trajectory after the other, by these templates of
    kernels/stepping.
    """
    return Interface(
        entry="propagate",
        arguments=(*BATCH, _F1),
        layout="stepping/layout",
        templates=(
            "clocks",
            *(f"stepping/{one}" for one in ("rates", *templates)),
            "impacts",
            *("stepping/laws", "stepping/trajectory"),
        ),
        sizes=(
            "NSTATES",
            "NMOVED",
            "NGUARDS",
            "NCONST",
            "NDRIVE",
            "NCLOCKS",
            "ROWS",
            "NUMBERS_OF_METHOD",
            "MATRICES",
            "MULTISTEP",
            *sizes,
        ),
        flags=("TANGENT", "GAPS_IN_TIME", "LAWS", "LEVELS"),
        tables=MappingProxyType(
            {"CLOCK_KIND": WHOLE, "CLOCK_TABLE": WHOLE, "LAW": WHOLE, "LAW_SIDE": REAL}
            | dict.fromkeys(tables, REAL)
        ),
        functions=MappingProxyType(dict(functions)),
        truths=(),
    )


#: Runge-Kutta pairs with MATLAB's rules, and Runge-Kutta steps of a fixed length.
PAIR = _one_by_one(("runge_kutta", *_MATLAB, "step_control"), *_TABLEAU, "RULES", sizes=("STAGES",))
FIXED_STEP = _one_by_one(("runge_kutta", "fixed_step", "landing"), *_TABLEAU, sizes=("STAGES",))
#: Adams' formulas of orders 1 to 13.
ADAMS = _one_by_one((*_MATLAB, "adams"))
#: Numerical differentiation formulas, which need the Jacobian.
NDF = _one_by_one((*_MATLAB, "ndf"), functions=_OF_RATES | {"jacobian": (REAL,) + (ARRAY,) * 5})

#: The test of capture, which doesn't depend on an equation.
CAPTURE = Interface(
    entry="capture",
    arguments=(_F3, _F2, _F3, _I1, _F1, _I1, _I1),
    layout="",
    templates=("capture",),
    sizes=(),
    flags=(),
    tables=MappingProxyType({}),
    functions=MappingProxyType({}),
    truths=(),
)

#: The zeros of Fourier series, which don't depend on an equation.
HARMONICS = Interface(
    entry="zeros",
    arguments=(_F2, _I1, _F1, _F1),
    layout="",
    templates=("harmonics/series", "harmonics/zeros"),
    sizes=(),
    flags=(),
    tables=MappingProxyType({}),
    functions=MappingProxyType({}),
    truths=(),
)

#: The equations of harmonic balance: an equation brings its forces with their slopes, the slopes of
#: its gaps, and the gaps that aren't linear.
BALANCE = Interface(
    entry="balance",
    arguments=(
        _I1, _F1, _F2, _F1, _F1, _F1, _F2, _F1, _F4, _F4, _I1, _I1, _I1, _I1, _I1, _I1, _F1, _F2,
        _F1, _F1, _I1, _F1, _F1, _I2, _F1, _F1, _I1, _F1, _F2, _F3, _F2, _F2, _F1, _F1, _F2, _F2,
        _F1, _F1, _F1, _F2, _F1, _F1, _F2, _F1,
    ),
    layout="",
    templates=(
        "harmonics/series",
        "harmonics/cut",
        "harmonics/sums",
        "harmonics/derivatives",
        "harmonics/balance",
    ),
    sizes=(),
    flags=(),
    tables=MappingProxyType({}),
    functions=MappingProxyType(
        dict.fromkeys(
            ("forces", "gap_slopes", "gap_values"), (REAL, ARRAY, ARRAY, WHOLE, ARRAY)
        )
    ),
    truths=(),
)  # fmt: skip

#: Lanes of the modal flow and of the search for the turns of waves: they hold modes.
MODE_LANES = 4
_ROWS = f"float64[:, {MODE_LANES}]"
_MODAL_TABLES = (
    *(_I1, _I1, _F1, _F2, _F2, _F2, _ROWS, _ROWS, _I2, _F2, _ROWS),
    *("int64[:, 6]", _F2, _F2, _I1, _ROWS, _F2),
)
#: Types of the work arrays, by lines as kernels/modal/layout.py names them.
_MODAL_WORK = (
    *(_ROWS, _ROWS, _ROWS, _ROWS, "float64[:, 24]", "float64[:, 4]"),
    *(_F1, "float64[:, 16]", "float64[:, 2]", _F1, _F1, "float64[:, 2]", _ROWS),
    *(_ROWS, "float64[:, 6]", "float64[:, 10]", _ROWS, _F2, _ROWS),
    *(_ROWS, _F2, _F2, _ROWS, "float64[:, 4]", _ROWS, "float64[:, 11]", _F1),
    *(_ROWS, _I1, _ROWS),
)

#: The modal flow: what it needs of an equation are tables, which it is given.
MODAL = Interface(
    entry="propagate",
    arguments=(*BATCH, *_MODAL_TABLES, *_MODAL_WORK),
    layout="modal/layout",
    templates=(
        "exponential",
        "modal/records",
        "modal/blocks",
        "modal/series",
        "modal/pieces",
        "modal/gaps",
        "modal/places",
        "modal/laws",
        "modal/impacts",
        "modal/friction",
        "modal/columns",
        "modal/tangents",
        "modal/touches",
        "modal/ends",
        "modal/steps",
    ),
    sizes=(),
    flags=(),
    tables=MappingProxyType({}),
    functions=MappingProxyType({}),
    truths=(),
)

#: The turning points of sums of waves, which don't depend on an equation.
WAVES = Interface(
    entry="search",
    arguments=(_I1, _F2, _F2, _I1, _F1, _F2, _F2, _F2, _F2, _F2, _I2, _I1),
    layout="waves/layout",
    templates=("exponential", "waves/sums", "waves/search"),
    sizes=(),
    flags=(),
    tables=MappingProxyType({}),
    functions=MappingProxyType({}),
    truths=(),
)


def numba_type(kind: str) -> str:
    """The Numba type of an argument, such as ``float64[:, ::1]`` of ``float64[:, 4]``."""
    return kind if columns_of(kind) is None else f"{kind[: kind.rindex(',')]}, ::1]"


def columns_of(kind: str) -> int | None:
    """Columns of an argument, if they are known: 4 of ``float64[:, 4]``."""
    last = kind.rpartition(",")[2].strip(" ]")
    return int(last) if last.isdigit() else None


def known_of_argument(kind: str) -> list[int | None]:
    """The numbers that Numba passes for an argument as far as they are known, None for others: of
    an array no owner, no parent, its size, the size of a number [bytes], its address, its shape,
    its strides [bytes].
    """
    if "[" not in kind:
        return [None]
    axes, columns = kind.count(",") + 1, columns_of(kind)
    strides: list[int | None] = [None] * axes
    strides[-1] = 8
    if columns is not None:
        strides[-2] = 8 * columns
    return [0, 0, None, 8, None, *([None] * (axes - 1)), columns, *strides]
