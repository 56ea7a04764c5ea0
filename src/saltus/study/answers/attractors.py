"""[attractors]: the attractors that given starts lead to, at one set of values."""

from __future__ import annotations

from dataclasses import replace

from saltus.fence import MOST_PERIODS
from saltus.study.answers.question import OneVerb, asked
from saltus.study.tables.kinds import KINDS, whole
from saltus.study.tables.signature import table as asking

#: Starts settle within many periods, or are surveyed.
KEYS = KINDS | {"periods": replace(whole(2000, most=MOST_PERIODS), default=2000)}


@asked(55, asking("attractors", ["attractors"], KEYS, called="Attractors"))
class AttractorsQuestion(OneVerb):
    """Attractors that starts lead to."""
