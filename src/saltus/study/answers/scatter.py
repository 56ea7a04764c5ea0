"""[scatter]: the effect of uncertain parameters on responses."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from pydantic import Field, model_validator

from saltus.distributions import Distribution, truncated
from saltus.study.answers.question import OneVerb, asked, first_figure
from saltus.study.identity import identity
from saltus.study.setting.quantities import number
from saltus.study.setting.setting import Setting
from saltus.study.tables.kinds import OF_RESPONSES
from saltus.study.tables.parts import Quantity, StudyTable
from saltus.study.tables.signature import Asked, table

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.division import Division

#: Quantities that each distribution takes.
_TAKES = {"normal": 2, "uniform": 2, "lognormal": 2, "triangular": 3}


class Uncertain(StudyTable):
    """[scatter.uncertain.<parameter>]: the distribution of an uncertain parameter."""

    normal: list[Quantity] | None = Field(
        None, description="Mean and standard deviation.", examples=[["0.4 mm", "0.02 mm"]]
    )
    uniform: list[Quantity] | None = Field(
        None, description="Lowest and highest value.", examples=[["0.35 mm", "0.45 mm"]]
    )
    lognormal: list[Quantity] | None = Field(
        None, description="Median, and the factor exp(sigma).", examples=[["14 kN/m", 1.1]]
    )
    triangular: list[Quantity] | None = Field(
        None,
        description="Lowest, most likely and highest value.",
        examples=[["0.35 mm", "0.4 mm", "0.45 mm"]],
    )
    low: Quantity | None = Field(
        None, description="No value is below this one.", examples=["0.3 mm"]
    )
    high: Quantity | None = Field(
        None, description="No value is above this one.", examples=["0.5 mm"]
    )

    @model_validator(mode="after")
    def _one(self) -> Uncertain:
        given = [kind for kind in _TAKES if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError('takes one distribution, such as normal = ["0.4 mm", "0.02 mm"]')
        if len(getattr(self, given[0])) != _TAKES[given[0]]:
            raise ValueError(f"{given[0]} takes {_TAKES[given[0]]} quantities")
        return self

    def distribution(self, unit: str, place: str) -> Distribution:
        """The distribution, in SI."""
        kind = next(kind for kind in _TAKES if getattr(self, kind) is not None)
        units = (unit, "1") if kind == "lognormal" else (unit,) * _TAKES[kind]
        given = [
            number(one, its, place, kind)
            for one, its in zip(getattr(self, kind), units, strict=True)
        ]
        found = Distribution(kind, tuple(given))
        ends = [
            None if one is None else number(one, unit, place, key)
            for key, one in (("low", self.low), ("high", self.high))
        ]
        return found if ends == [None, None] else truncated(found, *ends)


_UNCERTAIN = Field(
    min_length=1,
    description="Distributions of uncertain parameters.",
    examples=[{"upper_gap": {"normal": ["0.4 mm", "0.02 mm"]}}],
)


@asked(
    57,
    table(
        "scatter",
        ["scatter"],
        OF_RESPONSES,
        base=Asked,
        called="Scatter",
        without=("ask", "uncertain"),
        uncertain=(dict[str, Uncertain], _UNCERTAIN),
    ),
)
class Scatter(OneVerb):
    """[scatter]: responses of sets of uncertain values."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Check the distributions."""
        from saltus.analysis.scatter.sets import design_of

        self.arguments["uncertain"] = {
            name: one.distribution(
                self.system.units.get(name, ""), f"{self.place}.uncertain.{name}"
            )
            for name, one in table.uncertain.items()
        }
        names = ("uncertain", "samples", "seed", "indices")
        design_of(self.system, *(self.arguments[name] for name in names))

    @functools.cached_property
    def division(self) -> Division | str:
        """Chunks of sets."""
        from saltus.analysis.attractors.divided_grid import values_together
        from saltus.analysis.scatter.divided import DividedScatter
        from saltus.analysis.scatter.plan import scatter_plan

        given = dict(self.arguments)
        outputs, every = given.pop("outputs"), given.pop("every")
        plan = scatter_plan(self.system, method=self.method, **given)
        together = values_together(len(plan.starts))
        grid = plan.grid(every)
        return DividedScatter(grid, plan.method, plan.periods, outputs, together, plan)

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Numbers over parameters, and parameters over each other if there are some."""
        from saltus import plot

        several = ds.sizes["uncertain"] > 1
        corner = {"-corner": first_figure(plot.corner(ds))} if several else {}
        return {**super().pictures(ds), **corner}

    def identity(self) -> dict[str, str]:
        """Texts that must be the same for a file to hold the answer."""
        uncertain = {name: repr(one) for name, one in self.arguments["uncertain"].items()}
        return identity(self.system, self.method, self.arguments | {"uncertain": uncertain})
