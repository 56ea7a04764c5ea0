"""`fit`: parameters of a system from a measurement, with their standard errors."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, get_args

import numpy as np
import xarray as xr

from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.fits.doubts import doubt_sizes, doubt_times
from saltus.analysis.fits.growth import grow
from saltus.analysis.fits.measurement import Measurement, measurement, per_output
from saltus.analysis.fits.motion import Motions
from saltus.analysis.fits.search import MisfitSearch
from saltus.analysis.fits.sizes import Size
from saltus.analysis.fits.steady import SteadyResponses
from saltus.analysis.fits.unknowns import INSIDE, Unknowns
from saltus.analysis.fits.verdict import FOLLOW, UNKNOWN, follow, noise_of, valleys, verdict
from saltus.analysis.inputs.given import Range, Starts, Value
from saltus.analysis.inputs.starts import at_values, check_system
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError, one_of
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting, stage
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system import System
from saltus.system.outputs import with_more
from saltus.system.read_off import Quantity
from saltus.units import to_si

#: Smallest noise that is estimated, in the size of what was measured: rounding.
LEAST_NOISE = 1e-14

#: Rounds in which the noise of several outputs is estimated, and a change in one that is none.
ROUNDS, SETTLED = 20, 1e-3
#: Times as many places from which a search on short beginnings of the data begins.
MORE = 4
#: Misfit beyond which residuals are more than the noise that was given.
TOO_LARGE = 1.5
#: Residuals of this share of what was measured are small: they needn't be noise.
SMALL = 0.05

Measured = xr.Dataset | Mapping[str, Any] | str | PathLike[str] | bytes


@verb
def fit(
    system: System,
    measured: Measured,
    free: Mapping[str, Range],
    start: Starts | None = None,
    *,
    t_start: float | str = 0.0,
    quantity: Size = "amplitude",
    outputs: Mapping[str, Quantity] | None = None,
    noise: Value | Mapping[str, Value] | None = None,
    weights: float | Mapping[str, float] | None = None,
    missing: bool = False,
    starts: int = 16,
    flows: int = 4000,
    seed: int = 1,
    values: Mapping[str, Value] | None = None,
    method: Method | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Parameters of a system from a measurement: values, standard errors, and what the data leave
    open.

    1. Motions are computed from ``starts`` places between the bounds, a scrambled Sobol sequence,
       and from the system's own values. Where contacts come and go, misfits have many valleys.
    2. From the quarter of them with the least misfit, least squares descend (trust region
       reflective), by derivatives that the flow carries along exactly through every contact.
    3. If no two agree, or what is left isn't noise, minima on short beginnings of a history are
       followed to longer ones; and where a motion is too sensitive to be followed from its start,
       as chaotic ones are, through up to 400 windows (multiple shooting), each of which starts
       where the one before ends, to a millionth of the states.
    4. The best valley gives the values. Its derivatives give their standard errors, and by
       singular vectors the combinations of unknowns that the data don't fix.

    Parameters
    ----------
    system : System
        Equations, and the values of all that isn't free.
    measured : Dataset, mapping or path
        A history: ``t`` or ``time`` [s], ascending, and states or outputs by name. A Dataset, as
        from :func:`saltus.simulate`, tells units by its attributes; a mapping holds numbers in SI
        or ``(numbers, "mm")``; a CSV file has units in its heading, ``t [s], x [mm]``. Or sizes of
        steady responses: the forcing frequency by its name, in any order and repeatedly, in place
        of the time. Sweeps up and down find the responses, and a point counts to the nearest.
    free : mapping of str to (low, high)
        Unknowns and their bounds: parameters, states at the start as ``"x(0)"``, and ``"t_start"``,
        where it isn't known at which phase of the forcing the measurement begins: its times then
        count from there.
    start : sequence, mapping or array
        Start of the motion, as for :func:`saltus.simulate`. Default: at rest.
    t_start : float or str
        Time at the start [s].
    quantity : {"amplitude", "rms", "peak"}
        What was measured of responses: the amplitude of the first harmonic, the root mean square,
        or the largest magnitude.
    outputs : mapping of str to callable, or to (callable, unit)
        More outputs by name, as for :func:`saltus.simulate`, which may be measured.
    noise : float or str, or mapping of str to these, optional
        Standard deviation of the noise of each measured output [unit of the output]. Default:
        estimated from the residuals of each.
    weights : float, or mapping of str to float, optional
        In place of noise: factors of the residuals, whose common scale is estimated.
    missing : bool
        Whether NaN, or an empty cell, is a sample that is missing. Else it is refused.
    starts : int
        Places from which the search begins.
    flows : int
        Most motions that are computed, with derivatives or without, of any length; all windows
        count as one. Of responses two for each frequency and step.
    seed : int
        Of the places.
    values : mapping, optional
        Other values of parameters.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``unknown``, ``combination``, ``valley``, ``sample``, ``output``. ``value``,
        ``standard_error`` (infinite where the data say nothing), ``correlation``, ``at_bound``;
        ``combination_share`` and ``combination_error`` in widths of the bounds, ``identifiable``:
        whether the data tell more of a combination than the bounds do; ``valley_value``,
        ``valley_misfit``, ``valley_descents``; ``measured``, ``fitted``, ``residual`` and ``noise``
        of each output; ``misfit``, the root mean square of the residuals in standard deviations of
        the noise; ``windows``; ``flows``.

    Raises
    ------
    ParameterError, UnitError, ResultFileError
        If an argument can't be used, or the measurement can't be read.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the best place so far.

    References
    ----------
    Bates & Watts, Nonlinear Regression Analysis and Its Applications (1988), chapters 2 and 3;
    Branch, Coleman & Li, SIAM J. Sci. Comput. 21 (1999) 1-23; Sobol, USSR Comput. Math. Math.
    Phys. 7 (1967) 86-112; Bock, in Modelling of Chemical Reaction Systems (1981) 102-125 (multiple
    shooting).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="8 Hz")
    >>> run = sl.simulate(rig.with_values(upper_gap="0.45 mm"), periods=20, samples=24)
    >>> found = sl.fit(rig, run[["x"]], {"upper_gap": ("0.1 mm", "2 mm")})
    >>> f"{1e3 * found.value.item():.6f} mm"
    '0.450000 mm'
    """
    check_system(system)
    method = check_method(method, system)
    system, unknowns, data, spread = check_fit(
        system, measured, free, outputs=outputs, noise=noise, weights=weights, missing=missing,
        values=values,
    )  # fmt: skip
    model: Motions | SteadyResponses
    if data.along == "time":
        doubt_times(system, data)
        model = Motions.of(system, method, data, unknowns, start, t_start, threads)
    else:
        one_of(get_args(Size), quantity=quantity)
        model = SteadyResponses(system, method, data, unknowns, quantity, threads)
    search = MisfitSearch(
        model, unknowns, data.values, np.tile(spread.deviation, (len(data.at), 1)),
        whole(flows, "flows", 2),
    )  # fmt: skip
    places = _places(system, model, whole(starts, "starts"), whole(seed, "seed", 0))
    answer = functools.partial(_dataset, system, method, data, search, spread)
    with reporting(progress) as show:
        try:
            search.run(places, stage(show, 0.0, 0.3))
            doubt_sizes(data, search)
            described = functools.partial(_described, spread, data)
            sure = described(search) and (
                len(search.minima) < 2 or valleys(search.minima)[0][1] > 1
            )
            if not search.spent and not sure and data.along == "time":
                more = _places(system, model, MORE * starts, seed)
                grow(search, more, described, stage(show, 0.3, 1.0))
            if spread.each and len(data.outputs) > 1 and search.windows == 1:
                _settle(search, spread, data)
        except KeyboardInterrupt:
            raise Interrupted(answer if search.best is not None else None) from None
        return answer()


def check_fit(
    system: System, measured: Any, free: Any, *, outputs: Any = None, noise: Any = None,
    weights: Any = None, missing: bool = False, values: Any = None, **_: Any,
) -> tuple[System, Unknowns, Measurement, Spread]:  # fmt: skip
    """The system with its values and outputs, the unknowns, the measurement and its spread; other
    arguments are left to the fit.

    Raises
    ------
    ParameterError, UnitError, ResultFileError
        If one can't be used.
    """
    system = at_values(system, values)
    if outputs is not None:
        system = replace(system, outputs=with_more(system, outputs))
    unknowns, data = Unknowns.of(system, free), measurement(system, measured, missing)
    spread, count = Spread.of(data, noise, weights), int(data.there.sum())
    if count <= len(unknowns):
        raise ParameterError(
            f"{count} measured values are too few for {len(unknowns)} unknowns and the noise: "
            "measure more, or free fewer."
        )
    return system, unknowns, data, spread


@dataclass(frozen=True)
class Spread:
    """Standard deviations of the measured outputs, or numbers in proportion, float64[K]; whether
    their scale is estimated, of each or of all in common.
    """

    deviation: np.ndarray
    each: bool
    common: bool

    @classmethod
    def of(cls, data: Measurement, noise: Any, weights: Any) -> Spread:
        """The spread of a user's noise or weights."""
        if noise is not None and weights is not None:
            raise ParameterError(
                lambda say: (
                    f"give {say.key('noise')} or {say.key('weights')}, and only one of them."
                )
            )
        known = per_output(noise, data, "noise", lambda one, unit, name: to_si(one, unit, name))
        if known is not None:
            return cls(known, each=False, common=False)
        known = per_output(weights, data, "weights", lambda one, _, name: to_si(one, "1", name))
        if known is not None:
            return cls(1.0 / known, each=False, common=True)
        return cls(data.size, each=True, common=False)

    def seen(self, search: MisfitSearch, data: Measurement) -> np.ndarray:
        """Standard deviation of the noise of each output, float64[K]: given, or estimated from the
        residuals.
        """
        if not self.each and not self.common:
            return self.deviation
        assert search.best is not None
        there = data.there
        if self.common:
            left = max(there.sum() - len(search.unknowns), 1)
            factor = np.full(len(self.deviation), np.sqrt(search.best.misfit / left))
        else:
            factor = noise_of(search.best.residual, search.deviation, there, len(search.unknowns))
        return np.asarray(np.maximum(factor * search.deviation[0], LEAST_NOISE * data.size))


def _settle(search: MisfitSearch, spread: Spread, data: Measurement) -> None:
    """Descend from the best place until the noise of each output is that of its own residuals
    there.
    """
    for _ in range(ROUNDS):
        noise = spread.seen(search, data)
        search.reweigh(np.tile(noise, (len(data.at), 1)))
        assert search.best is not None
        search.minima.clear()
        search.descend(search.best.shares, None)
        if search.spent or np.abs(spread.seen(search, data) / noise - 1.0).max() < SETTLED:
            return


def _described(spread: Spread, data: Measurement, search: MisfitSearch) -> bool:
    """True if the residuals of the best place are noise: as large as it was said to be, or else
    such that neighbours don't follow each other.
    """
    noise = spread.seen(search, data)
    search.reweigh(np.tile(noise, (len(data.at), 1)))
    assert search.best is not None
    if not spread.each and not spread.common:
        return bool(search.best.misfit <= TOO_LARGE**2 * len(search.best.residual))
    alike = follow(data.values - search.best.fitted)
    return bool(((alike <= FOLLOW) | (noise < SMALL * data.size)).all())


def _places(system: System, model: Motions | SteadyResponses, starts: int, seed: int) -> np.ndarray:
    """Shares at which the search begins: the system's own values, where they lie between the
    bounds, then a Sobol sequence.
    """
    unknowns = model.unknowns
    known = {
        **system.values,
        **{f"{name}(0)": one for name, one in zip(system.states, model.start, strict=True)},
        "t_start": model.t_start,
    }
    own = np.array([known[name] for name in unknowns.names])
    drawn = unknowns.scattered(starts, seed)
    if not ((own > unknowns.low) & (own < unknowns.high)).all():
        return drawn
    return np.concatenate([np.clip(unknowns.shares(own), INSIDE, 1 - INSIDE)[None], drawn[:-1]])


# -- the answer ------------------------------------------------------------------------------------
def _dataset(
    system: System, method: Method, data: Measurement, search: MisfitSearch, spread: Spread
) -> xr.Dataset:
    """The Dataset of the best place."""
    unknowns = search.unknowns
    noise = spread.seen(search, data)
    search.reweigh(np.tile(noise, (len(data.at), 1)))
    best = search.best
    assert best is not None
    value = unknowns.values(best.shares)
    width = unknowns.widths(value)
    said, found = verdict(best), valleys(search.minima) or [(best, 0)]
    others = unknowns.values(np.array([one.shares for one, _ in found]))
    count = len(best.residual)
    names = dict(zip(unknowns.names, value.tolist(), strict=True))
    parameters = {name: names.get(name, one) for name, one in system.values.items()}
    given = not (spread.each or spread.common)
    alike = follow(data.values - best.fitted)
    larger = given and best.misfit > TOO_LARGE**2 * count
    attrs = provenance(system, method, parameters) | {
        "residuals": "larger" if larger else "alike" if (alike > FOLLOW).any() else "noise",
        "along": data.along,
        "noise_from": "given" if given else "residuals",
        "ended": "budget" if search.spent else "ok",
    }
    at_unit = "s" if data.along == "time" else system.units[data.along]
    return build(
        schema.FIT,
        subject(system, attrs),
        {
            "unknown": list(unknowns.names),
            "unknown_units": list(unknowns.units),
            "value": value,
            "standard_error": said.error * width,
            "low": unknowns.low,
            "high": unknowns.high,
            "at_bound": (best.shares < INSIDE) | (best.shares > 1 - INSIDE),
            "correlation": said.correlation,
            "combination_share": said.combination,
            "combination_error": said.combination_error,
            "identifiable": said.combination_error < UNKNOWN,
            "valley_value": others,
            "valley_misfit": [np.sqrt(one.misfit / count) for one, _ in found],
            "valley_descents": [number for _, number in found],
            "at": data.at,
            "output": list(data.outputs),
            "output_units": list(data.units),
            "measured": data.values,
            "fitted": best.fitted,
            "residual": data.values - best.fitted,
            "noise": noise,
            "residual_correlation": alike,
            "misfit": np.sqrt(best.misfit / count),
            "windows": search.windows,
            "flows": search.model.flows,
        },
        words={"<at>": at_unit, "<along>": data.along, "<unknown>": ""},
    )
