"""`scatter`: the effect of uncertain parameters on motions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.grid import check_grid
from saltus.analysis.closed.turns import ASKED, looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.random_starts import random_starts
from saltus.analysis.inputs.starts import at_values, check_system, ensemble
from saltus.analysis.inputs.verb import verb
from saltus.analysis.scatter import numbers as statistics
from saltus.analysis.scatter.answers import Answers, Ask, SetGrid, asked, steady
from saltus.analysis.scatter.sets import Design, design_of
from saltus.errors import ParameterError, SaltusWarning, counted, must_be
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.interrupt import Interrupted
from saltus.intervals import wilson
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.kinds import Kind
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
    check_system(system)
    samples, seed, periods = (
        whole(samples, "samples"),
        whole(seed, "seed", 0),
        whole(periods, "periods"),
    )
    system = at_values(system, values)
    design = design_of(system, uncertain, samples, seed, indices)
    method = check_method(method, system)
    if ask is not None:
        if not callable(ask):
            raise must_be("ask", "a function of the system and of values", ask)
        taken = {"start": start, "box": box, "outputs": outputs, "every": every}
        for name, given in taken.items():
            if given is not None:
                raise ParameterError(f"ask computes what it likes: give {name} to what it calls.")
    starts = _starts(system, start, box, seed)
    sets = design.values(np.arange(len(design)))
    taken_sets, why = design.accepted(sets)
    if not taken_sets[:samples].any():
        raise ParameterError(f"{system.name} takes none of the {samples} sets: ", why)
    rows = sets[taken_sets]
    part = partial(_dataset, design, method, periods, starts, sets, taken_sets)
    with reporting(progress) as show:
        if ask is None:
            check_grid(system, len(rows), starts)
            grid = _grid(design, rows, starts, every)
            read = outputs_of(system, outputs)
            found = steady(grid, method, periods, read, threads, show)
        else:
            found = asked(design, rows, ask, show)
    if not found.complete:
        raise Interrupted(lambda: part(found, None if ask is None else "function"))
    result = part(found, None if ask is None else "function")
    refused = int(np.count_nonzero(~taken_sets[:samples]))
    if refused:
        warnings.warn(
            SaltusWarning(
                f"{counted(refused, 'set')} of {samples} were refused and are in no statistics: "
                f"{why} sl.truncated(...) keeps such values out."
            ),
            stacklevel=2,
        )
    return result


def _starts(system: System, start: Any, box: Any, seed: int) -> np.ndarray:
    """The starts, float64[s, D]."""
    if isinstance(start, str):
        return random_starts(system, start, box, seed)
    if box is not None:
        raise ParameterError(
            lambda say: f"{say.key('box')} is for random starts: {say.key(start='random 20')}."
        )
    return ensemble(system, np.zeros(len(system.states)) if start is None else start, None).start


def _grid(design: Design, values: np.ndarray, starts: np.ndarray, every: Any) -> SetGrid:
    """The sets as places, with the time between two looks at a motion without forcing."""
    rows = design.rows(values)
    some = np.unique(np.linspace(0, len(rows) - 1, ASKED).astype(int))
    begin = starts[np.arange(len(some)) % len(starts)]
    looks = looks_every(design.system, every, begin, rows[some])
    return SetGrid(design.system, {}, starts, every=looks, values=rows)


def _dataset(
    design: Design, method: Method, periods: int, starts: np.ndarray, sets: np.ndarray,
    taken: np.ndarray, found: Answers, ask: str | None,
) -> xr.Dataset:  # fmt: skip
    """The Dataset of what was found in the sets that were taken."""
    system, n = design.system, design.samples
    count, wide = found.reached.shape[1], len(found.names)
    numbers = np.full((len(sets), count, wide), np.nan)
    reached = np.full((len(sets), count), Kind.NOT_COMPUTED, np.int64)
    numbers[taken], reached[taken] = found.numbers, found.reached
    own = taken[:n]
    done = own & (reached[:n] != Kind.NOT_COMPUTED).all(axis=1)
    middle, low, high = statistics.quantiles(numbers[:n])
    names = list(design.uncertain)
    units = [system.units.get(name, "") for name in names]
    values = {
        "set": np.arange(n),
        "set_status": np.where(done, "computed", np.where(own, "not_computed", "refused")),
        "uncertain": names,
        "uncertain_units": units,
        "uncertain_distribution": [
            one.text(unit, name)
            for (name, one), unit in zip(design.uncertain.items(), units, strict=True)
        ],
        "value": sets[:n],
        "start": np.arange(count),
        **({} if ask else {"start_<state>": starts}),
        "outcome": found.names,
        "outcome_units": found.units,
        "number": numbers[:n],
        "quantile": np.array(statistics.QUANTILES),
        "quantile_of": middle,
        "quantile_low": low,
        "quantile_high": high,
        **({} if ask else _responses(found, taken, reached, numbers, n, done)),
        **(_indices(design, numbers) if design.indices else {}),
    }
    certain = {key: value for key, value in system.values.items() if key not in names}
    attrs = provenance(system, method, certain) | {
        "samples": n,
        "seed": design.seed,
        **({} if ask else {"periods": periods}),
    }
    return build(schema.SCATTER, subject(system, attrs), values, words={"<uncertain>": ""})


def _responses(
    found: Answers, taken: np.ndarray, reached: np.ndarray, numbers: np.ndarray, n: int,
    done: np.ndarray,
) -> dict[str, Any]:  # fmt: skip
    """The responses and their probabilities, of the sets of the statistics."""
    exists = np.zeros((len(taken), len(found.responses)), bool)
    for k, one in enumerate(found.responses):
        exists[taken, k] = one.exists
    exists, reached, sets = exists[:n], reached[:n], int(done.sum())
    of_each = []
    for k in range(len(found.responses)):
        some, first = (reached == k).any(axis=1), np.argmax(reached == k, axis=1)
        of_each.append(statistics.quantiles(numbers[:n][some, first[some]])[0])
    middle = [of_one[len(of_one) // 2, 0] for of_one in of_each]
    seen = sorted(
        (k for k in range(len(found.responses)) if exists[:, k].any()),
        key=lambda k: (
            found.responses[k].kind,
            found.responses[k].period,
            np.nan_to_num(middle[k]),
        ),
    )
    renumber = np.zeros(len(found.responses) + 1, int)
    renumber[seen] = np.arange(len(seen))
    reached = np.where(reached >= 0, renumber[np.maximum(reached, 0)], reached)
    each = np.arange(len(seen))[:, None, None]
    hits = np.count_nonzero(reached[done] == each, axis=1).T
    there = np.count_nonzero(exists[done][:, seen], axis=0)
    responses = [found.responses[k] for k in seen]
    return {
        "response": np.arange(len(seen)),
        "response_type": [one.kind.word for one in responses],
        "response_period": np.array([one.period for one in responses], int),
        "response_followed": np.array([one.complete for one in responses], int),
        "response_of": reached,
        "exists": exists[:, seen].astype(int),
        **_ends("probability_exists", there, sets),
        **_ends("probability_reached", hits, sets),
        "response_quantile": np.array([of_each[k] for k in seen]).reshape(
            len(seen), len(statistics.QUANTILES), numbers.shape[2]
        ),
    }  # fmt: skip


def _ends(name: str, count: np.ndarray, sets: int) -> dict[str, np.ndarray]:
    """A probability, and the ends of its interval."""
    low, high = wilson(count, sets)
    return {name: count / max(sets, 1), f"{name}_low": low, f"{name}_high": high}


def _indices(design: Design, numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Sobol indices of each number from each start."""
    d, (_, count, wide) = len(design.uncertain), numbers.shape
    blocks = numbers.reshape(d + 2, design.samples, count, wide)
    found = np.full((2, 3, count, wide, d), np.nan)
    for i in range(count):
        for k in range(wide):
            first, other, *swapped = blocks[..., i, k]
            found[:, :, i, k] = statistics.sobol_indices(
                first, other, np.array(swapped), design.seed
            )
    return {
        f"{word}_index{end}": found[i, j]
        for i, word in enumerate(("first", "total"))
        for j, end in enumerate(("", "_low", "_high"))
    }
