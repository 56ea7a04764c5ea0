"""Symmetric systems: F(-x, t + T/2) = -F(x, t), so that the mirror image -x(t + T/2) of a motion is
a motion too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.language.evaluate import evaluate
from saltus.language.expression import depends_on
from saltus.system.modes import sides
from saltus.system.system import System

#: States at which both sides are compared.
SAMPLES = 256
#: Powers of ten between which their magnitudes lie.
SIZES = (-6.0, 2.0)
#: Share of a value by which it may differ from its mirror image: rounding.
ROUNDING = 1e-7


def is_symmetric(system: System, varied: Mapping[str, tuple[float, float]]) -> bool:
    """True if the mirror image of each motion is a motion too, at all values of some parameters.

    Both sides are compared at random states and times. Contacts that stick or slide, and jumps
    other than impacts, count as not symmetric.

    Parameters
    ----------
    system : System
        Its equations and the values of the other parameters.
    varied : mapping of str to (float, float)
        Ranges of parameters [SI].
    """
    laws = [guard.law for guard in system.guards if guard.law is not None]
    if any(law.kind not in ("impact", "hold") for law in laws):
        return False
    random = np.random.default_rng(0)
    values: dict[str, Any] = {
        name: random.uniform(low, high, SAMPLES) for name, (low, high) in varied.items()
    }
    period = _period(system, values)
    if period is None:
        return False
    size = 10 ** random.uniform(*SIZES, SAMPLES)
    sample = _Place(
        system,
        random.uniform(0, 1, SAMPLES) * period,
        values,
        size * random.normal(size=(len(system.states), SAMPLES)),
    )
    mirrored = _Place(system, sample.time + period / 2, values, -sample.states)
    if not all(map(_opposite, sample.of(system.field), mirrored.of(system.field))):
        return False
    impacts = [i for i, guard in enumerate(system.guards) if guard.law and guard.law.reset]
    return all(any(_mirror(system, i, j, sample, mirrored) for j in impacts) for i in impacts)


class _Place:
    """States at which expressions are evaluated, each on its own side of every boundary."""

    def __init__(
        self, system: System, time: np.ndarray, values: dict[str, Any], states: np.ndarray
    ) -> None:
        self.time, self.states = time, states
        self._named = dict(zip(system.states, states, strict=True))
        self._values = {**system.values, **values}
        self._bits = sides(system, time, states, values)

    def of(self, expressions: Any) -> list[np.ndarray]:
        found = evaluate(
            expressions, t=self.time, states=self._named, values=self._values, bits=self._bits
        )
        return [np.broadcast_to(one, self.time.shape) for one in found]


def _period(system: System, values: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Forcing periods; ones without forcing if the time doesn't matter, None if it does."""
    if system.forced_at is not None:
        frequency = values.get(system.forced_at, np.full(SAMPLES, system.values[system.forced_at]))
        return np.asarray(system.period({system.forced_at: 1.0}) / frequency)
    entries = (*system.field, *(guard.gap for guard in system.guards))
    return None if any(depends_on(one, ("time",)) for one in entries) else np.ones(SAMPLES)


def _opposite(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((np.abs(one + other) <= ROUNDING * np.abs(one)).all())


def _mirror(system: System, i: int, j: int, sample: _Place, mirrored: _Place) -> bool:
    """True if an impact is the mirror image of another one."""
    guard, other = system.guards[i], system.guards[j]
    assert guard.law is not None
    assert other.law is not None
    (gap,), (image,) = sample.of([guard.gap]), mirrored.of([other.gap])
    sign = -1 if _opposite(gap, image) else 1
    return (
        _opposite(gap, -sign * image)
        and other.law.side == sign * guard.law.side
        and all(map(_opposite, sample.of(guard.law.reset), mirrored.of(other.law.reset)))
    )
