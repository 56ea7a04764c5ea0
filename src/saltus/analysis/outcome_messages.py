"""Messages about trajectories that didn't end well: the kind of end, their number, the first place,
and advice.
"""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr

from saltus.analysis.inputs.spans import Span
from saltus.contact.guards import is_hold
from saltus.errors import SaltusWarning, listed
from saltus.kernels import status as st
from saltus.language import root_name
from saltus.language.evaluate import evaluate
from saltus.language.expression import varies, walk
from saltus.results.dataset.schema import told_of
from saltus.system import System, gap_units
from saltus.system.modes import sides
from saltus.units import from_si

#: Statuses after which a trajectory's end is missing, each with advice.
_ADVICE = {
    st.SLIDING: "Begin beside it, or give one of these forces a slope there: friction as "
    "mu*N*sl.tanh(v/eps) with a small eps, a stop as a stiff spring.",
    st.MODE_VIOLATION: "This is a fault of saltus: please report the equation, the values and the "
    "start. Another method, such as sl.ODE45(), may follow this motion.",
    st.BUDGET_STEPS: "Raise max_steps of the method, say Taylor(max_steps=10**10); if steps shrink "
    "towards one place, the equations are "
    "singular there.",
    st.BUDGET_EVENTS: "Contacts accumulate; sl.Taylor() follows impacts to rest and friction that "
    "sticks. Else give the contact a finite stiffness or damping, or raise max_events of the "
    "method.",
    st.NONFINITE: "The motion left the range of numbers, or met a pole or a root of something "
    "negative: check the equations at that state.",
    st.TURNED: 'Take sl.RK4(..., events="bisect"), a shorter step, or sl.Taylor().',
    st.AMBIGUOUS_IMPACT: "end_* is the state before them. Move a start or a gap so that one comes "
    "first, or give the stops a stiffness, which shares the blow.",
    st.NONUNIQUE: "Begin on the side that is meant: a little beyond the boundary.",
    st.INVALID_RESTITUTION: "Bound it where it is written, as sl.max(0.0, sl.min(1.0, e)) does.",
    st.INVALID_FRICTION: "Bound it where it is written, as sl.max(0.0, slip) does.",
    st.PAINLEVE: "Lower the friction, or let the contact give way: a stiff spring and a damper in "
    "place of the rigid stop follow what happens.",
    st.INVALID: "Check the starts and values of these trajectories.",
    st.INTERRUPTED: "The run was stopped; its end_* are where it stood. Start it again.",
    st.NOT_COMPUTED: "The run was stopped; start it again.",
}

#: The most frequent reason why a run in steps of a fixed length ends.
_GROWN = (
    "Errors of steps that are too long grow: take them well below 1/(the fastest rate of the "
    "system), in contact too, or sl.Taylor(). "
)
#: A reason why such a run may end long before the motion meets anything.
_BELOW_A_ROOT = (
    " A trial step of {method} that goes below a root ends it too: end the law before it, as "
    "sl.piecewise((-c*sl.sqrt(h), h > 1e-9), otherwise=0.0) does."
)
#: A step of one trajectory alone, for systems of two states on one core of a server [s]. Good to a
#: factor of three.
SECONDS_PER_STEP = 1e-6
#: Most states that a message gives.
MOST_STATES = 6

#: Gap, as a part of the largest state, below which a motion stands on a boundary.
ON_IT = 1e-9
#: Times the fastest rate of the equations that the rest of a run is long, from which on they count
#: as singular where it stands.
SINGULAR = 1e9
#: Times the usual step is long there: a stiff equation takes steps of about one from the start,
#: beside a root they become ever shorter.
SHARPENING = 100.0


def messages(run: xr.Dataset, asked: Span | None = None, system: System | None = None) -> list[str]:
    """One sentence or two for each status that isn't a success; empty if all is well.

    Parameters
    ----------
    run : Dataset
        From :func:`saltus.simulate` or :func:`saltus.stroboscope`.
    asked : Span, optional
        How long it should have run: tells how many steps one that ran out of them still has before
        it.
    system : System, optional
        Its equations: tell whether they are singular where it stands.
    """
    status = np.atleast_1d(run.variables["status"].values)
    met, texts = set(status.tolist()), []
    for code, advice in _ADVICE.items():
        name, meaning = st.STATUS[code]
        if name in met:
            here = np.flatnonzero(status == name)
            if code == st.BUDGET_STEPS and asked is not None:
                stuck = "" if system is None else _singular(run, asked, int(here[0]), system)
                advice = stuck or f"{_outlook(run, asked, int(here[0]))} {advice}"
            if code == st.NONFINITE and system is not None:
                advice = _root(run, int(here[0]), system) or advice
            if code == st.NONFINITE and run.attrs.get("method", "Taylor") != "Taylor":
                advice += _BELOW_A_ROOT.format(method=run.attrs["method"])
            if code == st.SLIDING:
                advice = _surfaces(run, int(here[0]), system) + advice
            if code == st.INVALID and _is_finite(run, int(here[0]), system):
                meaning = f"the start lies beyond a stop{_beyond(run, int(here[0]), system)}"
            if code == st.NONFINITE and run.attrs.get("method") == "RK4":
                meaning, advice = f"{meaning}, or is made of errors that grew", _GROWN + advice
            texts.append(
                f"{len(here)} of {len(status)} trajectories: {name} - {meaning} (first: "
                f"{_where(run, int(here[0]))}). {advice}"
            )
    return texts


def _is_finite(run: xr.Dataset, index: int, system: System | None) -> bool:
    """True if the state at the end of a trajectory, and its parameters, are numbers."""
    place = run.isel(trajectory=index) if "trajectory" in run.dims else run
    names = [f"end_{name}" for name in str(run.attrs["states"]).split()]
    names += [] if system is None else system.values
    return all(np.isfinite(place[name].values).all() for name in names if name in place.variables)


def _where(run: xr.Dataset, index: int) -> str:
    """Number, time and state of a trajectory at its end."""
    place = run.isel(trajectory=index) if "trajectory" in run.dims else run
    parts = [f"trajectory {index}"]
    if "end_time" in place:
        parts.append(f"t = {place['end_time'].item():.9g} s")
        shown = told_of(run)  # of structures the sensors
        parts += [_value(place, name) for name in shown[:MOST_STATES]]
        parts += ["..."] * (len(shown) > MOST_STATES)
    return ", ".join(parts)


def _outlook(run: xr.Dataset, asked: Span, index: int) -> str:
    """The number of steps that the whole run of a trajectory takes at its pace so far, as a
    sentence.
    """
    place = run.isel(trajectory=index) if "trajectory" in run.dims else run
    whole = asked.count[index] * asked.period[index] + asked.phase[index]
    done, steps = place["end_time"].item() - asked.t_start, place["steps"].item()
    if not done > 0:
        return ""
    return (
        f"It came {done:.3g} s of {whole:.3g} s far in {steps} steps: at this pace the whole takes "
        f"{steps * whole / done:.1e} steps "
        f"({_duration(steps * whole / done * SECONDS_PER_STEP)})."
    )


def _singular(run: xr.Dataset, asked: Span, index: int, system: System) -> str:
    """A sentence about a singular point if the equations change far faster at a trajectory's end
    than its remaining time allows; "" if they don't.
    """
    place, time, state, values = _end(run, index, system)
    rest = asked.t_start + asked.count[index] * asked.period[index] + asked.phase[index] - time
    bits = sides(system, time, list(state.values()), values)
    entries = evaluate(
        [entry for row in system.jacobian for entry in row],
        t=time,
        states=state,
        values=values,
        bits=bits,
    )
    matrix = np.array(entries, dtype=float).reshape(len(state), len(state))
    rate = float(np.abs(np.linalg.eigvals(matrix)).max()) if np.isfinite(matrix).all() else np.inf
    # a step of what lies behind: stiff equations take such, too
    usual = (time - asked.t_start) / max(place["steps"].item(), 1)
    if not (rate * rest > SINGULAR and rate * usual > SHARPENING):
        return ""
    return (
        f"The equations change at {rate:.1e} 1/s there: one of their laws has no derivative, as "
        f"the root of a level h has none at h = 0, "
        "or is extremely stiff. No number of steps gets over such a root: end the law a little "
        "before it, as "
        "sl.piecewise((-c*sl.sqrt(h), h > 1e-9), otherwise=0.0) does."
    )


def _surfaces(run: xr.Dataset, index: int, system: System | None) -> str:
    """The boundaries on which a trajectory ends, and a method that follows it, as a sentence."""
    if run.attrs.get("method", "Taylor") != "Taylor":
        return "sl.Taylor(), the default, follows the motion along such a boundary. "
    if system is None:
        return ""
    _, time, state, values = _end(run, index, system)
    size = max(1.0, *(abs(one) for one in state.values()))
    bits = sides(system, time, list(state.values()), values)
    own = [guard for guard in system.guards if not is_hold(guard)]
    gaps = evaluate([one.gap for one in own], t=time, states=state, values=values, bits=bits)
    names = [one.name for one, gap in zip(own, gaps, strict=True) if abs(float(gap)) < ON_IT * size]
    return f"It stands on {' and '.join(names)}, and every side leads back. " if names else ""


def _beyond(run: xr.Dataset, index: int, system: System | None) -> str:
    """The rigid stops beyond which a trajectory starts, and how far, as the end of a sentence."""
    if system is None:
        return ""
    _, time, state, values = _end(run, index, system)
    bits = sides(system, time, list(state.values()), values)
    gaps = evaluate(
        [one.gap for one in system.guards], t=time, states=state, values=values, bits=bits
    )
    beyond = [
        f"{guard.name} by {from_si(-guard.law.side * float(gap), unit)}"
        for guard, gap, unit in zip(system.guards, gaps, gap_units(system), strict=True)
        if guard.law and guard.law.kind == "impact" and guard.law.side * float(gap) < 0
    ]
    return f", {listed(beyond)}" if beyond else ""


def _root(run: xr.Dataset, index: int, system: System) -> str:
    """A sentence about a root of the equations that is zero where a trajectory ends, with a remedy;
    "" if none is.
    """
    _, time, state, values = _end(run, index, system)
    gaps = set(walk(*(guard.gap for guard in system.guards)))
    roots = [node for node in walk(*gaps, *system.field) if node.op == "sqrt" and varies(node)]
    bits = sides(system, time, list(state.values()), values)
    sizes = evaluate(roots, t=time, states=state, values=values, bits=bits)
    zero = [root for root, size in zip(roots, sizes, strict=True) if size == 0]
    if not zero:
        return ""
    compared = [root for root in zero if root in gaps]
    root, *_ = compared or zero
    found = f"{root_name(root)} is 0 there, where it has no derivative"
    if not compared:
        return (
            f"{found}, and nothing can be divided by it. Divide only where it is greater than 0, "
            f"as in sl.piecewise((k*(r - d)/r, r > d), otherwise=0) or sl.clearance(x, y, ...), or "
            f"add a small number under the root."
        )
    if any(node.op == "div" and root in set(walk(node.args[1])) for node in gaps):
        return (
            f"{found}, and a comparison divides by it, which is asked outside of its piece, too. "
            f"Divide by the gap in its place, or start a little beside."
        )
    return (
        f"{found}, and a comparison holds it. Compare squares, which have one: write "
        f"{root.args[0]!r} > d**2 in place of {root_name(root)} > d."
    )


def _end(
    run: xr.Dataset, index: int, system: System
) -> tuple[xr.Dataset, float, dict[str, float], dict[str, float]]:
    """A trajectory, the time and state at its end, and its parameters."""
    place = run.isel(trajectory=index) if "trajectory" in run.dims else run
    values = {
        name: place[name].item() if name in place.variables else value
        for name, value in system.values.items()
    }
    state = {name: place[f"end_{name}"].item() for name in system.states}
    return place, place["end_time"].item(), state, values


def _duration(seconds: float) -> str:
    """A time to wait, in a unit that people feel."""
    for unit, size in (("years", 3.2e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= size:
            return f"some {seconds / size:.2g} {unit}"
    return "less than a minute"


def _value(place: xr.Dataset, name: str) -> str:
    end = place[f"end_{name}"]
    return (
        f"{name} = {from_si(end.item(), end.attrs['units'])}"
        if np.isfinite(end.item())
        else f"{name} = {end.item()}"
    )


def warn(run: xr.Dataset, asked: Span | None = None, system: System | None = None) -> None:
    """Issue a SaltusWarning for each message, at the line of the user's call."""
    for text in messages(run, asked, system):
        warnings.warn(text, SaltusWarning, stacklevel=3)
