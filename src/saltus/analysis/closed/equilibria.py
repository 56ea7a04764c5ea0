"""`equilibria`: where a system without forcing can rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.closed.all_equilibria import Equilibrium, all_equilibria
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.inputs.box import box_ranges, draw
from saltus.analysis.inputs.given import Range, Starts, Value
from saltus.analysis.inputs.halton import halton
from saltus.analysis.inputs.starts import check_system, ensemble, fill, fixed_states
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError
from saltus.flow.counts import whole
from saltus.results import Subject, attributes, build
from saltus.results.dataset.schema import EQUILIBRIA
from saltus.system import System, margin_gaps
from saltus.system.modes import mode_number

#: Magnitudes that starts have where no box is given, as powers of ten [SI].
MAGNITUDES = (-4.0, 4.0)
#: Most starts in each mode.
MOST_STARTS = 100_000


@verb
def equilibria(
    system: System,
    start: Starts | None = None,
    *,
    starts: int = 256,
    at: Mapping[str, Value] | None = None,
    **box: Range,
) -> xr.Dataset:
    """All equilibria of a system without forcing: in each region, on boundaries, and held by
    contacts; stable ones and unstable ones.

    1. Every mode is taken in turn: a side of each boundary, and the contacts that are held. In a
       mode the equations are smooth.
    2. In each mode Newton's method looks for zeros of the field from all starts; linear equations
       need only one. Of a held contact the constraint vanishes too, so steps are least-squares
       steps.
    3. It is started again with the known zeros deflated, also from beside them, until nothing new
       is found: many starts lead to one zero, and hide the others.
    4. A zero counts if its mode holds there: the gaps have their sides, and held contacts stay
       held. Other zeros are virtual.
    5. The eigenvalues of the linear part along the boundaries that hold it give kind and stability.
       On a boundary itself linear parts decide nothing: ``undecided``.
    6. Where contacts leave a state free (a block that is stuck), the equilibria form a continuum;
       the ends of an interval are where a contact is released.

    Nothing is integrated.

    Parameters
    ----------
    system : System
        Equations, contacts and values; nothing in it may depend on time.
    start : sequence, mapping or array, optional
        Starts of Newton's method, as for :func:`saltus.simulate`, in place of a box.
    starts : int
        Quasi-random starts in the box, 100 000 at most, for each of up to 1024 modes. Without a
        box their states have either sign, and magnitudes from 1e-4 to 1e4 in SI.
    at : mapping, optional
        Starts of the states that have no range in the box; default zero.
    **box : (low, high)
        Range of the starts of each state [SI or text with a unit]. What is found outside
        counts too.

    Returns
    -------
    Dataset
        Dims ``equilibrium`` and ``eigenvalue``. ``equilibrium_<state>``; ``equilibrium_place``:
        ``region``, ``boundary`` (a gap, or the force that holds a contact, is just zero),
        ``pseudo`` (held by contacts: sliding on a surface, stuck, or pressed against a stop);
        ``equilibrium_type``: ``node``, ``focus``, ``saddle``, ``saddle_focus``, ``center`` (on the
        imaginary axis), ``degenerate``, ``continuum``, ``undecided`` (on a boundary linear parts
        decide nothing); ``equilibrium_stable``; ``equilibrium_contacts``; ``equilibrium_mode``;
        ``equilibrium_margin`` to the nearest other boundary [unit of the gap];
        ``equilibrium_dimension`` of a continuum, and the ends ``equilibrium_<state>_from``, ``_to``
        of an interval, such as that in which a block is stuck; eigenvalues [1/s] along the
        boundaries that hold it, NaN across them.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, the equations depend on time, or there are too many modes.

    References
    ----------
    di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (2008), section
    2.2; Farrell, Birkisson & Funke, SIAM J. Sci. Comput. 37 (2015) A2026-A2045 (deflation).

    Examples
    --------
    >>> import saltus as sl
    >>> found = sl.equilibria(sl.models.double_scroll())
    >>> found["equilibrium_x"].values.round(12).tolist()
    [-1.5, 0.0, 1.5]
    >>> found["equilibrium_type"].values.tolist()
    ['saddle_focus', 'saddle_focus', 'saddle_focus']
    """
    check_system(system)
    if not autonomous(system):
        raise ParameterError(
            lambda say: (
                f"{system.name} depends on time, so it has no equilibria. Ask "
                f"{say.verb('attractors')} for its periodic responses; or write it without the "
                "forcing."
            )
        )
    if start is not None and (box or at is not None):
        raise ParameterError(
            lambda say: f"give {say.key('start')} or ranges of a box, and only one of them."
        )
    begin, scale = _starts(system, start, whole(starts, "starts", 1, MOST_STARTS), at, box)
    found = all_equilibria(system, begin, scale)
    attrs = attributes(
        system=system.name,
        equations=system.equations(),
        parameters=system.values,
        units=system.units,
        method="Newton",
        method_options={"starts": len(begin)},
        fingerprint=system.fingerprint(),
        source=system.source,
    )
    about = Subject(system.states, system.units, attrs, margin_unit=margin_gaps(system)[1])
    return build(EQUILIBRIA, about, _columns(system, found))


def _starts(
    system: System, start: Any, count: int, at: Mapping[str, Any] | None, box: Mapping[str, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Starts float64[k, D], and the size of each state float64[D]."""
    size = len(system.states)
    if start is not None:
        begin = ensemble(system, start, None).start
    elif box:
        ranges = box_ranges(system, box)
        fixed = fixed_states(system, at, box)
        begin = fill(system, draw(ranges, halton(count, len(ranges))), fixed)
    else:
        fixed = fixed_states(system, at, ())
        low, high = MAGNITUDES
        signed = 2.0 * halton(count, size) - 1.0
        begin = np.sign(signed) * 10.0 ** (low + (high - low) * np.abs(signed))
        begin[0] = 0.0
        begin += np.array(list(fixed.values()))
        return begin, np.ones(size)
    wide = np.maximum(np.ptp(begin, axis=0), np.abs(begin).max(axis=0))
    return begin, np.where(wide > 0, wide, 1.0)


def _columns(system: System, found: list[Equilibrium]) -> dict[str, Any]:
    """The variables of the result."""
    size, names = len(system.states), [guard.name for guard in system.guards]
    eigenvalues = np.array([one.eigenvalues for one in found], complex).reshape(-1, size)
    ends = np.array([one.ends for one in found]).reshape(-1, 2, size)
    return {
        "equilibrium": np.arange(len(found)),
        "equilibrium_type": [one.kind for one in found],
        "equilibrium_place": [one.place for one in found],
        "equilibrium_stable": np.array([one.stable for one in found], "i1"),
        "equilibrium_contacts": [", ".join(names[i] for i in one.contacts) for one in found],
        "equilibrium_mode": np.array([mode_number(one.mode) for one in found], "i8"),
        "equilibrium_margin": np.array([one.margin for one in found]),
        "equilibrium_dimension": np.array([one.dimension for one in found], "i8"),
        "equilibrium_eigenvalue_real": eigenvalues.real,
        "equilibrium_eigenvalue_imag": np.where(np.isnan(eigenvalues), np.nan, eigenvalues.imag),
        "equilibrium_<state>": np.array([one.state for one in found]).reshape(-1, size),
        "equilibrium_<state>_from": ends[:, 0],
        "equilibrium_<state>_to": ends[:, 1],
    }
