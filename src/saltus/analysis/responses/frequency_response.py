"""`frequency_response`: all steady responses against the forcing frequency, each
branch kept apart.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import xarray as xr

from saltus.analysis.attractors.grid import grid_of
from saltus.analysis.inputs.given import Axis, Range, Reading, Starts, Value
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import verb
from saltus.analysis.responses.response_table import respond, response_plan
from saltus.errors import ParameterError
from saltus.flow.methods import Method
from saltus.system import System


@verb
def frequency_response(
    system: System,
    frequency: Axis,
    start: Starts | None = None,
    *,
    box: Mapping[str, Range] | None = None,
    follow: bool = False,
    unstable: bool = False,
    values: Mapping[str, Value] | None = None,
    outputs: Mapping[str, Reading] | None = None,
    method: Method | None = None,
    periods: int = 2000,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Steady responses against the forcing frequency, and the starts that lead to each.

    1. Every start is followed at every frequency until it has settled on an orbit that is closed by
       Newton's method and attracts by its Floquet multipliers. What never repeats is typed by its
       largest Lyapunov exponent.
    2. The branch that each response lies on is followed by pseudo-arclength continuation, through
       the frequencies between, until its orbits lose stability or the range ends. Coexisting
       responses are distinguished by their orbits, not by their amplitudes.
    3. The events on these branches - grazes, folds, period doublings and so on - are located to
       rounding.

    Branches have a budget, which models of few states never reach: points times periods of their
    orbits times squares of their states are at most 3e6, 470 points of an orbit of 80 states
    that repeats every period. Those of few periods come first; an orbit of n periods and D states
    with n D > 400 isn't followed. What was left is counted in the attribute
    ``responses_not_followed``; such responses are matched with their neighbours by where they lie.

    Parameters
    ----------
    system : System
        A forced system.
    frequency : (first, last, count), (first, last, count, "log"), or a list or array of values
        Forcing frequencies: text with a unit, or numbers in the unit of the system's parameter [Hz,
        or rad/s where it says so].
    start : sequence, mapping, array or str
        Starts as for :func:`saltus.simulate`, one or many, the same at every frequency; ``"random
        20"`` with ``box``; ``"sweep_up"`` or ``"sweep_down"``: from rest, then at each frequency
        from where the last one ended, as in an experiment. Default: at rest.
    box : mapping, optional
        Range (low, high) of each state for random starts.
    follow : bool
        Whether given starts are swept upwards too.
    unstable : bool
        Whether to follow the branches through their unstable parts too, and onto doubled and
        crossing ones, as :func:`saltus.branches` does.
    values : mapping, optional
        Other values of parameters.
    outputs : mapping of str to callable, or to (callable, unit), optional
        What to read off each response besides the states: functions of (t, states, parameters),
        their arguments found by name, such as ``{"acceleration": (lambda x, v, k, c, m: -(k*x +
        c*v)/m, "m/s^2")}``. Comparisons that are contacts of the system read their sides.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves.
    periods : int
        Forcing periods after which a trajectory that hasn't settled is looked at for chaos. A
        structure is looked at after a quarter of them, or 305 after its free motions have decayed
        to a thousandth: what is strongly chaotic by then isn't followed any further. They bound
        the work: closing orbits and measuring exponents may each cost ten times as many
        periods of the motion, and 20 000 more are spent on orbits that one which seems
        quasi-periodic may settle to. What isn't typed by then is ``not_repeating``; more periods
        spend more on it, and :func:`saltus.lyapunov` tells all exponents of one motion. What
        repeats after more than 64 periods, and 512 at most, is ``long_periodic``. What is
        ``chaotic`` is so for as long as it was followed (the attribute ``periods_watched``, where
        that is less than ``periods``): chaos may end later.
    seed : int
        Of random starts.
    threads : int, optional
        Default all processors. Results don't depend on it.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims: the frequency parameter, ``start``, ``response``, ``multiplier``, ``phase``,
        ``event``. On (frequency, start): ``response_of``, ``rms``, ``peak``, ``period``, ``type``,
        ``contacts_per_period``. On response: ``response_<parameter>``, ``response_branch``,
        ``response_type``, ``response_period``, ``response_rms``, ``response_peak``,
        ``response_margin``, multipliers, exponent, stroboscopic points, and for random starts
        ``response_share`` with its 95 % Wilson interval. Over two frequencies or more, and by an
        exact method, the branches are on ``point``, ``branch`` and ``event``, with the variables of
        :func:`saltus.branches`; ``branch_begin`` and ``branch_end`` are ``unstable`` where orbits
        lose stability. ``response_branch`` is a number on ``branch``; numbers behind these are of
        motions that never repeat, and of equilibria that a contact holds, each matched with its
        neighbours by where it lies. On (response, output): ``output_maximum``,
        ``_minimum``, ``_peak``, ``_peak_to_peak``, ``_mean``, ``_rms``, ``_rms_about_mean`` of
        every state and output, over whole responses (64 forcing periods of one that never repeats),
        and ``output_amplitude``, ``output_phase`` [rad] of the first harmonic: A cos(2 pi f t +
        phase), f the forcing frequency and t the time of the equations, also where the response
        repeats after several periods only. Turning points are located and means exact: nothing
        comes from samples.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the frequencies and starts that were finished;
        the others are of type ``not_computed``. While branches are followed it has all responses,
        the finished branches, and the points so far of those that weren't, which end with
        ``interrupted``.

    References
    ----------
    Nayfeh & Balachandran, Applied Nonlinear Dynamics (1995), chapters 3 and 5; Wilson, J. Am. Stat.
    Assoc. 22 (1927) 209-212.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> start = {"x": ["0 mm", "5 mm"], "v": 0}
    >>> responses = sl.frequency_response(rig, frequency=("15 Hz", "18 Hz", 4), start=start)
    >>> responses["response_frequency"].values.tolist()
    [15.0, 15.0, 16.0, 16.0, 17.0, 18.0]
    >>> responses["response_branch"].values.tolist()
    [0, 1, 0, 1, 1, 1]
    """
    check_system(system)
    if system.forced_at is None:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no forcing, so no frequency to vary. Take "
                f"{say.verb('bifurcation_diagram')} over another parameter; if a parameter is the "
                f"frequency of a forcing, declare {say.key('forced_at')} in {say.system()}."
            )
        )
    grid = grid_of(system, {system.forced_at: frequency}, start, box, values, seed, follow)
    plan = response_plan(grid, method, periods, outputs=outputs, unstable=unstable)
    return respond(plan, threads, progress)
