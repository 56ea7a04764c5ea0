"""Pictures of systems with outputs: sensors in place of coordinates of modes, outputs by their
names, units on the axes.
"""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError
from saltus.plot.style import display_scale

STIFFNESS = 1e3 * np.array([[2, -1, 0], [-1, 2, -1], [0, -1, 1.0]])


def structure(**options):
    about = {
        "contacts": [sl.Contact("x3", stiffness="5 kN/m", gap="2 mm")],
        "forces": [sl.Force("x1", "2 N")], "frequency": "1.8 Hz", "damping_ratio": 0.1, "modes": 3,
        "sensors": {"tip": "x3", "stop force": sl.contact_force("x3"), "speed": sl.velocity("x3")},
    }  # fmt: skip
    return sl.structure(np.eye(3), STIFFNESS, **about | options)


@pytest.fixture(scope="module")
def run():
    return sl.simulate(structure(), periods=40, progress=False)


@pytest.fixture(scope="module")
def responses():
    return sl.frequency_response(structure(), frequency=[1.8, 1.82], progress=False)


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def labels(axes):
    return axes.get_xlabel(), axes.get_ylabel()


def test_pictures_of_a_run_show_sensors(run, responses):
    assert labels(sl.plot.history(run)) == ("time [s]", "tip [mm]")
    assert labels(sl.plot.phase(run)) == ("tip [mm]", "speed [mm/s]")
    assert labels(sl.plot.spectrum(sl.spectrum(run)))[1] == "amplitude of tip [mm]"
    section = sl.poincare(structure(), None, "q1 turns", periods=9, progress=False)
    assert labels(sl.plot.section(section)) == ("tip [mm]", "stop force [N]")
    assert labels(sl.plot.frequency_response(responses)) == ("frequency [Hz]", "rms of tip [mm]")


def test_pictures_without_sensors_show_the_stop_and_no_coordinate_of_a_mode():
    given = structure(sensors={"deflection at stop": "x3", "velocity at stop": sl.velocity("x3"),
        "force at stop": sl.contact_force("x3")})  # fmt: skip
    made = structure(sensors=None)
    assert (made.outputs.names, made.outputs.units) == (given.outputs.names, ("m", "m/s", "N"))
    runs = [sl.simulate(one, periods=9, progress=False) for one in (made, given)]
    for name in (*made.states, *made.outputs.names):
        assert np.array_equal(*(one[name] for one in runs))
    assert labels(sl.plot.history(runs[0])) == ("time [s]", "deflection at stop [mm]")
    assert labels(sl.plot.phase(runs[0])) == ("deflection at stop [mm]", "velocity at stop [mm/s]")
    shown = labels(sl.plot.spectrum(sl.spectrum(runs[0])))[1]
    assert shown == "amplitude of deflection at stop [mm]"
    section = sl.poincare(made, None, "stop", periods=9, progress=False)
    assert "q1" not in "".join(labels(sl.plot.section(section)))
    responses = sl.frequency_response(made, frequency=[1.8], progress=False)
    assert labels(sl.plot.frequency_response(responses))[1] == "rms of deflection at stop [mm]"


def test_outputs_are_chosen_by_name(run, responses):
    assert labels(sl.plot.history(run, state="stop force"))[1] == "stop force [N]"
    assert labels(sl.plot.history(run, state="q1"))[1].startswith("q1 [")
    pair = sl.plot.phase(run, states=("tip", "stop force"), units={"stop force": "kN"})
    assert labels(pair) == ("tip [mm]", "stop force [kN]")
    axes = sl.plot.frequency_response(responses, quantity="peak", output="stop force")
    assert labels(axes)[1] == "peak |stop force| [N]"
    for draw in (sl.plot.history, lambda ds, state: sl.plot.spectrum(sl.spectrum(ds), state)):
        with pytest.raises(ParameterError, match="no state or output"):
            draw(run, state="tpi")


def test_the_curve_of_a_force_has_both_sides_of_its_jump():
    damped = structure(contacts=[sl.Contact("x3", stiffness="5 kN/m", gap="2 mm", damping=30.0)])
    run = sl.simulate(damped, periods=20, progress=False)
    before, after = (run[f"contact_stop force{end}"].values for end in ("_before", ""))
    assert (np.minimum(np.abs(before), np.abs(after)) < 1e-15).all()
    assert (np.abs(before - after) > 0.01).all()
    axes = sl.plot.history(run, state="stop force", units={"stop force": "N"})
    drawn = np.concatenate([line.get_ydata() for line in axes.get_lines() if len(line.get_xdata())])
    assert {*np.round(before, 12), *np.round(after, 12)} <= {*np.round(drawn, 12)}


def test_a_bifurcation_diagram_shows_the_first_sensor():
    diagram = sl.bifurcation_diagram(structure(), {"stop_gap": (1e-3, 3e-3, 3)}, progress=False)
    assert labels(sl.plot.bifurcation_diagram(diagram))[1] == "tip at turning points [mm]"
    axes = sl.plot.bifurcation_diagram(diagram, state="stop force")
    assert labels(axes)[1] == "stop force at turning points [N]"


def test_one_sensor_makes_no_portrait():
    alone = sl.simulate(structure(sensors={"tip": "x3"}), periods=3, progress=False)
    assert labels(sl.plot.history(alone))[1] == "tip [mm]"
    with pytest.raises(ParameterError, match="needs two outputs, this system has only 'tip'"):
        sl.plot.phase(alone)


def test_a_structure_without_modes_shows_its_states():
    whole = sl.simulate(structure(modes=None), periods=3, progress=False)
    assert labels(sl.plot.history(whole))[1] == "x1 [mm]"
    assert labels(sl.plot.phase(whole)) == ("x1 [mm]", "v1 [mm/s]")
    assert labels(sl.plot.history(whole, state="tip"))[1] == "tip [mm]"


def test_a_large_acceleration_stays_in_metres():
    assert display_scale("m/s^2", 2e3).unit == "m/s^2"
    assert display_scale("N", 2e3).unit == "kN"


def test_a_section_where_a_sensor_turns_leaves_its_rate_out():
    section = sl.poincare(structure(), None, "tip turns", periods=9, progress=False)
    assert labels(sl.plot.section(section)) == ("tip [mm]", "stop force [N]")
