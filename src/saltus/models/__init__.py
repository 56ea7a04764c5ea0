"""Published systems, ready to run. One file each: equations, parameter table, source, known
results.

Every entry of :data:`MODELS` is a function that takes parameter values by name and returns a
:class:`~saltus.system.System`. Nothing is traced before a model is asked for.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from saltus.errors import ParameterError, among, nearest, shown, unknown
from saltus.models.aeroelastic import aeroelastic
from saltus.models.ball_in_box import ball_in_box
from saltus.models.bang_bang import bang_bang
from saltus.models.belt_stribeck import belt_stribeck
from saltus.models.belt_two_values import belt_two_values
from saltus.models.bilinear_rig import bilinear_rig
from saltus.models.bouncing_ball import bouncing_ball
from saltus.models.chain import chain
from saltus.models.chattering_pair import chattering_pair
from saltus.models.delangre import delangre
from saltus.models.den_hartog import den_hartog
from saltus.models.double_scroll import double_scroll
from saltus.models.drifting_oscillator import drifting_oscillator
from saltus.models.dropped_oscillator import dropped_oscillator
from saltus.models.dry_friction import dry_friction
from saltus.models.falling_ball import falling_ball
from saltus.models.gear_pair import gear_pair
from saltus.models.hertz_stop import hertz_stop
from saltus.models.impact_oscillator import impact_oscillator
from saltus.models.jeffcott_rotor import jeffcott_rotor
from saltus.models.jenkins_oscillator import jenkins_oscillator
from saltus.models.latch import latch
from saltus.models.one_sided_spring import one_sided_spring
from saltus.models.painleve_rod import painleve_rod
from saltus.models.play import play
from saltus.models.pulled_pair import pulled_pair
from saltus.models.relief_valve import relief_valve
from saltus.models.rocking_block import rocking_block
from saltus.models.shaken_belt import shaken_belt
from saltus.models.soft_stop import soft_stop
from saltus.models.spring_rebound import spring_rebound
from saltus.models.switched_rotor import switched_rotor
from saltus.models.thermostat import thermostat
from saltus.models.thrown_mass import thrown_mass
from saltus.models.two_blocks import two_blocks
from saltus.models.two_masses import two_masses
from saltus.system import System

#: Every model by name.
MODELS: dict[str, Callable[..., System]] = {
    one.__name__: one
    for one in (
        delangre,
        chain,
        gear_pair,
        aeroelastic,
        jeffcott_rotor,
        bilinear_rig,
        soft_stop,
        one_sided_spring,
        spring_rebound,
        thrown_mass,
        hertz_stop,
        two_masses,
        bang_bang,
        switched_rotor,
        double_scroll,
        impact_oscillator,
        bouncing_ball,
        ball_in_box,
        rocking_block,
        relief_valve,
        falling_ball,
        dropped_oscillator,
        painleve_rod,
        thermostat,
        den_hartog,
        belt_two_values,
        belt_stribeck,
        dry_friction,
        two_blocks,
        shaken_belt,
        pulled_pair,
        chattering_pair,
        play,
        jenkins_oscillator,
        latch,
        drifting_oscillator,
    )
}


def find(name: str) -> Callable[..., System]:
    """The model called ``name``.

    Raises
    ------
    ParameterError
        If there is none; the message offers the nearest name.
    """
    if not among(name, MODELS):
        raise unknown("no model is called", name, MODELS)
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
        If there is no such model, or it brings no energies along.
    """
    if not has_energy(name):
        raise ParameterError(
            f"{name} brings no energies along. Write the energy, and the powers supplied and "
            f"dissipated, as functions, or as formulas in a study."
        )
    return dict(sys.modules[MODELS[name].__module__].ENERGY)


def has_energy(name: str) -> bool:
    """True if a model has its energies. Raises ParameterError for an unknown model."""
    return hasattr(sys.modules[find(name).__module__], "ENERGY")


def describe() -> dict[str, str]:
    """One line about every model, by name."""
    return {name: (model.__doc__ or "").strip().splitlines()[0] for name, model in MODELS.items()}


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    near = nearest(name.lower(), MODELS, 0.7).replace("Known", "Models")
    raise AttributeError(
        f"no model is called {shown(name)}. {near} saltus models lists all in a terminal. Write "
        f"your own equation with @sl.system."
    )


__all__ = [
    "MODELS",
    "aeroelastic",
    "ball_in_box",
    "bang_bang",
    "belt_stribeck",
    "belt_two_values",
    "bilinear_rig",
    "bouncing_ball",
    "chain",
    "chattering_pair",
    "delangre",
    "den_hartog",
    "describe",
    "double_scroll",
    "dropped_oscillator",
    "dry_friction",
    "energy",
    "falling_ball",
    "find",
    "gear_pair",
    "has_energy",
    "hertz_stop",
    "impact_oscillator",
    "jeffcott_rotor",
    "one_sided_spring",
    "painleve_rod",
    "pulled_pair",
    "relief_valve",
    "rocking_block",
    "shaken_belt",
    "soft_stop",
    "spring_rebound",
    "switched_rotor",
    "thermostat",
    "thrown_mass",
    "two_blocks",
    "two_masses",
]
