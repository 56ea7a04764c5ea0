"""`branches`: all branches of periodic orbits and equilibria over a parameter, stable or not, and
their bifurcations.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.grid import check_grid, grid_of
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.branch_table import table_of
from saltus.analysis.branches.equilibrium_branches import trace_equilibria
from saltus.analysis.branches.harmonic_branches import trace_harmonics, worst
from saltus.analysis.branches.plans import LONGEST_DOUBLED, MOST_WORK, POINTS, SWITCHES, plan_of
from saltus.analysis.branches.run_seeds import seeds_in
from saltus.analysis.branches.seeds import equilibria_between, equilibrium_seeds, scaled, seeds_of
from saltus.analysis.branches.switching import Seed
from saltus.analysis.branches.tracing import Plan, trace
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.harmonics.balance import HarmonicBalance, check_balanced
from saltus.analysis.inputs.given import Range, Reading, Starts, Value
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.starts import at_values, check_system, range_of
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError, SaltusWarning, among, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method, exact_method
from saltus.flow.progress import reporting, stage
from saltus.interrupt import Interrupted
from saltus.sentences import Dialect, Word
from saltus.system import System

#: Share of the work until seeds are known.
SEEDING = 0.3


@verb
def branches(
    system: System,
    vary: Mapping[str, Range],
    start: xr.Dataset | Starts | None = None,
    *,
    box: Mapping[str, Range] | None = None,
    at: int = 12,
    switch: Sequence[str] = SWITCHES,
    longest: int = LONGEST_DOUBLED,
    points: int = POINTS,
    values: Mapping[str, Value] | None = None,
    outputs: Mapping[str, Reading] | None = None,
    every: float | str | None = None,
    method: Method | None = None,
    by: HarmonicBalance | None = None,
    periods: int = 2000,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Branches of periodic orbits over a parameter, stable and unstable, with folds, period
    doublings, branch points, tori and grazes.

    1. Seeds are the orbits of ``start``, or the orbits that starts settle to at ``at`` values of
       the parameter: continuation needs an orbit to begin with.
    2. Newton's method closes each seed. Seeds on a branch that was followed already, or on its
       mirror image, are dropped, so each branch is listed once.
    3. The branch is followed by pseudo-arclength continuation on the exact flow in both directions,
       until it leaves the range or closes (an isola). Steps in arclength pass folds like any other
       point. Contacts come and go by themselves; no contact sequence is given. Derivatives, also
       with respect to the parameter, are those of the tangent flow.
    4. Orbits with impacts are followed from contact to contact, through the grazes at which an
       impact appears or vanishes, because the map over a period isn't smooth there.
    5. Events are located to rounding where a test function changes its sign. Where the number of
       multipliers outside the unit circle changes otherwise, the step is refined; what stays
       unexplained is counted in ``branch_unexplained``. Grazes and corners are left out of systems
       with more than 13 states.
    6. The branches that leave at the events in ``switch`` are seeds of their own, begun beside the
       event.

    Of a system without forcing branches of equilibria are followed too, with their eigenvalues, one
    branch in each mode, from mode to mode through boundary equilibria, and the limit cycles that
    are born at their Hopf points. Equilibria that a contact holds aren't followed.

    Parameters
    ----------
    system : System
        Forced, or without forcing: then its equilibria are followed, and its limit cycles, with
        their period.
    vary : mapping
        One parameter and its range, such as ``{"frequency": ("2 Hz", "30 Hz")}``.
    start : Dataset, or starts
        What :func:`saltus.frequency_response`, :func:`saltus.bifurcation_diagram`,
        :func:`saltus.attractors` or :func:`saltus.basins` returned: each of its periodic orbits is
        followed, and each equilibrium, also of :func:`saltus.equilibria`. Or starts as for these:
        they are run at ``at`` values of the parameter first, and are where Newton's method looks
        for equilibria.
        Default: at rest.
    box : mapping, optional
        Range (low, high) of each state for random starts: ``start="random 20"``.
    at : int
        Values of the parameter at which starts are run.
    switch : sequence of str
        Events at which the branches that leave are followed too.
    longest : int
        Doubled branches are followed up to orbits of this number of forcing periods.
    points : int
        Most points of a branch in each direction. All branches together have so many points that
        these times the periods of their orbits times the square of the states are 40 000 times
        ``points``, 4e7 by default: beyond that branches end, and ``orbits_not_followed`` of the
        result is how many orbits weren't followed.
    values : mapping, optional
        Other values of parameters.
    outputs : mapping of str to callable, or to (callable, unit), optional
        What to read off each orbit besides the states, as for :func:`saltus.frequency_response`.
    every : float or str, optional
        For starts of a system without forcing: time between two samples [s].
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one must be exact.
    by : HarmonicBalance, optional
        Motions of a few harmonics are followed in place of exact orbits, and each is held against
        the exact orbit beside it: see :class:`saltus.HarmonicBalance`.
    periods : int
        For starts: forcing periods after which a trajectory hasn't settled. Starts have a budget:
        beyond 2e9 periods times the square of the states, some five minutes, no more values are
        run, and a warning says how many weren't. The first ones are spread over the range. Starts
        that sweep have no budget but the periods.
    seed : int
        Of random starts.
    threads : int, optional
        Default all processors.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``point``, ``branch``, ``event``, ``multiplier``, ``orbit_point``,
        ``output``. On point:
        ``point_branch``, ``point_<parameter>``, ``point_stable``, ``point_unstable_multipliers``,
        ``point_period`` [s], ``point_peak`` and ``point_rms`` of the first state,
        ``point_contacts``, ``point_itinerary``, ``point_margin``, multipliers (of a limit cycle
        without the trivial one), the states at whole forcing periods, ``point_arclength``, and
        ``point_output_maximum`` and so on of each state and output. On branch:
        ``branch_kind`` (``periodic``, ``limit_cycle``, ``equilibrium``; these have
        ``point_eigenvalue_real`` and ``_imag`` [1/s] in place of multipliers and a period),
        ``branch_periods``, ``branch_closed``, ``branch_parent``, ``branch_begin``, ``branch_end``
        (``accumulates``: its grazes do, at ``branch_begin_limit`` or ``branch_end_limit``;
        ``held``: the chatter before a held contact is cut short, and orbits beyond are another
        branch),
        ``branch_twin``: whether its mirror image, in symmetric equations, is a branch of its own,
        which isn't listed. On event: ``event_kind`` (``fold``, ``period_doubling``,
        ``branch_point``, ``neimark_sacker``; ``hopf`` and ``boundary_equilibrium`` of equilibria;
        ``graze``: a contact appears or vanishes; ``corner``: two contacts come at once),
        ``event_<parameter>``, its states and multipliers, ``event_guard`` and ``event_phase`` of a
        graze or corner, ``event_sqrt_coefficient`` of a graze (see
        :func:`saltus.bifurcation_curve`), and of a graze of orbits with impacts
        ``event_outcome``: ``persistence``, where orbits with the impact go on from those without
        it, or ``nonsmooth_fold``, where both lie on one side; the same of equilibria on both sides
        of a boundary; of a Hopf point ``supercritical`` (stable cycles are born), ``subcritical``,
        or empty where the linear part doesn't tell.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or no periodic orbit is found to begin with.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the branches that were finished, and of the
        points so far of those that weren't, which end with ``interrupted``.

    References
    ----------
    Keller, in Applications of Bifurcation Theory (1977) 359-384; Kuznetsov, Elements of Applied
    Bifurcation Theory (2004), chapter 10; Leine & Nijmeijer, Dynamics and Bifurcations of
    Non-Smooth Mechanical Systems (2004).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> start = {"x": "5 mm", "v": 0}
    >>> found = sl.branches(rig, {"frequency": ("15 Hz", "18 Hz")}, start, at=3)
    >>> [f"{kind} at {f:.6f} Hz" for kind, f in zip(found.event_kind.values,
    ...                                              found.event_frequency.values)]
    ['fold at 17.734087 Hz']
    """
    check_system(system)
    method, system = exact_method(method, system, "sl.branches"), at_values(system, values)
    name, limits = _range(system, vary)
    if by is not None:
        check_balanced(by, system)
    chosen = frozenset(_kinds(switch))
    wanted = outputs_of(system, outputs)
    longest, points = whole(longest, "longest", 1), whole(points, "points", 2)
    done = list[Branch]()
    with reporting(progress) as show:
        try:
            from_rest = by is not None and start is None
            begins, equilibria = (
                ([], [])
                if from_rest
                else seeds_between(
                    system,
                    name,
                    limits,
                    start,
                    box,
                    at,
                    seed,
                    every,
                    method,
                    periods,
                    threads,
                    stage(show, 0.0, SEEDING),
                )
            )
            if not begins and not equilibria and not from_rest:
                raise ParameterError(
                    lambda say: (
                        f"no periodic orbit of {system.name} is known between "
                        f"{limits[0]:g} and {limits[1]:g}: give other starts, more of them "
                        f"({say.key(start='random 20')} with {say.key('box')}), or longer runs "
                        f"({say.key('periods')}). Orbits with a multiplier of 1, as where "
                        "static friction holds a body all the time, lead on to no branch."
                    )
                )
            plan = plan_of(
                system, name, limits, method, threads, points, longest, chosen,
                most=MOST_WORK * points / POINTS,
            )  # fmt: skip
            if by is None:
                follow_all(plan, system, name, begins, equilibria, done, stage(show, SEEDING, 0.9))
            else:
                count = whole(at, "at", 1, 1000) if from_rest else 0
                rest = np.linspace(*limits, count + 2)[1:-1].tolist()
                tries = by.tries
                for by in tries:
                    done.clear()
                    trace_harmonics(plan, system, name, begins, rest, by, done, method, threads)
                    if by is not tries[-1] and worst(done, wanted, by) < by.accuracy:
                        break
        except KeyboardInterrupt:
            partial = functools.partial(table_of, system, name, limits, done, wanted, method, by)
            raise Interrupted(partial) from None
        table = table_of(system, name, limits, done, wanted, method, by)
        return table.assign_attrs(orbits_not_followed=plan.watch.left) if plan.watch.over else table


def seeds_between(
    system: System,
    name: str,
    limits: tuple[float, float],
    start: Any,
    box: Any = None,
    at: Any = 12,
    seed: int = 1,
    every: Any = None,
    method: Method | None = None,
    periods: int = 2000,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[list[Seed], list[Seed]]:
    """Seeds of branches over a parameter between two values [SI]: of those of orbits, and those of
    equilibria. Arguments as for :func:`branches`.
    """
    method, equilibria = check_method(method, system), list[Seed]()
    if isinstance(start, xr.Dataset):
        begins = seeds_of(system, name, start)
        equilibria = [] if system.forced_at else equilibrium_seeds(system, name, start)
    else:
        check_grid(system, whole(at, "at", 1), start)
        places = np.linspace(*limits, int(at) + 2)[1:-1]
        grid = grid_of(system, {name: places}, start, box, None, seed, None, every)
        if autonomous(system):
            equilibria = equilibria_between(system, name, limits, grid.starts)
        begins, left = seeds_in(grid, method, periods, threads, progress)
        if left:
            warnings.warn(
                f"{left} of {at} values of {name} weren't run for seeds: the others took all the "
                "work that seeds may take. Branches that lie at these alone are missing: give "
                "fewer periods, a narrower range, or start= with what sl.frequency_response found.",
                SaltusWarning,
                stacklevel=2,
            )
    begins = scaled(system, name, _inside(begins, limits), method)
    return begins, _inside(equilibria, limits)


def follow_all(
    plan: Plan,
    system: System,
    name: str,
    begins: list[Seed],
    equilibria: list[Seed],
    done: list[Branch],
    progress: Callable[[float], None] | None = None,
) -> None:
    """Add the branches that seeds lie on to those that are known. Seeds on a known one are left
    out.
    """
    born = trace_equilibria(plan, system, name, equilibria, done) if equilibria else []
    born = born if "hopf" in plan.switch else []
    trace(plan, [*born, *begins], done, progress)


def _two_parameters(say: Dialect) -> str:
    ranges = "system, {one: (low, high, number), two: (low, high, number)}"
    return (
        f" Two parameters: {say.verb('bifurcation_curve')} follows a bifurcation over both, and "
        f"{say.verb('bifurcation_diagram', ranges)} maps the kinds of motion."
    )


def _range(system: System, vary: Any) -> tuple[str, tuple[float, float]]:
    """The parameter and its range [SI]."""
    example = next(iter(system.values), "name")
    if not isinstance(vary, Mapping) or len(vary) != 1:
        raise ParameterError(
            lambda say: (
                f"{say.either('sl.branches follows', 'follows')} one parameter: "
                f"{say.key(vary={example: (Word('low'), Word('high'))})}, not {shown(vary)}."
            ),
            _two_parameters if isinstance(vary, Mapping) and len(vary) > 1 else "",
        )
    ((name, ends),) = vary.items()
    return name, range_of(system, name, ends)


def _kinds(switch: Any) -> Sequence[str]:
    """Kinds of events, checked."""
    given = tuple(switch) if isinstance(switch, list | tuple | set | frozenset) else (switch,)
    for one in given:
        if not among(one, SWITCHES):
            raise ParameterError(f"switch={shown(one)} isn't known. {nearest(one, SWITCHES)}")
    return given


def _inside(seeds: list[Seed], limits: tuple[float, float]) -> list[Seed]:
    return [seed for seed in seeds if limits[0] <= seed.others[-1] <= limits[1]]
