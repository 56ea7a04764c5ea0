"""What `sl.structure` takes, refuses and returns."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import scipy.sparse as sp

import saltus as sl
from saltus.errors import ParameterError, TraceError, UnitError

M, K = np.eye(3), 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
STOP, PUSH = sl.Contact("x3", 50.0, 0.5), sl.Force("x1", 1.0)


def test_names_parameters_and_units():
    made = sl.structure(
        M, K, 0.1 * K, frequency="2 Hz", names="roof xa floor", name="house", source="nowhere",
        contacts=[
            sl.Contact("roof", "3 kN/m", "1 mm", to="floor", side="both", damping="2 N*s/m"),
            sl.Contact("xa", 1.0, 2.0, side="lower", name="left"),
        ],
        forces=[sl.Force("floor", "2 kN", phase="90 deg"), sl.Force("xa", 1.0)],
    )  # fmt: skip
    assert made.states == ("roof", "xa", "floor", "roof_rate", "va", "floor_rate")
    assert [guard.name for guard in made.guards] == ["stop lower", "stop upper", "left"]
    assert dict(made.values) == {
        "stop_gap": 1e-3, "stop_stiffness": 3e3, "stop_damping": 2.0,
        "left_gap": 2.0, "left_stiffness": 1.0,
        "force1": 2e3, "force1_phase": np.pi / 2, "force2": 1.0, "frequency": 2.0,
    }  # fmt: skip
    assert made.units["stop_damping"] == "N*s/m"
    assert made.units["roof_rate"] == "m/s"
    assert type(made).from_dict(made.to_dict()).fingerprint() == made.fingerprint()
    assert made.with_values(left_gap="3 mm").fingerprint() == made.fingerprint()
    assert (made.name, made.source) == ("house", "nowhere")


def test_without_forces_it_has_no_period():
    free = sl.structure(M, K, contacts=[STOP], unit="rad")
    assert free.forced_at is None
    assert free.units["stop_stiffness"] == "N*m/rad"


@pytest.mark.parametrize(("written", "turns"), [("40 rad/s", 20 / np.pi), ("900 rpm", 15.0)])
def test_the_frequency_is_in_hertz_however_it_is_written(written, turns):
    made = sl.structure(M, K, 0.1 * K, forces=[PUSH], frequency=written)
    assert (made.values["frequency"], made.units["frequency"]) == (pytest.approx(turns), "Hz")


def test_every_analysis_takes_it():
    made = sl.structure(
        M, K, damping_ratio=0.1, modes=2, contacts=[STOP], forces=[PUSH], frequency=0.1
    )
    curve = sl.frequency_response(made, frequency=[0.1, 0.12], start=np.zeros(4), progress=False)
    gaps = sl.bifurcation_diagram(made, {"stop_gap": [0.5, 0.6]}, np.zeros(4), progress=False)
    one = sl.attractors(made, np.zeros(4), progress=False)
    peaks = [curve.peak[0, 0], gaps.peak[0, 0], one.attractor_peak[0]]
    assert np.allclose(peaks, peaks[0], rtol=1e-9)
    assert sl.regularise(made, width={"stop": 1e-3}).guards == ()


def changed(matrix, place, value):
    copy = np.array(matrix, float)
    copy[place] = value
    return copy


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"mass": changed(M, (0, 1), 0.1)}, r"symmetric, but mass\[0, 1\] = 0.1"),
        ({"mass": changed(M, (2, 2), 0.0)}, "positive definite, but its smallest eigenvalue is 0"),
        ({"mass": np.ones((3, 3)) + 0.5 * M - 0.9 * np.eye(3)}, "positive definite"),
        ({"mass": sp.csr_array(changed(M, (2, 2), -1.0)), "modes": 2}, "positive definite"),
        ({"mass": np.ones(3)}, "square matrix"),
        ({"mass": [[1.0, 2.0], [3.0]]}, "square matrix"),
        ({"mass": M * 1j}, "real numbers"),
        ({"stiffness": np.eye(2)}, "2 x 2, but mass is 3 x 3"),
        ({"stiffness": changed(K, (0, 0), np.nan)}, r"stiffness\[0, 0\] = nan isn't finite\."),
        ({"mass": sp.csr_array(changed(M, (2, 2), np.inf))}, r"mass\[2, 2\] = inf isn't finite\."),
        ({"stiffness": np.triu(K), "modes": 2}, r"one triangle: give stiffness \+ stiffness\.T"),
        ({"stiffness": sp.csr_array(np.tril(K)), "modes": 2}, "one triangle"),
        ({"stiffness": changed(K, (0, 1), 0.0), "modes": 2}, "stiffness must be symmetric"),
        ({"stiffness": -K, "modes": 2}, "negative eigenvalue"),
        ({"damping": sp.eye_array(4)}, "4 x 4"),
        ({"damping": K, "damping_ratio": 0.1}, "not both"),
        ({"damping_ratio": -0.1}, "0 or more"),
        ({"damping_ratio": [0.1, 0.2]}, "3 of them"),
        ({"damping_ratio": True}, "one number or 3 of them, not True"),
        ({"modes": 4}, "at most 3"),
        ({"modes": 1.5}, "whole number"),
        ({"frequency": None}, "give frequency="),
        ({"names": "a b"}, "3 degrees of freedom, not 2: 'a b'"),
        ({"names": [1, 2, 3]}, "3 degrees of freedom, as texts"),
        ({"names": "a b a"}, "two degrees of freedom are called 'a'"),
        ({"names": ["a", "", "b"]}, "that of degree of freedom 2 is empty"),
        ({"names": ["x1", "t", "x3"]}, "'t' can't be the name of a state"),
        ({"names": ["x1", "a b", "x3"]}, r"'a b' can't be the name of a state.* With modes= "),
        ({"names": ["x1", "v1", "x3"]}, "'v1' would be a degree of freedom and another rate"),
        ({"names": ["x1", "x2", "stop_gap"], "contacts": [sl.Contact("x1", 1.0, 1.0)]},
            "'stop_gap' would be a degree of freedom and"),
        ({"stiffness": 0 * K, "modes": 2}, "entries of stiffness are zero"),
        ({"unit": "inch"}, "unit must be"),
        ({"contacts": STOP}, "a list"),
        ({"contacts": [sl.Contact("x4", 1.0, 1.0)]}, "x4"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, to="x1")]}, "both 'x1'"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, side="left")]}, "side="),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, name="a b")]}, "name of a stop"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, name="x2")]}, "as a degree of freedom"),
        ({"contacts": [{"at": "x1", "stiffness": 1.0}]}, "needs gap"),
        ({"contacts": [{"at": "x1", "stifness": 1.0}]}, "stiffness"),
        ({"contacts": [sl.Contact("x1", 1, 1, name="a"), sl.Contact("x2", 1, 1, name="a")]},
            "two stops"),
        ({"contacts": [sl.Contact("x1", 1.0, -1.0, side="both")]}, "Give two contacts"),
        ({"contacts": [sl.Contact("x1", gap=-1.0, restitution=0, side="both")]}, "two contacts"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, restitution=0.5)]}, "Give one of the two"),
        ({"contacts": [sl.Contact("x1", gap=1.0)]}, "Give one of the two"),
        ({"contacts": [sl.Contact("x1", gap=1.0, restitution=2)]},
            r"^stop: the restitution 2 is outside \[0, 1\]"),
        ({"contacts": [sl.Contact("x1", "-50 kN/m", 1.0)]}, "stop: stiffness must be 0 or more"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, damping=-1)]}, "stop: damping must be 0 or more"),
        ({"contacts": [sl.Contact("x1", gap=1.0, restitution=1, damping=1.0)]}, "a rigid stop has"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, power=0.5)]}, "power must be"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, side="both", preload=1.0)]}, "onto one side"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, friction=0.1)]}, "come together"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, friction=0.1, sliding="u1")]}, "'u1' is no"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, friction=0.1, sliding="x1")]}, "pressed too"),
        ({"contacts": [sl.Contact("x1", 1.0, 1.0, friction=-0.1, sliding="x2")]}, "0 or more"),
        ({"contacts": [sl.Contact("x1", gap=1.0, restitution=1, friction=0.1, sliding="x2")]},
            "no rebound"),
        ({"mass": M + 0.1, "contacts": [sl.Contact("x1", gap=1.0, restitution=1)]}, "Give modes="),
        ({"sensors": {"a": ("x1", "x1")}}, "'a' is the difference of 'x1' and itself"),
        ({"contacts": [sl.Contact("x1", gap=-2.0, restitution=1), sl.Contact("x1", gap=1.0,
            restitution=1, side="lower")]}, "stop1 and stop2 .* overlap by 1 m: nothing fits"),
        ({"contacts": [sl.Contact("x1", gap=-2.0, restitution=1, to="x2"), sl.Contact("x2", gap=1.0,
            restitution=1, to="x1")]}, "stop1 and stop2 .* overlap by 1 m: nothing fits"),
        ({"base": sl.Base("y", 1.0)}, "names no degree of freedom"),
        ({"base": sl.Base("rot", 1.0), "names": "rx_1_1 rx_1_2 w_1_2", "contacts": [],
            "forces": []}, "'rot' names no degree of freedom. Known: rx, w"),
        ({"base": sl.Base([1.0, 2.0], 1.0)}, "a vector of 3 finite numbers"),
        ({"base": sl.Base([0, 0, 0], 1.0)}, "not all zero"),
        ({"base": sl.Base({"y": 1.0}, 1.0)}, "'y' is no degree"),
        ({"base": sl.Base("x", lambda t: "a")}, "gives 'a', which isn't an acceleration"),
        ({"base": sl.Base("x", ([0, 1], [0, 1]))}, r"sl\.recorded\(times, values, 'm/s\^2'\)"),
        ({"base": sl.Base("x", lambda t: t, phase=1.0)}, "those of a harmonic acceleration"),
        ({"base": "x"}, r"sl\.Base\(direction, amplitude"),
        ({"forces": [sl.Force("x1", lambda t, x: x)]}, "of the time and the forcing frequency"),
        ({"forces": [sl.Force("x1", 1.0, harmonic=-1)]}, "harmonic"),
        ({"forces": [sl.Force("x1", 1.0, name="stop_gap")]}, "two parameters"),
        ({"forces": [3.0]}, "sl.Force"),
    ],
)  # fmt: skip
def test_refusals(arguments, words):
    usual = {"mass": M, "stiffness": K, "contacts": [STOP], "forces": [PUSH], "frequency": 1.0}
    with pytest.raises(ParameterError, match=words):
        sl.structure(**{**usual, **arguments})


def test_too_many_degrees_of_freedom_are_reduced():
    n = 300
    stiffness = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)],
        offsets=[-1, 0, 1])  # fmt: skip
    with pytest.raises(ParameterError, match="modes="):
        sl.structure(sp.eye_array(n), stiffness)
    made = sl.structure(sp.eye_array(n), stiffness, modes=4, contacts=[sl.Contact("x9", 1.0, 1.0)])
    assert len(made.states) == 8
    assert "lowest 4 modes" in made.description
    assert "left out" in made.description


def test_proportional_damping_is_diagonal_among_modes():
    random = np.random.default_rng(1).normal(size=(20, 20))
    mass, stiffness = np.eye(20) + random @ random.T / 20, 30 * np.eye(20) + random.T @ random
    push = np.eye(40)[21]  # the second mode moves
    made = sl.structure(mass, stiffness, 0.1 * mass + 0.01 * stiffness, modes=20)
    assert np.flatnonzero(made.rhs(0.0, push)).tolist() == [1, 21]
    made = sl.structure(mass, stiffness, np.diag(np.arange(20.0)), modes=20)
    assert np.count_nonzero(made.rhs(0.0, push)) == 21


def test_a_contact_that_no_mode_moves():
    free = 50.0 * np.array([[1, -1], [-1, 1]])
    between = sl.Contact("x2", 1e3, 0.1, to="x1")
    with pytest.raises(ParameterError, match="no mode that is kept moves stop"):
        sl.structure(np.eye(2), free, modes=1, contacts=[between])


@pytest.mark.parametrize("first", [-1, 0, float("nan"), "5 m"])
def test_sweeps_refuse(first):
    with pytest.raises((ParameterError, UnitError), match="first"):
        sl.sweep(first, 50.0, 1.0)
    with pytest.raises(UnitError, match="'1 oct/min'"):
        sl.sweep(5.0, 50.0, "1 oct")
    with pytest.raises(ParameterError, match="no change of frequency"):
        sl.sweep(5.0, "5 Hz", 1.0)


def test_names_of_numpy_become_plain_text():
    names = np.array(["u_1", "w_1", "w_2"])
    for given in (names, list(names), tuple(names)):
        made = sl.structure(M, K, names=given)
        assert {type(one) for one in made.states} == {str}
        with pytest.raises(ParameterError, match=r"Did you mean 'u_1'\?"):
            sl.structure(M, K, names=given, contacts=[sl.Contact("u_11", 1.0, 1.0)])


def test_a_free_mass_between_stops_needs_no_stiffness():
    made = sl.structure([[1.0]], [[0.0]], contacts=[sl.Contact("x1", 1.0, 1.0, side="both")])
    assert made.rhs(0.0, [3.0, 0.0]).tolist() == [0.0, -2.0]


def test_a_row_of_another_length_than_the_modes():
    with pytest.raises(TraceError, match=r"\*q stands for 2 values, q1 to q2: a row has a number"):
        sl.structure(M, K, modes=2, sensors={"strain": lambda *q: np.ones(3) @ q})


@pytest.mark.parametrize("law", [{"stiffness": 1e3}, {"restitution": 0.5}])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_gaps_of_one_mode_are_those_of_its_contacts(side, law):
    """The gap at a contact that one mode moves, upside down, is as written: in m, not in the
    coordinate of the mode.
    """
    made = sl.structure(
        [[4.0, 0.0], [0.0, 1.0]], [[400.0, 0.0], [0.0, 900.0]], modes=2, frequency="3 Hz",
        names="x y", contacts=[sl.Contact("y", gap="1 mm", to="x", side=side, name="near", **law),
            sl.Contact("x", gap="1 mm", side=side, **law)],
        forces=[sl.Force("x", "20 N")], sensors={"v": sl.velocity("x")},
    )  # fmt: skip
    run = sl.simulate(made, periods=5)
    found = sl.contacts(run)
    found = found[(found.guard == "stop") & found.kind.isin(["crossing", "impact"])]
    assert len(found) > 3
    assert np.allclose(found.velocity, found.v_before, rtol=1e-12)
    assert np.array_equal(found.direction, np.sign(found.v_before))
    assert run.guard_units.values.tolist()[:2] == ["m", "m"]


def test_a_record_of_something_else():
    with pytest.raises(TraceError, match=r"sl\.recorded: points must ascend"):
        sl.recorded([0, 1, 1], [0, 1, 2])
    with pytest.raises(UnitError, match="values are in m, and an acceleration is in m/s"):
        sl.structure(M, K, base=sl.Base("x", sl.recorded([0, 1], [0, 1], "mm")))


def test_guards_of_stops_have_their_names():
    rough = sl.Contact("x1", gap=1.0, restitution=0, friction=0.2, sliding="x2", name="rough")
    walls = sl.Contact("x3", gap=1.0, restitution=0.5, side="both", name="wall")
    made = sl.structure(M, K, contacts=[rough, walls], base=sl.Base("x", lambda t: 1.0))
    assert {guard.name for guard in made.guards} == {
        "rough", "rough slides", "wall upper", "wall lower", "rough at rest",
        "rough slides held", "wall upper at rest", "wall lower at rest",
    }  # fmt: skip


def test_units_of_its_values():
    with pytest.raises(UnitError, match="stop_gap"):
        sl.structure(M, K, contacts=[sl.Contact("x1", 1.0, "1 N")])


def test_modes_refuse():
    with pytest.raises(ParameterError, match="x7"):
        sl.structure_modes(M, K, at="x7")
    with pytest.raises(ParameterError, match="at must be"):
        sl.structure_modes(M, K, at=3)
    with pytest.raises(ParameterError, match="modes"):
        sl.structure_modes(M, K, 4)


def test_work_of_tracing_grows_with_the_equations():
    def work(modes):
        n, calls = 2 * modes, 0

        def count(_frame, event, _argument):
            nonlocal calls
            calls += event == "call"

        stiffness = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        stops = [sl.Contact(f"x{n - i}", 5e5, "0.1 mm", side="both") for i in range(3)]
        before = sys.getprofile()
        sys.setprofile(count)
        try:
            chain = sl.structure(
                np.eye(n), stiffness, modes=modes, damping_ratio="1 %", contacts=stops,
                forces=[sl.Force(f"x{n}", "20 N")], frequency="10 Hz",
            )  # fmt: skip
            assert chain.equations()
            assert chain.guard_gradients
            assert chain.fingerprint()
        finally:
            sys.setprofile(before)
        return calls

    work(2)  # what is done once in a process
    assert work(32) < 2.2 * work(16)


@pytest.mark.parametrize("modes", [None, 1, 3])
@pytest.mark.parametrize("unit", ["m", "rad"])
def test_velocities_at_rigid_stops_have_a_unit(modes, unit):
    chain = 900.0 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    stop = sl.Contact("x2", restitution=0.5, gap=1e-3)
    made = sl.structure(np.eye(3), chain, modes=modes, unit=unit, contacts=[stop],
        forces=[sl.Force("x1", lambda t: 5.0)])  # fmt: skip
    assert made.guards[1].name == "stop at rest"  # held by a force, whose unit is another
    run = sl.simulate(made, t_end=0.3, progress=False)
    assert run.sizes["contact"]
    assert run.contact_velocity.attrs["units"] == f"{unit}/s"
    hits = sl.impact_statistics(made, t_end=0.3, progress=False)
    assert hits.contact_speed.attrs["units"] == f"{unit}/s"


def test_a_rough_rigid_stop_of_one_mode_is_refused_in_words():
    rough = sl.Contact("x2", restitution=0, gap=1e-3, friction=0.2, sliding="x3")
    with pytest.raises(ParameterError, match=r"^stop: the modes .* can't slide .* modes=\.$"):
        sl.structure(
            np.eye(3),
            900.0 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)),
            modes=1,
            contacts=[rough],
        )


@pytest.mark.parametrize("n", [5, 1601])
def test_a_loose_degree_of_freedom_without_mass_is_refused_in_words(n):
    weight = np.ones(n)
    weight[2] = 0.0
    with pytest.raises(ParameterError, match=r"^some .* no mass, and the stiffness .* matrices\.$"):
        sl.structure(sp.diags(weight, format="csr"), 900 * sp.diags(weight, format="csr"), modes=2)


def test_without_modes_a_mass_of_zero_asks_for_them():
    with pytest.raises(ParameterError, match="follow the others with modes="):
        sl.structure(np.diag([1.0, 0]), np.eye(2))
    with pytest.raises(ParameterError, match="give modes=, at most 1"):
        sl.structure(np.diag([1.0, 0]), np.eye(2), damping_ratio=0.1)
