"""Growth of volumes of states: where no volume ever shrinks there is no attractor."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.contact.guards import Guard
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, mul
from saltus.system.system import System

#: Random states, times and sides of contacts at which divergences are looked at.
SAMPLES = 256
#: Powers of ten between which the magnitudes of the states lie.
SIZES = (-6.0, 2.0)
#: Share of its terms below which a sum is zero: rounding.
ROUNDING = 1e-12
_KEPT = (
    "Nothing damps this system (the divergence of its equations is zero): it has no attractors, "
    "and each start keeps a motion of its own."
)
_GROWS = (
    "This system has negative damping (the divergence of its equations is positive): it has no "
    "attractors, and motions grow."
)


def nothing_attracts(system: System) -> str:
    """The reason for which a system has no attractors, a sentence; "" where it may have some.

    An attractor is reached from a region whose volume shrinks to nothing. The volume grows at the
    rate of the divergence of the equations (Liouville's rule), and changes at a contact where the
    rate of its gap jumps or the state does. What is the same at random states and times is the same
    everywhere; a divergence that changes with them is not judged, unless it is zero.

    Parameters
    ----------
    system : System
        Equations, contacts and values.

    Returns
    -------
    str

    References
    ----------
    Guckenheimer & Holmes, Nonlinear Oscillations, Dynamical Systems, and Bifurcations of Vector
    Fields (1983), chapter 1.
    """
    sample = _Sample(system)
    terms = _diagonal(system.field, system.states)
    each = np.array(sample.of(terms))
    growth, size = each.sum(axis=0), ROUNDING * np.abs(each).sum(axis=0)
    kept = bool((np.abs(growth) <= size).all())
    if not kept:
        elsewhere = np.array(_Sample(system, 1).of(terms)).sum(axis=0)
        if not (np.abs(growth - elsewhere) <= size).all() or not (growth >= -size).all():
            return ""
    if not all(_keeps_volume(system, i, sample) for i in range(len(system.guards))):
        return ""
    return _KEPT if kept else _GROWS


@lru_cache(maxsize=16)
def _diagonal(field: tuple[Expr, ...], states: tuple[str, ...]) -> list[Expr]:
    """The diagonal of the Jacobian, whose sum is the divergence."""
    return [gradient(rate, [name])[0] for rate, name in zip(field, states, strict=True)]


class _Sample:
    """Random states, times and sides of contacts, none of which is held."""

    def __init__(self, system: System, place: int = 0) -> None:
        self._bits = np.random.default_rng(0).random((len(system.guards), SAMPLES)) < 0.5
        held = [guard.law is not None and guard.law.kind == "hold" for guard in system.guards]
        self._bits[held] = False
        random = np.random.default_rng(place)
        shape = (len(system.states), SAMPLES)
        states = 10 ** random.uniform(*SIZES, shape) * random.choice([-1.0, 1.0], shape)
        self._known: dict[str, Any] = {
            "t": random.uniform(0.0, 10.0, SAMPLES),
            "states": dict(zip(system.states, states, strict=True)),
            "values": system.values,
        }

    def of(
        self, expressions: Sequence[Expr], side: tuple[int, bool] | None = None
    ) -> list[np.ndarray]:
        """Values float64[SAMPLES] of expressions, a contact on a side."""
        bits = self._bits.copy()
        if side is not None:
            bits[side[0]] = side[1]
        found = evaluate(expressions, bits=list(bits), **self._known)
        return [np.broadcast_to(one, SAMPLES) for one in found]


def _keeps_volume(system: System, i: int, sample: _Sample) -> bool:
    """True where a contact keeps volumes: it rebounds without a loss, nothing holds or rubs there,
    or the rate of its gap is the same on both sides.
    """
    guard: Guard = system.guards[i]
    law = guard.law
    if law is not None and law.kind == "hold":
        return True  # its owner is judged
    if law is not None and law.kind == "surface":
        return law.pivot is not None and not sample.of([law.pivot])[0].any()
    if law is not None:
        if law.restitution is None or law.friction is not None:
            return False
        return bool((sample.of([law.restitution])[0] == 1.0).all())
    slopes = gradient(guard.gap, system.states)
    terms = [mul(slope, rate) for slope, rate in zip(slopes, system.field, strict=True)]
    terms.append(time_derivative(guard.gap))
    here, there = (np.array(sample.of(terms, (i, side))) for side in (True, False))
    size = np.abs(here).sum(axis=0) + np.abs(there).sum(axis=0)
    return bool((np.abs((here - there).sum(axis=0)) <= ROUNDING * size).all())
