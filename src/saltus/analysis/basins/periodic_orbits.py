"""`periodic_orbits`: the periodic orbits of a system, stable and unstable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.attractors import spread
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.orbits.all_orbits import OrbitSet, all_orbits
from saltus.analysis.orbits.orbit_table import table_of
from saltus.analysis.orbits.tolerances import LONGEST
from saltus.analysis.random_starts import random_starts
from saltus.analysis.starts import check_system, ensemble
from saltus.analysis.verb import verb
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.flow.room import check_room
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.orbits import OrbitTable
from saltus.system.system import System


@verb
def periodic_orbits(
    system: System,
    start: Any = "random 1000",
    *,
    box: Mapping[str, Any] | None = None,
    periods: int = 3,
    method: Method | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The periodic orbits of a forced system, stable and unstable, with periods up to a number of
    forcing periods.

    Newton's method is started from many states, for each period at once in all of them, with the
    points of an orbit at whole forcing periods as unknowns (multiple shooting), steps that are
    shortened until they help, and derivatives of the exact tangent flow. Then it is started again
    with the orbits that are known deflated: their zeros are divided out, so that only others can be
    found; also from beside known orbits, where a fold leaves the second of a pair. No search of
    this kind finds every orbit for sure. What is said of those that it missed: ``search_unseen``.

    Parameters
    ----------
    system : System
        A forced system.
    start : sequence, mapping, array or str
        Where to begin, as for :func:`saltus.simulate`, one or many; ``"random 1000"`` with ``box``.
    box : mapping, optional
        Range (low, high) of each state for random starts. Orbits may leave it.
    periods : int
        Longest period looked for [forcing periods].
    method : Method
        Default :class:`saltus.Taylor`; another one has errors that keep unstable orbits from
        closing.
    seed : int
        Of random starts.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dim ``orbit``, each once, by period: ``orbit_period`` (the n of nT, the least),
        ``orbit_stable``, ``orbit_stability`` (``stable node``, ``stable focus``, ``saddle``,
        ``inverse saddle``, ``unstable node``, ``unstable focus``, ``marginal``),
        ``orbit_unstable_directions``, ``orbit_found`` (starts that led to it; 0 if only deflation
        did), ``orbit_mismatch``, and as of attractors ``orbit_contacts``, ``orbit_itinerary``,
        ``orbit_peak``, ``orbit_rms``, ``orbit_margin``, multipliers, ``orbit_exponent`` [1/s] and
        its states at whole periods, dims (orbit, phase). Dim ``search_period``, a search each:
        ``search_converged`` of the starts led to an orbit, ``search_found_once`` orbits were found
        by one start only, ``search_unseen`` is their ratio: the share of converging starts whose
        orbit isn't known yet, as Good and Turing estimate it; ``search_deflated`` orbits were found
        by deflation only, and ``search_exhausted`` says whether that ended by finding nothing more.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C.

    References
    ----------
    Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter 5; Deuflhard,
    Newton Methods for Nonlinear Problems (2004), chapter 3; Farrell, Birkisson & Funke, SIAM J.
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
    states = (
        random_starts(system, start, box, seed)
        if isinstance(start, str)
        else _given(system, start, box)
    )
    method = exact_method(method)
    check_forced(system)
    size = len(system.states)
    check_room(len(states) * periods * size * 400.0, f"{len(states)} starts", "Take fewer.")
    map_ = Stroboscope(system, method, threads=threads)
    scale = spread(map_, states)
    with reporting(progress) as show:
        found = all_orbits(map_, states, periods, scale, show)
        table = table_of(map_, found.orbits, found.found)
    attrs = provenance(system, method, system.values) | {
        "periods": periods,
        "starts": len(states),
        "seed": seed,
    }
    return orbits_dataset(system, attrs, table, searches(found))


def exact_method(method: Method | None) -> Method:
    """The method. Raises ParameterError for one whose errors are more than rounding."""
    method = check_method(method)
    if not method.exact:
        raise ParameterError(
            f"errors of {method.name} keep unstable orbits from closing. Leave method= out: Taylor "
            f"integrates to rounding."
        )
    return method


def check_forced(system: System) -> None:
    """Raises ParameterError for a system without a forcing period."""
    if system.forced_at is None:
        raise ParameterError(
            f"{system.name} has no forcing period. Its attracting limit cycles are found by "
            f"sl.attractors, and its equilibria by sl.equilibria."
        )


def _given(system: System, start: Any, box: Any) -> np.ndarray:
    """The starts that were given, float64[k, D]."""
    if box is not None:
        raise ParameterError('box= is for random starts: start="random 1000".')
    return ensemble(system, start, None).start


def searches(found: OrbitSet) -> dict[str, Any]:
    """What the searches came to, by the names of the variables."""
    return {
        "search_period": [one.period for one in found.searches],
        **{
            f"search_{name}": [getattr(one, name) for one in found.searches]
            for name in ("converged", "found_once", "unseen", "deflated", "exhausted")
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
