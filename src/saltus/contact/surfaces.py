"""Surfaces on which the motion can stay: boundaries across which the rate of their own gap jumps.

Where both sides push onto such a surface, Filippov's rule holds: the motion stays on it, and the
two-valued sign takes the value sigma in [-1, 1] that this needs. Filippov, Differential Equations
with Discontinuous Righthand Sides (1988), section 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.contact.guards import Guard, bits_in
from saltus.errors import TraceError
from saltus.language import expression as ex
from saltus.language.canonical import Canonical, is_multiple
from saltus.language.derivatives import differentiate, gradient
from saltus.language.evaluate import evaluate
from saltus.language.expression import Bit, Expr
from saltus.language.known_sides import assuming
from saltus.language.sums import ratio, total

_SIGMA = ex.parameter("\0sigma")
_ZERO = ex.constant(0.0)
#: Samples of a surface where a jump is tried.
_PLACES = 512
#: Newton steps that lead onto the surface.
_STEPS = 8
#: A sum below this share of its terms is rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Surface:
    """A guard on whose boundary the motion can stay.

    Attributes
    ----------
    number : int
        Of the guard.
    pieces : dict of Expr to (Expr, Expr)
        Pieces that its side decides, where the field is linear in sigma: each with its value
        halfway, and its change for a unit of sigma.
    halves : tuple of Expr
        Change of the field for each unit of sigma.
    whole : dict of int to Expr
        Entries of the field that aren't linear in sigma, with the mean of their two sides.
    """

    number: int
    pieces: dict[Expr, tuple[Expr, Expr]]
    halves: tuple[Expr, ...]
    whole: dict[int, Expr]


def is_surface(
    number: int, field: Sequence[Expr], guards: Sequence[Guard], states: Sequence[str]
) -> bool:
    """True if the rate of a guard's gap jumps across it. Gaps with clocks are excluded."""
    gap = guards[number].gap
    if has_clock(gap):
        return False
    normal = gradient(gap, states)
    moved = [
        i for i, entry in enumerate(field) if not _is_zero(normal[i]) and number in bits_in([entry])
    ]
    if not moved:
        return False
    sides = {
        i: (assuming(field[i], number, True), assuming(field[i], number, False)) for i in moved
    }
    place = OnSurface(gap, states)
    jump = total([ex.mul(normal[i], ex.sub(*sides[i])) for i in moved])
    return not place.is_zero(jump) and _jumps(jump, number, guards, field, states)


class OnSurface:
    """Expressions where a gap is zero."""

    def __init__(self, gap: Expr, states: Sequence[str]) -> None:
        self._canonical = Canonical()
        self._gap = self._canonical.polynomial(gap)
        self._solved: tuple[Expr, Expr] | None = None
        for name, slope in zip(states, gradient(gap, states), strict=True):
            if not _is_zero(slope) and not ex.varies(slope):
                self._solved = ex.state(name), level(gap, name, slope)
                break

    def is_zero(self, expression: Expr) -> bool:
        """True if an expression is certainly zero on the surface."""
        polynomial = self._canonical.polynomial(expression)
        if not polynomial or is_multiple(polynomial, self._gap):
            return True
        if self._solved is None:
            return False
        try:
            there = ex.substituted(expression, dict([self._solved]))
        except TraceError:  # something in it is no number there
            return False
        return not self._canonical.polynomial(there)


def level(gap: Expr, name: str, slope: Expr) -> Expr:
    """The value of a state at which a gap, linear in it, is zero."""
    rest = ex.substituted(gap, {ex.state(name): _ZERO})
    return ratio(ex.neg(rest), slope)


def _is_zero(node: Expr) -> bool:
    return node.op == "const" and node.payload == 0


def has_clock(expression: Expr) -> bool:
    """True if an expression holds a remainder or a table of time, or a comparison of time."""
    if ex.depends_on(expression, ("mod", "table")):
        return True
    pieces = (node for node in ex.walk(expression) if node.op == "select")
    return any(True for node in pieces for _ in ex.relations_in(node.payload))


def _jumps(
    jump: Expr, number: int, guards: Sequence[Guard], field: Sequence[Expr], states: Sequence[str]
) -> bool:
    """True if the jump of a gap's rate exceeds rounding somewhere on the surface. Tested by
    sampling: an expression may be identically zero without simplifying to 0, e.g. where two spline
    pieces meet.
    """
    random = np.random.default_rng(7)
    gap = guards[number].gap
    at = {
        name: random.uniform(-1.5, 1.5, _PLACES) * 10.0 ** random.uniform(-2, 2, _PLACES)
        for name in states
    }
    values = {
        node.payload: random.uniform(0.5, 1.5, _PLACES)
        for node in ex.walk(*field, *(guard.gap for guard in guards))
        if node.op == "param"
    }
    t = random.uniform(0.0, 1.5, _PLACES)

    def sides(roots: Sequence[Expr]) -> dict[int, np.ndarray]:
        """Samples of the sides of guards whose bits stand in some expressions, and in the gaps of
        those.
        """
        needed, bits = bits_in(roots), dict[int, np.ndarray]()
        for other in range(len(guards) - 1, -1, -1):
            needed |= bits_in([guards[other].gap]) if other in needed else set()
        for other in sorted(needed):
            (value,) = evaluate([guards[other].gap], t=t, states=at, values=values, bits=bits)
            bits[other] = np.broadcast_to(value > 0, (_PLACES,))
        return bits

    slopes = gradient(gap, states)
    moving = (gap, *slopes)
    for _ in range(_STEPS):
        value, *slope = evaluate(moving, t=t, states=at, values=values, bits=sides(moving))
        with np.errstate(all="ignore"):
            step = value / np.asarray(sum(np.square(one) for one in slope))
            at = {name: at[name] - step * one for name, one in zip(states, slope, strict=True)}
    terms = [node for node in ex.walk(jump) if node.op in ("add", "sub", "mul", "div")] or [jump]
    found, *sizes = evaluate([jump, *terms], t=t, states=at, values=values, bits=sides([jump]))
    # a power of a negative depth is no number, where its piece doesn't act
    size = np.fmax.reduce([np.abs(np.broadcast_to(one, (_PLACES,))) for one in sizes])
    with np.errstate(invalid="ignore"):
        return bool(np.any(np.abs(found) > _ROUNDING * size))


def split(number: int, field: Sequence[Expr], surface: OnSurface) -> Surface:
    """Middle and halves of a field in terms of the sigma of a guard."""
    pieces: dict[Expr, tuple[Expr, Expr]] = {}
    spread: dict[Expr, Expr] = {}
    for node in ex.walk(*field, conditions=False):
        spread[node] = ex.rebuild(node, tuple(spread[child] for child in node.args), node.payload)
        if node.op == "select" and node.payload.bits >> number & 1:
            up, down = (assuming(node, number, side) for side in (True, False))
            half = _ZERO if surface.is_zero(ex.sub(up, down)) else _half(up, down, surface)
            pieces[node] = (_mean(up, down, surface), half)
            spread[node] = _at(*pieces[node], _SIGMA)
    halves: list[Expr] = []
    means: dict[int, Expr] = {}
    for i, entry in enumerate(field):
        half = differentiate(spread[entry], _SIGMA)
        if _SIGMA in set(ex.walk(half)) or number in bits_in([spread[entry]]):
            up, down = (assuming(entry, number, side) for side in (True, False))
            half, means[i] = _half(up, down, surface), _mean(up, down, surface)
        halves.append(half)
    return Surface(number, pieces, tuple(halves), means)


def _mean(up: Expr, down: Expr, surface: OnSurface) -> Expr:
    """The value halfway between two sides."""
    both = ex.add(up, down)
    return _ZERO if surface.is_zero(both) else ex.mul(0.5, both)


def _half(up: Expr, down: Expr, surface: OnSurface) -> Expr:
    """Half of the difference of two sides."""
    return up if surface.is_zero(ex.add(up, down)) else ex.mul(0.5, ex.sub(up, down))


def _at(mean: Expr, half: Expr, sigma: Expr) -> Expr:
    return ex.add(mean, ex.mul(sigma, half))


def held_at(
    field: Sequence[Expr], surface: Surface, hold: int, sigma: Expr = _ZERO
) -> tuple[Expr, ...]:
    """The field at a sigma of a surface where its hold guard says so; elsewhere unchanged."""
    memo: dict[Expr, Expr] = {}
    for node in ex.walk(*field, conditions=False):
        new = ex.rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        if node in surface.pieces:
            new = ex.select(Bit(hold), _at(*surface.pieces[node], sigma), new)
        memo[node] = new
    return tuple(
        ex.select(Bit(hold), _at(surface.whole[i], surface.halves[i], sigma), entry)
        if i in surface.whole
        else memo[entry]
        for i, entry in enumerate(field)
    )


def with_held_signs(root: Expr, guards: Sequence[Guard], states: Sequence[str]) -> Expr:
    """An expression that joins a system, with the sign that a held surface takes: friction that
    sticks is the force that holding it needs.
    """
    for number, guard in enumerate(guards):
        law = guard.law
        if law is None or law.kind != "surface" or number not in bits_in([root]):
            continue
        assert law.drive is not None
        assert law.pivot is not None
        surface = split(number, [root], OnSurface(guard.gap, states))
        sigma = ratio(ex.neg(law.drive), law.pivot)
        (root,) = held_at([root], surface, law.partner, sigma)
    return root


def averaged(entry: Expr, number: int, hold: int, surface: OnSurface) -> Expr:
    """The expression with the mean of its two sides where a surface is held."""
    if number not in bits_in([entry]):
        return entry
    return held_at([entry], split(number, [entry], surface), hold)[0]
