"""[branches]: periodic orbits over a parameter, stable or not, and their bifurcations; [backbone]:
the free vibrations that resonances follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from saltus.fence import MOST_COUNT
from saltus.study.answers.question import OneVerb, asked
from saltus.study.setting import quantities
from saltus.study.tables.kinds import OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity
from saltus.study.tables.signature import Generated, WrittenAs
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    from saltus.study.setting.setting import Setting


#: Motions of a few harmonics in place of exact orbits.
By: Any = asking(
    "branches.by", ["HarmonicBalance"], {
        "harmonics": WrittenAs(int | Literal["auto"], (9,)),
        "periods": whole(3),
        "accuracy": WrittenAs(float, (0.01,)),
    },
    base=Generated,
)  # fmt: skip
BY = WrittenAs(
    By,
    ({"harmonics": 9},),
    "Harmonic balance: motions of a few harmonics in place of exact orbits.",
    None,
    convert="balance",
)
#: Branches go over a range, without steps.
OF_BRANCHES = OF_RESPONSES | {
    "vary": WrittenAs(
        dict[str, Interval], ({"frequency": ["2 Hz", "30 Hz"]},),
        "One parameter and its range.", convert="ranges",
    ),
    "at": whole(12, most=MOST_COUNT),
    "longest": whole(8),
    "by": BY,
    "points": whole(1000),
    "switch": WrittenAs(
        list[Literal["period_doubling", "branch_point"]], (["period_doubling"],),
        default=["period_doubling", "branch_point"],
    ),
}  # fmt: skip
#: Backbones go over a range of amplitudes; parameters that are zero are taken out.
OF_BACKBONES = OF_RESPONSES | {
    "amplitude": WrittenAs(Interval, (["0.1 mm", "5 mm"],)),
    "state": WrittenAs(examples=("x",)),
    "force": WrittenAs(examples=("force",)),
    "values": WrittenAs(dict[str, Quantity], ({"force": "0 N", "damping_ratio": 0},),
        "Values of parameters: of free vibrations the force and all that damps are zero.", {},
        convert="values"),
    "mode": whole(1),
    "points": whole(400),
    "by": BY,
}  # fmt: skip


@asked(110, asking("branches", ["branches"], OF_BRANCHES, called="Branches of periodic orbits"))
class Branches(OneVerb):
    """Branches of periodic orbits over a parameter."""

    whole = "follows branches from point to point"


@asked(130, asking("backbone", ["backbone"], OF_BACKBONES, called="Backbone"))
class Backbone(OneVerb):
    """The backbone of resonances over their amplitude."""

    whole = "follows a branch from point to point"

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Read the amplitude in the unit of its state."""
        state = table.state or self.system.states[0]
        place = f"{self.place}.amplitude"
        self.arguments["amplitude"] = tuple(
            quantities.levels(self.system, {state: one}, place)[state] for one in table.amplitude
        )
