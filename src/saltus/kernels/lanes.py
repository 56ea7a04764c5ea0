"""Lanes: a short vector of doubles, one trajectory in each, as one explicit LLVM value.

LLVM doesn't vectorise plain inner loops over lanes (measured: three times slower than this), so a lane is a Numba type of its own whose
representation is ``<width x double>``. Kernels are written against the few operations below. With the JIT on they become single machine
instructions (AVX-512: 8 lanes, AVX2: 4, else 2; a wider lane takes several); with ``NUMBA_DISABLE_JIT=1`` the same text runs on NumPy
arrays of shape ``(width,)``.

No operation mixes lanes except :func:`any_lane` and :func:`bits`, which only steer: a lane's digits never depend on its neighbours.
"""

from __future__ import annotations

import math
import operator

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model


class LaneType(types.Type):
    """A vector of ``width`` doubles."""

    def __init__(self, width: int):
        self.width = width
        super().__init__(name=f"Lane({width})")


class MaskType(types.Type):
    """A vector of ``width`` truth values."""

    def __init__(self, width: int):
        self.width = width
        super().__init__(name=f"Mask({width})")


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, ir.VectorType(ir.DoubleType(), fe_type.width))


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, ir.VectorType(ir.IntType(1), fe_type.width))


# -- the operations, as NumPy (this is what runs with the JIT off) -------------------------------------------------------------


def load(array, row, width):
    """Row ``row`` of ``array`` (rows, width)."""
    return array[row].copy()


def store(array, row, lane):
    """Write a lane to row ``row`` of ``array`` (rows, width)."""
    array[row] = lane


def splat(value, width):
    """The same number in every lane."""
    return np.full(width, value)


def fma(a, b, c):
    """``a*b + c`` with one rounding (two when the JIT is off)."""
    return a * b + c


def select(mask, a, b):
    """``a`` where the mask holds, ``b`` elsewhere."""
    return np.where(mask, a, b)


def smaller(a, b):
    """``a if a < b else b``: b where either is NaN."""
    return np.where(a < b, a, b)


def larger(a, b):
    """``a if a > b else b``: b where either is NaN."""
    return np.where(a > b, a, b)


def magnitude(a):
    """Absolute value."""
    return np.abs(a)


def root(a):
    """Square root."""
    return np.sqrt(a)


def nearest_integer(a):
    """The nearest whole number, halves to even."""
    return np.rint(a)


def any_lane(mask):
    """Whether the mask holds in any lane."""
    return bool(np.any(mask))


def bits(mask):
    """The mask as an integer, lane i in bit i."""
    return sum(1 << i for i in range(len(mask)) if mask[i])


def lowest_bit(number):
    """Index of the lowest bit set in an integer that isn't 0."""
    return (int(number) & -int(number)).bit_length() - 1


def coarse_log2(a):
    """log2|a| to 0.09 from the bits of the number; about -1023 for zero. Enough for a step-size rule, which needs two digits."""
    return np.abs(np.asarray(a)).view(np.int64) * 2.0**-52 - 1023.0


def coarse_exp2(a):
    """The inverse of :func:`coarse_log2`."""
    return ((np.clip(a, -1000.0, 1000.0) + 1023.0) * 2.0**52).astype(np.int64).view(np.float64)


def libm_sin(a):
    """sin by the C library, lane by lane."""
    return np.sin(a)


def libm_cos(a):
    """cos by the C library, lane by lane."""
    return np.cos(a)


def libm_exp(a):
    """exp by the C library, lane by lane."""
    return np.exp(a)


def libm_log(a):
    """log by the C library, lane by lane."""
    return np.log(a)


def libm_tan(a):
    """tan by the C library, lane by lane."""
    return np.tan(a)


def libm_atan(a):
    """atan by the C library, lane by lane."""
    return np.arctan(a)


def libm_tanh(a):
    """tanh by the C library, lane by lane."""
    return np.tanh(a)


def libm_pow(a, b):
    """``a ** b`` by the C library, lane by lane."""
    return np.power(a, b)


# -- typing --------------------------------------------------------------------------------------------------------------------


def _lane_of(args):
    """The lane type among the arguments if every other one is the same lane or a scalar number, else None."""
    lanes = {a for a in args if isinstance(a, LaneType)}
    if len(lanes) != 1 or not all(isinstance(a, LaneType | types.Number) for a in args):
        return None
    return lanes.pop()


def _register(function, typer, literal=False):
    """Register the typing rule ``typer(args) -> signature | None`` of a function or operator."""

    @infer_global(function)
    class _Template(AbstractTemplate):
        prefer_literal = literal

        def generic(self, args, kws):  # noqa: ARG002  (Numba's interface)
            return typer(args)

    return _Template


def _elementwise(args):
    lane = _lane_of(args)
    return signature(lane, *[lane if isinstance(a, LaneType) else types.float64 for a in args]) if lane else None


def _comparison(args):
    sig = _elementwise(args)
    return signature(MaskType(sig.return_type.width), *sig.args) if sig else None


def _mask_logic(args):
    return signature(args[0], *args) if all(isinstance(a, MaskType) for a in args) else None


def _type_select(args):
    mask, *values = args
    lane = _lane_of(values)
    if not isinstance(mask, MaskType) or lane is None:
        return None
    return signature(lane, mask, *[lane if isinstance(a, LaneType) else types.float64 for a in values])


_register(
    load,
    lambda a: (
        signature(LaneType(a[2].literal_value), types.unliteral(a[0]), types.intp, types.intp) if isinstance(a[2], types.Literal) else None
    ),
    literal=True,
)
_register(store, lambda a: signature(types.none, a[0], types.intp, a[2]) if isinstance(a[2], LaneType) else None)
_register(
    splat,
    lambda a: signature(LaneType(a[1].literal_value), types.float64, types.intp) if isinstance(a[1], types.Literal) else None,
    literal=True,
)
_register(select, _type_select)
_register(any_lane, lambda a: signature(types.boolean, a[0]) if isinstance(a[0], MaskType) else None)
_register(lowest_bit, lambda a: signature(types.int64, types.int64))
_register(bits, lambda a: signature(types.int64, a[0]) if isinstance(a[0], MaskType) else None)

_ARITHMETIC = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}
_COMPARE = {operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">="}
_LOGIC = {operator.and_: "and_", operator.or_: "or_"}
_LIBM = {
    libm_sin: math.sin,
    libm_cos: math.cos,
    libm_exp: math.exp,
    libm_log: math.log,
    libm_tan: math.tan,
    libm_atan: math.atan,
    libm_tanh: math.tanh,
    libm_pow: math.pow,
}
for _f in (*_ARITHMETIC, fma, smaller, larger, magnitude, root, nearest_integer, coarse_log2, coarse_exp2, operator.neg, *_LIBM):
    _register(_f, _elementwise)
for _f in _COMPARE:
    _register(_f, _comparison)
for _f in (*_LOGIC, operator.invert):
    _register(_f, _mask_logic)

# -- lowering to LLVM -----------------------------------------------------------------------------------------------------------


def _splat(builder, value, width):
    vector = ir.VectorType(value.type, width)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def _vectors(builder, sig, args):
    """The arguments with scalars spread over the lanes."""
    width = next(t.width for t in sig.args if isinstance(t, LaneType))
    return [a if isinstance(t, LaneType) else _splat(builder, a, width) for a, t in zip(args, sig.args, strict=True)]


def _any_kinds(count):
    """Every mix of lanes and scalars with at least one lane, as type patterns."""
    kinds = [()]
    for _ in range(count):
        kinds = [(*k, t) for k in kinds for t in (LaneType, types.Float)]
    return [k for k in kinds if LaneType in k]


def _lower(function, count, emit):
    """Lower ``function`` of ``count`` lanes or scalars by ``emit(builder, sig, vectors)``."""
    for kinds in _any_kinds(count):

        @lower_builtin(function, *kinds)
        def _impl(context, builder, sig, args):
            return emit(builder, sig, _vectors(builder, sig, args))


def _intrinsic(name):
    def emit(builder, sig, v):
        module, vector = builder.module, v[0].type
        suffix = f"v{vector.count}f64"
        function = cgutils.get_or_insert_function(module, ir.FunctionType(vector, [vector] * len(v)), f"llvm.{name}.{suffix}")
        return builder.call(function, v)

    return emit


def _pick(sign):
    return lambda builder, sig, v: builder.select(builder.fcmp_ordered(sign, v[0], v[1]), v[0], v[1])


for _f, _name in _ARITHMETIC.items():
    _lower(_f, 2, lambda builder, sig, v, _name=_name: getattr(builder, _name)(v[0], v[1]))
for _f, _sign in _COMPARE.items():
    _lower(_f, 2, lambda builder, sig, v, _sign=_sign: builder.fcmp_ordered(_sign, v[0], v[1]))
_lower(operator.neg, 1, lambda builder, sig, v: builder.fneg(v[0]))
_lower(fma, 3, _intrinsic("fma"))
_lower(magnitude, 1, _intrinsic("fabs"))
_lower(root, 1, _intrinsic("sqrt"))
_lower(nearest_integer, 1, _intrinsic("rint"))
_lower(smaller, 2, _pick("<"))
_lower(larger, 2, _pick(">"))


def _constant(vector, value):
    return ir.Constant(vector, [value] * vector.count)


def _lower_coarse_log2(builder, sig, v):
    vector = v[0].type
    integer = ir.VectorType(ir.IntType(64), vector.count)
    pattern = builder.and_(builder.bitcast(v[0], integer), _constant(integer, 0x7FFFFFFFFFFFFFFF))
    scaled = builder.fmul(builder.sitofp(pattern, vector), _constant(vector, 2.0**-52))
    return builder.fsub(scaled, _constant(vector, 1023.0))


def _lower_coarse_exp2(builder, sig, v):
    vector = v[0].type
    integer = ir.VectorType(ir.IntType(64), vector.count)
    x = v[0]
    for sign, limit in (("<", 1000.0), (">", -1000.0)):
        bound = _constant(vector, limit)
        x = builder.select(builder.fcmp_ordered(sign, x, bound), x, bound)
    scaled = builder.fmul(builder.fadd(x, _constant(vector, 1023.0)), _constant(vector, 2.0**52))
    return builder.bitcast(builder.fptosi(scaled, integer), vector)


_lower(coarse_log2, 1, _lower_coarse_log2)
_lower(coarse_exp2, 1, _lower_coarse_exp2)


def _lower_libm(function, scalar, count):
    for kinds in _any_kinds(count):

        @lower_builtin(function, *kinds)
        def _impl(context, builder, sig, args):
            vectors = _vectors(builder, sig, args)
            callee = context.typing_context.resolve_value_type(scalar)
            one = callee.get_call_type(context.typing_context, (types.float64,) * count, {})
            call = context.get_function(callee, one)
            result = ir.Constant(vectors[0].type, ir.Undefined)
            for i in range(vectors[0].type.count):
                index = ir.Constant(ir.IntType(32), i)
                result = builder.insert_element(result, call(builder, [builder.extract_element(x, index) for x in vectors]), index)
            return result


for _f, _scalar in _LIBM.items():
    _lower_libm(_f, _scalar, 2 if _f is libm_pow else 1)


def _align_stack(builder):
    """Lanes that don't fit the registers go to the stack: each to one cache line, not across two (measured: 5 % of a step)."""
    builder.function.attributes.alignstack = 64
    builder.function.attributes.add("nounwind")  # llvmlite prints no alignment without another attribute; kernels raise nothing


def _pointer(context, builder, array_type, array, row, width):
    """Pointer to the first lane of a row, as a pointer to a vector."""
    _align_stack(builder)
    view = context.make_array(array_type)(context, builder, array)
    first = cgutils.get_item_pointer(context, builder, array_type, view, [row, ir.Constant(row.type, 0)], wraparound=False)
    return builder.bitcast(first, ir.VectorType(ir.DoubleType(), width).as_pointer())


@lower_builtin(load, types.Array, types.Integer, types.Integer)
def _lower_load(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.return_type.width)
    value = builder.load(pointer)
    value.align = 8
    return value


@lower_builtin(store, types.Array, types.Integer, LaneType)
def _lower_store(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[2].width)
    builder.store(args[2], pointer, align=8)
    return context.get_dummy_value()


@lower_builtin(splat, types.Float, types.Integer)
def _lower_splat(context, builder, sig, args):
    return _splat(builder, args[0], sig.return_type.width)


for _kinds in ((LaneType, LaneType), (LaneType, types.Float), (types.Float, LaneType)):

    @lower_builtin(select, MaskType, *_kinds)
    def _lower_select(context, builder, sig, args):
        width = sig.return_type.width
        a, b = (x if isinstance(t, LaneType) else _splat(builder, x, width) for x, t in zip(args[1:], sig.args[1:], strict=True))
        return builder.select(args[0], a, b)


for _f, _name in _LOGIC.items():

    @lower_builtin(_f, MaskType, MaskType)
    def _lower_logic(context, builder, sig, args, _name=_name):
        return getattr(builder, _name)(args[0], args[1])


@lower_builtin(operator.invert, MaskType)
def _lower_invert(context, builder, sig, args):
    return builder.not_(args[0])


def _bitmap(builder, mask):
    return builder.bitcast(mask, ir.IntType(mask.type.count))


@lower_builtin(any_lane, MaskType)
def _lower_any(context, builder, sig, args):
    bitmap = _bitmap(builder, args[0])
    return builder.icmp_unsigned("!=", bitmap, ir.Constant(bitmap.type, 0))


@lower_builtin(bits, MaskType)
def _lower_bits(context, builder, sig, args):
    return builder.zext(_bitmap(builder, args[0]), ir.IntType(64))


@lower_builtin(lowest_bit, types.Integer)
def _lower_lowest_bit(context, builder, sig, args):
    return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))
