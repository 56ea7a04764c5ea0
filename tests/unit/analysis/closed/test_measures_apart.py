"""Numbers of a motion don't depend on the motions that are measured with it, to the last bit."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

import saltus as sl
from saltus.analysis.closed.measures import measure
from saltus.flow.maps import Stroboscope


def test_alone_or_with_others():
    rig = sl.models.delangre("b", force="4 N")
    frequencies = np.linspace(13.0, 19.0, 200)
    rows = np.tile(list(rig.values.values()), (len(frequencies), 1))
    rows[:, list(rig.values).index("frequency")] = frequencies
    map_, periods = Stroboscope(rig, sl.Taylor(), rows), np.ones(len(frequencies), np.int64)
    start = np.random.default_rng(926).normal(size=(len(frequencies), 2)) * [1e-3, 0.1]
    together = measure(map_, start, periods)
    for few in (1, 7, 50):
        for some in np.split(np.arange(200), range(few, 200, few))[:20]:
            apart, rest = measure(map_.rows(some), start[some], periods[some]), together.rows(some)
            for field in fields(apart):
                for mine, theirs in zip(
                    getattr(apart, field.name), getattr(rest, field.name), strict=True
                ):
                    assert np.asarray(mine).tobytes() == np.asarray(theirs).tobytes(), field.name
