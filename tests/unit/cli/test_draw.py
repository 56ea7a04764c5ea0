"""Which picture draws which result: one table, complete."""

from __future__ import annotations

from saltus import plot
from saltus.cli import draw
from saltus.cli.commands import Kind
from saltus.plot.choice import PICTURES
from saltus.results.dataset.schema import NAMES


def test_every_kind_of_result_is_known():
    """Attractors alone have no picture, nor have tables of a few numbers; a new kind needs a line
    in the table, and a word for messages.
    """
    assert set(NAMES) == set(PICTURES) | {"attractors", "equilibria", "settled", "widths", "modes"}
    assert set(draw._WORDS) == set(PICTURES)


def test_every_picture_is_there_and_can_be_asked_for():
    kinds = {kind for possible in PICTURES.values() for kind in possible}
    assert all(callable(getattr(plot, kind)) for kind in kinds)
    assert {kind.value for kind in Kind} == kinds
    assert set(draw.OF_TRAJECTORIES) <= kinds
