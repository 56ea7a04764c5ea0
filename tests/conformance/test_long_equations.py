"""Equations with many boundaries, nested and joined: the work of reading and printing them grows
with their operations and boundaries, and their motion is that of plain Python with tiny steps.

A piece is ``(condition, piece, piece)``, or ``[a, b, c, d]`` for ``a*x + b*v + c*z + d``. A
condition is ``("&" or "|", condition, condition)``, ``("~", condition)``, or such a sum that must
be positive.
"""

import math
import random
import sys

import pytest

import saltus as sl
from saltus.codegen.taylor_head import taylor_head

STATES = "x v z"


# -- pieces, traced and in numbers -----------------------------------------------------------------
def sum_of(coefficients, x, v, z):
    a, b, c, d = coefficients
    return a * x + b * v + c * z + d


def traced(piece, *y):
    """A piece as an equation has it."""
    if isinstance(piece, list):
        return sum_of(piece, *y)
    condition, where, otherwise = piece
    return sl.piecewise((traced(where, *y), asked(condition, *y)), otherwise=traced(otherwise, *y))


def asked(condition, *y):
    match condition:
        case ("&", a, b):
            return asked(a, *y) & asked(b, *y)
        case ("|", a, b):
            return asked(a, *y) | asked(b, *y)
        case ("~", a):
            return ~asked(a, *y)
    return sum_of(condition, *y) > 0


def value(piece, *y):
    """A piece as plain Python reads it."""
    if isinstance(piece, list):
        return sum_of(piece, *y)
    condition, where, otherwise = piece
    return value(where if holds(condition, *y) else otherwise, *y)


def holds(condition, *y):
    match condition:
        case ("&", a, b):
            return holds(a, *y) and holds(b, *y)
        case ("|", a, b):
            return holds(a, *y) or holds(b, *y)
        case ("~", a):
            return not holds(a, *y)
    return sum_of(condition, *y) > 0


def oscillator(piece, omega):
    """A forced oscillator with a piecewise force."""

    @sl.system(states=STATES)
    def nested(t, x, v, z):
        return v, -x - 0.2 * v + 1.3 * sl.cos(omega * t) + traced(piece, x, v, z), -0.5 * z

    return nested


def by_small_steps(piece, omega, y, t_end, steps):
    """The end of its motion by RK4."""

    def rates(t, x, v, z):
        force = -x - 0.2 * v + 1.3 * math.cos(omega * t) + value(piece, x, v, z)
        return v, force, -0.5 * z

    def moved(y, rate, h):
        return tuple(a + h * b for a, b in zip(y, rate, strict=True))

    h = t_end / steps
    for i in range(steps):
        t = i * h
        a = rates(t, *y)
        b = rates(t + h / 2, *moved(y, a, h / 2))
        c = rates(t + h / 2, *moved(y, b, h / 2))
        d = rates(t + h, *moved(y, c, h))
        mean = [(p + 2 * q + 2 * r + s) / 6 for p, q, r, s in zip(a, b, c, d, strict=True)]
        y = moved(y, mean, h)
    return y


def random_piece(comparisons, depth, seed):
    """Pieces nested so deep, with so many different comparisons in their conditions. A tenth of
    these are of the velocity: the motion may stay on such a boundary, which makes it two.
    """
    rng = random.Random(seed)
    number = lambda: round(2 * rng.random() - 1, 3)  # noqa: E731
    waiting = [
        [0, 1, 0, number()] if i % 10 == 0 else [1, 0, (i % 3) / 2, number()]
        for i in range(comparisons)
    ]
    share = -(-comparisons // (2**depth - 1))

    def condition():
        joined = waiting.pop()
        for _ in range(min(share - 1, len(waiting))):
            joined = ("&" if rng.random() < 0.5 else "|", joined, waiting.pop())
            joined = ("~", joined) if rng.random() < 0.3 else joined
        return joined

    def piece(depth):
        if depth == 0 or not waiting:
            return [number() for _ in range(4)]
        return condition(), piece(depth - 1), piece(depth - 1)

    return piece(depth)


# -- motion ----------------------------------------------------------------------------------------
#: Twelve comparisons, nested twice.
TWICE = (
    ("|", ("&", [1, 0.856, 0, -0.924], [0, 1, 0, -0.74]), [0, 1, 0, -0.793]),
    (
        ("&", [1, 0.738, 0, 0.834], [1, 0, -1, 0.391]),
        [0.2, 0.609, 0.271, 0.102],
        (
            ("|", ("~", [1, 0, -1, 0.079]), ("~", [1, 0.561, 0, -0.048])),
            [-0.665, -0.49, 0.904, 0.313],
            [0.751, -0.387, 0.717, -0.379],
        ),
    ),
    (
        (
            "&",
            ("|", [0, 0, -1, -0.807], [1, 0.929, 0, 0.574]),
            ("|", [0, 0, -1, -0.53], [0, 1, 0, -0.541]),
        ),
        [-0.349, 0.743, 0.799, -0.964],
        (("~", [1, 0.436, 0, -0.069]), [0.657, -0.318, 0.23, 0.564], [-0.77, 0.77, -0.92, -0.521]),
    ),
)  # fmt: skip


@pytest.mark.parametrize(
    ("piece", "boundaries"),
    [(TWICE, 19), *((random_piece(44, 4, seed), 44) for seed in (1, 2))],
    ids=["twice", "four deep", "four deep again"],
)
def test_nested_conditions_move_as_in_plain_python(piece, boundaries):
    """RK4 is wrong by a jump times a part of a step at each contact, of which there are few."""
    system, start = oscillator(piece, 1.132), (0.1, 0.1, 0.1)
    assert len(system.guards) >= boundaries
    end = sl.simulate(system, start, t_end=2.0)
    assert end.status == "ok"
    there = by_small_steps(piece, 1.132, start, 2.0, 8000)
    assert [float(end[f"end_{name}"]) for name in "xvz"] == pytest.approx(there, abs=2e-3)


# -- work ------------------------------------------------------------------------------------------
class TooLongError(Exception):
    """More calls than were allowed."""


def calls(equation, most):
    """Calls of Python while an equation is traced and its flow printed; TooLongError beyond
    most.
    """
    count = 0

    def called(_frame, event, _argument):
        nonlocal count
        count += event == "call"
        if count > most:
            raise TooLongError

    before = sys.getprofile()
    sys.setprofile(called)
    try:
        taylor_head(sl.system(states=STATES, check_units=False)(equation), 4, 8)
    finally:
        sys.setprofile(before)
    return count


def side(i, x, v, z):
    return v + 0.1 * i * x + 0.05 * z > 0.1 * i


def of_a_sum(term, force=lambda total: total):
    """Equations with so many pieces in a sum."""
    return lambda n: (
        lambda _t, x, v, z: (v, -x + force(sum(term(i, x, v, z) for i in range(n))), -z)
    )


def of_a_product(factor):
    """Equations with so many pieces in a product."""
    return lambda n: (
        lambda _t, x, v, z: (v, -x, x * math.prod(factor(i, x, v, z) for i in range(n)) - z)
    )


def one_in_another(n):
    def equation(_t, x, v, z):
        inner = x
        for i in range(n):
            inner = sl.max(0.9 * inner, 0.1 * i + 0.05 * v) if i % 2 else sl.min(inner, i * z)
        return v, -x - inner, -z

    return equation


def joined(i, x, v, z):
    return sl.piecewise((x + i, side(i, x, v, z) & (z + 0.2 * i * x > 0.3)), otherwise=-0.2 * x)


def jump(i, x, v, z):
    return sl.piecewise((0.1 * x + i, side(i, x, v, z)), otherwise=-0.2 * x)


def depth_of(i, x, _v, z):
    return sl.max(x + 0.1 * i * z - 0.1 * i, 0)


@pytest.mark.parametrize(
    "family",
    [
        of_a_sum(jump),
        of_a_sum(joined),
        of_a_sum(jump, sl.sin),
        of_a_sum(lambda *a: depth_of(*a) ** 1.5),
        of_a_sum(depth_of, lambda total: total**1.5),
        of_a_sum(depth_of, lambda total: sl.sqrt(1 + total**2)),
        of_a_product(lambda i, *y: sl.piecewise((1.1 + i, side(i, *y)), otherwise=0.1 * i)),
        of_a_product(lambda i, *y: 1 / sl.piecewise((1.1 + i, side(i, *y)), otherwise=1 + i)),
        one_in_another,
    ],
    ids=["jumps", "joined", "sine of jumps", "powers", "power of a sum", "root of a sum",
         "product", "quotient", "one in another"],
)  # fmt: skip
def test_work_grows_with_operations_and_boundaries(family):
    """Half as many pieces more have half as many boundaries more; with what holds the motion on
    each of them they have up to 1.5**2 times the operations, most of which are looked at for a few
    boundaries only: less than the cube, 3.4, and far less than all sides, 2**4. Functions of up to
    seven pieces are written out for all sides of these.
    """
    few = calls(family(8), 1_000_000)
    assert calls(family(12), 3.1 * few) < 3.1 * few


@pytest.mark.parametrize("seed", range(2))
def test_work_for_conditions_four_deep(seed):
    few = calls(oscillating(random_piece(22, 4, seed)), 500_000)
    assert calls(oscillating(random_piece(44, 4, seed)), 7 * few) < 7 * few


def oscillating(piece):
    return lambda _t, x, v, z: (v, -x + traced(piece, x, v, z), -0.5 * z)


def test_a_chain_that_doubles_at_each_condition_is_refused_in_a_sentence():
    def odd(_t, x, v, z):
        inside = x > 0
        for i in range(30):
            inside = (inside & ~side(i, x, v, z)) | (~inside & side(i, x, v, z))
        return v, -x - sl.piecewise((1, inside), otherwise=-1), -z

    with pytest.raises(sl.SaltusError, match=r"joined \d+ comparisons in one condition"):
        calls(odd, 1_000_000)


def test_squares_of_squares_are_walked_once():
    """Written out they have 2**24 terms."""

    def equation(_t, x, v, z):
        square = x
        for _ in range(24):
            square = square * square + 0.1
        return v, -x - sl.sqrt(square + sl.max(x, 0)), -z

    calls(equation, 1_000_000)
