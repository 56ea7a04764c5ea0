"""The wrapper of every public verb: it answers wrong arguments in words, and ends well on
Ctrl-C.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

import numpy as np

from saltus.announce import silent
from saltus.arguments import Kinds
from saltus.blas_threads import one_blas_thread
from saltus.errors import MOST_IN_A_ROW, ParameterError, closest, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.engine import MOST_THREADS
from saltus.interrupt import Interrupted, PartInterrupted, no_ctrl_c_is_lost
from saltus.system import System

P = ParamSpec("P")
R = TypeVar("R")

#: Names of arguments in other programs, and ours.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(
        ("tend", "tfinal", "t_final", "tf", "t_max", "tmax", "duration", "t_span", "tspan"),
        "t_end=",
    ),
    **dict.fromkeys(("t_eval", "teval", "times", "saveat"), "at= (times)"),
    **dict.fromkeys(("n_samples", "nsamples", "dt", "step"), "samples= (per period)"),
    **dict.fromkeys(("y0", "x0", "u0", "initial", "initial_state", "ic"), "start="),
    **dict.fromkeys(
        ("rtol", "atol", "tol", "tolerance", "reltol", "abstol"),
        "method=sl.ODE45(rtol=..., atol=...), or sl.Taylor(), which needs none",
    ),
    **dict.fromkeys(("terminal", "stop", "stop_at", "stop_condition"), 'until="x > 2 mm"'),
    **dict.fromkeys(("params", "parameters", "args", "p"), "values="),
    **dict.fromkeys(("n_jobs", "workers", "cores"), "threads="),
    **dict.fromkeys(("n", "n_periods", "nperiods", "cycles"), "periods="),
    **dict.fromkeys(("solver", "integrator"), "method="),
}
_STEPS = (
    "The method chooses its steps, and no contact is stepped over; a fixed step is "
    "method=sl.RK4(step)."
)
_NOT_NEEDED = "It isn't needed: saltus reads the equation itself."
_RECORDS = (
    "Contacts are comparisons in the equation, and a run records them all: run.contact_time. "
    "sl.poincare(system, start, surface) records other crossings."
)
#: Names of arguments in other programs that have no counterpart, and the reason.
_MISSING: Mapping[str, str] = {
    **dict.fromkeys(("events", "event", "callback"), _RECORDS),
    **dict.fromkeys(
        ("until", "terminal", "stop", "stop_at"),
        'sl.simulate ends at a condition: sl.simulate(system, start, t_end=10, until="x > 2 mm").',
    ),
    "outputs": "The system has them: system.with_outputs({'tip': lambda x: ...}).",
    **dict.fromkeys(("max_step", "first_step", "min_step", "hmax", "h0", "options"), _STEPS),
    **dict.fromkeys(("jac", "jacobian", "vectorized", "mass_matrix"), _NOT_NEEDED),
    "dense_output": "Write at=[...] for the states at given times, or samples= for more samples.",
    **dict.fromkeys(
        ("transient", "discard", "settle", "skip"),
        "Write keep=, how many of the last periods are kept.",
    ),
    "noise": (
        "Draw the numbers once, outside the equation: noise = sl.recorded(times, values), and in "
        "the equation noise(t)."
    ),
    **dict.fromkeys(
        ("plot", "show"), "A picture is drawn of the result: sl.plot.history(run) and others."
    ),
    "units": (
        "Results are in SI. Pictures take units, sl.plot.history(run, units={'x': 'mm'}), and "
        "values any unit that fits, start={'x': '1 mm', 'v': 0}."
    ),
    "values": "Give other values by system.with_values(name=...), and call it once for each.",
}
#: Names in other programs for the forcing frequency.
_FREQUENCY = ("freq", "frequency", "omega", "w", "f", "forcing_frequency")
#: Arguments with the names of a system's states, as a user would write them.
_RANGES = {
    "axes": 'x=("-5 mm", "5 mm", 400), v=("-1 m/s", "1 m/s", 400)',
    "box": 'x=("-5 mm", "5 mm"), v=("-1 m/s", "1 m/s")',
}
#: Arguments for the length of a run; verbs that count whole periods have no t_end.
_LENGTHS = ("t_end", "periods", "every")
_INSIDE: ContextVar[bool] = ContextVar("inside", default=False)


def verb(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function a public verb.

    It answers unknown arguments by the known ones, and arguments of a wrong kind by the right kind.
    ``progress=False`` also silences messages about compiling. Ctrl-C before anything is finished is
    an :class:`Interrupted` too.
    """
    signature, kinds = inspect.signature(function), Kinds(function)

    @functools.wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        if _INSIDE.get():
            return function(*args, **kwargs)
        _check(function.__name__, signature, kinds, args, kwargs)
        quiet: AbstractContextManager[Any] = (
            silent() if kwargs.get("progress") is False else nullcontext()
        )
        token = _INSIDE.set(True)
        try:
            with quiet, one_blas_thread(), no_ctrl_c_is_lost():
                return function(*args, **kwargs)
        except KeyboardInterrupt as stop:
            if isinstance(stop, Interrupted) and not isinstance(stop, PartInterrupted):
                raise
            raise Interrupted from None  # a part has finished, but that is no answer
        finally:
            _INSIDE.reset(token)

    return called


def check_call(function: Callable[..., Any], *args: Any, **kwargs: Any) -> None:
    """Raise a ParameterError for arguments that a verb doesn't take; for a verb that passes its
    arguments to another one.
    """
    function = inspect.unwrap(function)
    _check(function.__name__, inspect.signature(function), Kinds(function), args, kwargs)


def _check(
    name: str,
    signature: inspect.Signature,
    kinds: Kinds,
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
) -> None:
    """Raise a ParameterError unless these arguments exist and have the right kinds."""
    given = _by_name(name, signature, args, kwargs)
    kinds.check(f"sl.{name}", given)
    if given.get("threads") is not None:
        whole(given["threads"], "threads", 1, MOST_THREADS)


def _by_name(
    name: str, signature: inspect.Signature, args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> Mapping[str, Any]:
    """The arguments by name. Raises a ParameterError for unknown ones."""
    known = signature.parameters
    open_ = any(parameter.kind == parameter.VAR_KEYWORD for parameter in known.values())
    for word in [word for word in kwargs if word not in known]:
        if not open_ or _misspelt(word, known, args, kwargs):
            raise ParameterError(
                f"sl.{name} has no argument {shown(word)}. {_instead(word, known, args, kwargs)}"
            )
    try:
        given = signature.bind(*args, **kwargs).arguments
    except TypeError as error:
        raise ParameterError(f"sl.{name}: {error}. Write sl.{name}({_call(known)}).") from None
    if "start" in known and isinstance(given.get("periods"), list | tuple | dict | np.ndarray):
        raise ParameterError(
            f"sl.{name}: the start comes second, and the time is one number: sl.{name}(system, "
            f"start, t_end=10). "
            f"periods can't be {shown(given['periods'])}."
        )
    samples = given.get("samples")
    if "t_end" in known and (
        isinstance(samples, list | tuple) or getattr(samples, "shape", ()) != ()
    ):
        raise ParameterError(
            f"sl.{name}: samples is a number: how many in a forcing period, or in the whole run of "
            f"a system without forcing. Write at=[...] for the states at given times."
        )
    return given


def _misspelt(
    word: str,
    known: Mapping[str, inspect.Parameter],
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
) -> bool:
    """True if a word that could be a state is nearly an argument, and neither a state nor a
    parameter.
    """
    system = kwargs.get("system", args[0] if args else None)
    return (
        any(name in known for name in _RANGES)
        and isinstance(system, System)
        and word not in system.values
        and word not in (*system.states, *system.outputs.names)
        and (meant := closest(word, known)) is not None
        and closest(word, [*known, *system.states]) == meant
    )


def _instead(
    word: str,
    known: Mapping[str, inspect.Parameter],
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
) -> str:
    """Advice about an argument that doesn't exist."""
    system = kwargs.get("system", args[0] if args else None)
    if isinstance(system, System) and word in system.values and "vary" in known:
        return f"It is a parameter of {system.name}: vary={{{word!r}: (low, high, count)}}."
    if isinstance(system, System) and word in system.values:
        by = f"values={{{word!r}: ...}} or " if "values" in known else ""
        return f"It is a parameter of {system.name}: give it by {by}system.with_values({word}=...)."
    if isinstance(system, System) and word in system.states and "start" in known:
        more = ", ..." if len(system.states) > MOST_IN_A_ROW else ""
        start = ", ".join(f"{state!r}: ..." for state in system.states[:MOST_IN_A_ROW])
        return f"It is a state of {system.name}: give it by start={{{start}{more}}}."
    if word.rstrip("s") in known:  # a plural of an argument
        return nearest(word, known)
    there = _ELSEWHERE.get(word.lower(), f"{word}=" if word in _LENGTHS else "")
    if there.partition("=")[0] in known:
        return f"Write {there}."
    if there.partition("=")[0] in _LENGTHS:
        return _length(known)
    missing = _MISSING.get(there.partition("=")[0] or word.lower(), "")
    if missing and ("keep=" not in missing or "keep" in known):
        return missing
    if isinstance(system, System) and "values" in known:
        meant = system.forced_at if word.lower() in _FREQUENCY else _like(word, system.values)
        if meant:
            return (
                f"Did you mean {meant!r}? It is a parameter of {system.name}: "
                f"values={{{meant!r}: ...}} or system.with_values({meant}=...)."
            )
    return nearest(word, known)


def _like(word: str, names: Iterable[str]) -> str | None:
    """The name that begins or ends with a word."""
    return next((name for name in names if len(word) > 1 and name.startswith(word)), None) or next(
        (name for name in names if name.endswith(f"_{word}")), None
    )


def _length(known: Mapping[str, inspect.Parameter]) -> str:
    """The arguments of a verb for the length of its run."""
    ways = {
        "t_end": "t_end= [s]",
        "periods": "periods= (forcing periods)"
        if "every" not in known
        else "periods= (forcing periods, or samples every= seconds of a system without forcing)",
    }
    return (
        f"The length of the run is "
        f"{' or '.join(text for name, text in ways.items() if name in known)}."
    )


def _call(known: Mapping[str, inspect.Parameter]) -> str:
    """A call of the verb with its required arguments."""
    needed = [
        p.name
        for p in known.values()
        if p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
    ]
    needed += [
        f"{p.name}=..." for p in known.values() if p.default is p.empty and p.kind == p.KEYWORD_ONLY
    ]
    ranges = [
        _RANGES[p.name] for p in known.values() if p.kind == p.VAR_KEYWORD and p.name in _RANGES
    ]
    rest = [] if ranges else [p.name for p in known.values() if p.default is not p.empty][:2]
    return ", ".join([*needed, *ranges, *(f"{name}=..." for name in rest), "..."])
