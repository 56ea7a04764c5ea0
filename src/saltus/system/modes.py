"""The mode of a system at a state, and its rates there, by NumPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from saltus.language.evaluate import evaluate
from saltus.system.equations_of_motion import EquationsOfMotion


def sides(
    system: EquationsOfMotion, t: Any, y: Any, values: Mapping[str, Any] | None = None
) -> list[Any]:
    """Side of each guard where the state is: True if the gap is positive.

    On a boundary itself (gap exactly 0) this says False; which side the motion enters is decided by
    derivatives, in the flow. Contacts that can be held count as not held.

    Parameters
    ----------
    system : System
        Its guards, equations and values.
    t : float or array
        Time [s].
    y : sequence of float or array
        One entry per state [SI].
    values : mapping, optional
        Values that replace the system's own [SI].

    Returns
    -------
    list of bool or array of bool
        One for each guard.
    """
    states, values = _arguments(system, y, values)
    bits: list[Any] = []
    for guard in system.guards:
        if guard.law is not None and guard.law.kind == "hold":
            bits.append(np.zeros(np.shape(bits[guard.law.partner]), dtype=bool)[()])
            continue
        (gap,) = evaluate([guard.gap], t=t, states=states, values=values, bits=bits)
        bits.append(gap > 0)
    return bits


def mode_number(bits: Sequence[Any]) -> Any:
    """Bits as one integer: bit i is guard i."""
    return sum(
        (np.asarray(bit, dtype=np.int64) << i for i, bit in enumerate(bits)), start=np.int64(0)
    )


def field(
    system: EquationsOfMotion,
    t: Any,
    y: Any,
    values: Mapping[str, Any] | None = None,
    bits: Sequence[Any] | None = None,
) -> np.ndarray:
    """Time derivatives of the states.

    Parameters
    ----------
    system : System
        Its guards, equations and values.
    t : float or array
        Time [s].
    y : sequence of float or array
        One entry per state [SI].
    values : mapping, optional
        Values that replace the system's own [SI].
    bits : sequence of bool, optional
        The mode; taken from the state if not given (:func:`sides`).

    Returns
    -------
    ndarray, shape (states, ...)
        [SI per second].
    """
    if bits is None:
        bits = sides(system, t, y, values)
    states, values = _arguments(system, y, values)
    derivatives = evaluate(system.field, t=t, states=states, values=values, bits=bits)
    return np.array(np.broadcast_arrays(*derivatives))


def _arguments(
    system: EquationsOfMotion, y: Any, values: Mapping[str, Any] | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """States by name and all parameter values."""
    return dict(zip(system.states, y, strict=True)), {**system.values, **(values or {})}
