"""`scatter`: the effect of uncertain parameters on motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import xarray as xr

from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.verb import verb
from saltus.analysis.scatter.answers import Ask, asked, steady
from saltus.analysis.scatter.plan import scatter_plan
from saltus.errors import ParameterError, must_be
from saltus.flow.methods import Method
from saltus.flow.progress import reporting
from saltus.system import System

if TYPE_CHECKING:
    from saltus.analysis.inputs.given import Range, Reading, Starts, Value
    from saltus.distributions import Distribution


@verb
def scatter(
    system: System,
    uncertain: Mapping[str, Distribution],
    start: Starts | None = None,
    *,
    ask: Ask | None = None,
    samples: int = 1024,
    seed: int = 1,
    indices: bool = False,
    box: Mapping[str, Range] | None = None,
    values: Mapping[str, Value] | None = None,
    outputs: Mapping[str, Reading] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Effect of uncertain parameters on motions: quantiles of their numbers, the probability that
    each response exists and that a start reaches it, and the share of each parameter.

    1. Sets of values are drawn by scrambled Sobol points, which fill the space of the parameters
       more evenly than independent draws: errors of means fall nearly as 1/samples.
    2. All starts are followed in all sets at once until they settle, as by
       :func:`saltus.attractors`.
    3. Each response is followed by Newton's method from the set in which it was found to all
       others: so it is known whether it exists there though no start reaches it, and which
       responses of two sets are one.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    uncertain : mapping of str to Distribution
        Distributions of parameters by name: :func:`saltus.normal`, :func:`saltus.uniform`,
        :func:`saltus.lognormal`, :func:`saltus.triangular`, :func:`saltus.truncated`,
        :func:`saltus.distribution`. They are independent of each other.
    start : sequence, mapping, array or str
        Starts as for :func:`saltus.frequency_response`, the same in every set; ``"random 20"`` with
        ``box``. Default: at rest.
    ask : callable, optional
        In place of steady responses: a function ``ask(system, values)`` that gets the values of
        some sets, an array for each uncertain parameter, and gives numbers by name, an array each.
        It may call any function, such as ``saltus.simulate(system, values=values, ...)``.
    samples : int
        Sets of values. A power of two is best.
    seed : int
        Of the scrambling, and of random starts: the same seed gives the same sets everywhere.
    indices : bool
        Whether to tell Sobol indices: for d parameters that takes d + 2 times as many sets.
    box : mapping, optional
        Range (low, high) of each state for random starts.
    values : mapping, optional
        Other values of the parameters that are certain.
    outputs : mapping, optional
        What to read off each response besides states and named outputs, as for
        :func:`saltus.frequency_response`, such as the force of a stop.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    periods : int
        Forcing periods after which a trajectory that hasn't settled is looked at for chaos. It
        bounds the work, as for :func:`saltus.frequency_response`; at most 24 responses are followed
        to all sets, what is beyond them is ``other``.
    every : float or str, optional
        Time between two samples [s] of a system without forcing; default about a turn of its
        motions.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``set``, ``uncertain``, ``start``, ``outcome``, ``response``, ``quantile``. ``value``
        of each parameter in each set; ``number`` (set, start, outcome), NaN where there is none;
        ``quantile_of`` with the ends of its 95 % interval, which hold for every distribution of
        independent sets. On response: ``response_type``, ``response_period``,
        ``response_quantile`` of its outcomes, ``probability_exists``, and ``probability_reached``
        from each start, with 95 % Wilson intervals; ``response_of`` and ``exists`` in each set.
        Where ``response_followed`` is 0 (what never repeats, and systems without forcing) motions
        of one kind are one response, which exists where a start reaches it. With ``indices``:
        ``first_index`` and ``total_index``. Sets whose values the system doesn't take have
        ``set_status`` refused and are in no statistics.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or all sets are refused.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the sets that were finished.

    References
    ----------
    Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270 (indices); Wilson, J. Am. Stat. Assoc.
    22 (1927) 209-212; Owen, J. Complexity 14 (1998) 466-489 (scrambled points).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="15 Hz")
    >>> gap = sl.normal("0.4 mm", "0.02 mm")
    >>> found = sl.scatter(rig, {"upper_gap": gap}, start=("5 mm", 0), samples=16)
    >>> found["response_period"].values.tolist(), found["probability_exists"].values.tolist()
    ([1], [1.0])
    """
    if ask is not None:
        if not callable(ask):
            raise must_be("ask", "a function of the system and of values", ask)
        taken = {"start": start, "box": box, "outputs": outputs, "every": every}
        for name, given in taken.items():
            if given is not None:
                raise ParameterError(f"ask computes what it likes: give {name} to what it calls.")
    plan = scatter_plan(
        system, uncertain, start, samples=samples, seed=seed, indices=indices, box=box,
        values=values, method=method, periods=periods,
    )  # fmt: skip
    with reporting(progress) as show:
        if ask is not None:
            found = asked(plan.design, plan.sets[plan.taken], ask, show)
        else:
            read = outputs_of(plan.design.system, outputs)
            found = steady(plan.grid(every), plan.method, plan.periods, read, threads, show)
        return plan.finished(found, ask is not None)
