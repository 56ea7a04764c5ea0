"""Branches of motions of a few harmonics, each held against the exact orbit that is closed from it.

The curve is that of harmonic balance. Its stability is that of the exact orbit which Newton's
method finds from each motion on it: what Hill's determinant would tell rests on the truncated
motion, and on how its eigenvalues are sorted.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct, follow
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.switching import Seed, crossing
from saltus.analysis.branches.tracing import Plan, both_ways, trace
from saltus.analysis.closed.cycles import units
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.balance import HarmonicBalance
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.analysis.harmonics.sizes import amplitudes
from saltus.analysis.inputs.outputs import Outputs
from saltus.analysis.solve.newton import newton
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.system import System
from saltus.system.modes import mode_number, sides
from saltus.system.symmetry import is_symmetric

#: Farthest that Newton's method goes from a truncated motion to the exact orbit, in ranges of the
#: states.
NEAR = 0.5
#: Samples of a forcing period by which an exact orbit is read off as a series, and by which it is
#: held against a truncated one.
SAMPLES = 256
#: Most points of the curve from rest to a truncated motion.
MOST_FROM_REST = 1000
#: Least share of a linear response whose range is a unit.
LEAST = 1e-6


@dataclass(frozen=True)
class Exact:
    """The exact orbits nearest to r truncated motions.

    Attributes
    ----------
    found : bool[r]
    points : float64[r, n, D]
        Their states at whole forcing periods.
    multipliers : complex128[r, D]
        NaN where none was found.
    """

    found: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray


class ClosedHarmonics(HarmonicOrbits):
    """Curves of motions of a few harmonics, with the exact orbits beside them.

    Parameters
    ----------
    method, threads
        Of the exact flow.
    """

    def __init__(
        self, system: System, name: str, harmonics: int, periods: int, scale: np.ndarray,
        symmetric: bool, method: Method, threads: int | None,
    ) -> None:  # fmt: skip
        super().__init__(system, name, harmonics, periods, scale, symmetric)
        none = np.ones((0, periods * len(system.states) + 1))
        self._exact = PeriodicOrbits(system, (name,), periods, none, method, threads)
        self._known: dict[bytes, tuple[bool, np.ndarray, np.ndarray]] = {}

    def exact(self, z: np.ndarray) -> Exact:
        """The exact orbits at the parameters of motions float64[r, z], each remembered."""
        new = [i for i, one in enumerate(z) if one.tobytes() not in self._known]
        if new:
            self._close(z[new])
        known = [self._known[one.tobytes()] for one in z]
        found, points, multipliers = zip(*known, strict=True)
        return Exact(np.array(found, bool), np.array(points), np.array(multipliers))

    def _close(self, z: np.ndarray) -> None:
        points = self.points(z)
        guess = np.concatenate([points.reshape(len(z), -1), self.values(z)], axis=1)
        seen = [self.samples(one) for one in z]
        sizes = [units(one.max(axis=0), one.min(axis=0)) for one in seen]
        orbits = copy_with(self._exact, np.array([
            np.append(np.tile(size, self.periods), max(abs(float(one[-1])), 1e-300))
            for size, one in zip(sizes, z, strict=True)
        ]))  # fmt: skip
        normal = np.zeros(guess.shape)
        normal[:, -1] = 1.0
        rows = np.arange(len(z))
        point = correct(orbits, guess, normal, rows, NEAR)
        multipliers = np.full((len(z), points.shape[2]), np.nan + 0j)
        good = np.flatnonzero(point.found)
        if len(good):
            derivative = orbits.evaluate(point.z[good], good)[1]
            multipliers[good] = orbits.multipliers(point.z[good], derivative, good)
        ends = orbits.points(point.z)
        for i, one in enumerate(z):
            self._known[one.tobytes()] = bool(point.found[i]), ends[i], multipliers[i]

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Floquet multipliers of the exact orbits, the largest first, complex128[r, D]; NaN where
        none is near.
        """
        return self.exact(z).multipliers

    def errors(self, z: np.ndarray, outputs: Outputs) -> tuple[np.ndarray, np.ndarray]:
        """Largest distances of outputs of motions float64[r, z] from those of the exact orbits at
        samples of a period, float64[r, K], and the ranges of these, float64[r, K]; NaN where none
        is near.
        """
        apart, ranges = np.full((2, len(z), len(outputs)), np.nan)
        exact = self.exact(z)
        good = np.flatnonzero(exact.found)
        if not len(good):
            return apart, ranges
        seen = samples(
            self.system, self.names[0], exact.points[good, 0], self.values(z[good])[:, 0],
            self.periods, self._exact.map.method,
        )  # fmt: skip
        share = np.arange(seen.shape[1]) / seen.shape[1]
        here = fourier.basis(2 * np.pi * share, self.harmonics)
        for i, one in zip(good, seen, strict=True):
            about = dict(self.system.values) | {self.names[0]: float(z[i, -1])}
            time, both = share * float(self.period(z[i])), (here @ self.states(z[i]).T, one)
            modes = [mode_number(sides(self.system, time, each.T, about)) for each in both]
            truncated, known = (
                outputs.values(time, each, about, mode)
                for each, mode in zip(both, modes, strict=True)
            )
            apart[i] = np.abs(truncated - known).max(axis=0)
            ranges[i] = np.ptp(known, axis=0)
        return apart, ranges


def copy_with(orbits: PeriodicOrbits, scale: np.ndarray) -> PeriodicOrbits:
    """The equations of orbits with another scale float64[k, z]."""
    other = orbits.near(orbits.scale, np.zeros(0, np.int64))
    other.scale = scale
    return other


def samples(
    system: System, name: str, starts: np.ndarray, values: np.ndarray, periods: int, method: Method
) -> np.ndarray:
    """Exact motions from states float64[r, D] at values of a parameter, in equal steps over some
    forcing periods, float64[r, periods*SAMPLES, D].
    """
    rows = np.tile(np.array(list(system.values.values())), (len(starts), 1))
    rows[:, list(system.values).index(name)] = values
    run = Stroboscope(system, method, rows).run(starts, periods, Schedule.even(periods, SAMPLES))
    return np.asarray(run.samples[:, :, : starts.shape[1]])


@dataclass
class HarmonicBranch(Branch):
    """A branch of motions of a few harmonics."""

    orbits: ClosedHarmonics  # type: ignore[assignment]
    audited: ClassVar[bool] = False

    def _contacts(self) -> list[Event]:
        """Where exact contact sequences change isn't known from truncated motions."""
        return []


def _leave(
    branch: HarmonicBranch,
    number: int,
    switch: frozenset[str],
    longest: int,  # noqa: ARG001
) -> Iterator[Seed]:
    """Seeds of the branches that leave one where branches of truncated motions cross."""
    size = branch.orbits.size
    for index, event in enumerate(branch.events):
        if event.kind == "branch_point" and event.kind in switch:
            for sign in (1.0, -1.0):
                way = sign * crossing(event)
                yield Seed(
                    event.z[None, :size], event.z[size:], branch.scale[:size], way, (number, index)
                )


def _goes_on(orbits: ClosedHarmonics, curve: Arc) -> str:  # noqa: ARG001
    return ""


def worst(branches: Sequence[Branch], outputs: Outputs, by: HarmonicBalance) -> float:
    """Largest distance of a motion on branches from its exact orbit, over the range."""
    found = balanced(branches, outputs, by.count)["point_error"]
    return float(np.nanmax(found, initial=0.0))


def balanced(branches: Sequence[Branch], outputs: Outputs, harmonics: int) -> dict[str, Any]:
    """The variables that branches of truncated motions have besides those of exact orbits."""
    size, wide = len(outputs), [np.zeros((0, len(outputs), harmonics + 1), complex)]
    apart, share = [np.zeros((0, size))], [np.zeros(0)]
    for branch in branches:
        orbits = branch.orbits
        assert isinstance(orbits, ClosedHarmonics)
        wide.append(np.array([amplitudes(orbits, z, outputs) for z in branch.z]))
        off, ranges = orbits.errors(branch.z, outputs)
        states = len(orbits.system.states)
        told = slice(states, None) if orbits.system.outputs.first else slice(states)
        share.append((off / np.where(ranges > 0, ranges, np.inf))[:, told].max(axis=1))
        apart.append(off)
    whole = np.concatenate(wide)
    return {
        "harmonic": np.arange(harmonics + 1),
        "point_error": np.concatenate(share),
        "point_output_error": np.concatenate(apart),
        "point_harmonic_real": whole.real,
        "point_harmonic_imag": whole.imag,
    }


def trace_harmonics(
    plan: Plan, system: System, name: str, seeds: Sequence[Seed], places: Sequence[float],
    by: HarmonicBalance, branches: list[Branch], method: Method, threads: int | None,
) -> None:  # fmt: skip
    """Add the branches of truncated motions near exact orbits, of those that Newton's method leads
    to from rest at some values of the parameter, and those that cross them, to a list.

    Raises
    ------
    ParameterError
        If no truncated motion is found.
    """
    symmetric = is_symmetric(system, {name: plan.limits})
    for periods, some in _by_periods(seeds, places, by):

        def make(_: int, scale: np.ndarray, periods: int = periods) -> ClosedHarmonics:
            return ClosedHarmonics(
                system, name, by.count, periods, scale, symmetric, method, threads
            )

        follow = functools.partial(both_ways, ends=_goes_on, kind=HarmonicBranch)
        mine = replace(plan, make=make, follow=follow, leave=_leave)  # type: ignore[arg-type]
        bare = make(1, np.ones((1, 1)))
        guesses = [_near(bare, one, method) for one in some]
        guesses += [_from_rest(bare, place) for place in places if periods == (by.periods or 1)]
        starts = [_begun(bare, *one) for one in guesses]
        trace(mine, [one for one in starts if one is not None], branches)
    if not branches:
        raise ParameterError(
            f"no motion of {by.count} harmonics was found near the orbits of {system.name} to "
            "begin with: ask for more of them by ",
            lambda say: f"{say.key('harmonics')}, or for other starts.",
        )


def _by_periods(
    seeds: Sequence[Seed], places: Sequence[float], by: HarmonicBalance
) -> Iterator[tuple[int, list[Seed]]]:
    """Orbits that share a fundamental period, and the number of forcing periods in it."""
    found: dict[int, list[Seed]] = {by.periods or 1: []} if len(places) else {}
    for seed in seeds:
        periods = by.periods or len(seed.points)
        if periods % len(seed.points) == 0:
            found.setdefault(periods, []).append(seed)
    yield from sorted(found.items())


def _near(orbits: ClosedHarmonics, seed: Seed, method: Method) -> tuple[np.ndarray, np.ndarray]:
    """The truncated series of an exact orbit float64[z], and the ranges of the signals."""
    value = float(seed.others[-1])
    seen = samples(
        orbits.system, orbits.names[0], seed.points[:1], np.array([value]), orbits.periods, method
    )[0].T
    signals = orbits.source.of_states(seen)
    z = orbits.of_states(fourier.of_samples(seen, orbits.harmonics), value)
    return z, units(signals.max(axis=1), signals.min(axis=1))


def _from_rest(orbits: ClosedHarmonics, value: float) -> tuple[np.ndarray, np.ndarray]:
    """Rest at a value of the parameter, and ranges of the signals: those of the linear response,
    or of so much of it as meets no boundary.
    """
    z = np.append(np.zeros(orbits.size), value)
    orbits.scale = np.ones((1, orbits.width))
    linear = -orbits.evaluate(z[None], np.zeros(1, np.int64))[0][0]
    share = 1.0
    while share > LEAST and len(orbits.sections(np.append(share * linear, value)).instants.angle):
        share *= 0.5
    sizes = 2.0 * share * np.abs(linear.reshape(-1, orbits.series)).max(axis=1)
    return z, np.where(sizes > 0, sizes, 1.0)


class _FromRest:
    """The curve of ``R(X) = (1 - share) R(0)`` from rest to a truncated motion, where the share is
    1: of drives on a structure at rest it is the share of the drives. A ``CurveEquations``.
    """

    def __init__(self, orbits: ClosedHarmonics, value: float) -> None:
        self._orbits, self._value, self.scale = orbits, value, orbits.scale
        self._first = self._of(np.zeros((1, orbits.size)))[0]

    def _of(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        here = np.append(x, np.full((len(x), 1), self._value), axis=1)
        residual, derivative = self._orbits.evaluate(here, np.zeros(len(x), np.int64))
        return residual, derivative[..., :-1]

    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # noqa: ARG002
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        residual, derivative = self._of(z[:, :-1])
        along = np.broadcast_to(self._first * self.scale[0, -1], residual.shape)[..., None]
        return residual - (1.0 - z[:, -1:]) * self._first, np.append(derivative, along, axis=2)

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """Nothing depends on it."""

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """The same points, float64[r, 1, z]."""
        return z[:, None]

    def end(self) -> np.ndarray | None:
        """The truncated motion, float64[size]; None if the curve doesn't lead there."""
        begin = np.zeros((1, self._orbits.width))
        up = np.eye(self._orbits.width)[-1:]
        (curve,) = follow(self, begin, up, {self._orbits.size: (0.0, 1.0)}, MOST_FROM_REST)
        return curve.z[-1][:-1] if curve.end == "range" and curve.z[-1][-1] > 0.5 else None


def _begun(orbits: ClosedHarmonics, z: np.ndarray, ranges: np.ndarray) -> Seed | None:
    """The truncated motion that damped steps lead to; None if they lead to none."""
    unit = np.repeat(ranges, orbits.series)
    orbits.scale = np.append(unit, 1.0)[None]

    value = float(z[-1])

    def equations(x: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        here = np.append(x, np.full((len(x), 1), value), axis=1)
        residual, derivative = orbits.evaluate(here, rows)
        return residual, derivative[..., :-1]

    near = newton(equations, z[None, :-1], unit[None], damped=True)
    found = near.z[0] if near.found[0] else None
    if found is None and not z[:-1].any():
        found = _FromRest(orbits, value).end()
    if found is None:
        return None
    signals = orbits.seen(found)
    ranges = units(signals.max(axis=0), signals.min(axis=0))
    return Seed(found[None], z[-1:], np.repeat(ranges, orbits.series))
