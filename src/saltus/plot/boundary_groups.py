"""Boundaries as pictures of contacts name them: of many, those of one stop together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes

from saltus.plot.palette import hues
from saltus.plot.style import CYCLE

#: Boundaries that have a colour each.
MOST_ALONE = len(CYCLE)
#: Last words of the names of boundaries that belong to one stop, in the order they come off.
_SIDES = (" at rest", " lower", " upper")
#: Most lines of a legend beside a picture.
_LINES = 12


@dataclass(frozen=True)
class BoundaryGroup:
    """Boundaries with one colour: their name in a legend, their places in the list of guards."""

    label: str
    places: tuple[int, ...]
    color: Any


def boundary_groups(names: Sequence[str]) -> list[BoundaryGroup]:
    """The boundaries of a result with their colours: one by one; of more than :data:`MOST_ALONE`
    both sides of a stop, and its rest, together.
    """
    labels = list(names)
    if len(labels) > MOST_ALONE:
        for side in _SIDES:
            labels = [name.removesuffix(side) for name in labels]
    known = list(dict.fromkeys(labels))
    colors = CYCLE if len(known) <= len(CYCLE) else hues(len(known))
    return [
        BoundaryGroup(
            label.replace("_", " "),
            tuple(place for place, one in enumerate(labels) if one == label),
            colors[i],
        )
        for i, label in enumerate(known)
    ]


def legend_beside(ax: Axes) -> None:
    """Name what has a label to the right of a picture, in as many columns as its height needs."""
    count = len(ax.get_legend_handles_labels()[1])
    if count:
        ax.legend(loc="upper left", bbox_to_anchor=(1.02, 1), ncols=-(-count // _LINES))
