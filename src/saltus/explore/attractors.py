"""Attractors at one set of values: their keys on the page, their hues, their numbers in words."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.attractors import attractors_dataset
from saltus.analysis.attractors.followed import cycle_on, followed
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion, orbit_distance, same
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.solve.tolerances import SAME
from saltus.flow.maps import Stroboscope
from saltus.results import AttractorTable
from saltus.results.dataset.kinds import Kind
from saltus.results.dataset.schema import kind_text

Attractor: TypeAlias = ClosedMotion | SampledMotion
#: Attractors with their hues, and all hues of the branches that they lie on.
Branches: TypeAlias = Callable[[], tuple[Sequence[tuple["Attractor", int]], set[int]]]
#: Two orbits of neighbouring values are one response if they are nearer than this share of the box.
NEIGHBOUR = 0.25
#: An equilibrium nearer to zero than this share of the box is there.
_AT_ZERO = 1e-9
#: Most points of an attractor that the page draws.
POINTS = 64
#: Labels are signed bytes: most attractors that a map can show.
MOST = 127


class Legend:
    """The attractors of a system at one set of values, as they are found.

    A key is the place at which an attractor was found and stays; ids, which sort attractors by
    period and size, change as more are found. A hue belongs to a response, not to a key: an
    attractor takes that of the nearest one at the values that were shown before.

    Parameters
    ----------
    map_ : Stroboscope
        The map at these values.
    scale : float64[D]
        Range of each state.
    before : Legend, optional
        Those of the values shown before.
    branches : callable, optional
        Gives attractors at these values that lie on branches with a hue, with it, and hues that
        other stretches of these branches have.
    """

    def __init__(
        self,
        map_: Stroboscope,
        scale: np.ndarray,
        before: Legend | None = None,
        branches: Branches | None = None,
    ) -> None:
        self.map, self.scale = map_, scale
        self.found = AttractorSet(Neighbourhoods.none(len(map_.states)))
        self.scouts = 0  # starts that were looked through for them
        self.lock = threading.RLock()
        self._members: list[Attractor] = []
        self._hues: list[int] = []
        self._table: AttractorTable | None = None
        self._before = (
            [] if before is None else list(zip(before._members, before._hues, strict=True))
        )
        self._branches = branches or (lambda: ([], set()))
        self._old = None if before is None else before.found
        self._followed = False

    def __len__(self) -> int:
        return len(self._members)

    def follow(self) -> bool:
        """Close the orbits of the values shown before at these, by Newton's method; once. True if
        there were any.
        """
        with self.lock:
            if self._old and not self._followed:
                self.grow(followed(self.map, self._old, self.scale)[0])
                self._followed = len(self) > 0
            self._old = None
            return self._followed

    def grow(self, found: AttractorSet) -> bool:
        """Take what was found meanwhile; True if an attractor is new. What others found while that
        was looked for stays.
        """
        with self.lock:
            found = self._joined(found)
            fresh = [one for one in found.every if self._key(one) is None]
            if list(map(id, found.every)) != list(map(id, self.found.every)):
                self._table = None  # its rows are by ids
            self.found = found
            fresh = fresh[: MOST - len(self._members)]
            self._hues += self._hues_of(fresh)
            self._members += fresh
            return bool(fresh)

    def _joined(self, found: AttractorSet) -> AttractorSet:
        """A set, and what is known besides."""
        more = [
            one
            for one in self.found.every
            if not any(_alike(one, other, self.scale) for other in found.every)
        ]
        for one in more:
            if isinstance(one, ClosedMotion):
                found.add(self.map, one, self.scale)
            else:
                found.add_sampled(one)
        return found.ordered(self.scale) if more else found

    def keys(self, found: AttractorSet | None = None) -> np.ndarray:
        """The key of each id of a set, int64[m]; -1 for one that isn't known."""
        with self.lock:
            keys = [self._key(one) for one in (found or self.found).every]
        return np.array([-1 if key is None else key for key in keys], np.int64)

    def nearest(self, other: Attractor) -> list[tuple[float, int]]:
        """Distance of each attractor from one at these values, in ranges of the states, and its
        hue.
        """
        with self.lock:
            every = zip(self._members, self._hues, strict=True)
            return [(_distance(one, other, self.scale), hue) for one, hue in every]

    def hues(self) -> set[int]:
        """All hues that are taken."""
        with self.lock:
            return set(self._hues)

    def closed(self, key: int) -> ClosedMotion | None:
        """The attractor of a key, closed by Newton's method; None if there is none, or it never
        repeats.
        """
        one = self._members[key] if key < len(self._members) else None
        if isinstance(one, SampledMotion) and one.kind == Kind.LIMIT_CYCLE.word:
            return cycle_on(self.map, one)
        if not isinstance(one, ClosedMotion) or self.map.system.forced_at is not None:
            return one if isinstance(one, ClosedMotion) else None
        still = np.where(np.abs(one.points) > _AT_ZERO * self.scale, one.points, 0.0)
        return replace(one, points=still)

    def table(self) -> list[dict[str, Any]]:
        """All of them in words and numbers, by their keys."""
        with self.lock:
            if self._table is None:
                self._table = portraits(self.map, self.found)
            keys, table = self.keys(), self._table
        rows = [
            self._row(i, int(key), table) | {"order": i} for i, key in enumerate(keys) if key >= 0
        ]
        return sorted(rows, key=lambda row: int(row["key"]))

    def row(self, key: int) -> dict[str, Any] | None:
        """One of them; None if there is none, or it has turned out to be scatter of another."""
        return next((row for row in self.table() if row["key"] == key), None)

    def _row(self, i: int, key: int, table: AttractorTable) -> dict[str, Any]:
        system = self.map.system
        cycle = float("nan") if table.cycle is None else float(table.cycle[i])
        period = int(table.period[i])
        seconds = period * float(self.map.period[0]) if period else cycle
        rest = table.kind[i] == "equilibrium" and table.eigenvalues is not None
        both = table.eigenvalues[i] if rest and table.eigenvalues is not None else None
        multipliers = table.multipliers[i] if both is None else both
        return {
            "key": key,
            "hue": self._hues[key],
            "period": period,
            "name": kind_text(table.kind[i], period),
            "kind": table.kind[i],
            "peak": {system.states[0]: float(table.peak[i]), **_of_outputs(table, i, "peak")},
            "rms": {system.states[0]: float(table.rms[i]), **_of_outputs(table, i, "rms")},
            "margin": float(table.margin[i]),
            "contacts": float(table.contacts[i]),
            "itinerary": table.itinerary[i],
            "seconds": seconds,
            "multipliers": pairs(multipliers),
            "eigenvalues": both is not None,
            "exponent": float(table.exponent[i]),
            "stable": True,
            "points": np.asarray(table.points[i])[:POINTS].tolist(),
            "fraction": None,
            "low": None,
            "high": None,
        }

    def _key(self, one: Attractor) -> int | None:
        for key, other in enumerate(self._members):
            if other is one or _alike(one, other, self.scale):
                return key
        return None

    def _hues_of(self, fresh: Sequence[Attractor]) -> list[int]:
        """The hues of new attractors: each that of the nearest one of the values shown before, else
        the first that neither these nor those have.
        """
        if not fresh:
            return []
        branches, reserved = self._branches()
        before = [*self._before, *branches]
        near = [
            (_distance(one, other, self.scale), i, hue)
            for i, one in enumerate(fresh)
            for other, hue in before
        ]
        taken, found = set(self._hues), dict[int, int]()
        for apart, i, hue in sorted(near):
            if apart < NEIGHBOUR and i not in found and hue not in taken:
                found[i] = hue
                taken.add(hue)
        kept = taken | reserved | {hue for _, hue in before}
        free = iter(sorted(set(range(len(kept) + len(fresh))) - kept))
        return [found[i] if i in found else next(free) for i in range(len(fresh))]


def dataset_of(map_: Stroboscope, found: AttractorSet) -> xr.Dataset:
    """Attractors as :func:`saltus.attractors` returns them."""
    about = provenance(map_.system, map_.method, map_.system.values)
    return attractors_dataset(subject(map_.system, about), portraits(map_, found))


def pairs(numbers: Sequence[complex] | np.ndarray) -> list[list[float]]:
    """Complex numbers as pairs, without those that aren't known."""
    known = np.ravel(np.asarray(numbers, complex))
    return [[float(z.real), float(z.imag)] for z in known[np.isfinite(known)]]


def _of_outputs(table: AttractorTable, i: int, what: str) -> dict[str, float]:
    if table.outputs is None:
        return {}
    numbers = np.asarray(table.outputs[f"attractor_output_{what}"])[i]
    return dict(zip(table.outputs["output"], map(float, numbers), strict=True))


def _alike(one: Attractor, other: Attractor, scale: np.ndarray) -> bool:
    """True where two are the same attractor, found twice."""
    if one.kind != other.kind:
        return False
    if isinstance(one, ClosedMotion) and isinstance(other, ClosedMotion):
        return one.period == other.period and same(one, other, scale, 10 * SAME)
    if isinstance(one, SampledMotion) and isinstance(other, SampledMotion):
        return bool(other.share(one.points[None])[0] >= 0.5)
    return False


def _distance(one: Attractor, other: Attractor, scale: np.ndarray) -> float:
    """Distance of two attractors of neighbouring values, in ranges of the states."""
    if one.kind != other.kind:
        return np.inf
    if isinstance(one, ClosedMotion) and isinstance(other, ClosedMotion):
        return orbit_distance(one.points, other.points, scale)
    few, many = sorted((one.points, other.points), key=len)
    return float(np.abs((few[:, None] - many) / scale).max(axis=2).min(axis=1).mean())
