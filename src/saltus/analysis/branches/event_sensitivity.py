"""`event_sensitivity`: derivatives of the place of a bifurcation by other parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from saltus.analysis.branches.bifurcation_curve import (
    EventOrbit,
    equations_at,
    event_orbit,
    orbits_over,
)
from saltus.analysis.branches.singular_orbits import SingularOrbits
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.derivatives.columns import Columns
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.analysis.solve.linear import moves
from saltus.analysis.solve.newton import newton
from saltus.errors import ParameterError
from saltus.flow.methods import Method, exact_method
from saltus.flow.progress import reporting
from saltus.flow.taylor import Taylor
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System


@verb
def event_sensitivity(
    system: System,
    event: xr.Dataset,
    *,
    to: str | Sequence[str],
    method: Method | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Derivatives of the place of a bifurcation, the value of the parameter that was varied, with
    respect to other parameters.

    The equations of the bifurcation are those of :func:`saltus.bifurcation_curve`, for each
    parameter beside the one that was varied; the slope of their solution is that of the implicit
    function theorem. At a graze the contact that grazes is left out of the equations: its place has
    one derivative, though the orbit's own derivatives are infinite on the side with contact of a
    rigid stop.

    Parameters
    ----------
    system : System
        Of which the branches were followed.
    event : Dataset
        A fold, period doubling, Neimark-Sacker bifurcation or graze of what
        :func:`saltus.branches` returned: ``branches.sel(event=0)``. Parameters have its values.
    to : str or sequence of str
        Parameters, not the one that was varied. The work is some runs of an orbit's period for
        each.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one must be exact. By parameters whose derivatives the modal flow takes
        by differences, such as the gap of a rigid stop: :class:`saltus.Taylor`.
    threads : int, optional
        Default all processors.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dim ``to``. ``event_value``, the value of the parameter that was varied, and
        ``event_derivative``; ``to_value``, ``to_units``; ``sqrt_coefficient`` of a graze (0 at a
        continuous force). Attributes ``bifurcation``, ``parameter``, ``guard``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, the bifurcation isn't one of these, or the equations are
        others than those of the event.
    Interrupted
        On Ctrl-C.

    References
    ----------
    Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000), chapters 3 and 4;
    di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 7.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> found = sl.branches(rig, {"frequency": ("15 Hz", "18 Hz")}, {"x": "5 mm", "v": 0}, at=3)
    >>> fold = sl.event_sensitivity(rig, found.sel(event=0), to=["force", "upper_gap"])
    >>> fold.attrs["bifurcation"], dict(fold.sizes)
    ('fold', {'to': 2})
    """
    check_system(system)
    method = exact_method(method, system, "sl.event_sensitivity")
    asked = Columns.of(system, to)
    if len(asked.parameters) < len(asked.names):
        raise ParameterError(
            "a bifurcation has no start: its place has derivatives with respect to parameters. "
            "Leave the starts out of to."
        )
    start, varied = event_orbit(system, event), str(event.attrs["parameter"])
    if varied in asked.names:
        raise ParameterError(
            f"the event is a value of {varied} itself. Leave it out of to: its place depends on "
            "the other parameters."
        )
    places, slopes = np.empty(len(asked.names)), np.empty(len(asked.names))
    with reporting(progress) as show:
        for i, name in enumerate(asked.names):
            places[i], slopes[i] = _place(start, varied, name, method, threads)
            if show is not None:
                show((i + 1) / len(asked.names))
    values = start.system.values
    one = event.squeeze("event") if "event" in event.dims else event
    attrs = provenance(system, method, values) | {
        "bifurcation": start.kind,
        "parameter": varied,
        "guard": system.guards[start.guard].name if start.guard >= 0 else "",
    }
    return build(
        schema.EVENT_SENSITIVITY,
        subject(system, attrs),
        {
            "to": list(asked.names),
            "to_units": asked.units(system),
            "to_value": np.array([values[name] for name in asked.names]),
            "event_value": places[0],
            "event_derivative": slopes,
            "sqrt_coefficient": float(one["event_sqrt_coefficient"]),
        },
        words={"<varied>": system.units.get(varied, ""), "<slope>": "", "<to>": ""},
    )


def _place(
    start: EventOrbit, varied: str, name: str, method: Method, threads: int | None
) -> tuple[float, float]:
    """Place of the bifurcation over ``varied`` [SI], and its slope over ``name``."""
    if method.tangents(start.system, (varied, name)) is None:
        method = Taylor()  # differences of another flow's differences have too few digits
    values = [start.system.values[one] for one in (varied, name)]
    limits = [(one - 0.1 * abs(one), one + 0.1 * abs(one) or 1.0) for one in values]
    orbits, z = orbits_over(start, (varied, name), limits, method, threads)
    equations, z = equations_at(start, orbits, z)
    equations.begin(np.stack([z, z]), np.arange(2))
    place, fixed = equations.parameters
    free = np.delete(np.arange(len(z)), fixed)
    unit = equations.scale[:1]

    def held(unknowns: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, derivative = equations.evaluate(np.insert(unknowns, fixed, z[fixed], 1), rows)
        return residual, derivative[..., free]

    zeros = newton(held, z[None, free], unit[:, free])
    if not zeros.found[0]:
        raise ParameterError(
            f"no {start.kind.replace('_', ' ')} was found at the event: it may lie on a graze, or "
            "the event is of other equations."
        )
    there = np.insert(zeros.z, fixed, z[fixed], 1)
    row = np.zeros(1, np.int64)
    slopes = equations.evaluate(there, row)[1]
    if isinstance(equations, SingularOrbits):  # its second derivatives are differences
        equations.beside = 0.5 * equations.beside
        slopes = (4.0 * equations.evaluate(there, row)[1] - slopes) / 3.0
    moved = moves(slopes[..., free], slopes[..., [fixed]])
    where = int(np.flatnonzero(free == place)[0])
    return float(there[0, place]), float(moved[0, where, 0] * unit[0, place] / unit[0, fixed])
