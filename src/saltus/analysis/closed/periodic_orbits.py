"""`periodic_orbits`: the periodic orbits of a system, stable and unstable."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.closed.all_cycles import all_cycles
from saltus.analysis.closed.all_orbits import all_orbits
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.orbit_table import table_of
from saltus.analysis.closed.search import AGES, Family, Search
from saltus.analysis.closed.spread import spread
from saltus.analysis.closed.turns import looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.given import Range, Starts, Value
from saltus.analysis.inputs.random_starts import random_count, random_starts
from saltus.analysis.inputs.starts import check_system, ensemble, trajectories
from saltus.analysis.inputs.verb import verb
from saltus.analysis.solve.tolerances import LONGEST
from saltus.errors import ParameterError, shown
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.room import check_room
from saltus.flow.taylor import Taylor
from saltus.interrupt import answered
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.orbits import OrbitTable
from saltus.system import System
from saltus.units import to_si

#: Steps for each iterate of a trial's motion, unless the method says how many. The rig takes 14 a
#: period from where it moves, 5 million from a kilometre away.
STEPS = 10_000
#: Contacts for each iterate likewise: a ball that keeps 0.9 of its speed comes to rest in 200, and
#: never where the impacts are written as jumps.
CONTACTS = 1000
#: Periods of the motion from rest whose points are starts where none are given.
FROM_REST = 64
#: States from which on Newton's method is dear, and the random starts there: of eight modes each
#: takes a second.
MANY_STATES, FEW_STARTS = 8, 64


@verb
def periodic_orbits(
    system: System,
    start: Starts | None = None,
    *,
    box: Mapping[str, Range] | None = None,
    periods: int = 3,
    period: Value | Range | None = None,
    method: Method | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The periodic orbits of a system, stable and unstable: of a forced one those with periods up
    to a number of forcing periods, of one without forcing its limit cycles.

    1. Starts are followed for none or some periods before Newton's method begins, in rotation: none
       finds repelling orbits, some periods reach a chaotic set and the orbits in it.
    2. For each period Newton's method is started from their next iterates, with the points of an
       orbit at whole forcing periods as unknowns (multiple shooting: errors grow over one forcing
       period only). Steps are shortened until they help; derivatives are those of the exact tangent
       flow.
    3. Orbits are reduced to their least period, and each is listed once.
    4. Newton's method is started again with the known orbits deflated: their zeros are divided out,
       so that only others can be found. Starts beside known orbits find the second of a pair that a
       fold has made.
    5. No search of this kind finds every orbit for sure. From the orbits that only one start led
       to, ``search_unseen`` estimates the share of those that were missed.
    6. Without forcing, the period is one more unknown. Close returns of the motions give first
       guesses of a state and a period, as a motion on a chaotic set passes near its unstable
       cycles. A cycle is the same whatever its phase, for deflation too. Cycles that lie side by
       side in families, as where energy is conserved, aren't found.

    Parameters
    ----------
    system : System
        Forced; or nothing in it depends on time.
    start : sequence, mapping, array or str
        Where to begin, as for :func:`saltus.simulate`, one or many; ``"random 1000"`` with
        ``box``, which is the default there, of more than seven states ``"random 64"``. Without a
        box the default of a forced system are 64 points of its motion from rest, one each period
        from the start on; of more than seven states 16 of the first 64.
    box : mapping, optional
        Range (low, high) of each state, or of what sensors of a structure show, for random starts.
        Orbits may leave it.
    periods : int
        Longest period looked for [forcing periods; about a turn of the motion each, in a system
        without forcing].
    period : float, str or pair of them, optional
        Of a system without forcing, in place of ``periods``: the range of periods looked for,
        ``("1 s", "5 s")``, or a first guess, which stands for half to twice of it.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one has errors that keep unstable orbits from
        closing. Its budgets, ``max_steps`` and ``max_events``, are those of each motion that is
        followed; default: 10 000 steps and 1000 contacts for each forcing period or turn, 12 of
        which a start may be followed before the search begins. Starts that need more, as those
        that chatter without end, are given up.
    seed : int
        Of random starts.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dim ``orbit``, each once, by period: ``orbit_period`` (the n of nT, the least; 0 of limit
        cycles, whose period is ``orbit_cycle`` [s]),
        ``orbit_stable``, ``orbit_stability`` (``stable node``, ``stable focus``, ``saddle``,
        ``inverse saddle``, ``unstable node``, ``unstable focus``, ``marginal``),
        ``orbit_unstable_directions``, ``orbit_found`` (starts that led to it; 0 if only deflation
        did), ``orbit_mismatch``, and as of attractors ``orbit_contacts``, ``orbit_itinerary``,
        ``orbit_peak``, ``orbit_rms``, ``orbit_margin``, multipliers, ``orbit_exponent`` [1/s] and
        its states at whole periods, dims (orbit, phase); of a limit cycle in equal steps of its
        period, and the multipliers are those beside the trivial 1. Dim ``search_period``, a search
        each (of limit cycles one, 0):
        ``search_converged`` of the starts led to an orbit, ``search_found_once`` orbits were found
        by one start only, ``search_unseen`` is their ratio: the share of converging starts whose
        orbit isn't known yet, as Good and Turing estimate it; ``search_deflated`` orbits were found
        by deflation only, ``search_exhausted`` says whether that ended by finding nothing more,
        and ``search_given_up`` starts were dropped, since their motion used up its budget.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the orbits that were found by then. A search
        that was stopped isn't ``search_exhausted``.

    References
    ----------
    Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter 5; Deuflhard,
    Newton Methods for Nonlinear Problems (2004), chapter 3; Auerbach, Cvitanovic, Eckmann,
    Gunaratne & Procaccia, Phys. Rev. Lett. 58 (1987) 2387-2389; Farrell, Birkisson & Funke, SIAM J.
    Sci. Comput. 37 (2015) A2026-A2045; Good, Biometrika 40 (1953) 237-264.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    >>> box = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
    >>> orbits = sl.periodic_orbits(rig, "random 200", box=box, periods=1)
    >>> orbits["orbit_stability"].values.tolist()
    ['saddle', 'inverse saddle', 'stable focus']
    """
    check_system(system)
    periods = whole(periods, "periods", 1, LONGEST)
    size = len(system.states)
    method = exact_method(method, system)
    if start is None:
        start = _usual(system, method, box, threads)
    many = random_count(start) if isinstance(start, str) else trajectories(start, None)
    check_room(many * periods * size * 400.0, f"{many} starts", "Take fewer.")
    states = (
        random_starts(system, start, box, seed)
        if isinstance(start, str)
        else _given(system, start, box)
    )
    attrs = provenance(system, method, system.values) | {"starts": len(states), "seed": seed}
    if system.forced_at is None:
        rotation = _turn(system, states)
        limits, guess = _range(period, (0.0, (periods + 0.5) * rotation))
        method = _with_budget(method, max(AGES[-1], limits[1] / rotation))
        looks = Stroboscope(system, method, every=rotation, threads=threads)
        attrs |= {"shortest_period": limits[0], "longest_period": limits[1]}
        with reporting(progress) as show:
            return answered(
                lambda: all_cycles(looks, states, limits, guess or rotation, show),
                lambda found: _dataset(looks, attrs, found),
            )
    if period is not None:
        raise ParameterError(
            lambda say: (
                f"{system.name} is forced: its orbits last whole forcing periods. Give "
                f"{say.key('periods')}, the longest of them, in place of {say.key('period')}."
            )
        )
    map_ = Stroboscope(system, _with_budget(method, 1), threads=threads)
    before = map_.by(_with_budget(method, AGES[-1] + periods))
    attrs |= {"periods": periods}
    with reporting(progress) as show:
        scale = spread(before, states)
        return answered(
            lambda: all_orbits(map_, states, periods, scale, show, before),
            lambda found: _dataset(map_, attrs, found),
        )


def _usual(system: System, method: Method, box: Any, threads: int | None) -> Any:
    """The starts where none are given."""
    many = len(system.states) >= MANY_STATES
    if box is not None or system.forced_at is None:
        return f"random {FEW_STARTS if many else 1000}"
    rest = ensemble(system, None, None).start
    map_ = Stroboscope(system, _with_budget(method, FROM_REST), threads=threads)
    found = map_.launch(rest, FROM_REST).advance(FROM_REST - 1)
    points = np.concatenate([rest[:, None], found], axis=1)[0, :: 4 if many else 1]
    return points[np.isfinite(points).all(axis=1)]


def _dataset(map_: Stroboscope, attrs: Mapping[str, Any], found: Family[Any]) -> xr.Dataset:
    table = table_of(map_, found.motions, found.found)
    return orbits_dataset(map_.system, attrs, table, searches(found.searches))


def _turn(system: System, states: np.ndarray) -> float:
    """About a turn of the motions of a system without forcing [s]."""
    if not autonomous(system):
        raise ParameterError(
            lambda say: (
                f"{system.name} depends on time, without a forcing period: none of its "
                f"motions need repeat. Name the parameter that forces it: {say.key('forced_at')}."
            )
        )
    every = looks_every(system, None, states)
    assert every is not None
    return every


def _range(period: Any, default: tuple[float, float]) -> tuple[tuple[float, float], float | None]:
    """Shortest and longest period, and a first guess, if there is one [s]."""
    if period is None:
        return default, None
    pair = isinstance(period, (tuple, list)) and len(period) == 2
    ends = [to_si(one, "s", "period") for one in (period if pair else (period,))]
    if not (np.isfinite(ends).all() and ends[-1] > 0 and (not pair or 0 <= ends[0] < ends[1])):
        raise ParameterError(
            lambda say: (
                "period must be a positive time or an ascending range of them, such as "
                f"{say.key(period=('1 s', '5 s'))}, not {shown(period)}."
            )
        )
    if pair:
        return (ends[0], ends[1]), None
    return (0.5 * ends[0], 2.0 * ends[0]), ends[0]


def exact_method(method: Method | None, system: System) -> Method:
    """The method. Raises ParameterError for one whose errors are more than rounding."""
    method = check_method(method, system)
    if not method.exact:
        raise ParameterError(
            lambda say: (
                f"errors of {method.name} keep unstable orbits from closing. Leave "
                f"{say.key('method')} out: Taylor integrates to rounding."
            )
        )
    return method


def _with_budget(method: Method, iterates: float) -> Method:
    """The method with a budget of steps and contacts for motions that last so many iterates."""
    if not isinstance(method, Taylor):
        return method
    budget = {"max_steps": STEPS, "max_events": CONTACTS}
    usual = Taylor()
    return replace(
        method,
        **{
            name: each * math.ceil(iterates)
            for name, each in budget.items()
            if getattr(method, name) == getattr(usual, name)
        },
    )


def _given(system: System, start: Any, box: Any) -> np.ndarray:
    """The starts that were given, float64[k, D]."""
    if box is not None:
        raise ParameterError(
            lambda say: f"{say.key('box')} is for random starts: {say.key(start='random 1000')}."
        )
    return ensemble(system, start, None).start


def searches(each: Sequence[Search]) -> dict[str, Any]:
    """Outcome of the searches, by the names of the variables."""
    return {
        "search_period": [one.period for one in each],
        **{
            f"search_{name}": [getattr(one, name) for one in each]
            for name in ("converged", "found_once", "unseen", "deflated", "exhausted", "given_up")
        },
    }


def orbits_dataset(
    system: System, attrs: Mapping[str, Any], table: OrbitTable, more: Mapping[str, Any]
) -> xr.Dataset:
    """The Dataset of periodic orbits, with other variables."""
    return build(
        schema.ORBITS,
        subject(system, attrs),
        {**table.values(len(system.states)), **more},
        words={"<when>": table.orbits.points_when},
    )
