"""[equilibria]: where a system without forcing can rest, stable or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from saltus.errors import StudyError
from saltus.results.dataset.schema import equilibrium_name, states_of
from saltus.results.wording import unit_of
from saltus.study.answers.question import Answers, OneVerb, asked
from saltus.study.setting import quantities
from saltus.study.table import ROWS, number, quantity, table, words
from saltus.study.tables.kinds import KINDS, whole
from saltus.study.tables.parts import Interval, Start
from saltus.study.tables.signature import Kind
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting
    from saltus.study.table import TextTable

#: Digits of a state at rest.
DIGITS = 10


#: They are looked for in a box, or from starts.
KEYS = KINDS | {
    "start": Kind(dict[str, Start], KINDS["start"].examples,
        "Starts of Newton's method, in place of a box: every state; lists make a batch.", None,
        convert="start"),
    "starts": whole(256),
}  # fmt: skip
_BOX = Field(
    None,
    description="Ranges of the starts of Newton's method.",
    examples=[{"x": ["-5 mm", "5 mm"]}],
)


@asked(
    90,
    asking(
        "equilibria",
        ["equilibria"],
        KEYS,
        called="Equilibria",
        box=(dict[str, Interval] | None, _BOX),
    ),
)
class Equilibria(OneVerb):
    """Equilibria in each region, on boundaries, and held by contacts."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """The ranges of a box are arguments of their own."""
        if table.start is not None and (table.box or table.at):
            raise StudyError("[equilibria] takes start, or box and at; leave out one of them.")
        self.arguments |= quantities.box(self.system, table.box, self.place) or {}

    def call(self, how: dict[str, Any]) -> xr.Dataset:  # noqa: ARG002
        """Nothing is integrated: there are no threads, and no method."""
        return super().call({})

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """A row for each."""
        states = {name: ds[equilibrium_name(name)] for name in states_of(ds)}
        growth = ds["equilibrium_eigenvalue_real"].values
        largest = np.fmax.reduce(growth, axis=1, initial=-np.inf)
        columns = [
            words("type", [kind.replace("_", " ") for kind in ds["equilibrium_type"].values]),
            words("stable", ["yes" if one else "no" for one in ds["equilibrium_stable"].values]),
            words("place", ds["equilibrium_place"].values),
            words("contacts", ds["equilibrium_contacts"].values),
            *(quantity(name, one.values, unit_of(one), DIGITS) for name, one in states.items()),
            number("largest growth", np.where(np.isinf(largest), np.nan, largest), ".6g", "1/s"),
        ]
        shown = list(range(min(ds.sizes["equilibrium"], ROWS)))
        return [table(self.title, columns, (), shown)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:  # noqa: ARG002
        """None: the table says all."""
        return {}
