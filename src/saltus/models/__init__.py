"""Published systems, ready to run. One file each: equations, parameter table, source, known
results.

Every entry of :data:`MODELS` is a function that takes parameter values by name and returns a
:class:`~saltus.system.System`. Nothing is traced before a model is asked for.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from saltus.errors import ParameterError, among, nearest, shown
from saltus.models.aeroelastic import aeroelastic
from saltus.models.chain import chain
from saltus.models.delangre import delangre
from saltus.models.gear_pair import gear_pair
from saltus.system import System

#: Every model by name.
MODELS: dict[str, Callable[..., System]] = {
    one.__name__: one for one in (delangre, chain, gear_pair, aeroelastic)
}


def find(name: str) -> Callable[..., System]:
    """The model called ``name``.

    Raises
    ------
    ParameterError
        If there is none; the message offers the nearest name.
    """
    if not among(name, MODELS):
        raise ParameterError(f"no model is called {shown(name)}. {nearest(name, MODELS)}")
    return MODELS[name]


def energy(name: str) -> dict[str, Callable[..., Any]]:
    """Energy and powers of a model, as :func:`saltus.energy_balance` takes them:
    ``**sl.models.energy("chain")``.

    Parameters
    ----------
    name : str
        The model.

    Returns
    -------
    dict
        ``energy`` [J] (stored), ``supplied`` and ``dissipated`` [W]: functions of (t, states,
        parameters).

    Raises
    ------
    ParameterError
        If there is no such model.
    """
    return dict(sys.modules[find(name).__module__].ENERGY)


def describe() -> dict[str, str]:
    """One line about every model, by name."""
    return {name: (model.__doc__ or "").strip().splitlines()[0] for name, model in MODELS.items()}


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise AttributeError(
        f"no model is called {shown(name)}. Models: {', '.join(MODELS)}. Write "
        f"your own equation with @sl.system."
    )


__all__ = ["MODELS", "aeroelastic", "chain", "delangre", "describe", "energy", "find", "gear_pair"]
