"""Branches that leave others: seeds of the doubled, halved and crossing ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.shooting import PeriodicOrbits

#: A branch that ends so near to where another is to leave is that one, in units of the scale.
BORN = 0.015


@dataclass(frozen=True)
class Seed:
    """Orbit at which a branch begins.

    Attributes
    ----------
    points : float64[n, D]
        An orbit.
    others : float64[..]
        The other unknowns: its period [s] if the system isn't forced, and the parameter.
    scale : float64[D]
        Ranges of the states.
    along : float64[z] or None
        The side on which to leave, in units of the scale; None for both sides of the parameter.
    parent : (int, int) or None
        The branch and its event that the new one leaves.
    """

    points: np.ndarray
    others: np.ndarray
    scale: np.ndarray
    along: np.ndarray | None = None
    parent: tuple[int, int] | None = None

    @property
    def z(self) -> np.ndarray:
        """All unknowns."""
        return np.concatenate([self.points.ravel(), self.others])


def children(branch: Branch, number: int, switch: frozenset[str], longest: int) -> Iterator[Seed]:
    """Seeds at the events of a branch, and at its ends: orbits of half the period, orbits that fly.

    Parameters
    ----------
    branch : Branch
        A branch whose events are known.
    number : int
        Its own.
    switch, longest
        As in :class:`Plan`.
    """
    size = branch.orbits.size
    for index, event in enumerate(branch.events):
        if event.kind not in switch:
            continue
        points = branch.orbits.points(event.z)
        own = event.z[branch.orbits.n * size :]
        unit = branch.scale[:size]
        if event.kind == "period_doubling" and 2 * branch.orbits.n <= longest:
            yield Seed(
                np.concatenate([points, points]),
                own,
                unit,
                _doubled(branch, event),
                (number, index),
            )
        elif event.kind == "branch_point":
            aside = crossing(event)
            for sign in (1.0, -1.0):
                yield Seed(points, own, unit, sign * aside, (number, index))
    for place, end in zip((0, -1), branch.ends, strict=True):
        if end == "period_doubling":
            z = branch.z[place]
            half = branch.orbits.n // 2
            points = branch.orbits.points(z)
            middle = 0.5 * (points[:half] + points[half:])
            yield Seed(middle, z[branch.orbits.n * size :], branch.scale[:size])
    for z in branch.flying:
        yield Seed(branch.orbits.points(z), z[branch.orbits.n * size :], branch.scale[:size])


def _doubled(branch: Branch, event: Event) -> np.ndarray:
    """The direction of the branch of twice the period."""
    orbits = branch.orbits
    assert isinstance(orbits, PeriodicOrbits)
    (segments,) = orbits.segments(event.derivative[None], np.array([branch.row]))
    product = np.eye(orbits.size)
    for one in segments:
        product = one @ product
    vector = np.linalg.svd(product + np.eye(len(product)))[2][-1]
    way = [vector]
    for one in segments[:-1]:
        way.append(one @ way[-1])
    way = np.array(way) / branch.scale[: orbits.size]
    whole = np.concatenate([way.ravel(), -way.ravel(), np.zeros(orbits.free + 1)])
    return np.asarray(whole / np.linalg.norm(whole))


def crossing(event: Event) -> np.ndarray:
    """The direction of the branch that crosses at a branch point."""
    null = np.linalg.svd(event.derivative)[2][-2:]
    across = null - np.outer(null @ event.tangent, event.tangent)
    longest = across[np.argmax(np.linalg.norm(across, axis=1))]
    return np.asarray(longest / np.linalg.norm(longest))


def ends_there(seed: Seed, branches: Sequence[Branch]) -> bool:
    """True if the branch that leaves a period doubling or a Hopf point is one that was seen to end
    there.
    """
    if seed.along is None:
        return False
    for branch in branches:
        if branch.orbits.n != len(seed.points) or branch.z.shape[1] != len(seed.z):
            continue
        others = branch.orbits.alike(seed.z[None], np.array([branch.row]))[0]
        for place in (0, -1):
            apart = np.linalg.norm((others - branch.z[place]) / branch.scale, axis=1)
            born = branch.ends[place] in ("period_doubling", "hopf")
            if born and apart.min() < BORN:
                return True
    return False
