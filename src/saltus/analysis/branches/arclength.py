"""Pseudo-arclength continuation of curves F(z) = 0, m equations in m + 1 unknowns, many curves side
by side.

A step goes along the cubic through the last two points and returns to the curve by Newton's method
in the plane across the tangent, so that folds are points like all others. Keller, in Applications
of Bifurcation Theory (1977); Allgower & Georg, Introduction to Numerical Continuation Methods
(2003), chapters 2 and 6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from saltus.analysis.branches.equations import CurveEquations
from saltus.analysis.solve.linear import solved
from saltus.analysis.solve.newton import Zeros, newton
from saltus.flow.polynomials import between

#: The corrector is done where its residual is smaller than this, in units of the scale.
CLOSED = 1e-14
#: Iterations of the corrector: more mean that the step was too long.
MOST_ITERATIONS = 7
#: Cosine of the angle between tangents at the ends of a step, and between it and each of them: less
#: halves the step. A step to another curve that runs alongside is at an angle to both.
TURN = 0.97
#: The second step of the corrector, in first ones: more halves the step. It may lead elsewhere.
CONTRACTS = 0.5
#: Longest step over which the derivative and the tangent together change the sign of their
#: determinant, in units of the scale: it passes a branch point, or leads to the branch beside.
PASSING = 1e-3
#: Farthest that a point lies from where it was predicted, in steps: beyond, the step may have
#: passed over a loop of the curve.
PREDICTED = 0.05
#: Steps shorter than this, in units of the scale, aren't halved for it.
SHORT = 0.002
#: Evaluations of a step behind which steps are doubled, at most.
EASY = 3
#: Cosine of the tangent's turn above which they are.
STRAIGHT = 0.995
#: First step, in units of the scale.
FIRST = 0.02
#: Longest step, in units of the scale.
LONGEST = 0.12
#: Shortest step, in units of the scale.
SHORTEST = 1e-7
#: Distance from where a curve began at which steps may be longer than the longest, in units of the
#: scale.
FAR = 3.0
#: Least share of a tangent.
TINY = 1e-3
#: Distance from where a curve ends within which its last point lies, in units of the scale.
ENDING = 0.0005
#: Farthest that the corrector moves from the predicted point, in steps.
ASTRAY = 0.6
#: Points after which a curve may be found to be closed.
LEAST_CLOSED = 8
#: Cosine of the angle at which it passes its start then.
AGAIN = 0.9
#: Farthest that a step lies from a point that it passes, in steps.
PASSED = 0.02
#: Farthest that a step lies from the line between its ends, in steps.
BENDS = 0.1


@dataclass
class Arc:
    """A curve in one direction from its start.

    Attributes
    ----------
    z : list of float64[m + 1]
        Its points, the start first.
    tangent : list of float64[m + 1]
        Unit tangents in units of the scale, in the direction of the curve.
    derivative : list of float64[m, m + 1]
        Of the equations, in units of the scale.
    length : list of float
        Arclength from the start, in units of the scale.
    end : str
        ``range``: the end of the range was reached; ``closed``; ``points``: as many as asked for;
        ``lost``: no step however short; ``stopped``: another curve of the group is closed;
        ``met``: another group goes on along the same curve; ``enough``: the caller needs no more;
        ``interrupted``: by Ctrl-C; or what the caller says.
    """

    z: list[np.ndarray] = field(default_factory=list)
    tangent: list[np.ndarray] = field(default_factory=list)
    derivative: list[np.ndarray] = field(default_factory=list)
    length: list[float] = field(default_factory=list)
    end: str = ""

    def whole(self) -> Arc:
        """The points of which all is known, when Ctrl-C has ended the curve."""
        k = min(len(self.z), len(self.tangent), len(self.derivative), len(self.length))
        end = self.end or "interrupted"
        return Arc(self.z[:k], self.tangent[:k], self.derivative[:k], self.length[:k], end)

    def behind(self, back: Arc) -> Arc:
        """The curve through the start of both that comes along another one and goes on as this."""
        return Arc(
            back.z[:0:-1] + self.z,
            [-tangent for tangent in back.tangent[:0:-1]] + self.tangent,
            back.derivative[:0:-1] + self.derivative,
            [-length for length in back.length[:0:-1]] + self.length,
            self.end,
        )


class OneWay(Protocol):
    """Part of a curve that was followed in one direction from a start."""

    @property
    def end(self) -> str:
        """Reason why it ends, as :attr:`Arc.end`."""


W = TypeVar("W", bound=OneWay)


def both_sides(ways: list[W]) -> tuple[list[W], tuple[str, str]]:
    """Choose the ways, ahead and back from a start, that make one curve: one that is closed alone,
    or both. Also why the curve ends at its first and at its last point.
    """
    for way in ways:
        if way.end == "closed":
            return [way], ("closed", "closed")
    return ways, (ways[1].end if len(ways) > 1 else "branch", ways[0].end)


def correct(
    equations: CurveEquations,
    guess: np.ndarray,
    normal: np.ndarray,
    rows: np.ndarray,
    astray: np.ndarray | float = np.inf,
    foresee: bool = False,
    enough: float = CLOSED,
) -> Zeros:
    """Newton's method from guesses float64[k, m + 1] in the planes across float64[k, m + 1].

    Parameters
    ----------
    equations : CurveEquations
        The curves.
    guess, normal
        Where to begin, and the normals of the planes in units of the scale.
    rows : int64[k]
        Which curves.
    astray : float or float64[k]
        Farthest from the guess, in units of the scale.
    foresee : bool
        Leave out the evaluation that would only confirm a last step: the derivative is that before
        it then.
    enough : float
        Residual of a zero, in units of the scale.
    """
    return newton(
        lambda z, some: equations.evaluate(z, rows[some]), guess, equations.scale[rows],
        planes=normal, enough=enough, foresee=foresee, longest_step=np.inf, farthest=astray,
        max_steps=MOST_ITERATIONS,
    )  # fmt: skip


def tangents(derivative: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Unit vectors that span the null spaces of float64[k, m, m + 1], float64[k, m + 1], on the
    side of others.
    """
    whole, last = np.empty((*along.shape, along.shape[1])), np.zeros(along.shape)
    whole[:, :-1], whole[:, -1], last[:, -1] = derivative, along, 1.0
    null = solved(whole, last)
    null /= np.linalg.norm(null, axis=1)[:, None]
    vague = ~np.isfinite(null).all(axis=1)
    if vague.any():  # two curves cross here, or it leads across the side asked for
        null[vague] = np.linalg.svd(derivative[vague])[2][:, -1]
    side = np.sign(np.einsum("ki,ki->k", null, along))
    return np.asarray(null * np.where(side == 0, 1.0, side)[:, None])


def follow(
    equations: CurveEquations,
    start: np.ndarray,
    along: np.ndarray,
    bounds: Mapping[int, tuple[float, float]],
    points: int,
    first: float | np.ndarray = FIRST,
    ends: Callable[[Arc], str] | None = None,
    group: np.ndarray | None = None,
    longest: float = LONGEST,
    foresee: bool = False,
    enough: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray] | None = None,
    curves: list[Arc] | None = None,
) -> list[Arc]:
    """Curves from points float64[k, m + 1] on them, until they leave the range of an unknown, are
    closed or have ``points`` points.

    Parameters
    ----------
    equations : CurveEquations
        Row i is curve i.
    start, along : float64[k, m + 1]
        Points, and on which side of them to go, in units of the scale.
    bounds : mapping of int to (float, float)
        Ranges of unknowns, by their columns.
    points : int
        Most points of a curve.
    first : float or float64[k]
        First step, in units of the scale.
    ends : callable, optional
        Why a curve ended before its last point, empty where it didn't: the curve then ends within
        ENDING of there.
    group : int64[k], optional
        Curves that are one: where one of them is closed, the others go no farther. Of two groups of
        which one passes where the other began, only the first goes on.
    longest : float
        Longest step, in units of the scale.
    foresee : bool
        See :func:`correct`: the derivatives of the curves, and their tangents, are good for
        following them only.
    enough : callable, optional
        Which curves go no farther, bool[r], from points float64[r, m + 1] that were reached, the
        derivatives there and their curves int64[r].
    curves : list of Arc, optional
        Takes the curves as they grow: what is known when Ctrl-C ends this.
    """
    rows = np.arange(len(start))
    curves = [] if curves is None else curves
    curves += [Arc() for _ in rows]
    here = correct(equations, start, tangents_at(equations, start, along, rows), rows, 1.0)
    fronts = _Fronts(equations, bounds, curves, first, longest, foresee, group)
    fronts.begin(here, tangents(_finite(here.derivative), along))
    while len(fronts.going):
        taken = fronts.step()
        for i in taken:
            if len(fronts.curves[i].z) >= points and not fronts.curves[i].end:
                fronts.curves[i].end = "points"
        for i in taken:
            if ends is not None and (why := ends(fronts.curves[i])):
                fronts.undo(i, why)
        if enough is not None:
            fronts.halt(taken, enough)
    return fronts.curves


class _Fronts:
    """The ends of curves that grow."""

    def __init__(
        self,
        equations: CurveEquations,
        bounds: Mapping[int, tuple[float, float]],
        curves: list[Arc],
        first: float | np.ndarray,
        longest: float = LONGEST,
        foresee: bool = False,
        group: np.ndarray | None = None,
    ) -> None:
        self.equations, self.bounds, self.curves = equations, bounds, curves
        self.longest, self.foresee = longest, foresee
        self.group = np.arange(len(curves)) if group is None else group
        self.firsts = np.zeros(0, np.int64) if group is None else np.unique(group, True)[1]
        self.length = np.broadcast_to(first, len(curves)).astype(float)

    def begin(self, here: Zeros, tangent: np.ndarray) -> None:
        """The first points."""
        self.z, self.tangent = here.z.copy(), tangent
        self.side = _orientation(here.derivative, tangent)
        self.began = here.z.copy()
        self.before = np.full((2, *tangent.shape), np.nan)  # the points before these, and tangents
        for i, curve in enumerate(self.curves):
            if here.found[i]:
                _add(curve, here.z[i], tangent[i], here.derivative[i], 0.0)
            else:
                curve.end = "lost"
        self.equations.accepted(here.z, np.arange(len(here.z)))

    @property
    def going(self) -> np.ndarray:
        """The curves that go on, int64[g]."""
        return np.array([i for i, curve in enumerate(self.curves) if not curve.end], np.int64)

    def step(self) -> np.ndarray:
        """Try a step of each; those that have a new point, int64[r]."""
        going = self.going
        guess, normal, outside = self._predicted(going)
        scale, length = self.equations.scale[going], self.length[going]
        trial = correct(self.equations, guess, normal, going, ASTRAY * length, self.foresee)
        tangent = tangents(_finite(trial.derivative), self.tangent[going])
        step = (trial.z - self.z[going]) / scale
        moved = np.linalg.norm(step, axis=1)
        chord = step / np.maximum(moved, np.finfo(float).tiny)[:, None]
        sides = ((tangent, self.tangent[going]), (chord, tangent), (chord, self.tangent[going]))
        cosine = np.min([np.einsum("ki,ki->k", *both) for both in sides], axis=0)
        side = _orientation(trial.derivative, tangent)
        stays = (side * self.side[going] >= 0) | (length < PASSING)
        off = np.linalg.norm((trial.z - guess) / scale, axis=1)
        foreseen = (off < PREDICTED * length) | (length < SHORT)
        converges = trial.found & (trial.contraction < CONTRACTS)
        smooth = (cosine > TURN) & stays & foreseen
        counts = converges & (smooth | (length < 100 * SHORTEST))  # a short one may turn a corner
        easy = counts & (trial.evaluations <= EASY) & (cosine > STRAIGHT)
        there = counts & outside & (moved < SHORTEST)  # it began at that end of the range
        for i in going[there]:
            self.curves[i].end = "range"
        counts &= ~there
        for j in np.flatnonzero(counts):
            curve = self.curves[going[j]]
            _add(curve, trial.z[j], tangent[j], trial.derivative[j], moved[j])
            curve.end = "range" if outside[j] else ""
        taken: np.ndarray = going[counts]
        self.before[:, taken] = self.z[taken], self.tangent[taken]
        self.z[taken], self.tangent[taken] = trial.z[counts], tangent[counts]
        self.side[taken] = side[counts]
        self.equations.accepted(self.z[taken], taken)
        factor = np.where(counts, np.where(easy, 2.0, 1.0), 0.5)
        self.length[going] = np.minimum(factor * length, self._longest(going))
        for i in going[~counts & ~there & (self.length[going] < SHORTEST)]:
            self.curves[i].end = "lost"
        self._meet(taken)
        return taken

    def _longest(self, going: np.ndarray) -> np.ndarray:
        """The longest steps of curves, which grow where these are far from where they began; those
        of unknowns with a range don't.
        """
        way = (self.z[going] - self.began[going]) / self.equations.scale[going]
        away = np.linalg.norm(way, axis=1)
        within = np.abs(self.tangent[going][:, list(self.bounds)]).max(axis=1, initial=TINY)
        longest: np.ndarray = self.longest * np.clip(away / FAR, 1.0, 1.0 / within)
        return longest

    def halt(
        self,
        taken: np.ndarray,
        enough: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    ) -> None:
        """End the curves of which there is enough; see :func:`follow`."""
        rows = np.array([i for i in taken if not self.curves[i].end], np.int64)
        if len(rows):
            derivative = np.array([self.curves[i].derivative[-1] for i in rows])
            for i in rows[enough(self.z[rows], derivative, rows)]:
                self.curves[i].end = "enough"

    def undo(self, i: int, why: str) -> None:
        """Take the last point of a curve back: it lies beyond the end."""
        curve = self.curves[i]
        length = 0.5 * (curve.length[-1] - curve.length[-2])
        for kept in (curve.z, curve.tangent, curve.derivative, curve.length):
            kept.pop()
        self.z[i], self.tangent[i], self.length[i] = curve.z[-1], curve.tangent[-1], length
        self.side[i] = _orientation(curve.derivative[-1][None], curve.tangent[-1][None])[0]
        self.before[:, i] = (curve.z[-2], curve.tangent[-2]) if len(curve.z) > 1 else np.nan
        self.equations.accepted(self.z[[i]], np.array([i]))
        curve.end = why if length < ENDING else ""

    def _predicted(self, going: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points ahead on the curves, the planes in which they are corrected, and which land on an
        end of the range.
        """
        normal, here, whole = self.tangent[going].copy(), self.z[going], np.ones(len(going))
        share, at = whole.copy(), np.full(len(going), -1)
        guess = here + self._ahead(going, whole)
        straight = here + self.length[going, None] * normal * self.equations.scale[going]
        # by the tangent too: a curve that only touches the end of a range is to land there
        for column, (low, high) in self.bounds.items():
            for ahead in (straight[:, column], guess[:, column]):
                bound = np.clip(ahead, low, high)
                with np.errstate(invalid="ignore", divide="ignore"):
                    reach = (bound - here[:, column]) / (ahead - here[:, column])
                nearer = (bound != ahead) & (reach < share)
                if not nearer.any():
                    continue
                share[nearer], at[nearer] = reach[nearer], column
                guess[nearer] = here[nearer] + self._ahead(going[nearer], share[nearer])
                guess[nearer, column], normal[nearer] = bound[nearer], np.eye(len(here[0]))[column]
        return guess, normal, at >= 0

    def _ahead(self, going: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Steps of the curves over shares float64[g] of the next step lengths, by the cubic through
        the last two points with their tangents; by the tangent if there is only one point.
        """
        scale, here = self.equations.scale[going], self.tangent[going]
        length = (share * self.length[going])[:, None]
        before, slope = self.before[:, going]
        back = (before - self.z[going]) / scale
        chord = np.linalg.norm(back, axis=1)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            far = between(0.0 * back, back, -chord * here, -chord * slope, -length / chord)
        return np.asarray(np.where(np.isfinite(far), far, length * here) * scale)

    def _meet(self, taken: np.ndarray) -> None:
        """Close the curves that have passed their start as they left it, and stop those of their
        groups; of two groups of which one has passed the start of the other, stop the later.
        """
        for i, j in self._come_by(taken):
            curve, other = self.curves[i], self.curves[j]
            if self.group[i] != self.group[j]:
                if other.z and _passed(self.equations, curve, other, i, either_way=True):
                    self._stop(max(self.group[i], self.group[j]), "met")
            elif len(curve.z) >= LEAST_CLOSED and (
                passed := _passed(self.equations, curve, curve, i)
            ):
                for kept in (curve.z, curve.tangent, curve.derivative, curve.length):
                    kept.pop()
                start, tangent = passed
                apart = (start - curve.z[-1]) / self.equations.scale[i]
                _, derivative = self.equations.evaluate(start[None], np.array([i]))
                _add(curve, start, tangent, derivative[0], _size(apart))
                self._stop(self.group[i], "stopped")
                curve.end = "closed"

    def _come_by(self, taken: np.ndarray) -> list[tuple[int, int]]:
        """Curves whose last step may have passed the start of a curve: by their last unknown."""
        unit = self.equations.scale[taken, -1]
        here, before = self.z[taken, -1], self.before[0, taken, -1]
        bend = BENDS * np.linalg.norm(
            (self.z[taken] - self.before[0, taken]) / self.equations.scale[taken], axis=1
        )
        low, high = np.minimum(here, before) - bend * unit, np.maximum(here, before) + bend * unit
        own, began = self.group[taken, None] == self.group[self.firsts], self.began[:, -1]
        near = (low[:, None] <= began[self.firsts]) & (began[self.firsts] <= high[:, None]) & ~own
        others = [
            (int(taken[i]), int(self.firsts[j])) for i, j in zip(*np.nonzero(near), strict=True)
        ]
        mine = (low <= began[taken]) & (began[taken] <= high)
        return [*others, *((int(i), int(i)) for i in taken[mine])]

    def _stop(self, group: int, why: str) -> None:
        """Curves of a group go no farther."""
        for i in np.flatnonzero(self.group == group):
            self.curves[i].end = self.curves[i].end or why


def passes(curve: Arc, point: np.ndarray, scale: np.ndarray) -> bool:
    """True if the last step of a curve passes a point, by the cubic between its ends."""
    step, way = (curve.z[-1] - curve.z[-2]) / scale, (point - curve.z[-2]) / scale
    length = _size(step)
    share = float(way @ step) / length**2 if length else 0.0
    if not 0.0 < share <= 1.0:
        return False
    before, here = (length * tangent for tangent in curve.tangent[-2:])
    on = between(np.zeros_like(step), step, before, here, np.array(share))
    return _size(way - on) < PASSED * length


def _passed(
    equations: CurveEquations, curve: Arc, other: Arc, row: int, either_way: bool = False
) -> tuple[np.ndarray, np.ndarray] | None:
    """The start of another curve that a curve has passed, as the curve came by it, and the tangent
    there: in the direction in which the other one left; with ``either_way``, also in the opposite
    direction. None if it hasn't.
    """
    scale, one = equations.scale[row], np.array([row])
    starts = equations.alike(other.z[0][None], one)[0]
    ways = equations.alike(other.tangent[0][None] * scale, one)[0] / scale
    along = ways @ curve.tangent[-1]
    for same, way, size in zip(starts, ways, along, strict=True):
        if (abs(size) if either_way else size) >= AGAIN and passes(curve, same, scale):
            return same, way
    return None


def _orientation(derivative: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Sign of the determinant of the derivative with the tangent below, float64[k]: along a curve
    it changes at branch points only. 0 where there is none.
    """
    whole = np.concatenate([_finite(derivative), tangent[:, None]], axis=1)
    return np.asarray(np.linalg.slogdet(whole)[0])


def _size(vector: np.ndarray) -> float:
    return float(np.linalg.norm(vector))


def tangents_at(
    equations: CurveEquations, start: np.ndarray, along: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    """Tangents at points that lie nearly on the curves."""
    return tangents(_finite(equations.evaluate(start, rows)[1]), along)


def _finite(derivative: np.ndarray) -> np.ndarray:
    """Derivatives with zeros in place of those that aren't known."""
    return np.where(np.isfinite(derivative).all(axis=(1, 2))[:, None, None], derivative, 0.0)


def _add(
    curve: Arc, z: np.ndarray, tangent: np.ndarray, derivative: np.ndarray, moved: float
) -> None:
    curve.z.append(z.copy())
    curve.tangent.append(tangent.copy())
    curve.derivative.append(derivative.copy())
    curve.length.append((curve.length[-1] if curve.length else 0.0) + float(moved))
