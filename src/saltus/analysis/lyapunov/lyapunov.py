"""`lyapunov`: growth rates of small deviations along a motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.closed.turns import looks_every
from saltus.analysis.dataset_parts import provenance, shared_values, subject
from saltus.analysis.inputs.given import Starts, Values
from saltus.analysis.inputs.starts import Ensemble, check_system, ensemble
from saltus.analysis.inputs.verb import verb
from saltus.analysis.lyapunov.algorithm import Algorithm
from saltus.analysis.lyapunov.exponents import Exponents
from saltus.analysis.lyapunov.wolf_on_flow import NeighbourExponents
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError, among, shown, unknown
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.sentences import Word
from saltus.system import System

METHODS = ("variational", "wolf")
#: Units of exponents: True for a growth per block, and the logarithm that counts as one.
UNITS = {
    "1/s": (False, 1.0),
    "1/period": (True, 1.0),
    "bit/s": (False, math.log(2)),
    "bit/period": (True, math.log(2)),
}
#: Least number of blocks: the error of the mean needs 8 independent batches, of some blocks each.
LEAST_PERIODS = 64


@verb
def lyapunov(
    system: System,
    start: Starts | None = None,
    *,
    method: str = "variational",
    exponents: int | None = None,
    flow: Method | None = None,
    periods: int = 2000,
    transient: int = 500,
    every: float | str | None = None,
    values: Mapping[str, Values] | None = None,
    unit: str = "1/s",
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Lyapunov exponents of the motions that given starts lead to, with their errors.

    1. Each trajectory runs through ``transient`` blocks; a block is a forcing period. At their end
       a frame of small deviations is carried along, so that its axes have found their directions.
    2. Over ``periods`` blocks the derivative of each block is computed by the variational
       equations, with their jumps at contacts (saltation).
    3. The frame is carried through these derivatives and made orthogonal after each (QR method), as
       otherwise all axes would turn to the fastest one. The mean logarithm of their growth gives
       the exponents.
    4. A motion that settles to a periodic orbit has exactly the exponents of the orbit, which
       replace the means: the logarithms of the magnitudes of its Floquet multipliers over its
       period. At an equilibrium they are the real parts of the eigenvalues.
    5. The errors of the means come from batches that grow until they are independent, since growth
       in successive blocks is correlated.
    6. The sum of the exponents is held against the mean divergence, which is found without the
       tangent.

    These are the steps of ``method="variational"``.

    Two conventions are in use. A forced system of D states has D exponents as a stroboscopic map:
    ``lyapunov_exponent``. As a flow, the phase of the forcing is one more state, whose exponent is
    zero: ``flow_lyapunov_exponent``. Without forcing both are the D exponents of the flow, which
    has a zero of its own unless the motion ends in an equilibrium.

    Parameters
    ----------
    system : System
        Equations, contacts and parameter values.
    start : sequence, mapping or array
        Starts, as for :func:`saltus.simulate`; one or many. Default: all zero.
    method : {"variational", "wolf"}
        ``"wolf"``: the largest exponent only, from the growth of the distance between neighbours on
        the trajectory, as much of the literature has it (:func:`saltus.wolf`). Points are all
        states and the phase of the forcing, 32 in a block; an evolution is one block. It is the
        largest exponent of the flow, so never below zero: neighbours on an orbit stay neighbours.
    exponents : int, optional
        Number of exponents, the largest ones; default all, as many as there are states. Where
        :class:`saltus.Modal` moves the system the cost is in proportion; elsewhere all directions
        are carried anyhow.
    flow : Method
        The method of integration. Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from
        eight states on where it serves. With
        ``sl.ODE45(events="ignore")`` jumps of the tangent are left out, as contacts aren't known.
    periods : int
        Blocks that growth is measured over, at least 64. The error falls with the square root of
        it. With the transient it bounds the work.
    transient : int
        Blocks before them that don't count. In the last 128 of them the directions align.
    every : float or str, optional
        Time of a block [s], for a system without forcing; default about a turn of the motion.
        Deviations should grow by less than 1e8 in it.
    values : mapping
        Parameter values of this call: one each, or an array with one for each trajectory.
    unit : {"1/s", "1/period", "bit/s", "bit/period"}
        Unit of the exponents; a bit is a factor of two. Those per period are for forced systems.
    threads : int
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds. A callable gets the
        share done.

    Returns
    -------
    Dataset
        Dims ``trajectory``, ``exponent`` (descending), ``flow_exponent``, ``running``.
        ``lyapunov_exponent`` with ``lyapunov_error`` (standard error) and the 95 % interval
        ``lyapunov_low``, ``lyapunov_high``: of an orbit the effect of rounding; of any other motion
        from batch means whose batches grow until they are independent (Flyvbjerg & Petersen 1989),
        ``independent_batches`` of them, by Student's t; -inf, without an error, of directions
        of which nothing is left where a contact sticks or rests. A direction that shrinks by more
        than 1e-12 of the fastest one in a block is lost in its rounding: one alone has what is left
        of the mean divergence without the others, several are NaN (a shorter ``every`` helps).
        ``kind``: ``periodic``, ``quasi_periodic``,
        ``chaotic``, ``equilibrium``, ``limit_cycle`` or ``unclear``, as of a motion that may still
        be settling; ``response_period``: n of nT, or 0. ``exponent_sum`` (of all) beside
        ``mean_divergence``, which must agree: the mean trace of the Jacobian and what contacts add,
        found without the tangent. ``near_graze``: 1 if the
        motion after the transient grazes a boundary, or is an orbit that misses one by less than a
        thousandth of its size: then deviations that could be seen in practice don't grow as
        infinitesimal ones do. ``running_exponent`` and its interval over ``running_time``;
        ``status``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset with the trajectories that were finished.

    References
    ----------
    Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15 (1980) 9-30; Eckmann & Ruelle, Rev. Mod.
    Phys. 57 (1985) 617-656; Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
    Systems (2004), section 7; Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989) 461-466; Wolf, Swift,
    Swinney & Vastano, Physica D 16 (1985) 285-317.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> spectrum = sl.lyapunov(rig, start=(0, 0), periods=400)
    >>> str(spectrum["kind"].values[0])
    'periodic'
    >>> spectrum["lyapunov_exponent"].values.round(4).tolist()  # -damping_ratio * omega, twice
    [[-0.9425, -0.9425]]
    """
    check_system(system)
    _check_words(method, unit, system)
    most = _most(exponents, method, len(system.states))
    flow = check_method(flow, system)
    group = ensemble(system, start, values)
    periods, transient = whole(periods, "periods", LEAST_PERIODS), whole(transient, "transient", 0)
    rows = np.broadcast_to(group.parameters, (group.size, len(system.values)))
    block = looks_every(system, every, group.start, rows)
    map_ = Stroboscope(system, flow, rows, block, threads)
    asked = map_, group.start, periods, transient, block
    work: Algorithm = (
        Exponents(*asked, most=most) if method == "variational" else NeighbourExponents(*asked)
    )

    def dataset() -> xr.Dataset:
        return _dataset(system, flow, group, work, unit)

    with reporting(progress) as show:
        try:
            work.run(show)
        except KeyboardInterrupt as stop:
            raise Interrupted(dataset) from stop
    result = dataset()
    warn(result)
    return result


def _check_words(method: Any, unit: Any, system: System) -> None:
    if isinstance(method, Method):
        raise ParameterError(
            lambda say: (
                'method says how exponents are measured: "variational" or "wolf". How to '
                f"integrate is {say.key(flow=Word(say.method(method.name)))}."
            )
        )
    if not among(method, METHODS):
        raise unknown("there is no method", method, METHODS)
    if not among(unit, UNITS):
        raise unknown("exponents aren't given in", unit, UNITS)
    if UNITS[unit][0] and system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing period, so {shown(unit)} has no meaning. "
                f"Take {say.key(unit=unit.replace('period', 's'))}."
            )
        )


def _most(exponents: Any, method: str, states: int) -> int:
    """Number of exponents that are computed."""
    if exponents is None:
        return states
    if method == "wolf":
        raise ParameterError(
            lambda say: (
                f"{say.key(method='wolf')} finds the largest exponent only. Leave "
                f"{say.key('exponents')} out."
            )
        )
    return whole(exponents, "exponents", 1, states)


def _dataset(
    system: System, flow: Method, group: Ensemble, work: Algorithm, unit: str
) -> xr.Dataset:
    """The Dataset of the exponents, in the chosen unit."""
    per_period, logarithm = UNITS[unit]
    factor = (1.0 if per_period else 1.0 / work.map.period) / logarithm
    attrs = (
        provenance(system, flow, shared_values(system, group), group.varied)
        | work.settings()
        | {"unit": unit}
    )
    columns = {
        "trajectory": np.arange(group.size),
        **work.columns(np.broadcast_to(factor, group.size)),
    }
    return build(
        schema.EXPONENTS,
        subject(system, attrs, varied=group.varied),
        columns,
        words={"<rate>": unit},
    )
