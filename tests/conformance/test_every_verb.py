"""The contract of a public verb: what it takes, what it refuses, how it stops, and what it gives.

A verb that is added needs a line in CALLS; the rest holds for it as for the others.
"""

from __future__ import annotations

import inspect
import json
import signal
from functools import cache

import numpy as np
import pytest
import xarray as xr

import saltus as sl
from saltus.results.dataset import schema
from saltus.results.dataset.result import Result
from saltus.results.files import export
from saltus.results.provenance import file_hash, to_json, versions
from saltus.system import System

pytestmark = pytest.mark.usefixtures("few_scouts")

RIG = sl.models.delangre("a", force="4 N", frequency="17 Hz")
#: The same start, numbers and names with units; and the same box.
START = {"in SI": (0.75e-3, 0.0), "in units": {"v": "0 m/s", "x": "0.75 mm"}}
BOX = {
    "in SI": {"x": (-1e-3, 1e-3, 4), "v": (-0.02, 0.02, 4)},
    "in units": {"x": ("-1 mm", "1 mm", 4), "v": ("-20 mm/s", "20 mm/s", 4)},
}
FREQUENCY = {"in SI": [17.0], "in units": ["17 Hz"]}
BRANCH = {"in SI": (16.9, 17.1), "in units": ("16.9 Hz", "17.1 Hz")}


FOLD = {"in SI": (16.0, 19.0), "in units": ("16 Hz", "19 Hz")}
FORCE = {"in SI": (3.9, 4.1), "in units": ("3.9 N", "4.1 N")}


SIZES = {"in SI": (2e-4, 6e-4), "in units": ("0.2 mm", "0.6 mm")}


@cache
def the_fold():
    """The end of the resonance."""
    start = {"x": 5e-3, "v": 0.0}
    return sl.branches(RIG, {"frequency": (15.0, 18.0)}, start, at=3, longest=1).sel(event=0)


def spring_force(x, mass, natural_frequency):
    return mass * (2 * sl.pi * natural_frequency) ** 2 * x


@cache
def a_run(how):
    """What might have been measured."""
    run = sl.simulate(RIG, START["in SI"], periods=3, samples=8)
    return {"in SI": {"t": run.time.values, "x": run.x.values}, "in units": run[["x"]]}[how]


def started(**arguments):
    """Arguments of a verb that takes a start."""
    return lambda how: (RIG, {"start": START[how], **arguments})


def of_result(verb, **arguments):
    """Arguments of a verb that takes what another has given."""
    return lambda how: (given(verb, how), arguments)


def logistic():
    """An orbit of x -> 4 x (1 - x), whose exponent is log 2."""
    x = [0.3]
    while len(x) < 600:
        x.append(4 * x[-1] * (1 - x[-1]))
    return np.array(x)


#: A small call of every public verb: how -> what it looks at, and its arguments.
CALLS = {
    "attractors": started(),
    "backbone": lambda how: (
        RIG,
        {"amplitude": SIZES[how], "values": {"force": 0, "damping_ratio": 0}, "points": 12},
    ),
    "basin_fractions": lambda how: (
        RIG,
        {"samples": 16, **{name: span[:2] for name, span in BOX[how].items()}},
    ),
    "basins": lambda how: (RIG, BOX[how]),
    "bifurcation_diagram": lambda how: (
        RIG,
        {"vary": {"frequency": FREQUENCY[how]}, "start": START[how]},
    ),
    "bifurcation_curve": lambda how: (
        RIG,
        {"event": the_fold(), "vary": {"frequency": FOLD[how], "force": FORCE[how]}, "points": 4},
    ),
    "event_sensitivity": lambda _: (RIG, {"event": the_fold(), "to": ["force"]}),
    "branches": lambda how: (
        RIG,
        {"vary": {"frequency": BRANCH[how]}, "start": START[how], "at": 1, "longest": 1},
    ),
    "compare": lambda how: (given("basins", how), {"map_b": given("basins", "in SI")}),
    "compare_methods": lambda how: (
        RIG,
        {
            "analysis": sl.frequency_response,
            "methods": [sl.ODE45(1e-6, 1e-9)],
            "frequency": FREQUENCY[how],
            "start": START[how],
        },
    ),
    "edge_orbit": lambda how: (
        RIG,
        {
            "a": {"in SI": (0.0, 0.0), "in units": ("0 mm", "0 m/s")}[how],
            "b": {"in SI": (2.5e-3, 0.56), "in units": ("2.5 mm", "560 mm/s")}[how],
        },
    ),
    "energy_balance": started(periods=3, **sl.models.energy("delangre")),
    "equilibria": lambda how: (
        sl.models.double_scroll(),
        {"start": {"x": {"in SI": 1.0, "in units": "1"}[how], "y": 0, "z": 0}},
    ),
    "fit": lambda how: (
        RIG,
        {
            "measured": a_run(how),
            "free": {"natural_frequency": {"in SI": (4.0, 6.0), "in units": ("4 Hz", "6 Hz")}[how]},
            "start": START[how],
            "starts": 4,
        },
    ),
    "frequency_response": lambda how: (
        RIG,
        {
            "frequency": FREQUENCY[how],
            "start": START[how],
            "outputs": {"spring_force": spring_force},
        },
    ),
    "impact_statistics": started(periods=30),
    "lyapunov": started(periods=64, transient=20),
    "periodic_orbits": started(periods=1),
    "poincare": started(surface="x turns", periods=5),
    "regularisation_widths": started(points=2, transient=20, widths=[1e-4, 1e-5]),
    "scatter": lambda how: (
        RIG,
        {
            "uncertain": {
                "upper_gap": {
                    "in SI": sl.normal(0.4e-3, 2e-5),
                    "in units": sl.normal("0.4 mm", "0.02 mm"),
                }[how]
            },
            "start": START[how],
            "samples": 2,
            "indices": True,
        },
    ),
    "sensitivity": started(periods=3, to=["upper_gap"]),
    "settled": of_result("simulate"),
    "simulate": started(periods=40),
    "spectrum": of_result("simulate", state="x"),
    "stroboscope": started(periods=5),
    "structure_modes": lambda _: (np.eye(2), {"stiffness": np.array([[2e3, -1e3], [-1e3, 1e3]])}),
    "transmissibility": of_result("frequency_response", output="spring_force", to="x"),
    "wolf": lambda how: (
        logistic(),
        {"sampling_interval": {"in SI": 1.0, "in units": "1 s"}[how], "dimension": 2, "delay": 1},
    ),
}
VERBS = [
    name for name, home in sl._HOMES.items()
    if home.startswith("saltus.analysis.") and not inspect.isclass(getattr(sl, name))
]  # fmt: skip
_given: dict[tuple[str, str], xr.Dataset] = {}


def given(verb, how="in SI"):
    """What a verb gives; computed once."""
    if (verb, how) not in _given:
        _given[verb, how] = ask(verb, how)
    return _given[verb, how]


def numbers(found):
    """A result without the times that its computation took, and without their hash."""
    if "method_cpu_seconds" not in found:
        return found
    kept = {name: value for name, value in found.attrs.items() if name != "result_hash"}
    return found.drop_vars("method_cpu_seconds").drop_attrs(deep=False).assign_attrs(kept)


def ask(verb, how="in SI", **more):
    subject, arguments = CALLS[verb](how)
    return getattr(sl, verb)(subject, **{**arguments, **more})


def takes(verb, argument):
    return argument in inspect.signature(getattr(sl, verb)).parameters


every = pytest.mark.parametrize("verb", VERBS)
long = pytest.mark.parametrize("verb", [verb for verb in VERBS if takes(verb, "progress")])


def test_there_is_a_call_of_each():
    assert set(CALLS) == set(VERBS)


# -- what it gives ---------------------------------------------------------------------------------
@every
def test_a_result_is_a_dataset_of_its_kind_in_which_all_has_units(verb):
    found = given(verb)
    assert isinstance(found, Result)
    kind = schema.kind_of(found)
    if verb != "transmissibility":  # which adds two variables to a response
        assert f"sl.{verb}" in schema.KINDS[kind].makers.split(" or ")
    schema.check(found, caller=f"sl.{verb}", kinds=(kind,))
    for name, variable in found.variables.items():
        assert isinstance(variable.attrs["units"], str), name
        assert variable.attrs["long_name"], name
        assert variable.dtype.kind in "fiU", name


@every
def test_a_result_says_where_it_comes_from(verb):
    attrs = given(verb).attrs
    assert attrs["saltus_version"]
    assert attrs["versions"] == to_json(versions())
    if verb in ("wolf", "structure_modes"):  # a series and matrices are no system
        return
    subject = CALLS[verb]("in SI")[0]
    system = subject if isinstance(subject, sl.System) else RIG
    assert attrs["system"] == system.name
    assert set(json.loads(attrs["parameters"])) <= set(system.values)
    assert set(system.states) <= set(json.loads(attrs["units"]))
    for name in (
        ("method_options_a", "method_options_b") if verb == "compare" else ("method_options",)
    ):
        assert json.loads(attrs[name])


@every
def test_asked_again_in_other_units_and_watched_it_is_the_same_to_the_bit(verb):
    shares = []
    watched = {"progress": shares.append} if takes(verb, "progress") else {}
    again = ask(verb, "in units", **watched)
    assert file_hash(numbers(again)) == file_hash(numbers(given(verb)))
    assert bool(shares) == bool(watched)
    assert shares == sorted(shares)
    assert all(0 <= share <= 1 for share in shares)


@every
def test_a_result_says_in_lines_and_in_rows_what_it_holds(verb):
    found = given(verb)
    kind = schema.KINDS[schema.kind_of(found)]
    lines = kind.account(found)
    assert lines
    assert set(lines) <= set(sl.describe(found).splitlines())
    tables = kind.rows("what it holds", found)
    assert tables[0].title == "what it holds"
    for table in tables:
        assert table.columns
        assert {len(row) for row in table.rows} <= {len(table.columns)}
        assert len(table.data) - 1 >= len(table.rows)


def test_every_kind_of_result_is_given_by_a_verb():
    assert {schema.kind_of(given(verb)) for verb in VERBS} == set(schema.NAMES)


@pytest.mark.parametrize("netcdf", [4, 3])
@every
def test_a_result_comes_back_from_its_file_as_it_was(verb, netcdf, tmp_path, monkeypatch):
    if netcdf == 3:
        monkeypatch.setattr(export, "_has", lambda _: False)  # without [io]
    file = sl.save(given(verb), tmp_path / "result.nc")
    back = sl.load(file)
    assert back.identical(given(verb))
    assert type(back) is Result
    if netcdf == 4:
        assert sl.save(back, tmp_path / "again.nc").read_bytes() == file.read_bytes()


# -- what it refuses -------------------------------------------------------------------------------
@every
def test_an_argument_that_is_nearly_one_is_answered_by_that_one(verb):
    (last,) = [
        name
        for name, one in inspect.signature(getattr(sl, verb)).parameters.items()
        if one.kind != one.VAR_KEYWORD
    ][-1:]
    with pytest.raises(sl.SaltusError, match=f"Did you mean '{last}'"):
        ask(verb, **{f"{last}s": 1})


@every
def test_without_what_it_looks_at_it_says_how_it_is_called(verb):
    with pytest.raises(sl.SaltusError, match=rf"sl\.{verb}.* Write sl\.{verb}\("):
        getattr(sl, verb)()
    with pytest.raises(sl.SaltusError, match=r"^[^\n]*\.$"):
        getattr(sl, verb)(*[object()] * len(CALLS[verb]("in SI")[1]))


def with_bad_start(verb, bad):
    """A call whose start is no number; None for a verb that takes a result."""
    subject, arguments = CALLS[verb]("in SI")
    if "start" in arguments:
        return subject, arguments | {"start": (bad, 0.0)}
    if "a" in arguments:
        return subject, arguments | {"a": (bad, 0.0)}
    if "x" in arguments:
        return subject, arguments | {"x": (bad, *arguments["x"][1:])}
    if isinstance(subject, xr.Dataset | System):
        return None
    return np.full_like(subject, bad), arguments


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@every
def test_a_start_that_is_no_number_is_refused(verb, bad):
    if call := with_bad_start(verb, bad):
        with pytest.raises(sl.SaltusError, match=r"finite|number"):
            getattr(sl, verb)(call[0], **call[1])


# -- how it stops ----------------------------------------------------------------------------------
@long
def test_a_request_ends_it_and_asked_again_in_silence_it_is_the_same(verb, capfd):
    stop = sl.Stop()
    stop.set()
    with stop, pytest.raises(sl.Interrupted):
        ask(verb)
    capfd.readouterr()
    again = ask(verb, progress=False)
    assert capfd.readouterr() == ("", "")
    assert file_hash(numbers(again)) == file_hash(numbers(given(verb)))


@pytest.mark.usefixtures("ctrl_c_may_leave_files_open")
@long
def test_ctrl_c_ends_it_as_an_interruption_that_others_know_too(verb):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as stopped:
            ask(verb, progress=lambda _: signal.raise_signal(signal.SIGINT))
    finally:
        signal.signal(signal.SIGINT, before)
    assert isinstance(stopped.value, sl.Interrupted)
    part = stopped.value.partial
    assert part is None or schema.kind_of(part) == schema.kind_of(given(verb))
