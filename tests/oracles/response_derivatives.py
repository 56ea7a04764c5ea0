"""Derivatives in fits to steady responses and to histories of random systems, beside differences of
what they predict.
"""

from __future__ import annotations

import warnings

import numpy as np

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.motion import Motions
from saltus.analysis.fits.steady import SteadyResponses
from saltus.analysis.fits.unknowns import Unknowns

from .derivative_systems import Case
from .differences import Column, shifts

SIZES = ("amplitude", "rms", "peak")


def _asked(system, names, along, at):
    """A measurement of all states and outputs, and the unknowns of a fit to it."""
    read = (*system.states, *system.outputs.names)
    given = {along: at} | {name: np.linspace(0.0, 1.0, len(at)) for name in read}
    known = {name: abs(system.values.get(name, 0.0)) for name in names}
    bounds = {name: (0.5 * one, 2.0 * one + 1.0) for name, one in known.items()}
    return measurement(system, given, False), Unknowns.of(system, bounds)


def _compared(model, bases, names, word, contacts) -> list[Column]:
    values, (_, slopes) = np.array(bases), model.with_derivatives(np.array(bases))
    answer = []
    for i, name in enumerate(names):
        moved, unit = shifts(values[i])
        rows = values + moved[:, None] * np.eye(len(values))[i]
        if len({contacts(row) for row in [values, *rows]}) > 1:
            answer.append(Column("other contacts", name, *np.empty((3, 0))))
            continue
        answer.append(Column.of(word, name, slopes[..., i], model.plain(rows), unit))
    return answer


def responses(that: Case, method: sl.Method) -> list[Column] | str:
    """Derivatives of sizes of the steady response of a case."""
    system = that.system()
    if system.forced_at is None:
        return "unforced"
    names = [n for n in that.to if not n.endswith("(0)") and n != system.forced_at]
    at = np.array([system.values[system.forced_at]] * 2)

    def contacts(row):
        own = system.with_values(**dict(zip(names, row, strict=True)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = sl.attractors(own, np.zeros(len(system.states)), method=method, periods=500)
        return str(found.attractor_itinerary.values[0]) if found.sizes["attractor"] else ""

    answer = []
    for size in SIZES:
        measured, unknowns = _asked(system, names, system.forced_at, at)
        model = SteadyResponses(system, method, measured, unknowns, size)
        bases = [system.values[name] for name in names]
        answer += _compared(model, bases, names, size, contacts)
    return answer


def histories(that: Case, method: sl.Method) -> list[Column] | str:
    """Derivatives of the motion of a case at times."""
    system = that.system()
    names = [*that.to, "t_start"]
    size = len(system.states)
    start = np.pad(np.array(that.start), (0, size - len(that.start)))
    at = np.linspace(0.21, 0.97, 4) * that.t_end
    measured, unknowns = _asked(system, names, "t", at)
    model = Motions(system, method, measured, unknowns, start, 0.0)
    known = dict(system.values) | {f"{s}(0)": x for s, x in zip(system.states, start, strict=True)}
    bases = [known.get(name, 0.03) for name in names]

    def contacts(row):
        values = dict(zip(names, row, strict=True))
        own = {n: v for n, v in values.items() if n in system.values}
        first = [values.get(f"{s}(0)", x) for s, x in zip(system.states, start, strict=True)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = sl.simulate(
                system.with_values(**own), first, t_start=values["t_start"],
                t_end=values["t_start"] + at[-1], method=method, samples=2,
            )  # fmt: skip
        if str(run.status.values) not in ("ok", "graze_unresolved"):
            raise ValueError(str(run.status.values))
        seen = np.searchsorted(run.contact_time.values, at + values["t_start"])
        return (*run.contact_guard.values, *run.contact_kind.values, *seen)

    return _compared(model, bases, names, "history", contacts)
