"""[periodic_orbits]: the periodic orbits of a system, stable or not, from many starts."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Tag

from saltus.fence import MOST_PERIODS
from saltus.study.answers.question import OneVerb, asked
from saltus.study.tables.kinds import KINDS, OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity, Starts
from saltus.study.tables.signature import WrittenAs
from saltus.study.tables.signature import table as asking

#: A time, or a range of them.
Period = Annotated[
    Annotated[Interval, Tag("list")] | Annotated[Quantity, Tag("quantity")],
    Discriminator(lambda given: "list" if isinstance(given, list) else "quantity"),
]
#: They are found from many starts.
KEYS = OF_RESPONSES | {
    "start": WrittenAs(Starts, (*KINDS["start"].examples, "random 1000"),
        'Where to begin: every state, lists making a batch; or "random 1000" with box. Default '
        "without a box: along the motion from rest.",
        convert="start"),
    "periods": whole(3, most=MOST_PERIODS),
    "period": WrittenAs(Period, (["1 s", "5 s"], "0.1 s"), convert="period"),
}  # fmt: skip


@asked(100, asking("periodic_orbits", ["periodic_orbits"], KEYS, called="Periodic orbits"))
class OrbitsQuestion(OneVerb):
    """Periodic orbits, stable and unstable."""
