"""`spectrum`: amplitudes of the response by frequency."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
import xarray as xr

from saltus.analysis.inputs.verb import verb
from saltus.analysis.motion.settled import settled
from saltus.errors import ParameterError, among, one_of, unknown
from saltus.flow.counts import whole as whole_number
from saltus.results import build, inherited, subject_of
from saltus.results.dataset import schema
from saltus.results.dataset.reader import reader
from saltus.sentences import Given

#: Windows by name: weights of n samples. They are periodic: the sample after the last would be the
#: first.
WINDOWS: dict[str, Callable[[int], np.ndarray]] = {
    "none": lambda n: np.ones(n),
    "hann": lambda n: 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n),
}
#: Fewest samples of an unforced run: a Hann line is four bins wide, and fewer than four lines are
#: no spectrum.
FEWEST = 16
#: Largest difference of two sampling intervals, relative to the time of the samples: far above
#: rounding.
UNEVEN = 1e-9


@verb
@reader
def spectrum(
    run: xr.Dataset,
    state: str | Sequence[str] | None = None,
    *,
    window: str | None = None,
    last: int | None = None,
) -> xr.Dataset:
    """Amplitude spectrum of the states and outputs of a run.

    The amplitude of a line is that of the cosine it stands for: ``x(t) = x_0 + sum of x_k cos(2 pi
    f_k t + phase_k)``. Where the response repeats after n forcing periods (:func:`saltus.settled`
    tells), whole responses are taken without a window: the lines lie exactly on multiples of
    1/(nT), nothing leaks, and **Parseval's relation** holds to rounding::

        mean of x^2 over the samples = x_0^2 + sum of x_k^2 / 2

    where the last line of an even number of samples counts in full.

    Where it doesn't, a Hann window is used and corrected by its coherent gain: a single line still
    has its amplitude, and the sum divided by ``noise_bandwidth`` (1.5) is near the mean square. The
    mean is taken off before the window and stands in the line of frequency 0.

    Parameters
    ----------
    run : Dataset
        The result of ``simulate``. Take the transient off with its ``keep=``. Sampling folds what
        lies above half of the samples per period back into the spectrum; forces of contact springs
        bend and their lines fall off as the third power of the order, so 200 samples a period leave
        some 1e-6 of the largest line.
    state : str or sequence of str, optional
        The states and outputs; all of them by default.
    window : {"none", "hann"}, optional
        For all trajectories; by default ``"none"`` where the response repeats, else ``"hann"``.
    last : int, optional
        Whole forcing periods at the end to transform, cut to whole responses; by default one
        response, or all periods that were kept where one doesn't repeat.

    Returns
    -------
    Dataset
        Dim ``frequency`` [Hz], with ``order`` = frequency / forcing frequency if forced; and
        ``trajectory`` for a batch (with forcing periods of its own the dim is ``order``).
        ``<state>_amplitude`` [unit of the state], ``<state>_phase`` [rad, of the cosine, at t = 0],
        ``window``, ``noise_bandwidth``, ``response_period``.

    Raises
    ------
    ParameterError
        If the samples are too few, not evenly spaced or missing, if an argument is unknown, or if
        no common stretch holds whole responses of all trajectories.

    References
    ----------
    F. J. Harris, On the use of windows for harmonic analysis with the discrete Fourier transform,
    Proc. IEEE 66 (1978) 51-83.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> run = sl.simulate(rig, start=("0.75 mm", 0), periods=400, keep=100)
    >>> lines = sl.spectrum(run, "x")
    >>> largest = int(lines["x_amplitude"].argmax("frequency"))
    >>> round(float(lines["order"][largest]), 3)  # the subharmonic at a third of 17 Hz
    0.333
    """
    schema.check(run, caller="spectrum", kinds=[schema.TRAJECTORY])
    if window is not None:
        one_of(WINDOWS, "spectrum: ", window=window)
    names = _states(run, state)
    stretch = _forced_stretch(run, last) if "period" in run.variables else _free_stretch(run, last)
    chosen = [window or ("none" if n else "hann") for n in stretch.response]
    weights = np.array([WINDOWS[name](stretch.count) for name in chosen])
    lines = {name: _lines(run, name, stretch, weights) for name in names}
    batch = "trajectory" in run.dims
    # a varied frequency shows in the lines
    named = json.loads(run.attrs.get("varied_parameters", "[]")) if batch else []
    varied = {
        name: run[name].values
        for name in named
        if name in run.coords and name not in ("frequency", "order")
    }
    separate = stretch.frequency.ndim == 2
    period = (
        np.atleast_1d(run["forcing_period"].values)
        if separate
        else run.attrs.get("forcing_period_s")
    )
    subject = subject_of(run, names, inherited(run), batch, varied, period)
    places = {"trajectory": np.arange(len(chosen)), "frequency": stretch.frequency}
    if stretch.order is not None:
        places["order"] = stretch.order
    each = {
        "window": chosen,
        "noise_bandwidth": np.mean(weights**2, axis=1) / np.mean(weights, axis=1) ** 2,
        "response_period": stretch.response,
        "status": np.atleast_1d(run["status"].values),
    }
    parts: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "<state>_amplitude": np.abs,
        "<state>_phase": np.angle,
    }
    spectra = [(row, {name: of(line)}) for name, line in lines.items() for row, of in parts.items()]
    return build(
        schema.SPECTRUM,
        subject,
        [*places.items(), *spectra, *each.items()],
        along={"frequency": "order"} if separate else {},
    )


# -- which samples ---------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Stretch:
    """Samples ``first`` to ``first + count``: frequencies [Hz], orders, the time of the first
    sample [s]; the periods of the responses [T].
    """

    first: int
    count: int
    frequency: np.ndarray
    order: np.ndarray | None
    begin: np.ndarray
    response: np.ndarray


def _states(run: xr.Dataset, state: str | Sequence[str] | None) -> list[str]:
    known = schema.outputs_in(run)
    names = (
        list(known)
        if state is None
        else list(state)
        if isinstance(state, Sequence) and not isinstance(state, str)
        else [state]
    )
    for name in names:
        if not among(name, known):
            raise unknown(f"spectrum: this run has no {schema.output_word(run)}", name, known)
    return names


def _forced_stretch(run: xr.Dataset, last: int | None) -> _Stretch:
    """Whole forcing periods at the end of the run, as many as hold whole responses of all
    trajectories that repeat.
    """
    phases = np.asarray(run["period"].values, dtype=float)
    whole_periods = np.flatnonzero(phases == np.round(phases))
    available = max(whole_periods.size - 1, 0)
    last = last if last is None else whole_number(last, "last")
    if last is not None and last > available:
        raise ParameterError(
            lambda say: (
                f"spectrum: {say.key(last=Given(last))}, but {available} whole forcing periods "
                f"were kept. Simulate with more {say.key('keep')}."
            )
        )
    if not available:
        raise ParameterError(
            lambda say: (
                "spectrum needs a whole forcing period of samples, its two ends included. "
                f"Simulate longer, or give more {say.key('keep')}."
            )
        )
    periods = available if last is None else last
    _check_even(phases[whole_periods[-periods - 1] :], "forcing periods")
    response = np.zeros(run.sizes.get("trajectory", 1), dtype=np.int64)
    if periods >= 2:
        response = np.atleast_1d(settled(run, last=periods)["response_period"].values)
    common = math.lcm(*(int(n) for n in response if n))
    if common > periods:
        raise ParameterError(
            lambda say: (
                "spectrum: the trajectories repeat after "
                f"{sorted({int(n) for n in response if n})} forcing periods, so only {common} "
                f"periods hold whole responses of all, and {periods} were kept. Give more "
                f"{say.key('keep')}, or take them one by one: run.isel(trajectory=0)."
            )
        )
    if last is None and response.all():
        periods = common  # more periods would only add empty lines between
    periods -= periods % common
    first, count = (
        int(whole_periods[-periods - 1]),
        int(whole_periods[-1] - whole_periods[-periods - 1]),
    )
    order = np.arange(count // 2 + 1) / periods
    own = "forcing_period" in run.variables and run["forcing_period"].ndim == 1
    period = (
        run["forcing_period"].values[:, None] if own else np.float64(schema.forcing_period(run))
    )
    begin = np.atleast_1d(run["time"].values[..., first])
    return _Stretch(first, count, order / period, order, begin, response)


def _free_stretch(run: xr.Dataset, last: int | None) -> _Stretch:
    """All samples of a system without forcing but the last, which would be the first of a
    repeat.
    """
    if last is not None:
        raise ParameterError(
            "spectrum: last= counts forcing periods, and this system isn't "
            "forced. Select by time: run.sel(time=...)."
        )
    time = np.asarray(run["time"].values, dtype=float)
    if time.size < FEWEST:
        raise ParameterError(
            f"spectrum needs {FEWEST} samples or more of a system that isn't "
            f"forced; this run has {time.size}."
        )
    _check_even(time, "s")
    count = time.size - 1
    frequency = np.arange(count // 2 + 1) / (time[-1] - time[0])
    response = np.zeros(run.sizes.get("trajectory", 1), dtype=np.int64)
    return _Stretch(0, count, frequency, None, time[:1], response)


def _check_even(places: np.ndarray, unit: str) -> None:
    steps = np.diff(places)
    bad = np.flatnonzero(
        np.abs(steps - steps.mean()) > UNEVEN * max(1.0, float(np.abs(places).max()))
    )
    if bad.size:
        at = int(bad[0])
        raise ParameterError(
            f"spectrum needs evenly spaced samples; after {places[at]:.6g} {unit} the next one "
            f"comes {steps[at]:.6g} {unit} later, while "
            f"the mean is {steps.mean():.6g}. Give it the run as simulate returned it, or a slice "
            f"of it without gaps."
        )


# -- lines -----------------------------------------------------------------------------------------
def _lines(run: xr.Dataset, name: str, stretch: _Stretch, weights: np.ndarray) -> np.ndarray:
    """Complex amplitudes of the cosines of each trajectory, referred to t = 0."""
    dim = schema.sample_dim(run)
    samples = (
        run[name].transpose(..., dim).values[..., stretch.first : stretch.first + stretch.count]
    )
    samples = np.atleast_2d(samples)
    mean = samples.mean(axis=1, keepdims=True)
    lines = scipy.fft.rfft((samples - mean) * weights, axis=1) / weights.sum(axis=1, keepdims=True)
    lines[:, 1:] *= 2.0
    if stretch.count % 2 == 0:
        lines[:, -1] /= 2.0
    lines[:, 0] = mean[:, 0]
    referred: np.ndarray = lines * np.exp(-2j * np.pi * stretch.frequency * stretch.begin[:, None])
    return referred
