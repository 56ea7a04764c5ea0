"""The computations of this paper: which table of which study file, by which method, how large."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.attractors import attractors, attractors_dataset
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.basins.basins import map_of
from saltus.analysis.basins.pipeline import basin_plan
from saltus.analysis.branches.branches import branches
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion, same
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.lyapunov.lyapunov import lyapunov
from saltus.analysis.methods.compare_methods import compare_methods, methods_dataset
from saltus.analysis.methods.method_errors import one_period_errors
from saltus.analysis.motion.simulate import simulate
from saltus.analysis.motion.stroboscope import stroboscope
from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
from saltus.analysis.responses.frequency_response import frequency_response
from saltus.flow import ODE45, Taylor
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.replication import Job
from saltus.study.read import read
from saltus.study.setting.setting import method_of, system_of
from saltus.study.spec import Study
from saltus.system import System
from saltus.units import to_si

#: The paper's sections 4 (validation) and 5 (with and without event location).
TIGHT = ODE45(rtol=1e-12, atol=1e-12, events="locate")
ON, OFF = ODE45(rtol=1e-4, atol=1e-7, events="locate"), ODE45(rtol=1e-4, atol=1e-7, events="ignore")
#: Those of section 5, and ten thousand times tighter: whether location or the tolerances make the
#: error.
TIGHTER = (
    ODE45(rtol=1e-8, atol=1e-11, events="locate"),
    ODE45(rtol=1e-8, atol=1e-11, events="ignore"),
)
#: Three ways of integrating, by the ends of the names of their jobs.
ENDS = {"exact": Taylor(), "ode45 located": ON, "ode45 not located": OFF}
RESPONSES: dict[str, Callable[..., xr.Dataset]] = {
    "frequency_response": frequency_response,
    "bifurcation_diagram": bifurcation_diagram,
}

#: Starts along each axis of a basin map in a quick run; the full one takes those of the study file.
QUICK_CELLS = {"fig6": 72, "fig8": 56, "fig11": 48, "fig13": 28}
#: Starts from which attractors are looked for first: full, quick.
SCOUTS = 1024, 256
#: Periods run on each attractor, and kept, for its picture: ode45's own scatter shows in the last
#: of them.
FOLLOWED, KEPT = 320, 64
#: Periods that exponents are measured over: full, quick; and periods before them.
EXPONENTS, TRANSIENT = (2000, 320), 256
#: Half-width of the bunch of starts around each start of Fig. 5 [m]: less than an experiment can
#: set. Starts in it: full, quick.
NANOMETRE, BUNCH = 1e-9, (101, 21)
#: A quick run: values of a frequency response, by ode45 at the tight tolerances, of a bifurcation
#: diagram; every fourth start; periods.
QUICK_FREQUENCIES, QUICK_TIGHT, QUICK_STIFFNESSES, QUICK_EVERY, QUICK_PERIODS = 57, 8, 181, 4, 400
#: Stiffnesses about the jump, the grazing and the period doubling.
_LOW, _AROUND, _DOUBLING = ("10 kN/m", "40 kN/m"), ("12 kN/m", "32 kN/m"), ("7.5 kN/m", "9 kN/m")
_SYMMETRIC = {"lower_gap": "0.4 mm", "upper_gap": "0.4 mm"}
#: Starts from which branches are looked for, at that many values of the parameter: full, quick.
SEEDS, SEEDED_AT = ("random 24", "random 12"), (6, 4)
#: A basin smaller than this share of the starts is looked at on its own.
RARE = 0.01
#: Distance [in ranges of the axes] within which two orbits are one.
SAME = 1e-5


def jobs(folder: Path, quick: bool) -> list[Job]:
    """All jobs, each after those that it needs."""
    plan = _Plan(folder, quick)
    early = [
        *plan.fig2(),
        *plan.responses("fig3"),
        *plan.fig4(),
        *plan.fig5(),
        *plan.fig6(),
        *plan.fig7(),
        *plan.branches(),
    ]
    late = [
        ("fig8", "25.5 kN per m"),
        ("fig8", "23.2 kN per m"),
        ("fig11", "7694 N per m"),
        ("fig11", "8833 N per m"),
        ("fig13", "18.4 MN per m"),
    ]
    maps = [job for name in ("fig8", "fig11", "fig13") for job in plan.maps(name)]
    return [
        *early,
        *maps,
        *(job for of, setting in late for job in plan.on_attractors(of, setting)),
        *plan.rare(),
    ]


class _Plan:
    """Makes the jobs of each figure."""

    def __init__(self, folder: Path, quick: bool):
        self.folder, self.quick = folder, quick

    def _study(self, name: str) -> tuple[Study, System, dict[str, Any]]:
        """A study file, its system, and what its tables say."""
        study = read(self.folder / f"{name}.toml")[0]
        return study, system_of(study.system), study.model_dump(mode="json", exclude_unset=True)

    def _simulated(
        self, name: str, own: Method, file: str = ""
    ) -> tuple[System, dict[str, Any], list[Job]]:
        """The motions of [simulate], exact and by ode45."""
        _, system, text = self._study(file or name)
        asked = {**text["simulate"], "time_errors": "local"}
        return (
            system,
            asked,
            [
                Job(f"{name}/{end}", simulate, system, way, asked)
                for end, way in (("ode45", own), ("exact", Taylor()))
            ],
        )

    def fig2(self) -> list[Job]:
        """Table 2's run, by ode45 as the paper has it and exactly."""
        return self._simulated("fig2", ON, "table2")[2]

    def fig4(self) -> list[Job]:
        """Three responses, and where the one at 16 Hz leads when the frequency steps to 17 Hz."""
        system, _, made = self._simulated("fig4", TIGHT)
        return [
            *made,
            Job(
                "fig4/step",
                settled_from_motion,
                system.with_values(frequency="17 Hz"),
                Taylor(),
                {},
                ("fig4/exact",),
            ),
        ]

    def fig5(self) -> list[Job]:
        """Four starts, their neighbours, and the orbit that the longest response doubled from."""
        system, asked, made = self._simulated("fig5", TIGHT)
        around = {
            "distance": NANOMETRE,
            "count": BUNCH[self.quick],
            "keep": 97,
            "start": asked["start"],
            "periods": asked["periods"],
        }
        return [
            *made,
            Job("fig5/attractors", attractors, system, Taylor(), {"start": asked["start"]}),
            Job("fig5/halved", halved, system, Taylor(), {}, ("fig5/attractors",)),
            Job("fig5/beside", beside, system, Taylor(), around),
        ]

    def fig7(self) -> list[Job]:
        """Responses and diagrams in three ways, these side by side, and along the diagrams the
        error of one period at tighter tolerances.
        """
        made = self.responses("fig7")
        for panel in "abcdef":
            three = [job for job in made if job.name.startswith(f"fig7/{panel}, ")]
            first, needs = three[0], tuple(job.name for job in three)
            made.append(
                Job(
                    f"fig7/{panel}, compared",
                    compared,
                    first.system,
                    Taylor(),
                    {"analysis": first.compute.__name__, **first.arguments},
                    needs,
                )
            )
            if panel in "def":
                made.append(
                    Job(f"fig7/{panel}, tighter", tighter, first.system, Taylor(), {}, needs[:1])
                )
        return made

    def responses(self, name: str) -> list[Job]:
        """A job for each [[frequency_response]] and [[bifurcation_diagram]] of a study file."""
        study, system, text = self._study(name)
        made = []
        for kind, verb in RESPONSES.items():
            for table, asked in zip(getattr(study, kind), text.get(kind, []), strict=True):
                method = method_of(table.method or study.method, system)
                arguments = {
                    key: asked[key] for key in ("start", "periods", "sample") if key in asked
                }
                ranges = (
                    {"frequency": asked["frequency"]} if "frequency" in asked else asked["vary"]
                )
                counts = (
                    QUICK_STIFFNESSES
                    if "vary" in asked
                    else QUICK_TIGHT
                    if method == TIGHT
                    else QUICK_FREQUENCIES
                )
                axes = {
                    key: _range(one, counts if self.quick else one["count"])
                    for key, one in ranges.items()
                }
                if self.quick:
                    arguments["periods"] = QUICK_PERIODS
                    arguments["start"] = {
                        key: one[::QUICK_EVERY] if isinstance(one, list) else one
                        for key, one in asked["start"].items()
                    }
                arguments |= axes if "frequency" in asked else {"vary": axes}
                made.append(
                    Job(
                        f"{name}/{table.name}",
                        verb,
                        system.with_values(**asked.get("values", {})),
                        method,
                        arguments,
                    )
                )
        return made

    def branches(self) -> list[Job]:
        """Stable and unstable orbits over what the paper varies, where it speaks of an isolated
        branch, a jump, a grazing and a period doubling.
        """
        wide = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
        return [
            Job(
                f"{figure}, branches",
                branches,
                self._study(study)[1].with_values(force="4 N", **values),
                Taylor(),
                {
                    "vary": {name: limits}, "start": SEEDS[self.quick], "box": wide,
                    "at": SEEDED_AT[self.quick], "longest": longest,
                },
            )
            for figure, study, values, name, limits, longest in (
                ("fig3/a4", "fig3", _SYMMETRIC, "frequency", ("13 Hz", "30 Hz"), 1),
                ("fig7/f", "fig8", {"frequency": "23 Hz"}, "contact_stiffness", _LOW, 1),
                ("fig8/5 Hz", "fig8", {}, "contact_stiffness", _AROUND, 1),
                ("fig11/17 Hz", "fig11", {}, "contact_stiffness", _DOUBLING, 2),
            )
        ]  # fmt: skip

    def maps(self, name: str) -> list[Job]:
        """A job for each basin map of a study file."""
        study, system, text = self._study(name)
        basins: Any = dict(study.questions())["basins"]
        count = QUICK_CELLS[name] if self.quick else None
        arguments: dict[str, Any] = {
            "axes": {
                state: _range(axis, count or axis["count"])
                for state, axis in text["basins"]["axes"].items()
            }
        }
        arguments["scouts"] = SCOUTS[self.quick]
        return [
            Job(
                f"{name}/{one.name}",
                basin_map,
                system.with_values(**one.values),
                method_of(one.method or study.method, system),
                arguments,
            )
            for one in basins.map
        ]

    def fig6(self) -> list[Job]:
        """Basins at the four frequencies, and at the one that the text names in place
        of the last.
        """
        made = self.maps("fig6")
        last = next(job for job in made if job.name == "fig6/16 Hz, exact")
        return [
            *made,
            replace(
                last,
                name="fig6/16.5 Hz, exact",
                system=last.system.with_values(frequency="16.5 Hz"),
            ),
        ]

    def on_attractors(self, name: str, setting: str) -> list[Job]:
        """A motion on each attractor of three maps (exact, ode45 located, not located), and its
        exponents by two algorithms.
        """
        system, made = (
            self._study(name)[1].with_values(contact_stiffness=setting.replace(" per ", "/")),
            [],
        )
        for end, method in ENDS.items():
            of = f"{name}/{setting}, {end}"
            made.append(
                Job(
                    f"{of}, motions",
                    motions,
                    system,
                    method,
                    {"periods": FOLLOWED, "keep": KEPT},
                    (of,),
                )
            )
            length = {"periods": EXPONENTS[self.quick], "transient": TRANSIENT}
            made += [
                Job(f"{of}, {by}", exponents, system, method, {"by": by, **length}, (of,))
                for by in ("variational", "wolf")
            ]
        return made

    def rare(self) -> list[Job]:
        """Where the starts in and around the rarest basin after the grazing lead, by
        each method.
        """
        system = self._study("fig8")[1].with_values(contact_stiffness="23.2 kN/m")
        ways = zip(("exact", "on", "off"), ENDS.values(), strict=True)
        return [
            Job(
                f"fig8/rare, {name}",
                settled_from_rare,
                system,
                way,
                {"rarer_than": RARE},
                ("fig8/23.2 kN per m, exact",),
            )
            for name, way in ways
        ]


def _range(given: Mapping[str, Any], count: int) -> tuple[Any, ...]:
    """A range of a study file as the analyses take it."""
    return given["first"], given["last"], count, *(("log",) if given.get("scale") == "log" else ())


# -- what no analysis of saltus does by itself -----------------------------------------------------
def basin_map(
    system: System,
    *,
    axes: Mapping[str, Any],
    scouts: int,
    method: Method,
    threads: int | None,
    progress: Any,
) -> xr.Dataset:
    """A basin map whose attractors are first looked for from some number of starts."""
    return map_of(
        replace(basin_plan(system, axes, None, method, 2000, None), scouts=scouts),
        threads,
        progress,
    )


def beside(
    system: System, *, start: Mapping[str, Any], distance: float, count: int, **how: Any
) -> xr.Dataset:
    """The stroboscopes of starts spread evenly over some distance to either side of each start."""
    (first, texts), (second, rest) = start.items()
    x = np.array([to_si(text, system.units[first], first) for text in texts])
    v = np.full(len(x) * count, to_si(rest, system.units[second], second))
    return stroboscope(
        system,
        {first: (x[:, None] + distance * np.linspace(-1.0, 1.0, count)).ravel(), second: v},
        **how,
    )


def _starts(system: System, found: xr.Dataset) -> dict[str, np.ndarray]:
    """A state on each attractor of a map."""
    return {name: found[f"attractor_{name}"].values[:, 0] for name in system.states}


def motions(system: System, found: xr.Dataset, **how: Any) -> xr.Dataset:
    """A motion on each attractor of a map: trajectory i starts on attractor i."""
    return simulate(system, _starts(system, found), time_errors="local", **how)


def exponents(
    system: System, found: xr.Dataset, *, by: str, method: Method, **how: Any
) -> xr.Dataset:
    """Lyapunov exponents on each attractor of a map: trajectory i starts on attractor i."""
    return lyapunov(system, _starts(system, found), method=by, flow=method, **how)


def settled_from_motion(system: System, run: xr.Dataset, **how: Any) -> xr.Dataset:
    """The attractors that the states along the last period of the first motion lead to."""
    one = run.isel(trajectory=0)
    last = one.isel({one[system.states[0]].dims[0]: slice(-201, -1)})
    return attractors(system, {name: last[name].values for name in system.states}, **how)


def settled_from_rare(
    system: System, found: xr.Dataset, *, rarer_than: float, **how: Any
) -> xr.Dataset:
    """The attractors that the cells of a map's rarest basins, and the cells around
    them, lead to.
    """
    cells = np.isin(
        found["basin"].values, np.flatnonzero(found["attractor_fraction"].values < rarer_than)
    )
    near = np.zeros_like(cells)
    for i, j in np.argwhere(cells):
        near[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = True
    places = np.nonzero(near) if near.any() else (np.array([0]), np.array([0]))
    axes = [str(name) for name in found["basin"].dims]
    return attractors(
        system, {name: found[name].values[at] for name, at in zip(axes, places, strict=True)}, **how
    )


def halved(
    system: System, found: xr.Dataset, *, method: Method, threads: int | None, **_: Any
) -> xr.Dataset:
    """Each attractor of even period with the orbit of half its period that lies within it: what it
    doubled from.
    """
    map_ = Stroboscope(system, method, threads=threads)
    points = np.stack([found[f"attractor_{name}"].values for name in system.states], axis=-1)
    scale = np.nanmax(points, axis=(0, 1)) - np.nanmin(points, axis=(0, 1))
    near: list[tuple[np.ndarray, int]] = []
    for i, n in enumerate(found["attractor_period"].values.tolist()):
        if n >= 2 and n % 2 == 0:
            near += [(points[i, 0], n), (0.5 * (points[i, 0] + points[i, n // 2]), n // 2)]
    start, period = (
        np.array([one for one, _ in near]).reshape(-1, len(scale)),
        np.array([n for _, n in near], np.int64),
    )
    closed = find_orbits(
        map_, start, period, np.broadcast_to(scale, start.shape), np.full(len(near), map_.noise)
    )
    orbits: list[ClosedMotion] = []
    for orbit in closed.rows(closed.period > 0):
        if not any(same(orbit, one, scale, SAME) and orbit.period == one.period for one in orbits):
            orbits.append(orbit)
    table = portraits(map_, AttractorSet(Neighbourhoods.none(len(system.states)), orbits))
    return attractors_dataset(
        subject(system, provenance(system, map_.method, system.values)), table
    )


def compared(
    system: System, *three: xr.Dataset, analysis: str, method: Method, **how: Any
) -> xr.Dataset:
    """Both of the paper's ways of integrating beside the exact one, from the three Datasets that
    exist already.
    """
    known = {one.label: ds for one, ds in zip((method, ON, OFF), three, strict=True)}
    return compare_methods(system, analysis, (ON, OFF), computed=known, **how)


def tighter(
    system: System, exact: xr.Dataset, *, method: Method, threads: int | None, **_: Any
) -> xr.Dataset:
    """The error of one forcing period at tighter tolerances, begun on the exact responses."""
    errors = [one_period_errors(system, method, way, exact, threads=threads) for way in TIGHTER]
    no_long_runs = np.full((len(TIGHTER), *exact["response_of"].shape), -1, np.int8)
    return methods_dataset(
        base=exact, labels=[way.label for way in TIGHTER], columns={},
        fields={"agrees": no_long_runs,
            **{name: np.stack([error[name] for error in errors]) for name in errors[0]}},
        attrs=provenance(system, TIGHTER[0], system.values) | {"analysis": "bifurcation_diagram"},
    )  # fmt: skip
