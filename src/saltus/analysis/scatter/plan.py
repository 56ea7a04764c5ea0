"""Plan of a scatter: the sets, the starts, and the Dataset of what is found in them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.grid import check_grid
from saltus.analysis.closed.turns import ASKED, looks_every
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.random_starts import random_starts
from saltus.analysis.inputs.starts import at_values, check_system, ensemble
from saltus.analysis.scatter import numbers as statistics
from saltus.analysis.scatter.answers import Answers, SetGrid
from saltus.analysis.scatter.sets import Design, design_of
from saltus.errors import ParameterError, SaltusWarning, counted
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.interrupt import Interrupted
from saltus.intervals import wilson
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.kinds import Kind
from saltus.system import System


@dataclass(frozen=True)
class ScatterPlan:
    """Sets of values, and how motions are followed in them.

    Attributes
    ----------
    design : Design
        The sets.
    starts : float64[s, D]
        States at the start [SI], the same in every set.
    method : Method
        The method of integration.
    periods : int
        Forcing periods that a trajectory is followed at most.
    sets : float64[m, d]
        Values of the uncertain parameters.
    taken : bool[m]
        Sets whose values the system takes.
    why : str
        The reason why the first of the others isn't taken.
    """

    design: Design
    starts: np.ndarray
    method: Method
    periods: int
    sets: np.ndarray
    taken: np.ndarray
    why: str

    def grid(self, every: Any) -> SetGrid:
        """The sets as places, with the time between two looks at a motion without forcing."""
        system, starts = self.design.system, self.starts
        rows = self.design.rows(self.sets[self.taken])
        check_grid(system, len(rows), starts)
        some = np.unique(np.linspace(0, len(rows) - 1, ASKED).astype(int))
        begin = starts[np.arange(len(some)) % len(starts)]
        looks = looks_every(system, every, begin, rows[some])
        return SetGrid(system, {}, starts, every=looks, values=rows)

    def finished(self, found: Answers, ask: bool = False) -> xr.Dataset:
        """The Dataset of what was found in the sets that were taken; ``ask``: by a user's function.
        Raises Interrupted if it isn't complete.
        """
        if not found.complete:
            raise Interrupted(lambda: self._dataset(found, ask))
        result, n = self._dataset(found, ask), self.design.samples
        if refused := int(np.count_nonzero(~self.taken[:n])):
            warnings.warn(
                SaltusWarning(
                    f"{counted(refused, 'set')} of {n} were refused and are in no statistics: "
                    f"{self.why} sl.truncated(...) keeps such values out."
                ),
                stacklevel=3,
            )
        return result

    def _dataset(self, found: Answers, ask: bool) -> xr.Dataset:
        design, sets, taken = self.design, self.sets, self.taken
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
            **({} if ask else {"start_<state>": self.starts}),
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
        attrs = provenance(system, self.method, certain) | {
            "samples": n,
            "seed": design.seed,
            **({} if ask else {"periods": self.periods}),
        }
        return build(schema.SCATTER, subject(system, attrs), values, words={"<uncertain>": ""})


def scatter_plan(
    system: System, uncertain: Any, start: Any, *, samples: Any, seed: Any, indices: bool, box: Any,
    values: Any, method: Method | None, periods: Any,
) -> ScatterPlan:  # fmt: skip
    """A plan from what users write, checked. Raises ParameterError or UnitError if an argument
    can't be used, or all sets are refused.
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
    starts = _starts(system, start, box, seed)
    sets = design.values(np.arange(len(design)))
    taken, why = design.accepted(sets)
    if not taken[:samples].any():
        raise ParameterError(f"{system.name} takes none of the {samples} sets: ", why)
    return ScatterPlan(design, starts, method, periods, sets, taken, why)


def _starts(system: System, start: Any, box: Any, seed: int) -> np.ndarray:
    """The starts, float64[s, D]."""
    if isinstance(start, str):
        return random_starts(system, start, box, seed)
    if box is not None:
        raise ParameterError(
            lambda say: f"{say.key('box')} is for random starts: {say.key(start='random 20')}."
        )
    return ensemble(system, start, None).start


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
