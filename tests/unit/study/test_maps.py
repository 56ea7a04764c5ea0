"""Basin maps of a study: the file, the plan, what a store must agree on."""

from __future__ import annotations

import dataclasses
import json

import pytest

from edited_copy import edited_copy
from saltus.errors import SaltusError, StudyError
from saltus.study import code
from saltus.study.answers.basins import BasinMap
from saltus.study.ask import questions_of
from saltus.study.read import parse
from saltus.study.run.running import Report, Resources, shard_of
from saltus.study.setting.inputs import Inputs
from small_study import maps_of, small_study

BASE = small_study(6, 4)
MAPS = BASE + '[[basins.map]]\nname = "first"\n[[basins.map]]\nname = "second"\n'


def job(text=BASE) -> BasinMap:
    return maps_of(parse(text))[0]


def replaced(old, new, text=BASE):
    assert old in text
    return text.replace(old, new)


# -- the plan --------------------------------------------------------------------------------------
def test_a_study_becomes_a_plan():
    one = job()
    assert (one.title, one.stem, one.compare) == ("small", "basins", None)
    assert one.plan.shape == (6, 4)
    assert list(one.plan.axes) == ["x", "v"]
    assert one.plan.axes["x"][[0, -1]].tolist() == [-0.005, 0.005]
    assert one.plan.system.values["frequency"] == 16.0
    assert one.plan.periods == 2000


def test_maps_have_values_and_methods_of_their_own():
    first, second = maps_of(
        parse(
            MAPS + 'values = { frequency = "7 Hz" }\nmethod = { name = '
            '"ODE45", rtol = 1e-4 }\ncompare = "first"\n'
        )
    )
    assert (first.stem, second.stem, second.compare) == ("first", "second", "first")
    assert [one.plan.system.values["frequency"] for one in (first, second)] == [16.0, 7.0]
    assert [one.plan.method.name for one in (first, second)] == ["Taylor", "ODE45"]
    assert second.plan.method.rtol == 1e-4
    assert second.plan.method.atol == 1e-6, "what isn't written has the method's default"


@pytest.mark.parametrize(
    ("name", "slug"),
    [
        ("exact, 25.5 kN/m", "exact-25.5-kn-m"),
        ("../../etc/passwd", "etc-passwd"),
        ("..", "map"),
        ("µ", "map"),
        ("A  b", "a-b"),
        ("a/", "a"),
    ],
)
def test_a_name_becomes_a_file_name(name, slug):
    """Nothing that leads out of the folder."""
    assert job(BASE + f"[[basins.map]]\nname = {json.dumps(name)}\n").stem == slug


@pytest.mark.parametrize("second", ["a agreement", "a attractors"])
def test_names_whose_files_would_overwrite_each_other_are_refused(second, tmp_path):
    text = BASE + (
        f'[[basins.map]]\nname = "b"\n[[basins.map]]\nname = "a"\ncompare = '
        f'"b"\n[[basins.map]]\nname = "{second}"\n'
    )
    with pytest.raises(StudyError, match="same file"):
        questions_of(parse(text), None, Inputs(tmp_path))


def test_at_for_an_axis_is_refused():
    with pytest.raises(SaltusError, match="x"):
        job(BASE + 'at = { x = "1 mm" }\n')


# -- faults of the file ----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "told"),
    [
        (replaced("[basins]", "[basins]\nperiod = 3"), r"\[basins\] has no key 'period'\. Did you "
                                                       r"mean 'periods'\?"),
        (replaced("count = 6", "cout = 6"), r"\[basins\.axes\.x\] has no key 'cout'\. Did you mean "
                                            r"'count'\?"),
        (MAPS + 'comapre = "first"\n', r"\[basins\.map 2\] has no key 'comapre'\. Did you mean "
                                       r"'compare'\?"),
        (MAPS + 'method = { name = "ODE45", rtl = 1e-3 }\n', r"\[basins\.map 2\.method\] has no "
            r"key 'rtl'\. Did you mean 'rtol'\?"),
        (MAPS + 'method = { name = "ode45" }\n', r"Did you mean 'ODE45'\?"),
        (MAPS + 'values = { frequenzy = "3 Hz" }\n', r"\[basins\.map\.values\] 'frequenzy' is "
                                                     r"unknown.*Did you mean 'frequency'\?"),
        (MAPS + "values = { frequency = 3 }\n", r'\[basins\.map\.values\] frequency = 3 has no '
                                                r'unit.*frequency = "3 Hz"'),
        (MAPS.replace("second", "first"), "two maps have the same name"),
        (MAPS.replace("second", "First"), r"names of this study give the same file names, such as "
                                          r"first\."),
        (MAPS + 'compare = "frist"\n', "map 'second' is compared with 'frist', which is no other "
                                       "map of this study"),
        (MAPS + 'compare = "second"\n', "which is no other map of this study"),
        (replaced("axes.v", "axes.w"), r"\[basins\.axes\] 'w' is unknown to delangre\. Known: "
                                       r"x, v\."),
        (replaced('"-5 mm"', "-5"), r"\[basins\.axes\] x\.first = -5 has no unit\."),
        (BASE + "every = 1\n", r'\[basins\] every = 1 has no unit.*every = "1 s"'),
        (BASE + 'every = "1 s"\n', r"delangre is forced.*Leave every out"),
        (BASE + 'at = { y = "1 mm" }\n', r"\[basins\.at\] 'y' is unknown to delangre"),
        (replaced("count = 6", "count = 1"), r"count = 1 must be greater than or equal to 2"),
        (replaced("count = 6", "count = 6.0"), r"count = 6\.0 must be a whole number"),
        (replaced('"-5 mm"', '"6 mm"'), r"the starts along x must ascend"),
        (replaced("count = 4", "count = 200000", replaced("count = 6", "count = 200000")),
            r"cells are more than"),
        (replaced("[basins]", "[basins]\nperiods = 0"), r"periods = 0 must be greater"),
        (BASE.split("[basins]")[0], r"a study asks something: it has a table \[simulate\], .* or "
                                    r"\[basins\]"),
        (BASE + '[compare]\nprinted = "a.csv"\n', r"maps are compared with compare = in "
                                                  r"\[\[basins\.map\]\]"),
        (replaced('model = "delangre"\n', ""), r"\[system\] names no model"),
    ],
)  # fmt: skip
def test_faults_say_where_and_what_to_write(text, told, tmp_path):
    with pytest.raises(SaltusError, match=told) as caught:
        questions_of(parse(text), None, Inputs(tmp_path))
    assert "pydantic" not in str(caught.value)


def test_a_grid_beyond_memory_is_refused():
    with pytest.raises(SaltusError, match="are more than"):
        job(replaced("count = 6", "count = 2000000000"))


def test_a_wrong_unit():
    with pytest.raises(StudyError, match=r"\[basins\.axes\] x"):
        job(replaced('"-5 mm"', '"-5 m/s"'))


@pytest.mark.parametrize(
    "text",
    [BASE.split("axes.v")[0], BASE + "axes.w = { first = 0, last = 1, count = 3 }\n"],
    ids=["one", "three"],
)
def test_one_or_three_axes_are_told_in_our_words(text):
    with pytest.raises(StudyError) as caught:
        job(text)
    assert "Dictionary" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["2/2", "x", "-1/2", "1", "1/0", "0/0", "0/2/3", "", "1.0/2", "0 /2", "0/-2"]
)
def test_nonsense_for_a_shard(text):
    with pytest.raises(
        StudyError,
        match=r"--shard .*: write K/N with K from 0 to N - 1, such "
        r"as 0/4",
    ):
        shard_of(text)


def test_a_shard():
    assert [shard_of(text) for text in ("0/1", "3/4", " 1/2 ")] == [(0, 1), (3, 4), (1, 2)]


# -- what a store must agree on --------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "names"),
    [
        (replaced('"4 N"', '"4.0000000001 N"'), {"values"}),
        (replaced('"16 Hz"', '"15 Hz"'), {"values"}),
        (replaced('"-5 mm"', '"-5.0000000001 mm"'), {"axes"}),
        (replaced("count = 6", "count = 7"), {"axes"}),
        (replaced("count = 6", "count = 4").replace("v = { first", "v = {first"), {"axes"}),
        (BASE + "periods = 1999\n", {"periods"}),
        (BASE + '[method]\nname = "Taylor"\norder = 18\n', {"method options"}),
        (BASE + '[method]\nname = "Taylor"\ntolerance = 1e-13\n', {"method options"}),
        (BASE + '[method]\nname = "ODE45"\n', {"method", "method options"}),
    ],
)
def test_what_changes_a_label_changes_the_identity(text, names):
    before, after = job().identity(), job(text).identity()
    assert {name for name in before if before[name] != after[name]} == names


def test_axes_in_another_order_are_another_map():
    """The same two axes: each cell would be another start."""
    x, v = BASE.strip().splitlines()[-2:]
    swapped = job("\n".join([*BASE.strip().splitlines()[:-2], v, x]) + "\n")
    assert swapped.identity() != job().identity()


@pytest.mark.parametrize(
    "text",
    [replaced('"small"', '"another title"'), replaced('"4 N"', '"4e3 mN"'),
        replaced('"-5 mm"', '"-0.005 m"'), "# a remark\n" + BASE,
     BASE + '[method]\nname = "Taylor"\n', BASE + '[[basins.map]]\nname = "of another '
                                                  'name"\n', BASE + "periods = 2000\n"],
)  # fmt: skip
def test_what_changes_nothing_does_not(text):
    assert job(text).identity() == job().identity()


@pytest.mark.slow
def test_the_code_is_part_of_the_identity(tmp_path, monkeypatch):
    """A label that comes from other code isn't mixed with this one's: every file that a label
    depends on counts.
    """
    before = code.code_hash.__wrapped__()
    assert before == code.code_hash.__wrapped__() == job().identity()["code"]
    for target in (
        "taylor/step.py",
        "labels.py",
        "engine.py",
        "trace.py",
        "find_attractors.py",
        "capture.py",
        "maps.py",
        "module.py",
        "build.py",
        "units.py",
    ):
        with monkeypatch.context() as patch:
            edited_copy(tmp_path / target, target, patch)
            assert code.code_hash.__wrapped__() != before, target


def test_the_identity_is_read_by_people():
    """It stands in the refusal."""
    assert "Taylor" in job().identity()["method"]


def test_the_identity_holds_plain_numbers():
    """numpy's words for a number change from one version of numpy to the next, and aren't for
    people.
    """
    assert "float64" not in json.dumps(job().identity())


# -- progress --------------------------------------------------------------------------------------
def test_time_left():
    assert Report("a", 2, 10, 4.0, 2).seconds_left == 16.0
    assert Report("a", 6, 10, 4.0, 2).seconds_left == 8.0, (
        "chunks of an earlier run don't count for the rate"
    )
    assert Report("a", 0, 10, 4.0, 0).seconds_left is None
    assert Report("a", 10, 10, 0.0, 0).seconds_left is None


@pytest.mark.parametrize(
    ("resources", "where"),
    [
        (Resources(threads=2), "threads"),
        (Resources(shard=(0, 2)), "threads"),
        (Resources(workers=1), "processes"),
        (Resources(scheduler="local"), "processes"),
    ],
)
def test_dask_only_if_asked_for(resources, where, monkeypatch):
    from saltus.study.run import divided

    monkeypatch.setattr(divided, "run_on_threads", lambda *_: done.append("threads"))
    monkeypatch.setattr(divided, "run_on_processes", lambda *_: done.append("processes"))
    done = []
    with divided._runner(resources) as run:
        run(None, None, [], None, None)
    assert done == [where]


def test_plans_are_plain_data():
    """What goes to a worker is a plan; nothing of it may be bound to this process."""
    import pickle

    one = job().plan
    again = pickle.loads(pickle.dumps(one))
    assert dataclasses.replace(again, axes=one.axes, system=one.system) == one
    assert {name: values.tobytes() for name, values in again.axes.items()} == {
        name: values.tobytes() for name, values in one.axes.items()
    }
    assert again.system.fingerprint() == one.system.fingerprint()
