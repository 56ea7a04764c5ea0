"""[branches]: periodic orbits over a parameter, stable or not, and their bifurcations; [backbone]:
the vibrations that resonances follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from saltus.study.answers.question import OneVerb
from saltus.study.setting import quantities

if TYPE_CHECKING:
    from saltus.study.setting.setting import Setting


class Branches(OneVerb):
    """Branches of periodic orbits over a parameter."""

    place, function = "branches", "branches"


class Backbone(OneVerb):
    """The backbone of resonances over their amplitude."""

    place, function = "backbone", "backbone"

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """The amplitude is in the unit of its state."""
        state = table.state or self.system.states[0]
        place = f"{self.place}.amplitude"
        self.arguments["amplitude"] = tuple(
            quantities.states(self.system, {state: one}, place)[state] for one in table.amplitude
        )
