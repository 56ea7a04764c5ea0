"""Why a branch ends between two values of a parameter: the bifurcation, where it can be recognised.

A fold, at which a stable and an unstable orbit meet, is recognised by three things: the leading
multiplier is real and goes to +1, by the square root of the distance; Newton's method finds nothing
beyond; and the place to which (1 - multiplier)^2 extrapolates is where it stops finding the orbit.
Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapters 4 and 5; di Bernardo, Budd,
Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.analysis.orbits.orbits import orbit_distance
from saltus.analysis.responses.continuation import LINK, Follower
from saltus.analysis.responses.followed import Followed
from saltus.analysis.responses.responses import GridResponses
from saltus.results.dataset.kinds import CLOSED, Kind

#: A complex leading multiplier is on its way to the unit circle beyond this, if it grew by so much
#: in the last step of the parameter that it is there after AHEAD more of them. Being near isn't
#: enough: of a lightly damped oscillator all multipliers are, and stay there.
TURNING, AHEAD = 0.95, 2.0
#: The law is measured over this multiple of the step within which a branch ends.
OVER = 64
#: Farthest that the law's extrapolation may lie from the interval, in its widths.
BESIDE = 3.0


@dataclass(frozen=True)
class Event:
    """What happens to a branch between two values.

    Attributes
    ----------
    value : float
        Where [SI]: a fold to some ten thousandths of the step, of an equilibrium and a Hopf
        bifurcation to rounding; anything else is in the middle of the two values.
    kind : str
        ``graze`` (contacts come or go), ``period_doubling``, ``fold``, ``hopf`` (an equilibrium
        begins to oscillate), ``neimark_sacker`` (a torus is born), ``chaos`` (its starts are
        chaotic beyond), or ``end`` (it isn't found any more, by the starts nor by Newton's method,
        for none of these reasons).
    branch : int
        Its number.
    """

    value: float
    kind: str
    branch: int


def why_they_end(
    found: GridResponses,
    followed: Followed,
    values: np.ndarray,
    ends: np.ndarray,
    way: int,
    exact: bool,
) -> list[Event]:
    """Why branches end upwards (way 1) or begin (way -1).

    Parameters
    ----------
    found : GridResponses
        The responses.
    followed : Followed
        Where they go.
    values : float64[places]
        The values of the parameter.
    ends : int64[k]
        The last response of branch 0, 1, ...
    way : {1, -1}
        Direction in which it ends.
    exact : bool
        Whether the method's errors are rounding, so that the place of an end can be located.

    Returns
    -------
    list of Event
        None for a branch at the edge of the grid, one that never repeats, one that was not computed
        beyond, and one that can be followed to the next value: just no start leads to it there.
    """
    beyond = found.place[ends] + way
    inside = (beyond >= 0) & (beyond < len(values)) & np.isin(found.kind[ends], CLOSED)
    inside[inside] = ~(found.of[beyond[inside]] == Kind.NOT_COMPUTED).all(axis=1)
    inside[inside] = ~followed.goes_on[followed.index(ends[inside], way)]
    branch = np.flatnonzero(inside)
    ends, beyond = ends[branch], beyond[branch]
    words = [
        _told_by_neighbours(found, int(end), int(at), _leading(found, int(end)))
        for end, at in zip(ends, beyond, strict=True)
    ]
    places = [
        middle(values, int(found.place[end]), int(at)) for end, at in zip(ends, beyond, strict=True)
    ]
    asked = [i for i, word in enumerate(words) if word == "end"]
    located = _located(
        found, followed.follower, followed.index(ends[asked], way), values, ends[asked]
    )
    for i, (word, place) in zip(asked, located, strict=True):
        words[i], places[i] = word, place if exact and np.isfinite(place) else places[i]
    return [
        Event(place, word, int(number))
        for place, word, number in zip(places, words, branch, strict=True)
        if word
    ]


def _leading(found: GridResponses, response: int) -> complex:
    """Leading multiplier; of a limit cycle the largest but the trivial one, of an equilibrium the
    leading eigenvalue [1/s].
    """
    multipliers = found.motions.orbits.multipliers[found.row[response]]
    return complex(
        multipliers[1 if found.kind[response] == Kind.LIMIT_CYCLE and len(multipliers) > 1 else 0]
    )


def _told_by_neighbours(found: GridResponses, last: int, beyond: int, multiplier: complex) -> str:
    """What the responses at the next value say, ``end`` if nothing; "" if another branch reports
    it.
    """
    here = int(found.place[last])
    neighbours = np.flatnonzero(found.place == beyond)
    doubled = [
        j for j in neighbours if _is_twice(found, int(j), last) and _covers(found, int(j), last)
    ]
    if any(_is_twice(found, last, int(j)) and _covers(found, last, int(j)) for j in neighbours):
        return ""  # the same doubling, reported by the branch of half the period
    if doubled and multiplier.real < 0:
        return "period_doubling"
    starts = np.flatnonzero((found.of[here] >= 0) & (found.of[here] == last))
    if (
        len(starts)
        and (found.motions.kind.reshape(found.of.shape)[beyond, starts] == Kind.CHAOTIC).any()
    ):
        return "chaos"
    if (
        found.kind[last] != Kind.EQUILIBRIUM
        and abs(multiplier.imag) > 1e-9
        and _turns(found, last, 2 * here - beyond, abs(multiplier))
    ):
        return "neimark_sacker"
    return "end"


def _turns(found: GridResponses, last: int, before: int, size: float) -> bool:
    """Whether a leading multiplier of this size reaches the unit circle soon, by how it grew from
    the value before.
    """
    alike = (
        (found.place == before)
        & (found.kind == found.kind[last])
        & (found.period == found.period[last])
    )
    if size <= TURNING or not alike.any():
        return False
    scale, points = found.motions.scale[found.row[last]], found.points(last)
    apart = {
        int(j): orbit_distance(found.points(int(j)), points, scale) for j in np.flatnonzero(alike)
    }
    nearest = min(apart, key=lambda j: apart[j])
    grown = size - abs(_leading(found, nearest))
    return apart[nearest] < LINK and AHEAD * grown >= 1.0 - size


def _is_twice(found: GridResponses, longer: int, shorter: int) -> bool:
    """Whether one response takes twice as long as another."""
    if found.kind[longer] != found.kind[shorter]:
        return False
    if found.kind[longer] == Kind.LIMIT_CYCLE:
        return bool(abs(found.time[longer] / (2 * found.time[shorter]) - 1.0) < 0.2)
    return bool(
        found.kind[longer] != Kind.EQUILIBRIUM and found.period[longer] == 2 * found.period[shorter]
    )


def _covers(found: GridResponses, longer: int, shorter: int) -> bool:
    """Whether every point of an orbit of period 2n lies near one of an orbit of period n."""
    scale = found.motions.scale[found.row[shorter]]
    apart = (
        np.abs((found.points(longer)[:, None] - found.points(shorter)[None]) / scale)
        .max(axis=2)
        .min(axis=1)
    )
    return bool(apart.max() < LINK)


def middle(values: np.ndarray, a: int, b: int) -> float:
    """Between two values: geometric where the axis spans decades."""
    low, high = float(values[a]), float(values[b])
    return (
        float(np.sqrt(low * high))
        if values[0] > 0 and values[-1] / values[0] > 100
        else 0.5 * (low + high)
    )


# -- folds and Hopf bifurcations -------------------------------------------------------------------
def _located(
    found: GridResponses, follower: Follower, rows: np.ndarray, values: np.ndarray, ends: np.ndarray
) -> list[tuple[str, float]]:
    """Kind and place of what ends branches whose leading multiplier is real and positive, or that
    rest, followed as far as they go.
    """
    last, width = follower.value[rows], follower.step[rows]
    farther = last - np.clip(
        OVER * np.abs(width), 0.0, np.abs(last - values[found.place[ends]])
    ) * np.sign(width)
    near, _ = follower.at(rows, last)
    far, same = follower.at(rows, farther)
    _, beyond = follower.at(rows, last + 2.0 * width)
    result = []
    for i, end in enumerate(ends):
        rests = found.kind[end] == Kind.EQUILIBRIUM
        column = 1 if found.kind[end] == Kind.LIMIT_CYCLE and near.multipliers.shape[1] > 1 else 0
        one, other = complex(near.multipliers[i, column]), complex(far.multipliers[i, column])
        oscillates = abs(one.imag) > 1e-9 * abs(one)
        distance = np.abs([one.real, other.real]) if rests else np.abs([1.0 - one, 1.0 - other])
        # linear through a Hopf bifurcation, a square root at a fold
        law = distance if rests and oscillates else distance**2
        place = (
            last[i] + law[0] * (last[i] - farther[i]) / (law[1] - law[0])
            if law[1] > law[0]
            else np.nan
        )
        here = bool(same[i] and follower.narrow[rows[i]]) and abs(
            place - last[i] - 0.5 * width[i]
        ) <= (0.5 + BESIDE) * abs(width[i])
        word = (
            "hopf"
            if rests and oscillates and beyond[i]
            else "fold"
            if not oscillates and not beyond[i]
            else "end"
        )
        if here and rests and word != "end":
            place = follower.special(int(rows[i]), word, near.points[i, 0], float(place))
        result.append((word, float(place)) if here else ("end", np.nan))
    return result
