"""Systems that are linear between their contacts: matrices of each contact state, read off the
equations.

In a contact state s the equations are ``z' = A_s z + b_s + sum_d B_s[:, d] u_d(t)`` and the gap of
guard g is ``a_g z + c_g + sum_d e_g[d] u_d(t)``, where a drive ``u_d`` is a sine or cosine of
``rate*t + phase``, or a polynomial of the time between breaks.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system.courses import TERMS, terms_of
from saltus.system.linear_friction import Sticking
from saltus.system.system import System

#: Size of the states and drives by which coefficients are read off: so large that constants of the
#: equations leave no rounding in them.
PROBE = 2.0**40
#: Difference of coefficients that is none, relative to the largest.
SAME = 1e-12


@dataclass(frozen=True)
class Drive:
    """``sin`` or ``cos`` of ``rate*t + phase``.

    Attributes
    ----------
    rate, phase : Expr
        Of parameters only [rad/s], [rad].
    lag : float
        Phase of the function behind a cosine [rad].
    """

    rate: Expr
    phase: Expr
    lag: float


@dataclass(frozen=True)
class LinearPiece:
    """The equations of one contact state for one set of parameter values.

    Attributes
    ----------
    matrix : float64[N, N]
        A.
    constant : float64[N]
        b.
    driven : float64[N, D]
        B: the harmonic drives, then the courses.
    """

    matrix: np.ndarray
    constant: np.ndarray
    driven: np.ndarray


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """A system that is linear between its contacts, with the drives in it.

    Attributes
    ----------
    system : System
        The system.
    drives : tuple of Drive
        The sines and cosines of time in it.
    courses : tuple of Expr
        The drives in it that are polynomials of the time between breaks.
    sticking : tuple of Sticking
        The boundaries on which friction may hold the motion.
    levels : tuple of Expr
        Of parameters alone: none is negative, or a friction would be.
    """

    system: System
    drives: tuple[Drive, ...]
    courses: tuple[Expr, ...]
    sticking: tuple[Sticking, ...]
    levels: tuple[Expr, ...]
    _field: tuple[Expr, ...]
    _gaps: tuple[Expr, ...]
    _names: Mapping[Expr, Expr]

    @functools.cached_property
    def states(self) -> tuple[str, ...]:
        """The states that the equations move: those that hold past values left out."""
        return self.system.states[: len(self._field)]

    @functools.cached_property
    def terms(self) -> int:
        """Coefficients of the pieces of its courses."""
        return max((terms_of(node) for node in self.courses), default=TERMS)

    @functools.cached_property
    def _driving(self) -> tuple[str, ...]:
        """The names that drives have in the equations: the harmonic ones, then the courses."""
        return tuple(drive_name(i) for i in range(len(self._names)))

    @functools.cached_property
    def parameters(self) -> tuple[str, ...]:
        """The parameters of the equations between contacts, those of the drives' rates left
        out.
        """
        nodes = ex.walk(*self._field)
        used = {node.payload for node in nodes if node.op == "param"}
        return tuple(name for name in self.system.values if name in used)

    @property
    def own_gaps(self) -> tuple[Expr, ...]:
        """The gaps, as functions of the states and the drives: those of the guards, then the second
        margins of frictions.
        """
        return self._gaps

    def of(self, quantities: tuple[Expr, ...]) -> tuple[Expr, ...] | None:
        """Quantities as functions of the states and the drives; None if one isn't linear."""
        found = ex.all_substituted(quantities, self._names)
        return found if are_affine(found, self._driving) else None

    def by(self, name: str) -> LinearSystem:
        """The derivative of the equations, the gaps and the drives' rates and phases with respect
        to a parameter, as a system of the same states and drives.
        """
        along = ex.parameter(name)
        drives = tuple(
            Drive(differentiate(d.rate, along), differentiate(d.phase, along), 0.0)
            for d in self.drives
        )
        field, gaps = (
            tuple(differentiate(one, along) for one in given) for given in (self._field, self._gaps)
        )
        return replace(self, drives=drives, _field=field, _gaps=gaps)

    def rows(
        self, quantities: tuple[Expr, ...], values: Mapping[str, float], mode: int
    ) -> LinearPiece:
        """Coefficients of quantities that :meth:`of` has given, in a contact state. The arrays
        belong to all that have asked for them.
        """
        return _rows_of(self, quantities, self._used(quantities, values), mode)

    def piece(self, values: Mapping[str, float], mode: int) -> LinearPiece:
        """The equations of a contact state, bit i the side of guard i."""
        bits = [bool(mode >> i & 1) for i in range(len(self.system.guards))]
        return LinearPiece(*self._coefficients(self._field, values, bits))

    def every_piece(self, values: Mapping[str, float]) -> Callable[[int], LinearPiece]:
        """The equations of any contact state, as of :meth:`piece`, read off the equations once for
        all of them, if these are linear in the terms that ask for contacts.
        """
        if self._terms is None:
            return functools.partial(self.piece, values)
        asked, entries = self._terms
        names = (*self._driving, *map(_term, range(len(asked))))
        read = LinearPiece(*self._coefficients(entries, values, [], names))
        counts = len(self.system.guards), len(self.states), len(self._driving)
        return EveryPiece(asked, *counts, read)

    @functools.cached_property
    def _terms(self) -> tuple[tuple[Expr, ...], tuple[Expr, ...]] | None:
        """The terms that ask for contacts, each as 1 or 0, and entries as functions of them: those
        of the equations, then both branches of each term. None if one isn't linear in them.
        """
        terms = tuple(node for node in ex.walk(*self._field) if node.op == "select")
        names = {node: ex.parameter(_term(i)) for i, node in enumerate(terms)}
        branches = [branch for node in terms for branch in node.args]
        entries = ex.all_substituted((*self._field, *branches), names)
        asked = tuple(ex.select(node.payload, 1.0, 0.0) for node in terms)
        moving = (*self._driving, *map(_term, range(len(terms))))
        return (asked, entries) if are_affine(entries, moving) else None

    def gaps(self, values: Mapping[str, float], mode: int = 0) -> LinearPiece:
        """a, c and e of all gaps in a contact state, float64[gaps, N], float64[gaps],
        float64[gaps, D]; only those of hold guards and second margins depend on it. The arrays
        belong to all that have asked for them.
        """
        return _rows_of(self, self._gaps, self._used(self._gaps, values), mode)

    def _used(
        self, entries: tuple[Expr, ...], values: Mapping[str, float]
    ) -> tuple[tuple[str, float], ...]:
        """The values of the parameters in some expressions."""
        used = _parameters_in(entries)
        return tuple((name, values[name]) for name in self.system.values if name in used)

    def pieces_of(self, entries: Sequence[Expr], values: Mapping[str, float]) -> LinearPiece:
        """Coefficients of other linear functions of the states and drives of the system."""
        known = ex.all_substituted(tuple(entries), self._names)
        return LinearPiece(*self._coefficients(known, values, []))

    def rates(self, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Rates [rad/s] and phases [rad] of the drives as cosines."""
        found = evaluate([part for d in self.drives for part in (d.rate, d.phase)], values=values)
        pairs = np.array(found, float).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1] + [d.lag for d in self.drives]

    def _coefficients(
        self,
        entries: tuple[Expr, ...],
        values: Mapping[str, float],
        bits: list[bool],
        names: Sequence[str] | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of the states, constants, and coefficients of the drives, or of parameters
        of other names.
        """
        names = self._driving if names is None else names
        n, m = len(self.states), len(names)
        probes = np.zeros((n + m, 1 + 2 * (n + m)))
        probes[:, 1 : 1 + n + m] = PROBE * np.eye(n + m)
        probes[:, 1 + n + m :] = -PROBE * np.eye(n + m)
        states = dict(zip(self.states, probes[:n], strict=True))
        known = {**values, **dict(zip(names, probes[n:], strict=True))}
        found = np.array(
            [
                np.broadcast_to(one, probes.shape[1])
                for one in evaluate(entries, states=states, values=known, bits=bits)
            ]
        ).reshape(len(entries), probes.shape[1])
        slopes = (found[:, 1 : 1 + n + m] - found[:, 1 + n + m :]) / (2 * PROBE)
        return slopes[:, :n].copy(), found[:, 0].copy(), slopes[:, n:].copy()


@functools.lru_cache(maxsize=256)
def _parameters_in(entries: tuple[Expr, ...]) -> frozenset[object]:
    """The names of the parameters in some expressions."""
    return frozenset(node.payload for node in ex.walk(*entries) if node.op == "param")


@functools.lru_cache(maxsize=2048)
def _rows_of(
    linear: LinearSystem,
    entries: tuple[Expr, ...],
    values: tuple[tuple[str, float], ...],
    mode: int,
) -> LinearPiece:
    """Coefficients of expressions in a contact state, by the parameters in them."""
    bits = [bool(mode >> i & 1) for i in range(len(linear.system.guards))]
    return LinearPiece(*linear._coefficients(entries, dict(values), bits))


@dataclass(frozen=True)
class EveryPiece:
    """The equations of all contact states for one set of parameter values: what they share, and
    terms that ask for contacts.

    Attributes
    ----------
    asked : tuple of Expr
        1 or 0 for each term, by the sides of the guards.
    guards, states, drives : int
        How many there are; courses count as drives.
    read : LinearPiece
        Rows of the equations, then two for each term: its branches. Behind the drives are the
        coefficients of the terms.
    """

    asked: tuple[Expr, ...]
    guards: int
    states: int
    drives: int
    read: LinearPiece

    @property
    def nbytes(self) -> int:
        """Memory of its arrays."""
        return self.read.matrix.nbytes + self.read.driven.nbytes

    def __call__(self, mode: int) -> LinearPiece:
        """The equations of one contact state, bit i the side of guard i."""
        size, first = self.states, self.states + 1 + self.drives
        bits = [bool(mode >> i & 1) for i in range(self.guards)]
        chosen = np.array(evaluate(self.asked, bits=bits)) == 0
        at = np.r_[:size, size + 2 * np.arange(len(self.asked)) + chosen]
        rows = np.column_stack([self.read.matrix[at], self.read.constant[at], self.read.driven[at]])
        for term in np.flatnonzero(rows[size:, first:].any(axis=1)):  # those within come first
            rows[size + term, :first] += rows[size + term, first:] @ rows[size:, :first]
        used = np.flatnonzero(rows[size:, :first].any(axis=1))
        found = rows[:size, :first] + rows[:size, first + used] @ rows[size + used, :first]
        return LinearPiece(
            found[:, :size].copy(), found[:, size].copy(), found[:, size + 1 :].copy()
        )


def drive_name(drive: int) -> str:
    """Name of the parameter that stands for a drive."""
    return f"drive {drive}"


def _term(number: int) -> str:
    return f"term {number}"


def are_affine(roots: Sequence[Expr], moving: Collection[str]) -> bool:
    """True if expressions are linear in the states and in parameters of some names, whichever sides
    their conditions choose.
    """
    degree: dict[Expr, float] = {}
    for node in ex.walk(*roots):
        below = [degree[one] for one in node.args]
        match node.op:
            case "state":
                degree[node] = 1
            case "param":
                degree[node] = 1 if node.payload in moving else 0
            case "const":
                degree[node] = 0
            case "add" | "sub" | "neg":
                degree[node] = max(below)
            case "mul":
                degree[node] = sum(below)
            case "div":
                degree[node] = below[0] if below[1] == 0 else math.inf
            case "select":
                asks_bits = next(ex.relations_in(node.payload), None) is None
                degree[node] = max(below) if asks_bits else math.inf
            case _:
                degree[node] = 0 if node.args and not any(below) else math.inf
    return all(degree[root] <= 1 for root in roots)
