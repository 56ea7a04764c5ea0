"""saltus: the toolkit for vibration with contacts - freeplay, backlash, stops, impacts, friction.

>>> import saltus as sl
>>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
>>> run = sl.simulate(rig, start=(0.0, 0.0), periods=2)
>>> run.sizes["contact"] > 0
True

Names are imported when they are first used, so that `import saltus` and `saltus --help` are quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from saltus import models, plot
    from saltus.analysis.attractors.attractors import attractors
    from saltus.analysis.attractors.edge_orbit import edge_orbit
    from saltus.analysis.basins.basin_fractions import basin_fractions
    from saltus.analysis.basins.basins import basins
    from saltus.analysis.basins.compare import compare
    from saltus.analysis.branches.backbone import backbone
    from saltus.analysis.branches.bifurcation_curve import bifurcation_curve
    from saltus.analysis.branches.branches import branches
    from saltus.analysis.closed.equilibria import equilibria
    from saltus.analysis.closed.periodic_orbits import periodic_orbits
    from saltus.analysis.lyapunov.lyapunov import lyapunov
    from saltus.analysis.methods.compare_methods import compare_methods
    from saltus.analysis.methods.regularisation_widths import regularisation_widths
    from saltus.analysis.motion.energy_balance import energy_balance
    from saltus.analysis.motion.impact_statistics import impact_statistics
    from saltus.analysis.motion.poincare import poincare
    from saltus.analysis.motion.settled import settled
    from saltus.analysis.motion.simulate import simulate
    from saltus.analysis.motion.spectrum import spectrum
    from saltus.analysis.motion.stroboscope import stroboscope
    from saltus.analysis.motion.structure_modes import structure_modes
    from saltus.analysis.motion.transmissibility import transmissibility
    from saltus.analysis.recorded.wolf import wolf
    from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
    from saltus.analysis.responses.frequency_response import frequency_response
    from saltus.contact import (
        clearance,
        flores,
        freeplay,
        friction,
        hertz,
        hunt_crossley,
        impact,
        iwan,
        jump,
        lankarani_nikravesh,
        play,
        slider,
    )
    from saltus.errors import SaltusError
    from saltus.flow import ODE23, ODE45, ODE113, RK4, Interrupted, ODE15s, Taylor
    from saltus.interrupt import Stop
    from saltus.language import (
        abs,
        acos,
        asin,
        atan,
        atan2,
        clip,
        cos,
        cosh,
        exp,
        heaviside,
        hypot,
        log,
        max,
        min,
        mod,
        pi,
        piecewise,
        pulse,
        recorded,
        sawtooth,
        sign,
        sin,
        sinh,
        sqrt,
        square,
        table,
        tan,
        tanh,
        where,
    )
    from saltus.results import contacts, load, samples, save, to_csv, to_mat
    from saltus.results.describe import describe
    from saltus.system import Contact, Force, System, regularise, structure, system

#: Public name: module that holds it.
_HOMES = {
    "attractors": "saltus.analysis.attractors.attractors",
    "basin_fractions": "saltus.analysis.basins.basin_fractions",
    "basins": "saltus.analysis.basins.basins",
    "bifurcation_diagram": "saltus.analysis.responses.bifurcation_diagram",
    "compare": "saltus.analysis.basins.compare",
    "compare_methods": "saltus.analysis.methods.compare_methods",
    "edge_orbit": "saltus.analysis.attractors.edge_orbit",
    "energy_balance": "saltus.analysis.motion.energy_balance",
    "equilibria": "saltus.analysis.closed.equilibria",
    "frequency_response": "saltus.analysis.responses.frequency_response",
    "impact_statistics": "saltus.analysis.motion.impact_statistics",
    "lyapunov": "saltus.analysis.lyapunov.lyapunov",
    "periodic_orbits": "saltus.analysis.closed.periodic_orbits",
    "poincare": "saltus.analysis.motion.poincare",
    "regularisation_widths": "saltus.analysis.methods.regularisation_widths",
    "settled": "saltus.analysis.motion.settled",
    "simulate": "saltus.analysis.motion.simulate",
    "spectrum": "saltus.analysis.motion.spectrum",
    "stroboscope": "saltus.analysis.motion.stroboscope",
    "structure_modes": "saltus.analysis.motion.structure_modes",
    "backbone": "saltus.analysis.branches.backbone",
    "bifurcation_curve": "saltus.analysis.branches.bifurcation_curve",
    "branches": "saltus.analysis.branches.branches",
    "transmissibility": "saltus.analysis.motion.transmissibility",
    "wolf": "saltus.analysis.recorded.wolf",
    "SaltusError": "saltus.errors",
    "Stop": "saltus.interrupt",
    **dict.fromkeys(("ODE23", "ODE45", "ODE113", "RK4", "Interrupted", "ODE15s", "Taylor"),
        "saltus.flow"),
    **dict.fromkeys(("contacts", "describe", "load", "samples", "save", "to_csv", "to_mat"),
        "saltus.results"),
    **dict.fromkeys(("abs", "acos", "asin", "atan", "atan2", "clip", "cos", "cosh", "exp",
        "heaviside", "hypot", "log", "max", "min", "mod", "pi", "piecewise", "pulse", "recorded",
        "sawtooth", "sign", "sin", "sinh", "sqrt", "square", "table", "tan", "tanh", "where"),
        "saltus.language"),
    **dict.fromkeys(("clearance", "flores", "freeplay", "friction", "hertz", "hunt_crossley",
        "impact", "iwan", "jump", "lankarani_nikravesh", "play", "slider"), "saltus.contact"),
    **dict.fromkeys(("Contact", "Force", "System", "regularise", "structure", "system"),
        "saltus.system"),
}  # fmt: skip
_MODULES = ("models", "plot")

__all__ = [
    "ODE23",
    "ODE45",
    "ODE113",
    "RK4",
    "Contact",
    "Force",
    "Interrupted",
    "ODE15s",
    "SaltusError",
    "Stop",
    "System",
    "Taylor",
    "abs",
    "acos",
    "asin",
    "atan",
    "atan2",
    "attractors",
    "backbone",
    "basin_fractions",
    "basins",
    "bifurcation_curve",
    "bifurcation_diagram",
    "branches",
    "clearance",
    "clip",
    "compare",
    "compare_methods",
    "contacts",
    "cos",
    "cosh",
    "describe",
    "edge_orbit",
    "energy_balance",
    "equilibria",
    "exp",
    "flores",
    "freeplay",
    "frequency_response",
    "friction",
    "heaviside",
    "hertz",
    "hunt_crossley",
    "hypot",
    "impact",
    "impact_statistics",
    "iwan",
    "jump",
    "lankarani_nikravesh",
    "load",
    "log",
    "lyapunov",
    "max",
    "min",
    "mod",
    "models",
    "periodic_orbits",
    "pi",
    "piecewise",
    "play",
    "plot",
    "poincare",
    "pulse",
    "recorded",
    "regularisation_widths",
    "regularise",
    "samples",
    "save",
    "sawtooth",
    "settled",
    "sign",
    "simulate",
    "sin",
    "sinh",
    "slider",
    "spectrum",
    "sqrt",
    "square",
    "stroboscope",
    "structure",
    "structure_modes",
    "system",
    "table",
    "tan",
    "tanh",
    "to_csv",
    "to_mat",
    "transmissibility",
    "where",
    "wolf",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    from saltus.interrupt import ctrl_c_waits

    if name in _MODULES:
        with ctrl_c_waits():
            return importlib.import_module(f"saltus.{name}")
    if name not in _HOMES:
        from saltus.system.elsewhere import instead

        raise AttributeError(f"saltus has no {name!r}. {instead(name, __all__)}")
    with ctrl_c_waits():
        value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
