"""Result of ``stroboscope``: motions at whole forcing periods."""

from __future__ import annotations

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import COUNTERS, GUARDS, MINIMA, SHARED, STATUS, Variable
from saltus.results.kinds.trajectory import account, headline, rows, sheets

#: Variables of the result of ``stroboscope``.
VARIABLES = {
    "<state>": Variable(("trajectory", "period"), "<state>", "<state>"),
    "period": Variable(("period",), "1", "whole forcing periods since the start", "i8", coord=True),
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **GUARDS,
    **SHARED,
}


KIND = ResultKind(
    "sl.stroboscope",
    VARIABLES,
    ("<state>", "status"),
    account,
    rows,
    headline=headline,
    sheets=sheets,
)
