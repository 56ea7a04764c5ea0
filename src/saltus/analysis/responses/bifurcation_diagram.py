"""`bifurcation_diagram`: steady responses against one parameter, or a map of their
types over two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import xarray as xr

from saltus.analysis.attractors.grid import grid_of
from saltus.analysis.inputs.given import Axis, Range, Reading, Starts, Value
from saltus.analysis.inputs.verb import verb
from saltus.analysis.responses.response_table import respond, response_plan
from saltus.analysis.responses.samples import check_sample, check_unforced_sample
from saltus.errors import ParameterError
from saltus.flow.methods import Method, check_method
from saltus.system import System


@verb
def bifurcation_diagram(
    system: System,
    vary: Mapping[str, Axis],
    start: Starts | None = None,
    *,
    sample: str = "turning_points",
    follow: bool = False,
    unstable: bool = False,
    box: Mapping[str, Range] | None = None,
    values: Mapping[str, Value] | None = None,
    outputs: Mapping[str, Reading] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    every: float | str | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Steady responses against a parameter: their turning points, periods, kinds and bifurcations,
    located to rounding. For the steps see :func:`saltus.frequency_response`.

    Parameters
    ----------
    system : System
        Any system.
    vary : mapping
        One parameter, or two for a map of types: a range, such as ``{"contact_stiffness": ("1e3
        N/m", "1e9 N/m", 2000, "log")}``, or a list or array of values.
    start : sequence, mapping, array or str
        As for :func:`saltus.frequency_response`.
    sample : {"turning_points", "stroboscope", "contacts"}
        What is kept of each response over one period of its own: ``"turning_points"`` (where the
        rate of the first state is zero), ``"stroboscope"`` (at whole forcing periods) or
        ``"contacts"``. Not with two parameters.
    follow : bool
        Whether each start goes on, from the lowest value upwards, where it stood at the value
        before; otherwise each value starts afresh.
    unstable : bool
        Whether to follow the branches through their unstable parts too, and onto doubled and
        crossing ones, as :func:`saltus.branches` does.
    every : float or str, optional
        Time between two samples of the motion of a system without forcing [s]; default about a
        turn of it. Equilibria, limit cycles, their periods, sizes and stability don't depend on it.
    box, values, outputs, method, periods, seed, threads, progress
        As for :func:`saltus.frequency_response`.

    Returns
    -------
    Dataset
        As :func:`saltus.frequency_response` over the parameters in ``vary``, and ``sample_<state>``
        on (response, sample), filled up with NaN. Without forcing responses are of type
        ``equilibrium`` (with ``response_eigenvalue_real`` and ``_imag`` of the Jacobian [1/s]),
        ``limit_cycle`` (with its period ``response_cycle`` [s] and multipliers, one of which is 1),
        ``quasi_periodic`` or ``chaotic``; ``response_<state>`` then has points of a limit cycle in
        equal steps of its time.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of what was finished.

    References
    ----------
    Nayfeh & Balachandran, Applied Nonlinear Dynamics (1995), chapters 3 and 5.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> stiffness = {"contact_stiffness": ["10 kN/m", "20 kN/m"]}
    >>> responses = sl.bifurcation_diagram(rig, stiffness, start={"x": ["0 mm", "0.75 mm"], "v": 0})
    >>> responses["response_period"].values.tolist()
    [1, 3, 1, 2]
    """
    if not isinstance(vary, Mapping):
        raise ParameterError(
            lambda say: (
                "vary must be a mapping, such as "
                f"{say.key(vary={'contact_stiffness': ('1e3 N/m', '1e9 N/m', 200, 'log')})}."
            )
        )
    method = check_method(method, system)
    check_sample(sample, method)
    grid = grid_of(system, vary, start, box, values, seed, follow, every)
    check_unforced_sample(sample, grid.system)
    plan = response_plan(grid, method, periods, sample, outputs, unstable)
    return respond(plan, threads, progress)
