"""Which picture draws which result: one table, complete."""

from __future__ import annotations

from saltus import plot
from saltus.cli import draw
from saltus.cli.commands import PictureKind
from saltus.plot.choice import TAKES, pictures_of
from saltus.results.dataset.schema import NAMES


def test_every_kind_of_result_is_known():
    """Attractors alone have no picture, nor have tables of a few numbers; a new kind needs a line
    in the table, and a word for messages.
    """
    drawn = {kind for kind in NAMES if pictures_of(kind)}
    assert set(NAMES) == drawn | {"attractors", "equilibria", "settled", "widths", "modes"} | {
        "event_sensitivity"
    }
    assert set(draw._WORDS) == drawn


def test_every_picture_is_there_and_can_be_asked_for():
    assert set(plot.__all__) == {*TAKES, "OKABE_ITO", "style"}
    drawn = {name for kind in NAMES for name in pictures_of(kind)}
    assert {kind.value for kind in PictureKind} == drawn == {*TAKES} - {"gallery"}
