"""Lanes: a short vector of doubles, one trajectory in each, as one explicit LLVM value.

LLVM doesn't vectorise plain inner loops over lanes (measured: three times slower than this), so a
lane is one value of the type ``<width x double>``. Kernels are written against the few operations
below. Compiled they are single machine instructions (AVX-512: 8 lanes, AVX2: 4, else 2; a wider
lane takes several): codegen/lowering/lane_types.py says which. Here they are NumPy on arrays of
shape ``(width,)``, which is what runs with ``SALTUS_DISABLE_JIT=1``.

No operation mixes lanes except :func:`any_lane` and :func:`bits`, which only steer, and
:func:`totals`, for lanes that hold the parts of one number: else a lane's digits never depend on
its neighbours.
"""

from __future__ import annotations

import numpy as np

#: Added to a whole number n less than 2^50 in size, 1.5 * 2^52 leaves n in the last bits: no
#: instruction before AVX-512 makes lanes of doubles integers.
WHOLE_IN_LAST_BITS = 6755399441055744.0


def load(array, row, width):
    """Row ``row`` of ``array`` (rows, width)."""
    return array[row].copy()


def store(array, row, lane):
    """Write a lane to row ``row`` of ``array`` (rows, width)."""
    array[row] = lane


def load_at(array, row, column, width):
    """Row ``row`` of ``array`` (rows, columns) from a column on; behind the row the next one."""
    start = row * array.shape[1] + column
    return array.reshape(-1)[start : start + width].copy()


def store_at(array, row, column, lane):
    """Write a lane to row ``row`` of ``array`` (rows, columns) from a column on."""
    array[row, column : column + len(lane)] = lane


def totals(a, b, c, d):
    """The sums of four lanes of width four, as one lane."""
    return np.array([(x[0] + x[1]) + (x[2] + x[3]) for x in (a, b, c, d)])


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
    """True if the mask holds in any lane."""
    return bool(np.any(mask))


def bits(mask):
    """The mask as an integer, lane i in bit i."""
    return sum(1 << i for i in range(len(mask)) if mask[i])


def lowest_bit(number):
    """Index of the lowest bit set in an integer that isn't 0."""
    return (int(number) & -int(number)).bit_length() - 1


def spacing(number):
    """Distance from a number that isn't negative to the next larger double."""
    return np.spacing(number)


def coarse_log2(a):
    """log2|a| to 0.09 from the bits of the number; about -1023 for zero. Enough for a step-size
    rule, which needs two digits.
    """
    return np.abs(np.asarray(a)).view(np.int64) * 2.0**-52 - 1023.0


def coarse_exp2(a):
    """The inverse of :func:`coarse_log2`."""
    return ((np.clip(a, -1000.0, 1000.0) + 1023.0) * 2.0**52).astype(np.int64).view(np.float64)


def power_of_two(n):
    """2^n of whole numbers n, at most 1000 in size."""
    return np.ldexp(1.0, _whole(n))


def is_odd(n):
    """A mask of the whole numbers that are odd; they are less than 2^50 in size."""
    return _whole(n) & 1 == 1


def turned_half(a, n):
    """``-a`` where the whole number n, less than 2^50 in size, has its second bit set: where n
    quarter turns are a half turn, or a half and a quarter. Else ``a``.
    """
    return np.where(_whole(n) & 2 == 2, -a, a)


def _whole(n):
    """Whole numbers as integers."""
    return np.nan_to_num(np.clip(n, -(2.0**50), 2.0**50)).astype(np.int64)


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
