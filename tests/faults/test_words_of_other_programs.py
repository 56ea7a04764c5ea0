"""What people type who come from MATLAB, SciPy, PyDSTool or a finite element program is answered by
what to write here.
"""

import importlib
import itertools
import re
import time

import numpy as np
import pytest
from typer.testing import CliRunner

import saltus as sl
from saltus.cli.commands import app
from saltus.errors import SaltusWarning
from saltus.study.read import parse

rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
COUNT = itertools.count(1)
MASS, STIFFNESS = np.diag([1.0, 2.0]), 1e3 * np.array([[2.0, -1.0], [-1.0, 1.0]])


def beam(**given):
    return sl.structure(MASS, STIFFNESS, **given)


def touching(**given):
    return sl.Contact("x2", stiffness="10 kN/m", gap="1 mm", **given)


def pushed(force):
    return beam(forces=[sl.Force("x1", force)], frequency=4.0)


def equation(function):
    return sl.system(states="x v")(function)


def set_item(mapping, name):
    mapping[name] = 5.0


# -- names -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("continuation", r"sl\.branches\(system, \{name: \(low, high\)\}\)"),
        ("arclength", r"sl\.branches\("),
        ("ContClass", r"sl\.branches\("),
        ("harmonic_balance", r"sl\.branches\(.*by=sl\.HarmonicBalance"),
        ("nnm", r"sl\.backbone\("),
        ("montecarlo", "values=.*array"),
        ("monte_carlo", "values=.*array"),
        ("events", r"run\.contact_time.*sl\.poincare"),
        ("Event", r"run\.contact_time.*sl\.poincare"),
        ("concat", r"xarray\.concat"),
        ("merge", r"xarray\.concat"),
        ("animate", "no animations.*FuncAnimation"),
        ("least_squares", r"sl\.fit\("),
        ("optimize", r"sl\.fit\("),
        ("white_noise", r"noise = sl\.recorded\(times, values\)"),
        ("solve_ivp", r"sl\.simulate\(system, start, t_end="),
        ("odeint", r"sl\.simulate\(system, start, t_end="),
        ("Vode_ODEsystem", r"sl\.simulate\(system, start, t_end="),
        ("RK45", r"method=sl\.ODE45\(\)"),
        ("Radau", r"method=sl\.ODE15s\(\)"),
        ("ode23s", r"method=sl\.ODE15s\(\)"),
        ("Newmark", r"sl\.RK4\(step\)"),
        ("odeset", r"sl\.ODE45\(rtol="),
        ("deval", r"run\.x\.interp"),
        ("linspace", r"NumPy.*\(first, last, number\)"),
        ("to_pandas", r"sl\.samples\(run\)"),
        ("args", r"with_values\("),
        ("Model", r"@sl\.system"),
        ("eig", r"sl\.structure_modes\("),
        ("base_excitation", r"base=sl\.Base"),
        ("chirp", r"sl\.sweep\("),
        ("Sensor", r"with_outputs\("),
        ("limit_cycle", r"sl\.periodic_orbits\("),
        ("cell_mapping", r"sl\.basins\("),
        ("bouc_wen", "one more state"),
        ("coulomb", r"sl\.friction\("),
        ("backlash", r"sl\.freeplay\(.*sl\.impact\("),
        ("saturation", r"sl\.clip\("),
        ("dirac", r"sl\.pulse\("),
        ("integral", "Make it a state"),
        ("diff", "what the function returns"),
        ("if_else", r"sl\.where\("),
        ("version", "__version__"),
        ("arctan2", r"sl\.atan2"),
        ("equilibrium", "Did you mean 'equilibria'"),
        ("zzz", r"dir\(saltus\)"),
    ],
)
def test_names_that_saltus_has_not(name, words):
    with pytest.raises(AttributeError, match=f"no {name!r}. .*{words}"):
        getattr(sl, name)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("animate", "FuncAnimation"),
        ("plot", r"sl\.plot\.history\(run\)"),
        ("time_history", r"sl\.plot\.history\(run\)"),
        ("frf", r"sl\.plot\.frequency_response\("),
        ("poincare", r"sl\.plot\.section\("),
        ("phase_portrait", r"sl\.plot\.phase\("),
        ("show", r"axes\.figure\.savefig"),
        ("basin", "Did you mean 'basins'"),
        ("zzz", "Known: .*energy"),
    ],
)
def test_pictures_that_saltus_has_not(name, words):
    with pytest.raises(AttributeError, match=words):
        getattr(sl.plot, name)


def test_what_is_advised_exists():
    """No sentence names a function of saltus that isn't there."""
    from saltus.analysis.inputs import verb
    from saltus.language import foreign
    from saltus.plot import elsewhere as pictures
    from saltus.system import elsewhere
    from saltus.system.structures import parts

    structure = importlib.import_module("saltus.system.structures.structure")
    told = itertools.chain(
        elsewhere._ADVICE.values(), pictures._PICTURES.values(), foreign.ADVICE.values(),
        verb._MISSING.values(), verb._ELSEWHERE.values(), parts._ELSEWHERE.values(),
        structure._ELSEWHERE.values(),
    )  # fmt: skip
    for sentence in told:
        for inside, picture in re.findall(r"\bsl\.(\w+)(?:\.(\w+))?", sentence):
            assert hasattr(sl, inside), sentence
            assert not picture or hasattr(sl.plot, picture), sentence


# -- arguments -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"events": abs}, r"comparisons in the equation.*sl\.poincare"),
        ({"terminal": True}, r"Write until=.x > 2 mm"),
        ({"outputs": {"a": lambda x: x}}, r"system\.with_outputs"),
        ({"max_step": 0.1}, r"chooses its steps.*sl\.RK4\(step\)"),
        ({"jac": None}, "isn't needed"),
        ({"dense_output": True}, "at="),
        ({"tol": 1e-9}, r"sl\.ODE45\(rtol="),
        ({"transient": 100}, "keep="),
        ({"noise": 0.1}, r"sl\.recorded"),
        ({"plot": True}, r"sl\.plot\.history\(run\)"),
        ({"units": {"x": "mm"}}, r"sl\.plot\.history\(run, units="),
        ({"freq": 15.0}, r"Did you mean 'frequency'\? .*values=\{'frequency'"),
        ({"omega": 15.0}, r"Did you mean 'frequency'"),
        ({"stiffness": 1.0}, r"values=\{'contact_stiffness'"),
        ({"samples": [0.0, 0.1]}, r"samples is a number: .*at="),
        ({"start": "random 20"}, r"default_rng\(1\)\.uniform\(low, high, \(n, 2\)\)"),
    ],
)
def test_arguments_that_a_run_has_not(given, words):
    with pytest.raises(sl.SaltusError, match=words):
        sl.simulate(rig, **{"start": (0, 0), "periods": 1, **given})


PAIR = {"mass": ("1 kg", "2 kg"), "force": ("1 N", "2 N")}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: sl.frequency_response(rig, (14, 15, 2), values={"upper_gap": [1e-3, 2e-3]}),
            "one value.*[Cc]all it once for each value.*sl.bifurcation_diagram",
        ),
        (
            lambda: sl.branches(rig, PAIR),
            "one parameter.*sl.bifurcation_curve.*sl.bifurcation_diagram",
        ),
        (
            lambda: sl.branches(rig, {"mass": (1, 2, 50)}),
            r"\(low, high\), not \(1, 2, 50\): the steps",
        ),
        (lambda: sl.attractors(rig, (0, 0), values={"mass": [1, 2]}), r"with_values\(name="),
        (lambda: sl.basins(rig, values={"mass": 1}), r"with_values\(name="),
        (lambda: set_item(rig.values, "mass"), r"system = system\.with_values\(mass=\.\.\.\)"),
        (lambda: setattr(rig, "mass", 5.0), r"system = system\.with_values\(mass=\.\.\.\)"),
        (lambda: set_item(rig.units, "x"), r"@sl\.system\(units="),
        (lambda: sl.simulate(rig, {"xdot": 1, "v": 0}, periods=1), "Known: x, v"),
        (lambda: sl.RK4(), r"Write sl\.RK4\(step="),
        (lambda: sl.plot.history(rig, xlim=(0, 1)), r"axes\.set_xlim"),
        (lambda: sl.plot.phase(rig, title="a"), r"axes\.set_title"),
        (lambda: beam(damping_ratio=["2 %", "wide"]), "damping_ratio"),
        (lambda: beam(damping_ratio="2 mm"), "damping_ratio"),
        (lambda: beam(zeta=0.02), "damping_ratio="),
        (lambda: beam(base="2 m/s^2"), r"sl\.Base\(direction, amplitude"),
        (lambda: beam(n_modes=2), "Write modes="),
        (lambda: beam(contacts=[touching(restitution=0.8)]), "restitution=. Give one of the two"),
        (lambda: beam(contacts=[touching(friction=0.2)]), "sliding= come together"),
        (lambda: touching(exponent=1.5), "power=1.5"),
        (lambda: touching(mu=0.2), "friction=, and sliding="),
        (lambda: sl.Contact("x2"), "needs gap"),
        (lambda: sl.Contact("x2", 1.0, 1.0, at="x1"), r"write sl\.Contact\(at, stiffness, gap"),
        (lambda: beam(contacts=[{"at": "x2", "restitution": 1}]), "needs gap"),
        (lambda: beam(contacts=[sl.Contact(2, 1.0, 1.0)]), "number 2 is 'x2'"),
        (lambda: sl.Force("x1", "2 N", frequency=3), "harmonic="),
        (lambda: pushed(lambda t, x: x), "lambda t, frequency"),
        (lambda: pushed(sl.recorded([0, 1], [0, 1], "m/s^2")), "a record of a force"),
        (lambda: beam(base=sl.Base("z", 1.0)), "names no degree of freedom"),
    ],
)
def test_arguments_are_answered_by_what_to_write(call, words):
    with pytest.raises(sl.SaltusError, match=words):
        call()


def test_many_names_are_listed_in_their_order_and_shortened():
    names = [f"node {chr(97 + i)}" for i in range(26)] + [f"w_{i}_z" for i in range(8, 102)]
    for given, listed in (
        (None, "Known: x1 ... x120."),
        (names, "node l, ..., w_8_z ... w_101_z (120 in all)."),
    ):
        with pytest.raises(sl.SaltusError) as told:
            sl.structure(
                np.eye(120), np.eye(120), names=given, contacts=[sl.Contact("tip", 1.0, 1.0)]
            )
        assert str(told.value).endswith(listed)
        assert len(str(told.value)) < 200


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("simulate", r"sl\.simulate\(delangre, \.\.\.\)"),
        ("plot", r"sl\.plot\.phase\(sl\.simulate\(delangre"),
        ("copy", r"delangre\.with_values\(name="),
        ("parameters", r"delangre\.values"),
    ],
)
def test_what_a_system_does_not_do_itself(name, words):
    with pytest.raises(AttributeError, match=words):
        getattr(rig, name)


def test_what_results_of_other_programs_are_asked():
    run = sl.simulate(rig, (0, 0), periods=1)
    for name, words in (("t", r"run\.time"), ("y", r"run\.x"), ("te", r"run\.contact_time"),
                        ("sol", r"interp\(time=")):  # fmt: skip
        with pytest.raises(AttributeError, match=words):
            getattr(run, name)
    assert not hasattr(run, "zzz")


# -- equations -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "force",
    [
        lambda x, a: -(x > a) * (x - a),
        lambda x, a: (x > a) * (x - a),
        lambda x, a: 3.0 * (x > a),
        lambda x, a: (x > a) + (x < -a),
        lambda x, a: (x > a) - 0.5,
        lambda x, a: 1.0 - (x > a),
        lambda x, a: (x > a) ** 2,
        lambda x, a: (x > a) / 2.0,
        lambda x, a: abs(x > a),
        lambda x, a: float(x > a),
        lambda x, a: np.float64(2.0) * (x > a),
    ],
)
def test_a_comparison_is_no_number(force):
    with pytest.raises(sl.SaltusError, match=r"comparison was used as a number\. Write sl\.piecew"):
        equation(lambda t, x, v, *, a=1.0: (v, -x + force(x, a)))


@pytest.mark.parametrize(
    "drawn",
    [
        lambda x: np.random.default_rng().normal(),
        lambda x: time.perf_counter(),
        lambda x: next(COUNT) * x,
        lambda x: x ** next(COUNT),
        lambda x: sl.piecewise((x, x > next(COUNT)), otherwise=0.0),
        lambda x: sl.sin(x) if next(COUNT) % 2 else sl.cos(x),
    ],
)
def test_what_differs_from_call_to_call_is_no_equation(drawn):
    with pytest.raises(sl.SaltusError, match=r"another equation each time.*sl\.recorded"):
        equation(lambda t, x, v: (v, -x + drawn(x)))


def test_a_law_that_differs_from_call_to_call_is_none():
    with pytest.raises(sl.SaltusError, match="another equation each time"):
        equation(lambda t, x, v: (v, -x, sl.impact(x < next(COUNT), v, restitution=0.8)))


RECORD = sl.recorded([0, 1], [0, 1])


def with_a_vector(t, y):
    return y[1], -y[0]


def with_a_record(t, x, v):
    return v, -x + RECORD


def with_half_a_choice(t, x, v):
    return v, -sl.where(x > 1, x - 1)


def with_a_mapping(t, x, v):
    return {"x": v, "v": -x}


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (with_a_vector, r"\*y, \.\.\.\) for all states"),
        (with_a_record, r"'record' of 2 points.*Call it: of a record record\(t\)"),
        (with_half_a_choice, r"Write sl\.where\(condition, value, otherwise\)"),
        (with_a_mapping, "in the order of the states: return dx/dt, dv/dt"),
    ],
)
def test_equations_written_as_elsewhere(function, words):
    with pytest.raises(sl.SaltusError, match=words):
        equation(function)


def test_parameters_are_arguments_of_the_function():
    with pytest.raises(sl.SaltusError, match=r"after a \* in the function"):
        sl.system(states="x v", params={"k": 1.0})


def test_the_advice_for_a_step_gives_the_step():
    """A force of 0, from t = 1 on of 1: x = 1 - cos(t - 1) and v = sin(t - 1)."""
    with pytest.raises(sl.SaltusError, match=r"sl\.where\(t < 1\.0, before\(t\), after\(t\)\)"):
        sl.recorded([0, 1, 1, 2], [0, 0, 1, 1])
    before, after = sl.recorded([0, 1], [0, 0]), sl.recorded([1, 2], [1, 1])
    made = equation(lambda t, x, v: (v, sl.where(t < 1.0, before(t), after(t)) - x))
    run = sl.simulate(made, (0.0, 0.0), t_end=2.0)
    assert abs(run.end_x.item() - (1.0 - np.cos(1.0))) < 1e-15
    assert abs(run.end_v.item() - np.sin(1.0)) < 1e-15


@pytest.mark.parametrize(
    ("points", "values", "words"),
    [([0, 2, 1], [0, 1, 2], "Sort them"), ([0, 1, 1], [0, 2, 2], "Drop one of the two")],
)
def test_points_that_do_not_ascend(points, values, words):
    with pytest.raises(sl.SaltusError, match=words):
        sl.recorded(points, values)


# -- structures ------------------------------------------------------------------------------------
def test_mass_and_stiffness_the_wrong_way_round_are_doubted():
    """The natural frequencies of two equal masses on two equal springs follow by hand:
    omega**2 = (3 -+ sqrt 5)/2 k/m.
    """
    chain = 1e3 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    first, second = np.sqrt(1e3 * (3 + np.array([-1, 1]) * np.sqrt(5)) / 2) / (2 * np.pi)
    with pytest.warns(SaltusWarning, match=f"mass comes first.*{first:.4g} Hz"):
        sl.structure(chain, np.eye(2))
    with pytest.warns(SaltusWarning, match="mass comes first"):
        sl.structure(chain, np.eye(2), modes=1)
    for made in (sl.structure(np.eye(2), chain), sl.structure(np.eye(2), chain, modes=2)):
        assert f"natural frequencies {first:.4g}, {second:.4g} Hz" in " ".join(repr(made).split())


def test_a_damping_ratio_in_per_cent():
    """Each mode decays as exp(-ratio*omega*t): the damping matrix is 2*ratio*omega."""
    one, other = beam(damping_ratio="2 %", modes=2), beam(damping_ratio=0.02, modes=2)
    assert one.fingerprint() == other.fingerprint()
    assert beam(damping_ratio=["2 %", 0.05], modes=2).fingerprint() != one.fingerprint()
    with pytest.warns(SaltusWarning, match="write '2 %'"):
        beam(damping_ratio=2.0)


# -- studies ---------------------------------------------------------------------------------------
STUDY = '[study]\nname = "s"\n[system]\nmodel = "delangre"\n[simulate]\nperiods = 3\n'


@pytest.mark.parametrize(
    ("added", "words"),
    [
        ("[monte_carlo]\nruns = 3\n", r"no table 'monte_carlo'\. .*values = .*sl\.simulate"),
        ("[continuation]\nvary = 3\n", r"\[branches\] with vary"),
        ("[events]\nx = 1\n", r"\[poincare\]"),
        ("[solver]\nname = 'a'\n", r"\[method\]"),
        ("[parameters]\nmass = 1\n", r"\[system\]"),
        ('outputs = { a = "x" }\n', r"key of \[sensitivity\], .*\[frequency_response\], "),
        (
            '[branches]\nvary.mass = { first = "1 kg", last = "2 kg", count = 9 }\n',
            "first and last only",
        ),
        ('[branches]\nvary.mass = { low = "1 kg", high = "2 kg" }\n', "takes { first ="),
    ],
)
def test_tables_and_keys_that_a_study_has_not(added, words):
    with pytest.raises(sl.SaltusError, match=words):
        parse(STUDY + added)


def test_ends_are_spelt_as_those_of_a_range():
    one, other = (
        parse(f"{STUDY}[branches]\nvary.mass = {ends}\n[backbone]\namplitude = {sizes}\n"
              'state = "x"\nforce = "force"\n')
        for ends, sizes in (
            ('["1 kg", "2 kg"]', '["1 mm", "2 mm"]'),
            ('{ first = "1 kg", last = "2 kg" }', '{ first = "1 mm", last = "2 mm" }'),
        )
    )  # fmt: skip
    assert one == other


def refused(study):
    result = CliRunner().invoke(app, ["run", str(study), "--out", str(study.parent / "out" / "s")])
    assert result.exit_code == 2, result.output
    assert not (study.parent / "out").exists(), "an empty folder is left"
    return " ".join(result.output.split())


def test_a_study_without_a_model_names_the_file_beside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text(STUDY.replace('model = "delangre"\n', ""))
    assert "names no model. Write model =" in refused(study)
    (tmp_path / "unlike.py").write_text("print('no system')\n")
    (tmp_path / "my_rig.py").write_text('import saltus as sl\n\n@sl.system(states="x")\n')
    told = refused(study).replace(" ", "")
    assert f"saltusrun{study}--system{tmp_path / 'my_rig.py'}" in told


def test_a_study_of_a_structure_looks_at_no_file_beside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text(
        STUDY.replace('model = "delangre"\n', "")
        + '[system.structure]\nmass = "gone.npz"\nmodes = 2\n'
    )
    (tmp_path / "my_rig.py").write_text("import saltus as sl\n\nrig = sl.structure(1, 2)\n")
    told = refused(study)
    assert "gone.npz" in told
    assert "my_rig" not in told


def test_a_refused_study_leaves_no_folder(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY.replace("periods = 3", 'periods = 3\nstart = { y = "1 mm" }'))
    assert "lacks x, v" in refused(study)
