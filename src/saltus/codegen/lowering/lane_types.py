"""The operations on lanes (kernels/lanes.py) as Numba types and LLVM instructions: for the build of
the templates only.
"""

from __future__ import annotations

import math
import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model
from numba.np.arrayobj import make_array, populate_array

from saltus.kernels.lanes import (
    WHOLE_IN_LAST_BITS,
    any_lane,
    bits,
    coarse_exp2,
    coarse_log2,
    fma,
    is_odd,
    larger,
    libm_atan,
    libm_cos,
    libm_exp,
    libm_log,
    libm_pow,
    libm_sin,
    libm_tan,
    libm_tanh,
    load,
    load_at,
    lowest_bit,
    magnitude,
    nearest_integer,
    power_of_two,
    root,
    select,
    smaller,
    spacing,
    splat,
    store,
    store_at,
    totals,
    turned_half,
)
from saltus.kernels.parts import part


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


# -- typing ----------------------------------------------------------------------------------------


def _lane_of(args):
    """The lane type among the arguments if every other one is the same lane or a scalar number,
    else None.
    """
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
    return (
        signature(lane, *[lane if isinstance(a, LaneType) else types.float64 for a in args])
        if lane
        else None
    )


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
    return signature(
        lane, mask, *[lane if isinstance(a, LaneType) else types.float64 for a in values]
    )


_register(
    load,
    lambda a: (
        signature(LaneType(a[2].literal_value), types.unliteral(a[0]), types.intp, types.intp)
        if isinstance(a[2], types.Literal)
        else None
    ),
    literal=True,
)
_register(
    store,
    lambda a: signature(types.none, a[0], types.intp, a[2]) if isinstance(a[2], LaneType) else None,
)
_register(
    load_at,
    lambda a: (
        signature(LaneType(a[3].literal_value), types.unliteral(a[0]), *[types.intp] * 3)
        if isinstance(a[3], types.Literal)
        else None
    ),
    literal=True,
)
_register(
    store_at,
    lambda a: (
        signature(types.none, a[0], types.intp, types.intp, a[3])
        if isinstance(a[3], LaneType)
        else None
    ),
)
_register(
    totals,
    lambda a: signature(LaneType(4), *a) if all(one == LaneType(4) for one in a) else None,
)
_register(
    is_odd,
    lambda a: signature(MaskType(a[0].width), a[0]) if isinstance(a[0], LaneType) else None,
)
_register(
    splat,
    lambda a: (
        signature(LaneType(a[1].literal_value), types.float64, types.intp)
        if isinstance(a[1], types.Literal)
        else None
    ),
    literal=True,
)
_register(select, _type_select)
_register(
    any_lane, lambda a: signature(types.boolean, a[0]) if isinstance(a[0], MaskType) else None
)
_register(lowest_bit, lambda a: signature(types.int64, types.int64))
_register(spacing, lambda a: signature(types.float64, types.float64))
_register(bits, lambda a: signature(types.int64, a[0]) if isinstance(a[0], MaskType) else None)

_ARITHMETIC = {
    operator.add: "fadd",
    operator.sub: "fsub",
    operator.mul: "fmul",
    operator.truediv: "fdiv",
}
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
for _f in (
    *_ARITHMETIC,
    fma,
    smaller,
    larger,
    magnitude,
    root,
    nearest_integer,
    coarse_log2,
    coarse_exp2,
    power_of_two,
    turned_half,
    operator.neg,
    *_LIBM,
):
    _register(_f, _elementwise)
for _f in _COMPARE:
    _register(_f, _comparison)
for _f in (*_LOGIC, operator.invert):
    _register(_f, _mask_logic)

# -- lowering to LLVM ------------------------------------------------------------------------------


def _splat(builder, value, width):
    vector = ir.VectorType(value.type, width)
    one = builder.insert_element(
        ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def _vectors(builder, sig, args):
    """The arguments with scalars spread over the lanes."""
    width = next(t.width for t in sig.args if isinstance(t, LaneType))
    return [
        a if isinstance(t, LaneType) else _splat(builder, a, width)
        for a, t in zip(args, sig.args, strict=True)
    ]


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
        function = cgutils.get_or_insert_function(
            module, ir.FunctionType(vector, [vector] * len(v)), f"llvm.{name}.{suffix}"
        )
        return builder.call(function, v)

    return emit


def _pick(sign):
    return lambda builder, sig, v: builder.select(
        builder.fcmp_ordered(sign, v[0], v[1]), v[0], v[1]
    )


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


def _last_bits(builder, n, more=0.0):
    """The whole numbers n + more in the last bits of integers."""
    integer = ir.VectorType(ir.IntType(64), n.type.count)
    return builder.bitcast(builder.fadd(n, _constant(n.type, WHOLE_IN_LAST_BITS + more)), integer)


def _lower_power_of_two(builder, sig, v):
    whole = _last_bits(builder, v[0], 1023.0)
    return builder.bitcast(builder.shl(whole, _constant(whole.type, 52)), v[0].type)


def _lower_turned_half(builder, sig, v):
    a, whole = v[0], _last_bits(builder, v[1])
    sign = builder.and_(
        builder.shl(whole, _constant(whole.type, 62)), _constant(whole.type, -(2**63))
    )
    return builder.bitcast(builder.xor(builder.bitcast(a, whole.type), sign), a.type)


_lower(power_of_two, 1, _lower_power_of_two)
_lower(turned_half, 2, _lower_turned_half)


@lower_builtin(is_odd, LaneType)
def _lower_is_odd(context, builder, sig, args):
    whole = _last_bits(builder, args[0])
    first = builder.shl(whole, _constant(whole.type, 63))
    return builder.icmp_signed("<", first, _constant(whole.type, 0))


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
                result = builder.insert_element(
                    result,
                    call(builder, [builder.extract_element(x, index) for x in vectors]),
                    index,
                )
            return result


for _f, _scalar in _LIBM.items():
    _lower_libm(_f, _scalar, 2 if _f is libm_pow else 1)


def _align_stack(builder):
    """Align lanes on the stack to cache lines, so that none is in two (measured: 5 % of a step)."""
    builder.function.attributes.alignstack = 64
    # llvmlite prints no alignment without another attribute; kernels raise nothing
    builder.function.attributes.add("nounwind")


def _pointer(context, builder, array_type, array, row, width, column=None):
    """Pointer to the lane of a row that begins at a column, as a pointer to a vector."""
    _align_stack(builder)
    view = context.make_array(array_type)(context, builder, array)
    begin = ir.Constant(row.type, 0) if column is None else column
    first = cgutils.get_item_pointer(
        context, builder, array_type, view, [row, begin], wraparound=False
    )
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


@lower_builtin(load_at, types.Array, types.Integer, types.Integer, types.Integer)
def _lower_load_at(context, builder, sig, args):
    width = sig.return_type.width
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], width, args[2])
    value = builder.load(pointer)
    value.align = 8
    return value


@lower_builtin(store_at, types.Array, types.Integer, types.Integer, LaneType)
def _lower_store_at(context, builder, sig, args):
    width = sig.args[3].width
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], width, args[2])
    builder.store(args[3], pointer, align=8)
    return context.get_dummy_value()


@lower_builtin(totals, LaneType, LaneType, LaneType, LaneType)
def _lower_totals(context, builder, sig, args):
    def mixed(x, y, places):
        mask = ir.Constant(ir.VectorType(ir.IntType(32), 4), places)
        return builder.shuffle_vector(x, y, mask)

    def paired(x, y):
        """(x0 + x1, y0 + y1, x2 + x3, y2 + y3): what a processor adds in one instruction."""
        return builder.fadd(mixed(x, y, [0, 4, 2, 6]), mixed(x, y, [1, 5, 3, 7]))

    a, b = paired(args[0], args[1]), paired(args[2], args[3])
    return builder.fadd(mixed(a, b, [0, 1, 4, 5]), mixed(a, b, [2, 3, 6, 7]))


@lower_builtin(splat, types.Float, types.Integer)
def _lower_splat(context, builder, sig, args):
    return _splat(builder, args[0], sig.return_type.width)


for _kinds in ((LaneType, LaneType), (LaneType, types.Float), (types.Float, LaneType)):

    @lower_builtin(select, MaskType, *_kinds)
    def _lower_select(context, builder, sig, args):
        width = sig.return_type.width
        a, b = (
            x if isinstance(t, LaneType) else _splat(builder, x, width)
            for x, t in zip(args[1:], sig.args[1:], strict=True)
        )
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


@lower_builtin(spacing, types.Float)
def _lower_spacing(context, builder, sig, args):
    whole = ir.IntType(64)
    following = builder.add(builder.bitcast(args[0], whole), ir.Constant(whole, 1))
    return builder.fsub(builder.bitcast(following, args[0].type), args[0])


# -- parts of a work array -------------------------------------------------------------------------
@infer_global(part)
class _PartType(AbstractTemplate):
    def generic(self, args, kws):
        view = types.Array(types.float64, 1, "C")
        return (
            signature(view, args[0], types.intp, types.intp)
            if args[0] == view and not kws
            else None
        )


@lower_builtin(part, types.Array, types.intp, types.intp)
def _lower_part(context, builder, signature, arguments):
    work, start, length = arguments
    whole = make_array(signature.args[0])(context, builder, work)
    view = make_array(signature.return_type)(context, builder)
    itemsize = context.get_constant(types.intp, 8)
    unowned = ir.Constant(view.meminfo.type, None)
    first = builder.gep(whole.data, [start])
    populate_array(
        view, data=first, shape=[length], strides=[itemsize], itemsize=itemsize, meminfo=unowned
    )
    return view._getvalue()
