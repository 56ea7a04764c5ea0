"""`edge_orbit`: the unstable orbit on the boundary between two basins."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.edge import MOST, Edge, follow_edge
from saltus.analysis.attractors.portrait import portraits
from saltus.analysis.closed.orbit_table import table_of
from saltus.analysis.closed.periodic_orbits import exact_method, orbits_dataset
from saltus.analysis.closed.spread import spread
from saltus.analysis.dataset_parts import provenance
from saltus.analysis.inputs.given import Starts
from saltus.analysis.inputs.starts import check_system, ensemble
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.progress import reporting
from saltus.results.dataset.schema import kind_text
from saltus.system import System
from saltus.units import from_si


@verb
def edge_orbit(
    system: System,
    a: Starts,
    b: Starts,
    *,
    method: Method | None = None,
    periods: int = 2000,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The unstable periodic orbit on the boundary of a basin, from a start in it and one outside.

    1. Both starts are followed to their attractors, which must differ: then the boundary of the
       basin of the first one lies between them.
    2. The line between them is divided until its ends are very close together and still lead to
       different attractors: they are on the two sides of the boundary.
    3. Both ends are followed until they part. Until then they have shadowed a motion on the
       boundary. They are brought together again where they stand (step 2), since every motion near
       the boundary leaves it: edge tracking.
    4. On the boundary the motion settles to an attractor of its own, the edge state. Where it
       nearly recurs, Newton's method closes the orbit: mostly a saddle, whose stable manifold is
       the boundary.
    5. The orbit is accepted if it is unstable and lies near the motion on the boundary.
    6. Starts on both sides of it, along its most unstable direction, are followed to the attractors
       that meet there (``beside``).

    Parameters
    ----------
    system : System
        A forced system.
    a, b : sequence or mapping
        Two starts, as for :func:`saltus.simulate`, that lead to different attractors.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one has errors that keep unstable orbits from
        closing.
    periods : int
        Forcing periods after which a trajectory that hasn't settled is looked at for chaos. The
        boundary is followed for 256 at most.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        One orbit, in the variables of :func:`saltus.periodic_orbits` (dims ``orbit``, ``phase``,
        ``multiplier``). Attributes: ``leads_to_a`` and ``leads_to_b``, the attractors of the two
        starts in words; ``beside``, those on the two sides of the orbit (more than two basins may
        meet); ``edge_periods``, how long the boundary was followed.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used; if both starts lead to one attractor, or one to none; if the
        motion on the boundary doesn't repeat: a chaotic edge state.
    Interrupted
        On Ctrl-C.

    References
    ----------
    Skufca, Yorke & Eckhardt, Phys. Rev. Lett. 96 (2006) 174101; Battelino, Grebogi, Ott, Yorke &
    Yorke, Physica D 32 (1988) 296-305.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> saddle = sl.edge_orbit(rig, ("0 mm", "0 m/s"), ("2.5 mm", "0.56 m/s"))
    >>> saddle["orbit_stability"].item(), saddle.attrs["leads_to_a"], saddle.attrs["leads_to_b"]
    ('saddle', 'T, peak 0.128 mm', 'T, peak 6.05 mm')
    """
    check_system(system)
    ends = np.concatenate([_one(system, "a", a), _one(system, "b", b)])
    periods, method = whole(periods, "periods"), exact_method(method, system)
    _check_forced(system)
    map_ = Stroboscope(system, method, threads=threads)
    scale = spread(map_, ends)
    with reporting(progress) as show:
        edge = follow_edge(map_, ends, scale, periods, show)
        words = _words(map_, edge.found)
        orbit = _found(edge, words)
        table = table_of(map_, [orbit], [1])
    attrs = provenance(system, method, system.values) | {
        "periods": periods,
        "leads_to_a": words[edge.sides[0]],
        "leads_to_b": words[edge.sides[1]],
        "beside": " | ".join(words[i] if i >= 0 else "not established" for i in edge.beside),
        "edge_periods": edge.iterates,
    }
    return orbits_dataset(system, attrs, table, {})


def _check_forced(system: System) -> None:
    """Raises ParameterError for a system without a forcing period."""
    if system.forced_at is None:
        raise ParameterError(
            f"{system.name} has no forcing period. Its limit cycles, those between two basins too, "
            f"are found by sl.periodic_orbits, and its equilibria by sl.equilibria."
        )


def _one(system: System, name: str, start: Any) -> np.ndarray:
    """One start, float64[1, D]."""
    states = ensemble(system, start, None).start
    if len(states) != 1:
        raise ParameterError(f"{name} must be one start, not {len(states)}.")
    return states


def _found(edge: Edge, words: list[str]) -> Any:
    """The orbit. Raises ParameterError if there is none."""
    nowhere = [name for name, side in zip("ab", edge.sides, strict=True) if side < 0]
    if nowhere:
        raise ParameterError(
            f"{nowhere[0]} leads to no known attractor within the periods allowed. Take another "
            f"start, or more periods."
        )
    if edge.sides[0] == edge.sides[1]:
        raise ParameterError(
            f"a and b lead to the same attractor: {words[edge.sides[0]]}. Take two starts from "
            f"different basins; sl.basins shows them."
        )
    if edge.orbit is None:
        raise ParameterError(
            f"the motion on the boundary between a and b doesn't repeat in {MOST} periods: it is "
            f"chaotic there. Take starts elsewhere, or the saddles of sl.periodic_orbits."
        )
    return edge.orbit


def _words(map_: Stroboscope, found: AttractorSet) -> list[str]:
    """Each attractor in words."""
    table = portraits(map_, found)
    unit = map_.system.units[map_.states[0]]
    return [
        f"{kind_text(kind, int(n))}, peak {from_si(float(peak), unit, 3)}"
        for kind, n, peak in zip(table.kind, table.period, table.peak, strict=True)
    ]
