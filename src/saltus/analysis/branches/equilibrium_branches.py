"""Branches of equilibria: followed in each mode, from mode to mode through boundary equilibria, and
on to the limit cycles that are born at their Hopf points.

At a boundary equilibrium a branch of one mode ends and one of another begins: on the other side of
the parameter, *persistence*, or on the same one, a *nonsmooth fold*. di Bernardo, Budd, Champneys &
Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 5.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import Arc, tangents
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.criticality import criticality
from saltus.analysis.branches.equilibrium_curves import EquilibriumCurves
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.piece import refine
from saltus.analysis.branches.switching import Seed, crossing
from saltus.analysis.branches.tracing import Plan, both_ways, trace
from saltus.analysis.solve.newton import newton
from saltus.system import System

#: Farthest that a branch ends from what ends it, in units of the scale.
ENDING = 0.02
#: Rates that vanish on one side of a boundary and are smaller than this on the other, in units of
#: their derivatives, vanish there too.
CONTINUOUS = 1e-9
#: Halvings of the interval around a change of stability.
CLOSER = 6
#: Two events nearer than this, in units of the scale, are one.
ONE = 1e-8


@dataclass
class EquilibriumBranch(Branch):
    """A branch of equilibria in one mode.

    Attributes
    ----------
    borders : tuple of Event or None
        The boundary equilibria at its first and at its last point.
    beyond : tuple of float64[z] or None
        The direction in which the branch in the mode behind each begins, in units of the scale.
    """

    orbits: EquilibriumCurves
    borders: list[Event | None] = field(default_factory=lambda: [None, None])
    beyond: list[np.ndarray | None] = field(default_factory=lambda: [None, None])

    def find_events(self) -> None:
        """Locate what happens along the branch; see :class:`Branch`."""
        self._end()
        super().find_events()
        self.events = [_named(self, event) for event in self.events]
        for _ in range(CLOSER):  # so that a picture shows where stability changes
            at = {event.after for event in self.events if event.kind in ("fold", "hopf")}
            refine(self, sorted(at))

    def _contacts(self) -> list[Event]:
        """The boundary equilibria at the ends."""
        places = (0, max(len(self.z) - 2, 0))
        return [
            replace(border, after=place)
            for border, place in zip(self.borders, places, strict=True)
            if border is not None
        ]

    def _end(self) -> None:
        """Put the boundary equilibria in the place of the ends that lie beside them."""
        for side, place in ((0, 0), (1, -1)):
            if self.ends[side] == "boundary_equilibrium" and self.borders[side] is None:
                _meet_boundary(self, side, place)


def _leave(
    branch: EquilibriumBranch,
    number: int,
    switch: frozenset[str],
    longest: int,  # noqa: ARG001
) -> Iterator[Seed]:
    """Seeds of the branches of equilibria that leave one; see :func:`switching.children`."""
    unit, size = branch.scale[: branch.orbits.size], branch.orbits.size
    for index, event in enumerate(branch.events):
        points, own = event.z[None, :size], event.z[size:]
        if event.kind == "branch_point" and event.kind in switch:
            for sign in (1.0, -1.0):
                yield Seed(points, own, unit, sign * crossing(event), (number, index))
        if event.kind != "boundary_equilibrium":
            continue
        for border, beyond in zip(branch.borders, branch.beyond, strict=True):
            if border is not None and beyond is not None and (border.z == event.z).all():
                yield Seed(points, own, unit, beyond, (number, index))


def trace_equilibria(
    plan: Plan, system: System, name: str, seeds: Sequence[Seed], branches: list[Branch]
) -> list[Seed]:
    """Add the branches of equilibria that seeds lie on, and those that leave them, to a list.

    Parameters
    ----------
    plan : Plan
        Of the limit cycles.
    system : System
        Without forcing.
    name : str
        The parameter.
    seeds : sequence of Seed
        Equilibria.
    branches : list of Branch
        What is found is added to it.

    Returns
    -------
    list of Seed
        Of the limit cycles that are born at Hopf points.
    """
    follow = functools.partial(both_ways, ends=_left, kind=EquilibriumBranch)

    def make(_: int, scale: np.ndarray) -> Any:
        return EquilibriumCurves(system, name, scale)

    mine = replace(plan, make=make, follow=follow, leave=_leave, crossed=True)
    trace(mine, seeds, branches)
    equilibria = [(i, one) for i, one in enumerate(branches) if isinstance(one, EquilibriumBranch)]
    known: list[Event] = []
    for _, branch in equilibria:
        branch.events = [event for event in branch.events if not _told(branch, event, known)]
        known += [event for event in branch.events if event.kind == "boundary_equilibrium"]
    return [
        _born(branch, event, (number, index))
        for number, branch in equilibria
        for index, event in enumerate(branch.events)
        if event.kind == "hopf"
    ]


def _left(orbits: EquilibriumCurves, curve: Arc) -> str:
    """``boundary_equilibrium`` if a curve has just left its mode."""
    ends = orbits.sides(np.stack([curve.z[0], curve.z[-1]]))
    return "boundary_equilibrium" if (ends[0] != ends[1]).any() else ""


def _told(branch: EquilibriumBranch, event: Event, known: Sequence[Event]) -> bool:
    """True if an event is a boundary equilibrium that is already known from the branch on its other
    side.
    """
    return event.kind == "boundary_equilibrium" and any(
        np.abs((event.z - other.z) / branch.scale).max() < ONE for other in known
    )


# -- Hopf points -----------------------------------------------------------------------------------
def _named(branch: EquilibriumBranch, event: Event) -> Event:
    """An event by the name that it has of equilibria."""
    if event.kind != "neimark_sacker":
        return event
    return replace(event, kind="hopf", outcome=criticality(branch.orbits, branch.row, event.z))


def _born(branch: EquilibriumBranch, event: Event, parent: tuple[int, int]) -> Seed:
    """The limit cycle that is born at a Hopf point."""
    orbits, size, unit = branch.orbits, branch.orbits.size, branch.scale
    matrix = orbits.jacobian(event.z[None], orbits.modes[[branch.row]])[0, :, :size]
    values, vectors = np.linalg.eig(matrix * unit[:size] / unit[:size, None])
    here = int(np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf)))
    vector = vectors[:, here]
    turned = vector * np.exp(-0.5j * np.angle((vector * vector).sum()))
    way = np.concatenate([turned.real / np.linalg.norm(turned.real), [0.0, 0.0]])
    own = np.array([2.0 * np.pi / values[here].imag, event.z[-1]])
    return Seed(event.z[None, :size], own, unit[:size], way, parent)


# -- boundaries ------------------------------------------------------------------------------------
def _meet_boundary(branch: EquilibriumBranch, side: int, place: int) -> None:
    """Put the boundary equilibrium before the first or behind the last point of a branch."""
    orbits, row, z = branch.orbits, branch.row, branch.z[place]
    out = branch.tangent[place] * (1.0 if side else -1.0)
    gaps, slopes = orbits.gaps(z, row)
    with np.errstate(all="ignore"):
        far = -gaps / (slopes @ out)
    guard = int(np.argmin(np.where(far > 0, far, np.inf)))
    end, one = _on_boundary(orbits, row, z, guard), np.array([row])
    apart = np.inf if end is None else float(np.linalg.norm((end - z) / branch.scale))
    if end is None or apart > ENDING:
        return
    derivative = orbits.evaluate(end[None], one)[1]
    tangent = tangents(derivative, out[None])[0]
    outcome, branch.beyond[side] = _behind(branch, end, guard, tangent)
    multipliers = orbits.multipliers(end[None], derivative, one)
    tangent = tangent if side else -tangent
    branch.borders[side] = Event(
        "boundary_equilibrium",
        0,
        end,
        multipliers[0],
        tangent,
        derivative[0],
        (guard,),
        outcome=outcome,
    )
    at = len(branch.z) if side else 0
    length = branch.length[place] + (apart if side else -apart)
    new = {"z": end, "tangent": tangent, "derivative": derivative[0], "length": length}
    for name, value in {**new, "multipliers": multipliers[0]}.items():
        setattr(branch, name, np.insert(getattr(branch, name), at, value, axis=0))
    branch.length = branch.length - branch.length[0]


def _on_boundary(
    orbits: EquilibriumCurves, row: int, z: np.ndarray, guard: int
) -> np.ndarray | None:
    """The equilibrium near another float64[z] at which the gap of a guard vanishes, float64[z]."""

    def equations(z: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, derivative = orbits.evaluate(z, np.array([row]))
        gap, slope = (one[[guard]] for one in orbits.gaps(z[0], row))
        unit = np.abs(slope).max()
        return (
            np.append(residual, gap[None] / unit, axis=1),
            np.append(derivative, slope[None] / unit, axis=1),
        )

    found = newton(equations, z[None], orbits.scale[[row]])
    return found.z[0] if found.found[0] else None


def _behind(
    branch: EquilibriumBranch, z: np.ndarray, guard: int, out: np.ndarray
) -> tuple[str, np.ndarray | None]:
    """Continuation of the equilibria behind a boundary, and its direction in units of the scale;
    empty and None if there is none.
    """
    if branch.orbits.system.guards[guard].law is not None:
        return "", None
    other, one = branch.orbits.across(z, branch.row, guard), np.array([0])
    residual, derivative = other.evaluate(z[None], one)
    if not np.isfinite(derivative).all() or np.abs(residual).max() > CONTINUOUS:
        return "", None
    way = tangents(derivative, out[None])[0]
    opens = other.gaps(z, 0)[1][guard] @ way
    if (opens > 0) != other.modes[0, guard]:
        way = -way
    outcome = "persistence" if way[-1] * out[-1] > 0 else "nonsmooth_fold"
    return outcome, way
