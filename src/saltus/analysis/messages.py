"""What to tell people about trajectories that didn't end well: what, how many, where first, and what to do next."""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr

from saltus.errors import SaltusWarning
from saltus.kernels import status as st
from saltus.units import from_si

#: Statuses after which a trajectory's end is missing, each with advice.
_ADVICE = {
    st.SLIDING: "Sliding and sticking aren't followed yet. Make the force continuous there: friction as mu*N*sl.tanh(v/eps), eps small.",
    st.BUDGET_STEPS: "Raise max_steps of the method; if steps shrink towards one place, the equations are singular there.",
    st.BUDGET_EVENTS: "Contacts accumulate; give the contact a finite stiffness or damping, or raise max_events of the method.",
    st.NONFINITE: "The motion left the range of numbers, or a piece isn't analytic where it is entered (x**1.5 at x = 0: use sl.ODE45).",
    st.INVALID: "Check the starts and values of these trajectories.",
    st.INTERRUPTED: "The run was stopped; its end_* are where it stood. Start it again.",
    st.NOT_COMPUTED: "The run was stopped; start it again.",
}


def messages(run: xr.Dataset) -> list[str]:
    """One sentence or two for each status that isn't a success; empty if all is well.

    Parameters
    ----------
    run : Dataset
        From :func:`saltus.simulate` or :func:`saltus.stroboscope`.
    """
    status = np.atleast_1d(run["status"].values)
    texts = []
    for code, advice in _ADVICE.items():
        name, meaning = st.STATUS[code]
        here = np.flatnonzero(status == name)
        if len(here):
            texts.append(f"{len(here)} of {len(status)} trajectories: {name} - {meaning} (first: {_where(run, int(here[0]))}). {advice}")
    return texts


def _where(run: xr.Dataset, index: int) -> str:
    """Number, time and state of a trajectory at its end."""
    place = run.isel(trajectory=index) if "trajectory" in run.dims else run
    parts = [f"trajectory {index}"]
    if "end_time" in place:
        parts.append(f"t = {place['end_time'].item():.9g} s")
        parts += [_value(place, name) for name in str(run.attrs["states"]).split()]
    return ", ".join(parts)


def _value(place: xr.Dataset, name: str) -> str:
    end = place[f"end_{name}"]
    return f"{name} = {from_si(end.item(), end.attrs['units'])}" if np.isfinite(end.item()) else f"{name} = {end.item()}"


def warn(run: xr.Dataset) -> None:
    """Issue a SaltusWarning for each message, at the line of the user's call."""
    for text in messages(run):
        warnings.warn(text, SaltusWarning, stacklevel=3)
