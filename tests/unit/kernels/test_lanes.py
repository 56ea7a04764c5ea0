"""Operations on lanes: the compiled ones and the NumPy ones that stand in for them give the same
numbers, lane by lane.
"""

from __future__ import annotations

import inspect
import math
from functools import cache

import numpy as np
import pytest
from numba import njit

from saltus.codegen.lowering import lane_types  # noqa: F401  (how Numba compiles them)
from saltus.codegen.module import jit_disabled
from saltus.kernels import lanes
from saltus.kernels.lanes import (
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

JIT = not jit_disabled()
WIDTHS = (2, 4, 8, 16)
SPECIAL = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    math.inf,
    -math.inf,
    math.nan,
    5e-324,
    -1e308,
    2.5,
    3.5,
    -0.5,
    1e-300,
    7.0,
    -2.0,
    0.3,
]


def _arithmetic(a, b, c, out, flags):
    """One of each, of lanes and of lanes with scalars; one row of ``out`` for each result."""
    store(out, 0, a + b)
    store(out, 1, a - b)
    store(out, 2, a * b)
    store(out, 3, a / b)
    store(out, 4, -a)
    store(out, 5, fma(a, b, c))
    store(out, 6, fma(a, 2.0, 1.5))
    store(out, 7, fma(0.5, a, b))
    store(out, 8, 3.0 - a)
    store(out, 9, a * 2.0)
    store(out, 10, 1.0 / a)
    store(out, 11, smaller(a, b))
    store(out, 12, larger(a, b))
    store(out, 13, smaller(a, 0.3))
    store(out, 14, larger(0.3, a))
    store(out, 15, magnitude(a))
    store(out, 16, root(magnitude(a)))
    store(out, 17, nearest_integer(a))
    store(out, 18, select(a < b, a, b))
    store(out, 19, select((a > b) & (c > 0.0), a, 4.0))
    store(out, 20, select((a >= b) | (c <= 0.0), -1.0, b))
    store(out, 21, select(~(a < 0.0), a, c))
    store(out, 22, a + 1)
    flags[0] = bits(a < b)
    flags[1] = bits(a > 0.0)
    flags[2] = bits((a >= b) & (~(c < 1.0)))
    flags[3] = any_lane(a > 1e307)
    flags[4] = any_lane(a < b)


def _rough(a, out):
    store(out, 0, coarse_log2(a))
    store(out, 1, coarse_exp2(a))


def _whole_numbers(n, a, out):
    store(out, 0, power_of_two(n))
    store(out, 1, select(is_odd(n), 1.0, n - n))
    store(out, 2, turned_half(a, n))


def _library(a, b, out):
    store(out, 0, libm_sin(a))
    store(out, 1, libm_cos(a))
    store(out, 2, libm_exp(a))
    store(out, 3, libm_log(magnitude(a)))
    store(out, 4, libm_tan(a))
    store(out, 5, libm_atan(a))
    store(out, 6, libm_tanh(a))
    store(out, 7, libm_pow(magnitude(a), b))
    store(out, 8, libm_pow(magnitude(a), 1.5))


@cache
def compiled(function, width, count):
    """A function of lanes behind one that reads them from an array."""
    arguments = ", ".join(f"load(rows, {i}, {width})" for i in range(count))
    names = {"kernel": njit(function), "load": load}
    exec(f"def call(rows, out, *more):\n    kernel({arguments}, out, *more)\n", names)
    return njit(names["call"])


def in_lanes(function, rows, width, results, flags=0):
    """Run a function of lanes compiled, or plain with the JIT off; ``rows`` (lanes, width) are its
    arguments.
    """
    if not JIT:
        return plain(function, rows, width, results, flags)
    out, integers = np.zeros((results, width)), np.zeros(flags, np.int64)
    compiled(function, width, len(rows))(
        np.array(rows, float), out, *((integers,) if flags else ())
    )
    return out, integers


def plain(function, rows, width, results, flags=0):
    """The NumPy operations."""
    out, integers = np.zeros((results, width)), np.zeros(flags, np.int64)
    with np.errstate(all="ignore"):
        function(*(np.array(row) for row in rows), out, *((integers,) if flags else ()))
    return out, integers


def rows(width, count, seed=0, special=True):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(count, width)) * 10.0 ** rng.integers(-3, 4, (count, width))
    mixed = np.where(rng.random((count, width)) < 0.5, rng.choice(SPECIAL, (count, width)), values)
    mixed[:2, 0] = rng.permutation([0.0, -0.0])
    return mixed if special else values


@pytest.mark.nojit
@pytest.mark.parametrize("width", WIDTHS)
def test_arithmetic_comparisons_and_choices(width):
    for seed in range(20):
        arguments = rows(width, 3, seed)
        found, found_flags = in_lanes(_arithmetic, arguments, width, 23, 5)
        expected, flags = plain(_arithmetic, arguments, width, 23, 5)
        fused = [5, 6, 7]
        rest = [i for i in range(23) if i not in fused]
        assert np.array_equal(found[rest], expected[rest], equal_nan=True)
        numbers = ~np.isnan(expected[rest])
        # 0 and -0 are told apart
        assert np.array_equal(np.signbit(found[rest])[numbers], np.signbit(expected[rest])[numbers])
        assert found_flags.tolist() == flags.tolist()
        with np.errstate(all="ignore"):
            size = (
                np.abs(arguments[0] * arguments[1])
                + np.abs(arguments[2])
                + 2 * np.abs(arguments[0])
                + np.abs(arguments[1])
                + 2
            )
            same = (found[fused] == expected[fused]) | (
                np.abs(found[fused] - expected[fused]) <= 2.0**-52 * size
            )
        assert np.all(
            same | (np.isnan(found[fused]) & np.isnan(expected[fused])) | ~np.isfinite(size)
        )


@pytest.mark.nojit
@pytest.mark.parametrize("width", WIDTHS)
def test_functions_of_the_c_library(width):
    arguments = rows(width, 2, seed=4, special=False)
    found, expected = (run(_library, arguments, width, 9)[0] for run in (in_lanes, plain))
    assert np.allclose(found, expected, rtol=4 * 2.0**-52, atol=0, equal_nan=True)


@pytest.mark.skipif(not JIT, reason="NumPy has no fused multiply-add")
def test_fma_rounds_once():
    tiny = 2.0**-30
    out, _ = in_lanes(
        lambda a, b, c, out: store(out, 0, fma(a, b, c)),
        [[1 + tiny] * 4, [1 - tiny] * 4, [-1.0] * 4],
        4,
        1,
    )
    assert out[0].tolist() == [-(tiny**2)] * 4


@pytest.mark.nojit
def test_coarse_logarithm_and_its_inverse():
    values = np.ldexp(
        np.random.default_rng(1).uniform(0.5, 1.0, (200, 4)),
        np.random.default_rng(2).integers(-900, 900, (200, 4)),
    )
    for row in values * np.array([1, -1, 1, -1]):
        logs, _ = in_lanes(_rough, [row], 4, 2)
        assert np.all(np.abs(logs[0] - np.log2(np.abs(row))) < 0.09)
        assert np.array_equal(logs[0], coarse_log2(row))
        back, _ = in_lanes(_rough, [logs[0]], 4, 2)
        # 1000 + log2 keeps so many digits
        assert np.allclose(back[1], np.abs(row), rtol=1e-12, atol=0)
    ends, _ = in_lanes(_rough, [[0.0, 2000.0, -2000.0, 0.0]], 4, 2)
    assert ends[0, 0] == -1023.0
    assert ends[1].tolist() == [
        1.0,
        coarse_exp2(np.array([1000.0]))[0],
        coarse_exp2(np.array([-1000.0]))[0],
        1.0,
    ]


@pytest.mark.nojit
def test_a_nan_stays_in_its_lane():
    clean, dirty = rows(4, 3, seed=9, special=False), rows(4, 3, seed=9, special=False)
    dirty[:, 2] = math.nan
    a, b = (in_lanes(_arithmetic, arguments, 4, 23, 5)[0] for arguments in (clean, dirty))
    assert np.array_equal(a[:, [0, 1, 3]], b[:, [0, 1, 3]])


@pytest.mark.nojit
def test_a_comparison_with_nan_holds_nowhere():
    (_, flags) = in_lanes(_arithmetic, [[math.nan] * 4, [1.0] * 4, [1.0] * 4], 4, 23, 5)
    assert flags.tolist() == [0, 0, 0, 0, 0]


@pytest.mark.nojit
@pytest.mark.parametrize("width", WIDTHS)
def test_whole_numbers_in_lanes(width):
    rng = np.random.default_rng(3)
    for _ in range(40):
        n, a = rng.integers(-1000, 1001, width), rng.normal(size=width)
        found, _ = in_lanes(_whole_numbers, [n.astype(float), a], width, 3)
        half = np.mod(n // 2, 2) == 1  # n quarter turns: a half turn, or three quarters
        assert found[0].tolist() == [2.0 ** int(k) for k in n]
        assert found[1].tolist() == np.mod(n, 2).tolist()
        assert found[2].tolist() == np.where(half, -a, a).tolist()
    large, _ = in_lanes(_whole_numbers, [[2.0**49 + 1] * width, [-0.0] * width], width, 3)
    assert large[1].tolist() == [1.0] * width


@pytest.mark.nojit
def test_totals_are_the_sums_of_each_lane():
    arguments = np.random.default_rng(4).normal(size=(4, 4))
    out, _ = in_lanes(lambda a, b, c, d, out: store(out, 0, totals(a, b, c, d)), arguments, 4, 1)
    assert out[0].tolist() == [(a + b) + (c + d) for a, b, c, d in arguments]


@njit
def _shift(table, row, column, to):
    store_at(table, row, to, load_at(table, row, column, 4))


@pytest.mark.nojit
def test_lanes_from_a_column_on():
    table = np.arange(24.0).reshape(3, 8)
    _shift(table, 1, 3, 1)
    assert table[1].tolist() == [8.0, 11.0, 12.0, 13.0, 14.0, 13.0, 14.0, 15.0]
    _shift(table, 1, 6, 0)  # behind the row stands the next one
    assert table[1, :4].tolist() == [14.0, 15.0, 16.0, 17.0]
    assert table[[0, 2]].ravel().tolist() == [*range(8), *range(16, 24)]


@njit
def _copy(source, target, row, value):
    store(target, row, load(source, row, 4))
    store(target, 0, splat(value, 4))


@pytest.mark.nojit
def test_load_store_and_splat_touch_their_row_only():
    source, target = np.arange(12.0).reshape(3, 4), np.full((3, 4), -1.0)
    _copy(source, target, 2, 7.0)
    assert target.tolist() == [[7.0] * 4, [-1.0] * 4, [8.0, 9.0, 10.0, 11.0]]
    target[2] = 0.0
    assert source[2].tolist() == [8.0, 9.0, 10.0, 11.0]


@pytest.mark.parametrize("number", [1, 2, 3, 6, 40, 2**15, 2**62, 2**62 + 8])
def test_the_lowest_bit(number):
    lowest = 0
    while not (number >> lowest) & 1:
        lowest += 1
    assert lowest_bit(number) == lowest
    assert njit(lambda value: lowest_bit(value))(number) == lowest


@pytest.mark.parametrize(
    "number", [0.0, 5e-324, 1e-310, 2.0**-1022, 0.3, 1.0, 1.5, 2.0**52, 1e300, math.inf, math.nan]
)
def test_the_distance_to_the_next_number(number):
    expected = np.spacing(number)
    assert np.array_equal(
        [spacing(number), njit(lambda value: spacing(value))(number)],
        [expected, expected],
        equal_nan=True,
    )


def test_every_operation_is_tried_here():
    """A new operation in lanes.py needs a line above."""
    operations = {
        name
        for name, item in vars(lanes).items()
        if inspect.isfunction(item) and item.__module__ == lanes.__name__ and name[0] != "_"
    }
    assert operations <= {name for name, item in globals().items() if inspect.isfunction(item)}
