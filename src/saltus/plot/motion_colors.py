"""Colours of the kinds of motion. A kind has the same colour in every picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from saltus.plot.palette import hues, shades
from saltus.results.dataset.schema import period_text

#: Longest period with its own hue; longer periods share one. The eye can't distinguish more hues of
#: small dots.
OWN_HUES = 8
#: Code of longer periods. The code of a shorter period is the period.
LONG = OWN_HUES + 1
#: Code of quasi-periodic motion.
QUASI_PERIODIC = OWN_HUES + 2
#: Code of chaos.
CHAOTIC = OWN_HUES + 3
#: Code of limit cycles.
LIMIT_CYCLE = OWN_HUES + 4
#: Code of equilibria.
EQUILIBRIUM = OWN_HUES + 5
#: Code of motion that hasn't repeated, and whose exponent is undecided.
NOT_REPEATING = OWN_HUES + 6
#: Periods whose hues limit cycles and equilibria take: systems without forcing have no periods.
_HUE_OF = {LIMIT_CYCLE: 1, EQUILIBRIUM: 2}
_NAMES = {
    QUASI_PERIODIC: "quasi-periodic",
    CHAOTIC: "chaotic",
    LIMIT_CYCLE: "limit cycle",
    EQUILIBRIUM: "equilibrium",
    NOT_REPEATING: "not repeating",
}
_OWN = {
    "quasi_periodic": QUASI_PERIODIC,
    "limit_cycle": LIMIT_CYCLE,
    "equilibrium": EQUILIBRIUM,
    "not_repeating": NOT_REPEATING,
}
#: Greys of motion that never repeats: a hue would suggest a period.
_GREYS = {
    QUASI_PERIODIC: (0.70, 0.70, 0.70),
    CHAOTIC: (0.20, 0.20, 0.20),
    NOT_REPEATING: (0.45, 0.45, 0.45),
}
#: Markers of the periods 1, 2, ..., and of longer ones.
_MARKERS = dict(enumerate("osD^vPX*p", start=1))
#: Shades of a hue; the middle one, for areas, is the hue itself.
_SHADES = 7
#: Shade for small dots and thin lines on white: one darker than the hue.
_DOT = 4


def codes(kind: Sequence[str] | np.ndarray, period: Sequence[int] | np.ndarray) -> np.ndarray:
    """Code of each motion, by its kind and its period in forcing periods."""
    period, kind = np.asarray(period, dtype=np.int64), np.asarray(kind, dtype=np.str_)
    others = np.select([kind == word for word in _OWN], list(_OWN.values()), CHAOTIC)
    return np.where(period > 0, np.minimum(period, LONG), others)


def repeats(code: int) -> bool:
    """True if motions of a kind repeat or rest: their branches are lines."""
    return code not in _GREYS


def color(code: int, dots: bool = True) -> np.ndarray:
    """The colour of a kind, sRGB in 0 to 1: darker for dots and lines than for areas."""
    if code in _GREYS:
        return np.array(_GREYS[code])
    hue = hues(LONG)[_HUE_OF.get(code, code) - 1]
    return np.asarray(shades(hue[None], _SHADES)[0, _DOT if dots else _SHADES // 2])


def marker(code: int) -> str:
    """Marker of a kind, for readers and printers without colours."""
    return _MARKERS.get(_HUE_OF.get(code, code), ".")


def label(code: int, periods: np.ndarray) -> str:
    """Name of a kind in a legend; ``periods`` are those that occur, to name the long ones."""
    if code == LONG:
        long = np.unique(periods[periods > OWN_HUES]).tolist()
        return (
            ", ".join(map(period_text, long))
            if len(long) <= 3
            else (f"{period_text(long[0])} to {period_text(long[-1])}")
        )
    return _NAMES.get(code) or period_text(code)


def of(ds: xr.Dataset) -> np.ndarray:
    """Code of each response of a Dataset."""
    return codes(ds["response_type"].values, ds["response_period"].values)
