"""Parts of a work array: stretches whose place the compiler knows, so that it keeps their values in registers.

A slice checks its ends against the length of the array at run time; after that no compiler can tell whether two slices overlap, and it
reloads every value after every store. :func:`part` checks nothing. With the JIT off it is a plain slice.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin
from numba.np.arrayobj import make_array, populate_array


def part(work: np.ndarray, start: int, length: int) -> np.ndarray:
    """The ``length`` values of a one-dimensional array of doubles from index ``start`` on, as an array that shares its memory.

    Both must lie inside the array: compiled code doesn't check.
    """
    return work[start : start + length]


@infer_global(part)
class _PartType(AbstractTemplate):
    def generic(self, args, kws):
        view = types.Array(types.float64, 1, "C")
        return signature(view, args[0], types.intp, types.intp) if args[0] == view and not kws else None


@lower_builtin(part, types.Array, types.intp, types.intp)
def _lower_part(context, builder, signature, arguments):
    work, start, length = arguments
    whole = make_array(signature.args[0])(context, builder, work)
    view = make_array(signature.return_type)(context, builder)
    itemsize = context.get_constant(types.intp, 8)
    unowned = ir.Constant(view.meminfo.type, None)
    first = builder.gep(whole.data, [start])
    populate_array(view, data=first, shape=[length], strides=[itemsize], itemsize=itemsize, meminfo=unowned)
    return view._getvalue()
