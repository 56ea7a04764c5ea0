"""Branches of motions of a few harmonics, from exact orbits or from rest."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from saltus.analysis.branches.arclength import follow
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.closed_harmonics import ClosedHarmonics, samples
from saltus.analysis.branches.doubled_harmonics import doubled, halved
from saltus.analysis.branches.switching import Seed, crossing
from saltus.analysis.branches.tracing import Plan, both_ways, trace
from saltus.analysis.closed.cycles import units
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.balance import MOST, HarmonicBalance
from saltus.analysis.harmonics.sizes import amplitudes
from saltus.analysis.inputs.outputs import Outputs
from saltus.analysis.solve.newton import newton
from saltus.errors import ParameterError
from saltus.flow.methods import Method
from saltus.system import System
from saltus.system.symmetry import is_symmetric

#: Most points of the curve from rest to a truncated motion.
MOST_FROM_REST = 1000
#: Least share of a linear response whose range is a unit.
LEAST = 1e-6


@dataclass
class HarmonicBranch(Branch):
    """A branch of motions of a few harmonics."""

    orbits: ClosedHarmonics
    audited: ClassVar[bool] = False


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


def worst(branches: Sequence[Branch], outputs: Outputs, by: HarmonicBalance) -> float:
    """Largest distance of a motion on branches from its exact orbit, over the range."""
    found = balanced(branches, outputs, by.count)["point_error"]
    return float(np.nanmax(found, initial=0.0))


def balanced(branches: Sequence[Branch], outputs: Outputs, harmonics: int) -> dict[str, Any]:
    """The variables that branches of truncated motions have besides those of exact orbits."""
    balances = [one.orbits for one in branches if isinstance(one.orbits, ClosedHarmonics)]
    most = max((orbits.harmonics for orbits in balances), default=harmonics)
    size, wide = len(outputs), [np.zeros((0, len(outputs), most + 1), complex)]
    unknown: dict[str, Any] = {"constant_values": np.nan}
    apart, share = [np.zeros((0, size))], [np.zeros(0)]
    for branch, orbits in zip(branches, balances, strict=True):
        each = np.array([amplitudes(orbits, z, outputs) for z in branch.z])
        wide.append(np.pad(each, [(0, 0), (0, 0), (0, most - orbits.harmonics)], **unknown))
        off, ranges = orbits.errors(branch.z, outputs)
        states = len(orbits.system.states)
        told = slice(states, None) if orbits.system.outputs.first else slice(states)
        share.append((off / np.where(ranges > 0, ranges, np.inf))[:, told].max(axis=1))
        apart.append(off)
    whole = np.concatenate(wide)
    return {
        "harmonic": np.arange(most + 1),
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

    def equations(harmonics: int, periods: int, scale: np.ndarray) -> ClosedHarmonics:
        return ClosedHarmonics(system, name, harmonics, periods, scale, symmetric, method, threads)

    for periods, some in _by_periods(seeds, places, by):
        bare = equations(by.count, periods, np.ones((1, 1)))
        guesses = [_near(bare, one, method) for one in some]
        guesses += [_from_rest(bare, place) for place in places if periods == (by.periods or 1)]
        starts = [_begun(bare, *one) for one in guesses]
        begins, harmonics = [one for one in starts if one is not None], by.count
        while begins:
            make = functools.partial(_made, equations, harmonics, periods)
            follow = functools.partial(both_ways, ends=halved, kind=HarmonicBranch)
            first = len(branches)
            trace(replace(plan, make=make, follow=follow, leave=_leave), begins, branches)  # type: ignore[arg-type]
            harmonics, periods, begins = 2 * harmonics, 2 * periods, []
            if periods <= plan.longest and "period_doubling" in plan.switch and harmonics <= MOST:
                wide = equations(harmonics, periods, np.ones((1, 1)))
                for number, branch in enumerate(branches[first:], first):
                    begins += doubled(branch, number, wide)
    if not branches:
        raise ParameterError(
            f"no motion of {by.count} harmonics was found near the orbits of {system.name} to "
            "begin with: ask for more of them by ",
            lambda say: f"{say.key('harmonics')}, or for other starts.",
        )


def _made(
    equations: Callable[[int, int, np.ndarray], ClosedHarmonics], harmonics: int, periods: int,
    _: int, scale: np.ndarray,
) -> ClosedHarmonics:  # fmt: skip
    return equations(harmonics, periods, scale)


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
    while share > LEAST and len(orbits.intervals(np.append(share * linear, value)).instants.angle):
        share *= 0.5
    sizes = 2.0 * share * np.abs(linear.reshape(-1, orbits.series)).max(axis=1)
    return z, np.where(sizes > 0, sizes, 1.0)


class _FromRest:
    """The curve of ``share R(X) + (1 - share) D X = 0`` from rest to a truncated motion, where the
    share is 1. D is a damper on each signal, and a spring on its mean: with them alone rest is the
    only motion, so the curve doesn't come back to a share of 0. A ``CurveEquations``.
    """

    def __init__(self, orbits: ClosedHarmonics, value: float) -> None:
        self._orbits, self._value, self.scale = orbits, value, orbits.scale
        unit = self.scale[0, :-1]
        self._dampers = _dampers(orbits, value) * unit / unit[:, None]

    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # noqa: ARG002
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        x, share = z[:, :-1], z[:, -1:]
        here = np.append(x, np.full((len(x), 1), self._value), axis=1)
        residual, derivative = self._orbits.evaluate(here, np.zeros(len(x), np.int64))
        damped = x / self.scale[0, :-1] @ self._dampers.T
        along = (residual - damped)[..., None] * self.scale[0, -1]
        each = share[..., None]
        slopes = each * derivative[..., :-1] + (1.0 - each) * self._dampers
        return share * residual + (1.0 - share) * damped, np.append(slopes, along, axis=2)

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


def _dampers(orbits: ClosedHarmonics, value: float) -> np.ndarray:
    """Dampers on the signals and springs on their means, seen as the forces are, float64[size,
    size].
    """
    source, harmonics, count = orbits.source, orbits.harmonics, orbits.count
    rate = 2 * np.pi / float(orbits.period(np.append(np.zeros(orbits.size), value)))
    real, imaginary = source.response(harmonics, rate)[0][..., :count]
    seen = real + 1j * imaginary
    seen /= np.abs(np.diagonal(seen[1])).min()
    seen[1:] *= 1j ** np.array([len(chain) - 1 for chain in source.chains])
    unit = fourier.to_complex(np.eye(orbits.series))  # of each coefficient, its amplitudes
    moved = np.einsum("kij,nk->ijnk", seen, unit)
    return np.asarray(fourier.of_complex(moved).transpose(0, 3, 1, 2).reshape(orbits.size, -1))


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
