"""[stroboscope], [settled], [poincare], [spectrum], [impacts] and [energy]: analyses of motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from saltus.errors import StudyError, nearest, shown
from saltus.study.answers.question import OneVerb, asked, first_figure
from saltus.study.code import code_hash
from saltus.study.setting import quantities
from saltus.study.tables.kinds import KINDS, whole
from saltus.study.tables.signature import Asked, OfLength, WrittenAs, table, verb
from saltus.system.read_off import quantity

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting

#: The key of a surface that is a formula.
FORMULA = "formula"
#: Parts that every energy balance needs.
_PARTS = ("energy", "supplied", "dissipated")
#: Parts that an energy balance may have.
_OPTIONAL = ("friction",)


_BASE: Any = (OfLength, Asked)
_STATES = Field(
    None, min_length=1, description="Which states and outputs; all by default.", examples=[["x"]]
)
_LEFT_OUT = ("state", "at", "until", "keep", "time_errors", "surface", "direction")


class OfMotions(OneVerb):
    """Question on motions from given starts, of given length after a transient."""

    #: True if its picture draws some trajectories of a batch.
    several: ClassVar[bool] = False

    def check_first(self, table: Any) -> None:
        """Check that lengths are forcing periods if there is forcing, else times."""
        forced = self.system.forced_at is not None
        if forced != (table.periods is not None):
            right = (
                "periods = 200 in place of t_end"
                if forced
                else ('t_end = "20 s" in place of periods')
            )
            raise StudyError(
                f"[{self.place}] {self.system.name} is "
                f"{'forced' if forced else 'not forced'}. Write {right}."
            )

    def check(self, table: Any, setting: Setting) -> None:
        """Check start, length and values, then the keys that only this question has."""
        from saltus.analysis.motion.window import stretch

        stretch(
            self.system,
            **{
                name: self.arguments[name]
                for name in ("start", "values", "periods", "t_end", "t_start", "transient")
            },
        )
        self.check_more(table, setting)

    def check_more(self, table: Any, setting: Setting) -> None:
        """Read and check the keys that only this question has."""

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The usual picture of such a result; of a large batch the first trajectories."""
        from saltus import plot
        from saltus.plot.choice import default_kind
        from saltus.plot.selection import MOST

        some = (
            {"trajectory": ds["trajectory"].values[:MOST].tolist()}
            if self.several and "trajectory" in ds.dims
            else {}
        )
        return {"": first_figure(getattr(plot, default_kind(ds))(ds, **some))}

    def needs_contacts(self) -> None:
        """Refuse a method that steps over contacts."""
        if not self.method.records_contacts:
            raise StudyError(
                f"[{self.place}] needs a method that locates contacts: name = "
                f'"Taylor", or ODE45 with events = "locate".'
            )


def _only_forced(question: OneVerb) -> None:
    """Refuse a system without forcing, which has no periods."""
    if question.system.forced_at is None:
        raise StudyError(
            f"[{question.place}] looks at whole forcing periods, and {question.system.name} is not "
            f'forced. Ask [simulate] with t_end = "20 s", or [poincare].'
        )


@asked(12, table("stroboscope", ["stroboscope"], KINDS, called="Stroboscope"))
class Points(OfMotions):
    """[stroboscope]: states at whole forcing periods."""

    several = True

    def check_first(self, table: Any) -> None:  # noqa: ARG002
        """It needs forcing."""
        _only_forced(self)

    def check(self, table: Any, setting: Setting) -> None:
        """Check start and values."""
        from saltus.analysis.inputs.starts import ensemble

        ensemble(self.system, self.arguments["start"], self.arguments["values"])
        self.check_more(table, setting)


@asked(
    14,
    table(
        "settled",
        ["settled", "simulate"],
        KINDS | {"tolerance": WrittenAs(examples=(1e-6,))},
        called="Settled response",
        without=(*_LEFT_OUT, "t_end"),
    ),
)
class SettledResponse(OneVerb):
    """[settled]: the responses that given starts settle to."""

    def check_first(self, table: Any) -> None:
        """It needs forcing, and a length."""
        _only_forced(self)
        if table.periods is None:
            raise StudyError(f"[{self.place}] lacks periods. Write periods = 400.")

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Check start, values and the periods that are compared."""
        from saltus.analysis.inputs.starts import ensemble
        from saltus.analysis.motion.settled import LAST

        asked = self.arguments
        ensemble(self.system, asked["start"], asked["values"])
        self.compared = asked["last"] or min(LAST, asked["periods"])
        if not 2 <= self.compared <= asked["periods"]:
            raise StudyError(
                f"[{self.place}] compares {self.compared} last periods of {asked['periods']}. "
                "Write at least periods = 2, and last between 2 and periods."
            )

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Simulate, and compare the last periods."""
        asked = self.arguments
        motion = {name: asked[name] for name in ("start", "t_start", "values", "samples")}
        run = verb("simulate")(
            self.system, periods=asked["periods"], keep=self.compared, **motion, **how
        )
        ds: xr.Dataset = verb(self.function)(run, tolerance=asked["tolerance"], last=self.compared)
        return ds


@asked(20, table("poincare", ["poincare"], KINDS, base=_BASE, called="Poincare section"))
class Section(OfMotions):
    """[poincare]: crossings of a surface."""

    picture, several = "section", True

    def check_more(self, table: Any, setting: Setting) -> None:
        """The surface in SI."""
        from saltus.analysis.motion.poincare import crossed

        self.needs_contacts()
        surface: Any = table.surface
        known = [
            *(guard.name for guard in self.system.guards),
            *(f"{name} turns" for name in (*self.system.states, *self.system.outputs.names)),
        ]
        if surface is None:
            raise StudyError(
                f'[{self.place}] lacks surface. Write surface = "{self.system.states[0]} turns", '
                "or a level."
            )
        if (
            isinstance(surface, dict)
            and isinstance(text := surface.get(FORMULA), str)
            and FORMULA not in self.system.states
        ):
            surface = setting.formula(text, f"{self.place}.surface")
        elif isinstance(surface, dict):
            (surface,) = quantities.levels(self.system, surface, f"{self.place}.surface").items()
        elif surface not in known:
            level = f'surface = {{ {self.system.states[0]} = "0.3 mm" }}'
            raise StudyError(
                f"[{self.place}] surface = {shown(surface)} is unknown. "
                f"{nearest(surface, known)} Or give a level: {level}."
            )
        crossed(self.system, surface, self.arguments["values"] or {})
        self.arguments["surface"] = surface


@asked(
    30,
    table(
        "spectrum",
        ["spectrum", "simulate", "poincare"],
        KINDS | {"samples": whole(200, least=4)},
        base=_BASE,
        called="Spectrum",
        without=_LEFT_OUT,
        states=(list[str] | None, _STATES),
    ),
)
class LinesQuestion(OfMotions):
    """[spectrum]: motions by frequency."""

    picture, several = "spectrum", True

    def check_more(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Read and check states and periods."""
        self.arguments["states"] = table.states
        known = (*self.system.states, *self.system.outputs.names)
        for name in table.states or []:
            if name not in known:
                raise StudyError(
                    f"[{self.place}] states: {name!r} is unknown to "
                    f"{self.system.name}. {nearest(name, known)}"
                )
        if table.last is not None and table.periods is None:
            raise StudyError(
                f"[{self.place}] last counts forcing periods, and {self.system.name} "
                f"isn't forced. Leave it out."
            )
        if table.last is not None and table.last > (table.periods or 0):
            raise StudyError(
                f"[{self.place}] last = {table.last} are more forcing periods than "
                f"are looked at, periods = {table.periods}."
            )

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Simulate, leave the transient out, take the spectrum."""
        asked, simulate = self.arguments, verb("simulate")
        motion = {name: asked[name] for name in ("start", "t_start", "values", "samples")}
        if self.system.forced_at is not None:
            periods = asked["transient"] + asked["periods"]
            run = simulate(self.system, periods=periods, keep=asked["periods"], **motion, **how)
        else:
            run = simulate(self.system, t_end=asked["t_end"], **motion, **how)
            run = run.sel(time=slice(asked["t_start"] + asked["transient"], None))
        ds: xr.Dataset = verb(self.function)(
            run, asked["states"], window=asked["window"], last=asked["last"]
        )
        return ds


@asked(40, table("impacts", ["impact_statistics"], KINDS, base=_BASE, called="Impact statistics"))
class Statistics(OfMotions):
    """[impacts]: number, speeds and durations of contacts."""

    picture = "impacts"

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The histogram of speeds, and the forces of the contacts where they are known."""
        from saltus import plot
        from saltus.plot.contact_forces import height_of

        known = ds.sizes["contact"] and height_of(ds) is not None
        contacts = {"-forces": first_figure(plot.contact_forces(ds))} if known else {}
        return {**super().pictures(ds), **contacts}

    def check_more(self, table: Any, setting: Setting) -> None:
        """Sides and forces."""
        self.needs_contacts()
        names = [guard.name for guard in self.system.guards]
        if not names:
            raise StudyError(
                f"[{self.place}] {self.system.name} has no boundary, so there is no contact to "
                "count."
            )
        for key in ("contact_side", "force"):
            for name in getattr(table, key):
                if name not in names:
                    raise StudyError(
                        f"[{self.place}.{key}] {name!r} is no boundary of "
                        f"{self.system.name}. {nearest(name, names)}"
                    )
        force: dict[str, Any] = {
            name: text
            if text in self.system.outputs.names
            else setting.formula(text, f"{self.place}.force")
            for name, text in table.force.items()
        }
        for name, function in force.items():
            if not isinstance(function, str):
                quantity(self.system, function, f"the force at {name!r}")
        self.arguments["force"] = force or None


@asked(50, table("energy", ["energy_balance"], KINDS, base=_BASE, called="Energy balance"))
class Balance(OfMotions):
    """[energy]: energy stored, supplied and dissipated."""

    picture = "energy"

    def check_more(self, table: Any, setting: Setting) -> None:
        """The three functions: as written, or those of the model, which stand in its code."""
        from saltus import models

        if table.intervals is not None and self.system.forced_at is not None:
            raise StudyError(
                f"[{self.place}] {self.system.name} is forced: its balance is drawn "
                f"each forcing period. Leave intervals out."
            )
        written = {
            name: text
            for name in (*_PARTS, *_OPTIONAL)
            if (text := getattr(table, name)) is not None
        }
        model = setting.study.system.model
        self.of_model: dict[str, Any] = {}
        if not written and model is not None:
            self.of_model = models.energy(model)
            self.arguments = {
                name: value
                for name, value in self.arguments.items()
                if name not in (*_PARTS, *_OPTIONAL)
            }
            return
        if lacking := [name for name in _PARTS if name not in written]:
            bring = "" if model is None else ", or leave all three out: the model brings them along"
            raise StudyError(
                f'[{self.place}] lacks {lacking[0]}. Write {lacking[0]} = "..." as a '
                f"formula, 0 if there is none{bring}."
            )
        for name, text in written.items():
            self.arguments[name] = setting.formula(text, self.place)
            quantity(self.system, self.arguments[name], f"{name} =")

    def identity(self) -> dict[str, str]:
        """Identity of the question. If a model holds the functions, its code is part of it."""
        return super().identity() | ({"models": code_hash("models")} if self.of_model else {})

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Draw the balance."""
        return super().call(self.of_model | how)
