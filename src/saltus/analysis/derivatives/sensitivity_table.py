"""From a run of the flow that carries derivatives to the Dataset of `sensitivity`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from saltus.analysis import dataset_parts
from saltus.analysis.derivatives.carried import HELD, Places
from saltus.analysis.derivatives.closed_orbits import ClosedOrbits
from saltus.analysis.derivatives.columns import Columns, Turning
from saltus.analysis.derivatives.readings import Readings, slope_of
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.spans import Span
from saltus.analysis.motion.sample_times import SampleTimes
from saltus.flow import engine
from saltus.flow.contact_table import ContactTable
from saltus.flow.methods import Method
from saltus.flow.request import Outcome, Request
from saltus.language.evaluate import evaluate
from saltus.language.expression import TIME, parameter, state
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import jumps_by_time

Show = Callable[[float], None]

#: Variables of trajectories and contacts, in the order of the result.
_ROWS = [name for name in schema.KINDS[schema.SENSITIVITY].variables if name != "time"]
#: Counters that are kept.
COUNTED = ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")
#: Relative difference of the derivatives of an instant by two gaps that is rounding.
ALIKE = 1e-6
#: Kinds of contacts at which states jump.
JUMPS = ("impact",)
#: Rate of a gap at a contact, in the largest at its contacts, below which the contact's time isn't
#: that of a zero of the gap: the motion rests there, or goes along the boundary.
LEAVES = 1e-9
#: Distance of a gap from its zero just before a contact, in the time of the run at its rate, that
#: is rounding: beyond it something else has carried the motion over the boundary.
NEAR = 1e-7


@dataclass(frozen=True, kw_only=True)
class SensitivityRun(Readings):
    """A run of the flow that carries derivatives."""

    method: Method
    length: Span
    plan: SampleTimes
    turning: Turning
    asked: Columns
    closed: ClosedOrbits | None

    def rows(self, which: slice) -> SensitivityRun:
        """Some of the trajectories, which aren't orbits, with the samples of all."""
        return replace(self, group=self.group.rows(which), length=self.length.rows(which))

    @property
    def request(self) -> Request:
        """The request to the engine."""
        return self.flow.request(self.group, self.length, self.plan)

    def fly(self, request: Request, threads: int | None, show: Show | None = None) -> Outcome:
        """The outcome of a request of the flow."""
        method = self.method.suited_to(len(request.start))
        return engine.run(self.flow.flown, method, request, threads, show)

    def chosen(self, slopes: np.ndarray, who: np.ndarray) -> np.ndarray:
        """The derivatives that were asked for, float64[m, ..., to], of all columns float64[m, ...,
        C] at places of trajectories int64[m].
        """
        if self.closed is None:
            return slopes[..., self.asked.places]
        weights = self.closed.weights[who]
        return np.asarray(np.einsum("m...c,mct->m...t", slopes, weights))

    def contact_times(self, at: Places, table: ContactTable) -> np.ndarray:
        """Derivatives of the times of contacts, float64[m, C], from the places just before them.

        The gap of each stays zero. One whose gap isn't zero there, or stays zero, comes with what
        else happens at its instant: the first jump of the state, or all that tell the same. Where
        nothing else does and the gap isn't zero, a drive in it jumps, whose phase stays.
        """
        moved, jumped = self._gap_times(at, table)
        known, first = np.isfinite(moved).all(axis=1), np.isin(table.kind_name, JUMPS)
        began = np.ones(len(moved), bool)
        began[1:] = (np.diff(at.time) != 0) | (np.diff(at.trajectory) != 0)
        instant = np.cumsum(began) - 1
        # the first row of each instant that tells something, jumps before all others
        order = np.lexsort((np.arange(len(moved)), ~first, ~known, instant))
        leader = order[np.flatnonzero(began)][instant]
        same = np.isclose(moved, moved[leader], rtol=ALIKE, atol=0.0).all(axis=1)
        split = np.bincount(instant, known & ~same, len(moved))[instant] > 0
        caused = ~known & (first[leader] | ~split)
        moved[caused] = moved[leader[caused]]
        steps = np.array([jumps_by_time(one.gap) for one in self.turning.system.guards], bool)
        driven = jumped & ~known[leader] & ~first[leader] & steps[table.guard]
        moved[driven] = self._phase_times(at)[driven]
        return moved

    def _phase_times(self, at: Places) -> np.ndarray:
        """Derivatives of times whose phase of the forcing stays, float64[m, C]."""
        moved, where = np.zeros((len(at.time), at.slopes.shape[2])), self.system.forced_at
        if where in self.flow.names:
            frequency = self.flow.parameters(self.group, at.trajectory)[where]
            column = len(self.system.states) + self.flow.names.index(where)
            moved[:, column] = -at.time / frequency
        return moved

    def _gap_times(self, at: Places, table: ContactTable) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the times at which the gaps of contacts are zero, float64[m, C], from
        places just before; NaN where a gap isn't zero there, or stays zero. And whether it isn't
        zero, bool[m].
        """
        jumped = np.zeros(len(at.time), bool)
        moved = np.full((len(at.time), at.slopes.shape[2]), np.nan)
        rates, system = self.flow.rates(at, self.group), self.turning.system
        size, whose = len(system.states), at.trajectory
        near = NEAR * self._largest(at.time, whose)
        met = np.arange(len(system.guards))  # where a contact begins to be held
        for number, one in enumerate(system.guards):
            if one.law is not None and one.law.kind == "hold":
                met[number] = one.law.partner
        guard = np.where(np.isin(table.kind_name, HELD), met[table.guard], table.guard)
        leaves = [*map(state, system.states), *map(parameter, self.flow.names), TIME]
        for number in np.unique(guard):
            here, gap = guard == number, system.guards[number].gap
            found = evaluate(
                [gap, *(slope_of(gap, leaf) for leaf in leaves)],
                t=at.time[here],
                states=dict(zip(system.states, at.states[here].T, strict=True)),
                values=self.flow.parameters(self.group, at.trajectory[here]),
                bits=[(at.mode[here] >> i) & 1 == 1 for i in range(len(system.guards))],
            )
            here = np.flatnonzero(here)
            value, *slopes = (np.broadcast_to(one, here.shape) for one in found)
            by_state, by_name = np.array(slopes[:size]), np.array(slopes[size:-1])
            change = np.einsum("im,mic->mc", by_state, at.slopes[here])
            change[:, size:] += by_name.T.reshape(len(here), -1)
            rate = np.einsum("im,mi->m", by_state, rates[here]) + slopes[-1]
            met_it = np.abs(rate) > LEAVES * self._largest(rate, whose[here])
            jumped[here] = np.abs(value) > near[here] * np.abs(rate)
            met_it &= ~jumped[here]
            moved[here[met_it]] = -change[met_it] / rate[met_it, None]
        return moved, jumped

    def _largest(self, column: np.ndarray, whose: np.ndarray) -> np.ndarray:
        """The largest magnitude in float64[m] of the same trajectory, float64[m]."""
        largest = np.zeros(self.group.size)
        np.maximum.at(largest, whose, np.abs(column))
        return np.asarray(largest[whose])


def sensitivity_rows(run: SensitivityRun, outcome: Outcome) -> dict[str, np.ndarray]:
    """The numbers of each trajectory and each contact: arrays with these first."""
    system, group, length, turning = run.system, run.group, run.length, run.turning
    n, forced = group.size, system.forced_at is not None
    unit = length.period if run.flow.timed else np.ones(n)
    time, _ = run.plan.of_result(outcome, length, forced)
    kept = run.plan.reached(outcome)
    count = time.shape[-1]
    own = np.broadcast_to(time, (n, count))
    at = run.flow.samples(outcome, group, length, own, kept)
    value = run.values(at).reshape(n, count, -1)
    slope = run.chosen(run.slopes(at), at.trajectory).reshape(*value.shape, len(run.asked.names))
    table = outcome.contacts
    early, touch = run.flow.contacts(outcome, group, length, lambda one: run.fly(one, 1))
    speed = table.velocity / unit[table.trajectory]
    moved = run.contact_times(early, table)
    mine = np.flatnonzero(table.guard < len(system.guards))
    names = np.array([guard.name for guard in system.guards] or [""], dtype=np.str_)
    end = run.flow.ends(outcome, group, length)
    return {
        "time": own,
        "value": value,
        "derivative": slope,
        "contact_time": touch.time[mine],
        "contact_time_derivative": run.chosen(moved, touch.trajectory)[mine],
        "contact_guard": names[table.guard[mine]],
        "contact_kind": table.kind_name[mine],
        "contact_velocity": speed[mine],
        "contact_trajectory": table.trajectory[mine],
        **(_extremes(run, outcome, touch, early, moved, at, end) if turning.known else {}),
        "end_derivative": run.chosen(run.slopes(end), end.trajectory),
        **(_of_orbits(run.closed, end) if run.closed is not None else {}),
        **dataset_parts.endings(outcome, COUNTED),
        "end_time": end.time,
        "end_<state>": run.values(end),
    }


def sensitivity_dataset(run: SensitivityRun, rows: Mapping[str, np.ndarray]) -> xr.Dataset:
    """The Dataset of what :func:`sensitivity_rows` gives for all trajectories."""
    system, group, length, asked = run.system, run.group, run.length, run.asked
    forced, outputs = system.forced_at is not None, outputs_of(system)
    own = forced and bool(np.ptp(length.period) > 0)
    subject = dataset_parts.trajectories(
        system,
        run.method,
        group,
        (length.period if own else float(length.period[0])) if forced else None,
    )
    return build(
        schema.SENSITIVITY,
        subject,
        {
            "trajectory": np.arange(group.size),
            "time": rows["time"] if own and run.plan.given is None else rows["time"][0],
            "to": list(asked.names),
            "to_units": asked.units(system),
            "to_value": asked.values(system, group),
            "output": list(outputs.names),
            "output_units": list(outputs.units),
            **{name: rows[name] for name in _ROWS if name in rows},
        },
        words={"<slope>": "", "<to>": ""},
    )


def _of_orbits(closed: ClosedOrbits, end: Places) -> dict[str, np.ndarray]:
    """The variables that only periodic orbits have."""
    own, slope = closed.multipliers, closed.multiplier_slope
    return {
        "period": end.time,
        "period_derivative": closed.period_slope,
        "multiplier_real": own.real,
        "multiplier_imag": own.imag,
        "multiplier_real_derivative": slope.real,
        "multiplier_imag_derivative": slope.imag,
    }


def _extremes(
    run: SensitivityRun,
    outcome: Outcome,
    touch: Places,
    early: Places,
    moved: np.ndarray,
    samples: Places,
    end: Places,
) -> dict[str, np.ndarray]:
    """The largest and smallest values of each output, when, and their derivatives: where it turns,
    at a contact, just before it, at the first sample that is kept or at the end.
    """
    n, ahead = run.group.size, outcome.contacts.mode_before
    guard = outcome.contacts.guard
    first = _rows(samples, np.searchsorted(samples.trajectory, np.arange(n)))
    turns = np.isin(guard, list(run.turning.of))
    still = np.where(turns[:, None] & np.isnan(moved), 0.0, moved)
    # what an impact changes has one more value, just before it
    parts = [(touch, still, None), (early, still, ahead), (first, None, None)]
    if run.closed is None:  # an orbit ends where it begins, whose own slope is known
        parts.append((end, None, None))
    value = np.concatenate([run.values(at, mode) for at, _, mode in parts])
    slope = np.concatenate([run.slopes(*part) for part in parts])
    time = np.concatenate([at.time for at, _, _ in parts])
    who = np.concatenate([at.trajectory for at, _, _ in parts])
    slope = run.chosen(slope, who)
    of = np.full(len(time), -1)
    of[: 2 * len(guard)] = np.tile([run.turning.of.get(int(one), -1) for one in guard], 2)
    width = value.shape[1]
    found = {
        f"{word}{part}": np.full((n, width, *more), np.nan)
        for word in ("maximum", "minimum")
        for part, more in (("", ()), ("_time", ()), ("_derivative", slope.shape[2:]))
    }
    for i in range(n):
        mine = np.flatnonzero(who == i)
        for k in run.turning.known:
            here = mine[(of[mine] == k) | (of[mine] < 0)]
            here = here[np.isfinite(value[here, k])]
            if not len(here):
                continue
            for word, choose in (("maximum", np.argmax), ("minimum", np.argmin)):
                place = here[choose(value[here, k])]
                found[word][i, k] = value[place, k]
                found[f"{word}_time"][i, k] = time[place]
                found[f"{word}_derivative"][i, k] = slope[place, k]
    return found


def _rows(at: Places, which: np.ndarray) -> Places:
    return Places(
        at.time[which], at.states[which], at.slopes[which], at.mode[which], at.trajectory[which]
    )
