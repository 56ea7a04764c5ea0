"""Sets of values of uncertain parameters: scrambled Sobol points through the distributions."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from saltus.analysis.inputs.starts import ensemble
from saltus.distributions import Distribution
from saltus.errors import ParameterError, SaltusError, must_be, shown, unknown
from saltus.system import System

#: Half of the distance between two values of a coordinate of Sobol points: none is 0 or 1.
HALF = 2.0**-31
#: Most sets of a call, those for the indices included: the points have 30 bits.
MOST_SETS = 2**24
#: Most parameters: the table of directions of Sobol points has 21201.
MOST_PARAMETERS = 1000


@dataclass(frozen=True)
class Design:
    """Sets of values of the uncertain parameters of a system; set i follows from i and the seed.

    Attributes
    ----------
    system : System
        Its values are those of the parameters that are certain.
    uncertain : mapping of str to Distribution
        The d uncertain parameters.
    samples : int
        Sets n of which statistics are made.
    seed : int
        Of the scrambling.
    indices : bool
        Whether n (d + 1) sets more are there, for Sobol indices: n others, then for each parameter
        the first n with its values taken from the others.

    References
    ----------
    Owen, J. Complexity 14 (1998) 466-489 (scrambling); Saltelli et al., Comput. Phys. Commun. 181
    (2010) 259-270 (the sets for indices).
    """

    system: System
    uncertain: Mapping[str, Distribution]
    samples: int
    seed: int
    indices: bool = False

    def __len__(self) -> int:
        return self.samples * (len(self.uncertain) + 2 if self.indices else 1)

    @cached_property
    def _points(self) -> np.ndarray:
        """Values of the first n sets and of n others, float64[2, n, d]."""
        from scipy.stats import qmc

        d = len(self.uncertain)
        with warnings.catch_warnings():  # a number of points that is no power of two
            warnings.simplefilter("ignore", UserWarning)
            sobol = qmc.Sobol(2 * d, seed=np.random.default_rng(self.seed))
            shares = sobol.random(self.samples) + HALF
        columns = [
            one.values(shares[:, [k, d + k]].T, self.system.units.get(name, ""), name)
            for k, (name, one) in enumerate(self.uncertain.items())
        ]
        return np.stack(columns, axis=-1)

    def values(self, sets: np.ndarray) -> np.ndarray:
        """Values of the uncertain parameters in sets int64[m], float64[m, d] [SI]."""
        block, row = np.divmod(np.asarray(sets, np.int64), self.samples)
        found: np.ndarray = self._points[(block == 1).astype(int), row]
        swapped = np.flatnonzero(block >= 2)
        column = block[swapped] - 2
        found[swapped, column] = self._points[1, row[swapped], column]
        return found

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Values of all parameters, float64[m, P], with these of the uncertain ones."""
        names = list(self.system.values)
        found = np.tile(np.array(list(self.system.values.values()), float), (len(values), 1))
        found[:, [names.index(name) for name in self.uncertain]] = values
        return found

    def accepted(self, values: np.ndarray) -> tuple[np.ndarray, str]:
        """Sets whose values the system takes, bool[m], and why it refuses the first of the others:
        halves of them are tried, so that few refused ones cost little.
        """
        good, why = np.zeros(len(values), bool), ""
        parts = [np.arange(len(values))]
        while parts:
            part = parts.pop()
            try:
                columns = dict(zip(self.uncertain, values[part].T, strict=True))
                ensemble(self.system, np.zeros(len(self.system.states)), columns)
                good[part] = True
            except SaltusError as error:
                if len(part) > 1:
                    parts += reversed(np.array_split(part, 2))
                elif not why:
                    why = str(error)
        return good, why


def design_of(system: System, uncertain: Any, samples: int, seed: int, indices: bool) -> Design:
    """A design from what users write, checked.

    Raises
    ------
    ParameterError, UnitError
        If a name is unknown, a distribution doesn't fit, or the sets are too many.
    """
    example = 'such as {"gap": sl.normal("0.4 mm", "0.02 mm")}'
    if not isinstance(uncertain, Mapping) or not uncertain:
        raise must_be(
            "uncertain", f"a mapping of parameters to distributions, {example}", uncertain
        )
    for name, one in uncertain.items():
        if not isinstance(name, str) or name not in system.values:
            raise unknown(f"{system.name} has no parameter", name, system.values)
        if not isinstance(one, Distribution):
            raise ParameterError(
                f"{name} has no distribution but {shown(one)}. Give it one, {example}."
            )
    if len(uncertain) > MOST_PARAMETERS:
        raise ParameterError(
            f"{len(uncertain)} uncertain parameters are too many; {MOST_PARAMETERS} may be."
        )
    found = Design(system, dict(uncertain), samples, seed, indices)
    if len(found) > MOST_SETS:
        raise ParameterError(
            f"{len(found)} sets are too many; {MOST_SETS} may be. Take fewer samples."
        )
    for name, one in found.uncertain.items():
        one.values(np.array([0.5]), system.units.get(name, ""), name)
    return found
