"""Colours and names of starts that have no hue. Nothing here needs matplotlib."""

from __future__ import annotations

from dataclasses import dataclass

from saltus.results.dataset.kinds import Kind


@dataclass(frozen=True)
class Unsettled:
    """A code for starts: its name in a legend and its colour."""

    label: str
    color: str


#: Without hue, so that no shade is taken for them: near-black where nothing settled, grey where a
#: start left, pale where nothing is known.
UNSETTLED: dict[int, Unsettled] = {
    Kind.ESCAPED: Unsettled("escaped", "#BDBDBD"),
    Kind.UNCONVERGED: Unsettled("not settled", "#1E1E1E"),
    Kind.FAILED: Unsettled("failed", "#3C3C3C"),
    Kind.NOT_COMPUTED: Unsettled("not computed", "#E9E9E9"),
}

#: Two maps lead a start to the same attractor, or elsewhere; differences are the news.
AGREEMENT: dict[int, Unsettled] = {
    1: Unsettled("agree", "#E4E4E4"),
    0: Unsettled("differ", "#D55E00"),
    -1: Unsettled("not settled in one of them", "#3C3C3C"),
}
