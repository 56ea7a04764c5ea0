"""Kinds of motion as colours: the same kind has the same colour in every picture, whatever else is
in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from saltus.plot.palette import hues, shades
from saltus.results.dataset.schema import period_text

#: Periods with a hue of their own; longer ones share the next. More hues than these can't be
#: distinguished as small dots.
OWN_HUES = 8
#: Codes of the kinds: the period itself up to :data:`OWN_HUES`, then these.
LONG, QUASI_PERIODIC, CHAOTIC = OWN_HUES + 1, OWN_HUES + 2, OWN_HUES + 3
#: Of systems without forcing; a limit cycle has the hue of period 1, as there is no other, an
#: equilibrium that of period 2.
LIMIT_CYCLE, EQUILIBRIUM = OWN_HUES + 4, OWN_HUES + 5
#: Motion that hasn't repeated, and whose exponent says nothing.
NOT_REPEATING = OWN_HUES + 6
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
#: Motion that never repeats is grey, so that no period is taken for it.
_GREYS = {
    QUASI_PERIODIC: (0.70, 0.70, 0.70),
    CHAOTIC: (0.20, 0.20, 0.20),
    NOT_REPEATING: (0.45, 0.45, 0.45),
}
#: Markers of the periods 1, 2, ..., and of longer ones.
_MARKERS = dict(enumerate("osD^vPX*p", start=1))
#: The shade of a hue for small dots and thin lines on white; the hue itself is for areas.
_DOT, _SHADES = 4, 7


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
    """The marker of a kind, for readers and printers without colours."""
    return _MARKERS.get(_HUE_OF.get(code, code), ".")


def label(code: int, periods: np.ndarray) -> str:
    """A kind in a legend; ``periods`` are those that occur, to name the long ones."""
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
