"""Names that users of other programs type, and a sentence of advice for each."""

from __future__ import annotations

from saltus.errors import nearest
from saltus.language.foreign import ADVICE

_RUN = "Write sl.simulate(system, start, t_end=...)."
_PAIR = "sl.simulate(system, start, t_end=..., method={})."
_ARRAYS = (
    'Draw the values with NumPy and give them to one call: sl.simulate(..., values={"gap": '
    "array}); start= takes arrays as well."
)
_EVENTS = (
    "Contacts are comparisons in the equation, such as sl.piecewise((k*(x - gap), x > gap), "
    "otherwise=0), and a run holds them all: run.contact_time. sl.poincare(system, start, surface) "
    "records other crossings."
)
_FIT = 'Write sl.fit(system, measured, {"gap": ("0.1 mm", "1 mm")}, start).'
_SCATTER = 'Write sl.scatter(system, {"gap": sl.normal("0.4 mm", "0.02 mm")}).'
_NOISE = (
    "Draw the numbers once, outside the equation: noise = sl.recorded(times, values), and in the "
    "equation noise(t)."
)
_STEPS = "The steps are chosen by the method, such as sl.Taylor() or sl.ODE45(rtol=..., atol=...)."
_BRANCHES = "Write sl.branches(system, {name: (low, high)})."
_HARMONICS = f"{_BRANCHES[:-2]}, by=sl.HarmonicBalance(9))."
_SHAPES = (
    "Write sl.structure(mass, stiffness, ...), or sl.structure_modes(mass, stiffness, modes) for "
    "frequencies and mode shapes."
)
_MERGE = (
    "One call takes many starts and values and gives one result; of several results "
    "xarray.concat([a.x, b.x], dim) joins what they have in common."
)
_EQUATION = "Write the equation as a function, with @sl.system(states=...) above it."
#: Advice by name, in small letters and without _.
_ADVICE: dict[str, str] = {
    **dict.fromkeys(
        ("continuation", "continue", "arclength", "pseudoarclength", "contclass", "auto", "matcont",
            "coco", "bifurcationkit"),
        _BRANCHES,
    ),
    **dict.fromkeys(("harmonicbalance", "hb", "hbm", "aft"), _HARMONICS),
    **dict.fromkeys(("nnm", "freevibration"),
        "Write sl.backbone(system, ...), of free vibrations."),
    **dict.fromkeys(("montecarlo", "sampling", "uncertainty"), f"{_SCATTER} {_ARRAYS}"),
    **dict.fromkeys(("ensemble", "ensembleproblem", "parametersweep", "parameterscan", "scan"),
        _ARRAYS),
    **dict.fromkeys(("events", "event", "eventlocation", "odezero", "makezerocrossevent",
        "terminal", "callback", "continuouscallback", "zerocrossing"), _EVENTS),
    **dict.fromkeys(("concat", "merge", "combine", "join", "append"), _MERGE),
    **dict.fromkeys(("fit", "optimize", "optimise", "minimize", "leastsquares", "identify",
        "calibrate", "curvefit"), _FIT),
    **dict.fromkeys(("noise", "whitenoise", "random", "randn", "rand", "normal", "wiener"), _NOISE),
    **dict.fromkeys(("solve", "solveivp", "sim", "simulation", "integrate", "odeint", "run",
        "solveode", "compute", "generator", "vodeodesystem", "radauodesystem",
        "dopriodesystem"), _RUN),
    **dict.fromkeys(("rk45", "dop853", "dopri5", "ode78", "ode89", "tsit5"),
        f"Write {_PAIR.format('sl.ODE45()')}"),
    "rk23": f"Write {_PAIR.format('sl.ODE23()')}",
    "lsoda": f"Write {_PAIR.format('sl.ODE113()')}",
    **dict.fromkeys(("bdf", "radau", "ode23s", "ode23t", "ode23tb", "cvode", "vode"),
        f"Write {_PAIR.format('sl.ODE15s()')}"),
    **dict.fromkeys(("rk4", "rungekutta", "euler", "newmark", "newmarkbeta", "hht",
        "generalizedalpha", "centraldifference", "verlet"),
        f"Of fixed steps there is {_PAIR.format('sl.RK4(step)')}"),
    **dict.fromkeys(("odeset", "odeget", "options"), _STEPS),
    **dict.fromkeys(("deval", "odextend", "odeextend"),
        "Write samples= for more samples a period; run.x.interp(time=...) reads between them."),
    **dict.fromkeys(("args", "par", "pars", "param", "params", "parameter", "parameters"),
        "Parameters stand after the * of the equation; other values are "
        "system.with_values(name=...) or values=."),
    **dict.fromkeys(("model", "ode", "odesystem", "odeproblem", "symbols", "var", "fun"),
        _EQUATION),
    **dict.fromkeys(("linspace", "logspace", "geomspace", "array", "zeros"),
        "It is NumPy's. A range is a tuple here: (first, last, number)."),
    **dict.fromkeys(("topandas", "todataframe", "dataframe"),
        "Write sl.samples(run), sl.contacts(run) or sl.to_csv(run, path)."),
    **dict.fromkeys(("animate", "animation", "movie"),
        "There are no animations; matplotlib.animation.FuncAnimation can draw run.x and run.v, "
        "the samples of a run."),
    **dict.fromkeys(("fft", "psd", "periodogram", "welch"), "Write sl.spectrum(run)."),
    **dict.fromkeys(("frf", "bode", "resonance", "nonlinearfrf"),
        "Write sl.frequency_response(system, (first, last, number))."),
    **dict.fromkeys(("orbitdiagram", "bifurcation"),
        "Write sl.bifurcation_diagram(system, {name: (low, high, number)})."),
    **dict.fromkeys(("lyapunovspectrum", "lyapunovexponent", "lyapunovexponents", "ftle"),
        "Write sl.lyapunov(system, start, periods=...)."),
    **dict.fromkeys(("transmission", "transmissibilities"),
        "Write sl.transmissibility(response, output, input)."),
    **dict.fromkeys(("eigenvalues", "eig", "modes", "modal", "modeshapes", "eigenmodes"), _SHAPES),
    **dict.fromkeys(("base", "baseexcitation"),
        "Write base=sl.Base(direction, acceleration) of sl.structure; of an equation write the "
        "acceleration into it."),
    **dict.fromkeys(("chirp", "sinesweep", "sweptsine"),
        "Write sl.sweep(first, last, rate), a function of the time."),
    **dict.fromkeys(("sensor", "sensors", "output", "outputs", "observer", "withoutputs"),
        "Outputs are formulas by name, which every result gives: "
        "system.with_outputs({name: lambda x: ...}), and of structures sensors={name: 'x3'}."),
    **dict.fromkeys(("fixedpoint", "fixedpoints", "steadystate"),
        "Write sl.equilibria(system), or sl.periodic_orbits(system, start) for points of the map."),
    **dict.fromkeys(("limitcycle", "limitcycles", "shooting", "floquet", "monodromy"),
        "Write sl.periodic_orbits(system, start), or sl.branches(system, {name: (low, high)}); "
        "both give the Floquet multipliers."),
    "stability": "Attractors, orbits and branches hold their multipliers; sl.lyapunov gives "
        "exponents.",
    "cellmapping": "Write sl.basins(system, x=(low, high, number), v=(low, high, number)).",
    **dict.fromkeys(("hysteresis", "jenkins", "masing", "prandtl"),
        "Write sl.slider(x, stiffness=..., limit=...), sl.iwan(x, stiffnesses=..., limits=...) or "
        "sl.play(x, gap=...)."),
    "boucwen": "Write its state as one more state of the equation.",
    **dict.fromkeys(("coulomb", "stribeck", "dryfriction"),
        "Write sl.friction(v, slip=..., stick=...)."),
    **dict.fromkeys(("gap", "stop", "spring", "backlash", "deadzone", "deadband"),
        "Write sl.freeplay(x, stiffness=..., gap=...), or sl.impact(x < gap, v, restitution=0.8) "
        "for a rigid stop."),
    **dict.fromkeys(("saturation", "saturate"), "Write sl.clip(x, low, high)."),
    "relay": "Write sl.sign(x); with hysteresis a state of -1 and 1 and sl.jump.",
    **dict.fromkeys(("dirac", "impulse", "delta", "shock"),
        "Write sl.pulse(t, duration, shape='half_sine'), or give the start its velocity."),
    **dict.fromkeys(("integral", "cumtrapz"),
        "Make it a state, whose rate is what is integrated."),
    **dict.fromkeys(("diff", "derivative", "ddt", "der", "gradient"),
        "A rate is what the function returns: return v for dx/dt."),
    **dict.fromkeys(("ifelse", "cond", "select", "when"),
        "Write sl.where(x > gap, value, other) or sl.piecewise((value, x > gap), ..., "
        "otherwise=...)."),
    "version": "Write sl.__version__, or saltus doctor in a terminal.",
    **dict.fromkeys(("show", "plt", "figure"),
        "Pictures are in sl.plot, such as sl.plot.phase(run); the caller shows or saves them."),
    **dict.fromkeys(("attractor", "findattractors"), "Write sl.attractors(system, starts)."),
    **dict.fromkeys(("dde", "delays", "history"),
        "There are no delays: a rate depends on the states at the time t only. A picture over "
        "time is sl.plot.history(run)."),
}  # fmt: skip


#: Likeness from which on a name among many is a slip of the pen: 0.5 is "montecarlo", "poincare".
_NEAR = 0.7


def _plain(name: str) -> str:
    return name.lower().replace("_", "")


def instead(name: str, known: list[str]) -> str:
    """A sentence of advice for a name that saltus lacks; ``known`` are the names it has."""
    advice = _ADVICE.get(_plain(name)) or ADVICE.get(name)
    return advice or nearest(name, known, _NEAR, "dir(saltus) and docs/api.md list all.")
