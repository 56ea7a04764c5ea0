"""`regularisation_widths`: the widths at which a regularised contact is as exact as the method that
integrates it, and the steps it then takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.attractors.find_responses import motion_range
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.given import Starts, Value
from saltus.analysis.inputs.starts import ensemble
from saltus.analysis.inputs.verb import verb
from saltus.contact import STEPS
from saltus.errors import ParameterError, must_be, one_of
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import ODE45, Method, Taylor, check_method
from saltus.kernels import status as st
from saltus.language.evaluate import evaluate
from saltus.results import build
from saltus.results.dataset.schema import WIDTHS
from saltus.system import System, gap_units, regularise
from saltus.units import to_si

#: Default widths, as shares of the largest gap of the motion.
SHARES = np.geomspace(1e-1, 1e-6, 16)


@verb
def regularisation_widths(
    system: System,
    law: str = "tanh",
    *,
    method: Method | None = None,
    start: Starts | None = None,
    widths: Sequence[Value] | np.ndarray | None = None,
    transient: int = 200,
    points: int = 32,
    threads: int | None = None,
) -> xr.Dataset:
    """The width at which the error of regularisation equals that of the integrating method, and the
    steps taken there.

    A forcing period is computed from points of the settled motion: exactly; by the method, with its
    contacts; and of :func:`saltus.regularise`'s stand-in at each width, exactly and by the method.
    Below the width of equal errors a stand-in gains nothing, above it it is the larger error.

    Parameters
    ----------
    system : System
        Forced, with boundaries whose gaps have one unit.
    law : str
        As of :func:`saltus.regularise`.
    method : Method, optional
        What integrates; default ``ODE45(rtol=1e-4, atol=1e-7)``.
    start : sequence or mapping, optional
        States from which the motion settles; default zero.
    widths : sequence of float or str, optional
        Widths to try [unit of the gap]; default 16 from a tenth to a millionth of the largest gap
        of the motion.
    transient : int
        Forcing periods until the motion counts as settled.
    points : int
        Periods after them, from which the errors are measured. For each width so many are run, and
        those of the transient.
    threads : int, optional
        Default: all.

    Returns
    -------
    Dataset
        Dim ``width``, descending. ``regularisation_error``: root mean square over points and states
        of the error of a period by the width alone, in units of the range of each state in the
        motion; ``error``: by width and method; ``steps_per_period`` of the method. Scalars of the
        method with contacts: ``method_error``, ``method_steps_per_period``; and where both errors
        are equal: ``equal_width`` [unit of the gap] and ``equal_steps_per_period``, NaN if that is
        outside of the widths.

    Raises
    ------
    ParameterError, UnitError, TraceError
        If an argument can't be used, the motion doesn't last, or the system can't be regularised.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> table = sl.regularisation_widths(rig, "tanh", start=("0.75 mm", 0), points=3)
    >>> 1e-6 < float(table["equal_width"]) < 1e-5  # [m]; the gap is 4e-4 m
    True
    """
    one_of(STEPS, "regularisation_widths: ", law=law)
    method = check_method(ODE45(rtol=1e-4, atol=1e-7) if method is None else method, system)
    group = ensemble(system, start, None)
    if len(group.start) != 1:
        raise ParameterError("regularisation_widths takes one start.")
    exact = Stroboscope(system, Taylor(), threads=threads)
    orbit = _orbit(exact, group.start, whole(transient, "transient", 0), whole(points, "points"))
    begin, end = orbit[:-1], orbit[1:]
    scale = motion_range(exact, begin[:1])
    unit = gap_units(system)[0]
    tried = _widths(system, begin, widths, unit)
    smooth = regularise(system, law, width=float(tried[-1]))
    (name,) = smooth.values.keys() - system.values.keys()

    def period(moving: System, by: Method, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Error and steps of a period for each width."""
        rows = np.tile(np.array(list(moving.values.values())), (len(width) * len(begin), 1))
        if moving is smooth:
            rows[:, list(moving.values).index(name)] = np.repeat(width, len(begin))
        map_ = Stroboscope(moving, by, rows, threads=threads)
        outcome = map_.run(np.tile(begin, (len(width), 1)), 1)
        apart = (outcome.state - np.tile(end, (len(width), 1))) / scale
        steps = outcome.counters[:, st.STEPS] + outcome.counters[:, st.REJECTED]
        return (
            np.sqrt(np.mean(apart.reshape(len(width), -1) ** 2, axis=1)),
            steps.reshape(len(width), -1).mean(axis=1),
        )

    (method_error,), (method_steps,) = period(system, method, np.ones(1))
    by_width, _ = period(smooth, Taylor(), tried)
    both, steps = period(smooth, method, tried)
    equal = _where_equal(tried, by_width, method_error)
    equal_steps = np.exp(np.interp(np.log(equal), np.log(tried[::-1]), np.log(steps[::-1])))
    if np.isnan(equal):
        equal_steps = np.nan
    values = {
        "width": tried, "regularisation_error": by_width, "error": both, "steps_per_period": steps,
        "method_error": method_error, "method_steps_per_period": method_steps, "equal_width": equal,
        "equal_steps_per_period": equal_steps,
    }  # fmt: skip
    about = subject(system, provenance(system, method, system.values) | {"law": law})
    return build(WIDTHS, about, values)


def _orbit(map_: Stroboscope, start: np.ndarray, transient: int, points: int) -> np.ndarray:
    """States at whole periods of the settled motion, float64[points + 1, D]."""
    states = [map_.run(start, transient).state if transient else start]
    for _ in range(points):
        states.append(map_.run(states[-1], 1).state)
    orbit = np.concatenate(states)
    if not np.isfinite(orbit).all():
        raise ParameterError(
            "regularisation_widths: the motion from this start doesn't last. Give another start=."
        )
    return orbit


def _widths(system: System, orbit: np.ndarray, given: Any, unit: str) -> np.ndarray:
    """Widths [unit of the gap], descending."""
    if given is None:
        gaps = evaluate(
            [guard.gap for guard in system.guards],
            states=dict(zip(system.states, orbit.T, strict=True)),
            values=system.values,
            bits=[np.zeros(len(orbit), bool)] * len(system.guards),
        )
        return SHARES * max(float(np.abs(gap).max()) for gap in gaps)
    given = given if isinstance(given, list | tuple | np.ndarray) else [given]
    widths = np.array([to_si(one, unit, "widths") for one in given])
    if not len(widths) or not (widths > 0).all():
        raise must_be("widths", "positive, at least one", given)
    return np.sort(widths)[::-1]


def _where_equal(widths: np.ndarray, errors: np.ndarray, wanted: float) -> float:
    """The largest width below which the error stays under another one, NaN if there is none among
    them.
    """
    below = errors <= wanted
    count = len(below) if below.all() else int(np.argmin(below[::-1]))
    first = len(widths) - count  # the first width from which on all are below
    if first in (0, len(widths)):
        return np.nan
    pair = slice(first - 1, first + 1)
    share = np.interp(np.log(wanted), np.log(errors[pair][::-1]), [1.0, 0.0])
    return float(np.exp(np.interp(share, [0.0, 1.0], np.log(widths[pair]))))
