"""Starts at a stop, or beyond it."""

from __future__ import annotations

import numpy as np

from saltus.language.evaluate import evaluate
from saltus.system import System
from saltus.system.modes import sides

EPS = 2.0**-52
#: A start this many roundings beyond a stop lies on it.
ROUNDINGS = 64.0


def on_allowed_sides(
    system: System,
    start: np.ndarray,
    parameters: np.ndarray,
    origin: float,
    period: np.ndarray,
    roundings: float = ROUNDINGS,
) -> tuple[np.ndarray, np.ndarray]:
    """Move starts that rounding has put beyond a stop back to its allowed side, and mark those on a
    side where an impact allows no motion.

    The end of a run at rest on a moving stop is a start of the next: it lies on the stop but for
    the rounding of its place, and of the way that it goes in a period.

    Parameters
    ----------
    system : System
        The equations.
    start : float64[n, D]
        States.
    parameters : float64[n or 1, P]
        Values.
    origin : float
        Time of the starts [s].
    period : float64[n]
        Forcing period, or the span of a run without forcing [s].
    roundings : float
        Most roundings beyond a stop of a start that lies on it.

    Returns
    -------
    (float64[n, D], bool[n])
    """
    start = np.array(start, float, order="C")
    beyond = np.zeros(len(start), bool)
    stops = {
        g: guard.law.side
        for g, guard in enumerate(system.guards)
        if guard.law is not None and guard.law.kind == "impact"
    }
    if not stops:
        return start, beyond
    values = dict(zip(system.values, parameters.T, strict=True))

    def columns(expressions: object) -> np.ndarray:
        """Expressions at the starts, float64[n, ...]."""
        states = dict(zip(system.states, start.T, strict=True))
        bits = sides(system, origin, list(start.T), values)
        found = evaluate(expressions, t=origin, states=states, values=values, bits=bits)  # type: ignore[arg-type]
        return np.stack(np.broadcast_arrays(*found, beyond)[:-1], axis=1).astype(float)

    for g, side in stops.items():
        inside = columns([system.guards[g].gap])[:, 0] * side
        if not (inside < 0.0).any():
            continue
        moved = len(system.field)  # a flow may carry derivatives without equations of theirs
        normal = columns(system.guard_gradients[g][:moved]) * side
        way = np.abs(columns(system.field)) * period[:, None]
        place = (np.abs(normal) * np.abs(start[:, :moved])).sum(axis=1)
        size = place + (np.abs(normal) * way).sum(axis=1)
        here = (inside < 0.0) & (inside >= -roundings * EPS * size)
        back = (EPS * place - inside) / (normal**2).sum(axis=1)
        start[here, :moved] += (back[:, None] * normal)[here]
        beyond |= (inside < 0.0) & ~here
    return start, beyond
