"""The jobs of this paper: which study file, which part of it, how large."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from saltus.replication.job import Job
from saltus.replication.saunders2021 import compute, compute_responses
from saltus.study.tables.read import read
from saltus.study.tables.spec import Study

TAYLOR = {"name": "Taylor"}
#: The paper's sections 4 (validation) and 5 (with and without event location).
TIGHT = {"name": "ODE45", "rtol": 1e-12, "atol": 1e-12, "events": "locate"}
#: Those of section 5, and ten thousand times tighter: whether location or the tolerances make the error.
ON = {"name": "ODE45", "rtol": 1e-4, "atol": 1e-7, "events": "locate"}
OFF = {"name": "ODE45", "rtol": 1e-4, "atol": 1e-7, "events": "ignore"}
TIGHTER = [{**table, "rtol": 1e-8, "atol": 1e-11} for table in (ON, OFF)]

#: Starts along each axis of a basin map in a quick run; the full one takes those of the study file.
QUICK_CELLS = {"fig6": 72, "fig8": 56, "fig11": 48, "fig13": 28}
#: Starts from which attractors are looked for first: full, quick.
SCOUTS = 1024, 256
#: Periods run on each attractor, and kept, for its picture: ode45's own scatter shows in the last of them.
FOLLOWED, KEPT = 320, 64
#: Periods that exponents are measured over: full, quick; and periods before them.
EXPONENTS, TRANSIENT = (2000, 320), 256
#: Half-width of the bunch of starts around each start of Fig. 5 [m]: less than an experiment can set. Starts in it: full, quick.
NANOMETRE, BUNCH = 1e-9, (101, 21)
#: Values of a frequency response and of a bifurcation diagram in a quick run, starts taken of those in the study file (every so manieth),
#: periods that a start is followed at most; the full run has those of the study file.
QUICK_FREQUENCIES, QUICK_STIFFNESSES, QUICK_EVERY, QUICK_PERIODS = 57, 181, 4, 400
#: Frequencies in a quick run for ode45 at the tight tolerances, which is slow.
QUICK_TIGHT = 8
#: A basin smaller than this share of the starts is looked at on its own.
RARE = 0.01


def jobs(folder: Path, quick: bool) -> list[Job]:
    """All jobs, each after those that it needs."""
    plan = _Plan(folder, quick)
    early = [*plan.fig2(), *plan.fig3(), *plan.fig4(), *plan.fig5(), *plan.fig6()]
    return [*early, *plan.fig7(), *plan.fig8(), *plan.fig11(), *plan.fig13()]


def map_name(figure: str, name: str) -> str:
    """Name of the job of one map of a study file."""
    return f"{figure}/{name}"


class _Plan:
    """Makes the jobs of each figure."""

    def __init__(self, folder: Path, quick: bool):
        self.folder, self.quick = folder, quick

    def _study(self, name: str) -> Study:
        return read(self.folder / f"{name}.toml")[0]

    def _job(self, name: str, what: Callable[..., Any], study: Study, *needs: str, **settings: Any) -> Job:
        """A job on a study; its name and comments don't count."""
        table = study.model_dump(mode="json", exclude={"study", "method", "compare"}, exclude_unset=True)
        return Job(name, {"study": table, **settings}, what, needs)

    def fig2(self) -> list[Job]:
        """Table 2's run, by ode45 as the paper has it and exactly."""
        study = self._study("table2")
        return [
            self._job("fig2/ode45", compute.simulated, study, method=ON),
            self._job("fig2/exact", compute.simulated, study, method=TAYLOR),
        ]

    def fig4(self) -> list[Job]:
        """Three responses, and where the one at 16 Hz leads when the frequency steps to 17 Hz."""
        study = self._study("fig4")
        at17 = {"frequency": "17 Hz"}
        return [
            self._job("fig4/exact", compute.simulated, study, method=TAYLOR),
            self._job("fig4/ode45", compute.simulated, study, method=TIGHT),
            self._job("fig4/step", compute.settled_from_motion, study, "fig4/exact", method=TAYLOR, values=at17),
        ]

    def fig5(self) -> list[Job]:
        """Four starts, their neighbours, and the orbit that the longest response doubled from."""
        study = self._study("fig5")
        count = BUNCH[self.quick]
        return [
            self._job("fig5/exact", compute.simulated, study, method=TAYLOR),
            self._job("fig5/ode45", compute.simulated, study, method=TIGHT),
            self._job("fig5/attractors", compute.settled_from, study, method=TAYLOR),
            self._job("fig5/halved", compute.halved, study, "fig5/attractors", method=TAYLOR),
            self._job("fig5/beside", compute.beside, study, method=TAYLOR, distance=NANOMETRE, count=count, keep=97),
        ]

    def fig3(self) -> list[Job]:
        """Six frequency responses, exact and, at fewer frequencies, by ode45."""
        return self._responses("fig3")

    def fig7(self) -> list[Job]:
        """Three frequency responses and three bifurcation diagrams, each in three ways, and these ways side by side.

        Along the diagrams also the error of one period at tighter tolerances.
        """
        made = self._responses("fig7")
        for panel in "abcdef":
            three = [job for job in made if job.name.startswith(f"fig7/{panel}, ")]
            settings = {**{key: value for key, value in three[0].settings.items() if key != "method"}, "methods": [ON, OFF]}
            made.append(Job(f"fig7/{panel}, compared", settings, compute_responses.compared, tuple(job.name for job in three)))
            if panel in "def":
                tighter = {**settings, "methods": TIGHTER}
                made.append(Job(f"fig7/{panel}, tighter", tighter, compute_responses.period_errors, (f"fig7/{panel}, exact",)))
        return made

    def _responses(self, name: str) -> list[Job]:
        """A job for each [[frequency_response]] and [[bifurcation_diagram]] of a study file."""
        text = self._study(name).model_dump(mode="json", exclude_unset=True)
        made = []
        for question in ("frequency_response", "bifurcation_diagram"):
            for table in text.get(question, []):
                asked = {key: value for key, value in table.items() if key not in ("name", "method", "measured")}
                settings = {
                    "question": question, "system": text["system"], "method": table.get("method", TAYLOR),
                    "table": self._smaller(asked, question, table.get("method", TAYLOR) == TIGHT) if self.quick else asked,
                }  # fmt: skip
                made.append(Job(f"{name}/{table['name']}", settings, compute_responses.responses))
        return made

    def _smaller(self, table: dict[str, Any], question: str, tight: bool) -> dict[str, Any]:
        """A table of a quick run."""
        if question == "bifurcation_diagram":
            vary = {name: {**given, "count": QUICK_STIFFNESSES} for name, given in table["vary"].items()}
            return {**table, "vary": vary, "periods": QUICK_PERIODS}
        start = {name: value[::QUICK_EVERY] if isinstance(value, list) else value for name, value in table["start"].items()}
        frequency = {**table["frequency"], "count": QUICK_TIGHT if tight else QUICK_FREQUENCIES}
        return {**table, "frequency": frequency, "start": start, "periods": QUICK_PERIODS}

    def maps(self, name: str) -> list[Job]:
        """A job for each basin map of a study file."""
        study = self._study(name)
        table = study.model_dump(mode="json", exclude={"study", "compare"}, exclude_unset=True)
        basins = table["basins"]
        made = []
        for one in basins["map"]:
            axes = {state: {**axis, "count": QUICK_CELLS[name] if self.quick else axis["count"]} for state, axis in basins["axes"].items()}
            alone = {**table, "basins": {**basins, "axes": axes, "map": [{key: one[key] for key in one if key != "compare"}]}}
            made.append(Job(map_name(name, one["name"]), {"study": alone, "scouts": SCOUTS[self.quick]}, compute.mapped))
        return made

    def fig6(self) -> list[Job]:
        """Basins at the four frequencies, and at the one that the text names in place of the last."""
        made = self.maps("fig6")
        last = next(job for job in made if job.name == "fig6/16 Hz, exact")
        study = dict(last.settings["study"])
        (one,) = study["basins"]["map"]
        study["basins"] = {**study["basins"], "map": [{**one, "name": "16.5 Hz, exact", "values": {"frequency": "16.5 Hz"}}]}
        return [*made, Job("fig6/16.5 Hz, exact", {**last.settings, "study": study}, compute.mapped)]

    def _motions(self, name: str, prefix: str, values: dict[str, str]) -> list[Job]:
        """A motion on each attractor of three maps (exact, ode45 located, not located), and its exponents by two algorithms."""
        study, made = self._study(name), []
        for end, method in {"exact": TAYLOR, "ode45 located": ON, "ode45 not located": OFF}.items():
            of = map_name(name, f"{prefix}, {end}")
            way = {"method": method, "values": values}
            made.append(self._job(f"{of}, motions", compute.on_attractors, study, of, **way, periods=FOLLOWED, keep=KEPT))
            for by in ("variational", "wolf"):
                length = {"periods": EXPONENTS[self.quick], "transient": TRANSIENT}
                made.append(self._job(f"{of}, {by}", compute.exponents_on_attractors, study, of, **way, by=by, **length))
        return made

    def fig8(self) -> list[Job]:
        """Basins around the grazing, motions on their attractors (Figs. 9, 10), and the rare attractor by each method."""
        study = self._study("fig8")
        made = self.maps("fig8")
        for name, value in (("25.5 kN per m", "25.5 kN/m"), ("23.2 kN per m", "23.2 kN/m")):
            made += self._motions("fig8", name, {"contact_stiffness": value})
        for end, method in (("exact", TAYLOR), ("on", ON), ("off", OFF)):
            rare = {"method": method, "values": {"contact_stiffness": "23.2 kN/m"}, "rarer_than": RARE}
            made.append(self._job(f"fig8/rare, {end}", compute.settled_from_rare, study, map_name("fig8", "23.2 kN per m, exact"), **rare))
        return made

    def fig11(self) -> list[Job]:
        """Basins around the period doubling and motions on their attractors (Fig. 12)."""
        made = self.maps("fig11")
        for name, value in (("7694 N per m", "7694 N/m"), ("8833 N per m", "8833 N/m")):
            made += self._motions("fig11", name, {"contact_stiffness": value})
        return made

    def fig13(self) -> list[Job]:
        """Basins at stiff contact and motions on their attractors (Fig. 14)."""
        return [*self.maps("fig13"), *self._motions("fig13", "18.4 MN per m", {"contact_stiffness": "18.4 MN/m"})]
