"""Provenance: complete, plain, free of clocks; and a hash that sees every bit of the numbers and
nothing else.
"""

import json
import platform

import numpy as np

from saltus.results import content_hash, describe

from .conftest import sine_points, sine_run


def test_attributes_are_plain_and_complete(run):
    assert all(isinstance(value, str | int | float) for value in run.attrs.values())
    assert json.loads(run.attrs["parameters"]) == {"gap": 1e-3, "frequency": 1.0}
    assert json.loads(run.attrs["equations"])[0] == "x' = v"
    assert json.loads(run.attrs["method_options"]) == {"tolerance": 1e-16, "order": None}
    assert json.loads(run.attrs["versions"])["python"] == platform.python_version()
    assert set(json.loads(run.attrs["versions"])) == {
        "python",
        "numpy",
        "llvmlite",
        "xarray",
        "saltus",
    }


def test_the_same_run_has_the_same_attributes():
    assert sine_run().attrs == sine_run().attrs


def test_hash_sees_one_bit(run):
    changed = run.copy(deep=True)
    changed["x"].values[5] = np.nextafter(changed["x"].values[5], 1)
    assert content_hash(changed) != run.attrs["result_hash"]


def test_hash_sees_the_sign_of_zero(run):
    changed = run.copy(deep=True)
    assert changed["x"].values[0] == 0
    changed["x"].values[0] = -0.0
    assert content_hash(changed) != run.attrs["result_hash"]


def test_hash_sees_a_word_and_a_name(run):
    assert content_hash(run.assign(status="resting")) != run.attrs["result_hash"]
    assert content_hash(run.rename(x="y")) != run.attrs["result_hash"]


def test_describe_says_from_when_on_contacts_are_not_known(run):
    assert "aren't known" not in describe(run)
    error = run["contact_time_error"].values.copy()
    error[2:] = np.inf
    lost = run.assign(contact_time_error=("contact", error))
    first = float(run["contact_time"][2])
    said = f"times of {len(error) - 2} aren't known, from {first:.6g} s on"
    assert said in " ".join(describe(lost).split())


def test_hash_ignores_attributes_and_widths(run):
    changed = run.copy(deep=True).assign_attrs(system="other")
    changed["mode"] = changed["mode"].astype(np.int32)
    changed["contact_kind"] = changed["contact_kind"].astype(object)
    changed["x"] = changed["x"].astype(">f8")
    assert content_hash(changed) == run.attrs["result_hash"]


def test_describe_says_what_it_is(batch):
    text = describe(batch)
    for part in (
        "sine",
        "gap = 1 mm",
        "closed form(tolerance=1e-16",
        "3 trajectories",
        "3 ok",
        "12 crossing",
    ):
        assert part in text
    assert batch.attrs["result_hash"].startswith(text.split()[-1])
    assert "1 ok, 1 resting" in describe(sine_points())
    assert "contacts none" in describe(sine_run((0.5e-3,)))


def test_of_many_parameters_drives_and_stops_are_told(run):
    stops = [f"stop{i}_{kind}" for i in range(1, 9) for kind in ("gap", "stiffness", "damping")]
    values = dict.fromkeys([*stops, "base", "frequency"], 2.0)
    many = run.assign_attrs(parameters=json.dumps(values), units="{}", varied_parameters="[]")
    told = describe(many).splitlines()[0].partition(": ")[2].split(", ")
    names = [one.partition(" = ")[0] for one in told]
    gaps, springs = ([f"stop{i}_{kind}" for i in range(1, 9)] for kind in ("gap", "stiffness"))
    assert names == ["base", "frequency", *gaps, *springs[:3], "and 13 parameters more"]
    few = run.assign_attrs(parameters=json.dumps(dict.fromkeys(stops[:13], 2.0)), units="{}")
    assert [one.partition(" = ")[0] for one in
        describe(few).splitlines()[0].partition(": ")[2].split(", ")] == stops[:13]  # fmt: skip
