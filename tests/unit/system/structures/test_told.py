"""What is said of a structure, and what is doubted of its matrices."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest
import scipy.sparse as sp

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning
from saltus.system.structures import reduction

N = 9
MASS, CHAIN = 0.5 * np.eye(N), 900.0 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))


def test_the_mass_that_moves_with_the_base():
    """Of a chain between walls mode i holds 2 cot^2(i pi/(2 (n + 1)))/(n + 1) masses for odd i,
    none for even i.
    """
    made = sl.structure(MASS, CHAIN, modes=4, base=sl.Base("x", lambda t: 1.0))
    shares = [
        2 / (N + 1) / math.tan(i * math.pi / (2 * (N + 1))) ** 2 / N if i % 2 else 0.0
        for i in range(1, 5)
    ]
    found = re.search(r"Of the 4.5 kg that move with base, the modes hold (\S+) %: (.*)\.$",
        made.description)  # fmt: skip
    assert float(found[1]) == pytest.approx(100 * sum(shares), rel=1e-3)
    parts = {int(mode): float(share) for share, mode in
        re.findall(r"(\S+) % in mode (\d+)", found[2])}  # fmt: skip
    assert parts == {i: pytest.approx(100 * shares[i - 1], rel=5e-3) for i in (1, 3)}
    assert "Of the 4.5 kg" in re.sub(r"\s+", " ", repr(made))


def test_each_of_several_bases():
    names = [f"{kind}_{i}" for i in "123" for kind in "xyz"]
    made = sl.structure(MASS, CHAIN, modes=2, names=names,
        base=[sl.Base("x", lambda t: 1.0), sl.Base("z_*", lambda t: 1.0, name="up")])  # fmt: skip
    assert "Of the 1.5 kg that move with base," in made.description
    assert "Of the 1.5 kg that move with up," in made.description


@pytest.mark.parametrize(
    ("unit", "words"), [("rad", r"of the 4\.5 kg\*m\^2 that"), ("", r"of the 4\.5 that")]
)
def test_units_of_what_is_told(unit, words):
    stop = sl.Contact("x2", stiffness=1e3, gap=0.1)
    made = sl.structure(MASS, CHAIN, modes=2, unit=unit, contacts=[stop],
        base=sl.Base("x", lambda t: 1.0))  # fmt: skip
    assert re.search(words, made.description.lower())
    assert ("rad/(N*m) left out" in made.description) == (unit == "rad")
    assert "m/N" not in made.description


def test_contacts_at_which_all_is_kept_share_a_sentence():
    stops = [sl.Contact(f"x{i}", stiffness=1e3, gap=0.1, name=f"s{i}") for i in (1, 2)]
    made = sl.structure(MASS, CHAIN, modes=len(MASS), contacts=stops)
    assert made.description.endswith("Static flexibility at s1, s2: 100 % of it kept.")


@pytest.mark.parametrize("size", [6, 1600])
def test_rigid_bodies_move_and_are_no_error(size):
    """A free chain: its first frequency is exactly 0, the next that of a closed form; of a large
    one nobody knows what is left out.
    """
    free = sp.diags_array([-np.ones(size - 1), np.r_[1.0, 2 * np.ones(size - 2), 1.0],
        -np.ones(size - 1)], offsets=[-1, 0, 1]) * 1e7  # fmt: skip
    stop = sl.Contact("x1", stiffness=1.0, gap=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = sl.structure(1e-3 * sp.eye_array(size), free, modes=3, contacts=[stop],
            base=sl.Base("x", lambda t: 1.0))  # fmt: skip
    table = sl.structure_modes(1e-3 * sp.eye_array(size), free, 3, at=[])
    truth = np.sqrt(1e10) * 2 * np.sin(np.arange(3) * math.pi / (2 * size)) / (2 * math.pi)
    assert table.frequency.values[0] == 0.0
    assert np.allclose(table.frequency.values, truth, rtol=1e-7)
    assert "the modes hold 100 %: 100 % in mode 1" in made.description
    assert ("isn't known: a rigid body moves there" in made.description) == (size > 1500)


@pytest.mark.parametrize("size", range(4, 14))
def test_the_frequency_of_a_rigid_body_is_said_without_rounding(size):
    """Also where all degrees of freedom are kept, whose eigenvalues are those of no reduction: half
    of them are rounded to more than zero.
    """
    free = 1e4 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    free[0, 0] = free[-1, -1] = 1e4
    assert "natural frequencies 0, " in sl.structure(np.eye(size), free).description


@pytest.mark.parametrize(("factor", "told"), [(1e-12, "kg and N/m"), (1e14, "kg and N/m")])
def test_wrong_units_are_doubted(factor, told):
    with pytest.warns(SaltusWarning, match=told):
        sl.structure(MASS, factor * CHAIN + factor * np.diag(np.linspace(0, 4e12, N)), modes=3)


@pytest.mark.parametrize("modes", [None, 2])
def test_swapped_matrices_are_doubted(modes):
    with pytest.warns(SaltusWarning, match="mass comes first"):
        sl.structure(1e4 * CHAIN, MASS, modes=modes)


@pytest.mark.parametrize("modes", [None, 3])
def test_a_spring_that_is_rigid_is_doubted(modes):
    with pytest.warns(SaltusWarning, match="restitution= in place of stiffness="):
        sl.structure(MASS, CHAIN, modes=modes, contacts=[sl.Contact("x3", 1e12, 1e-3)])


def test_singular_and_indefinite_matrices():
    with pytest.raises(ParameterError, match="mass must be positive definite"):
        sl.structure(np.ones((2, 2)), np.eye(2), modes=1)
    with pytest.raises(ParameterError, match="negative eigenvalue"):
        sl.structure(np.eye(2), np.diag([1.0, -1e-3]), modes=1)


@pytest.mark.parametrize("size", [6, 1600])
def test_indefinite_matrices_of_any_size(size):
    """Of large ones a negative eigenvalue far from the lowest modes is one of the pivots."""
    mass = sp.eye_array(size).tolil()
    chain = sp.diags_array([-np.ones(size - 1), 2.5 * np.ones(size), -np.ones(size - 1)],
        offsets=[-1, 0, 1]).tolil()  # fmt: skip
    chain[3, 3] = -1e5
    with pytest.raises(ParameterError, match=r"stiffness has .* negative eigenvalue"):
        sl.structure(mass.tocsr(), chain.tocsr(), modes=2)
    chain[3, 3], mass[4, 4] = 2.5, -1.0
    with pytest.raises(ParameterError, match="mass must be positive definite"):
        sl.structure(mass.tocsr(), chain.tocsr(), modes=2)


def test_modes_that_lie_too_close_together_are_not_waited_for(monkeypatch):
    monkeypatch.setattr(reduction, "MOST_RESTARTS", 1)
    size = 3000
    chain = sp.diags_array([-np.ones(size - 1), 2 * np.ones(size), -np.ones(size - 1)],
        offsets=[-1, 0, 1])  # fmt: skip
    with pytest.raises(ParameterError, match=r"of the 9 lowest modes in 1 restarts.*swapped\?"):
        sl.structure(chain, sp.eye_array(size), modes=9)


NEGATIVE = np.diag([0.1, -0.2, 0.1])


@pytest.mark.parametrize(("modes", "told"), [(None, "-0.2 N"), (3, "-0.4 1/s among the modes")])
def test_damping_that_feeds_energy_is_doubted(modes, told):
    mass, stiffness = 0.5 * np.eye(3), np.diag([1e3, 2e3, 3e3])
    with pytest.warns(SaltusWarning, match=f"damping has a negative eigenvalue, {told}"):
        sl.structure(mass, stiffness, NEGATIVE, modes=modes)
    turning = 5 * (np.eye(3, k=1) - np.eye(3, k=-1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sl.structure(mass, stiffness, turning, modes=modes)
        sl.structure(mass, stiffness, 1e-3 * stiffness, modes=modes)


@pytest.mark.parametrize(
    ("gap", "law", "told"),
    [
        ("1 mm", {"stiffness": 1e3}, ""),
        ("0 mm", {"stiffness": 1e3}, " Without load the structure touches stop."),
        ("-1 mm", {"stiffness": 1e3}, " Without load the structure presses 1 mm into stop."),
        ("0 mm", {"restitution": 0.5}, " Without load the structure touches stop."),
        ("-1 mm", {"restitution": 0.5},
            " Without load the structure stands 1 mm beyond stop, a rigid stop."),
    ],
)  # fmt: skip
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_stops_that_touch_without_load(gap, law, told, side):
    stop = sl.Contact("x2", gap=gap, side=side, **law)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        made = sl.structure(MASS, CHAIN, modes=N, contacts=[stop], sensors={"tip": "x2"})
    assert made.description.partition(" of it kept.")[2] == told
    assert len(heard) == ("beyond" in told)
    if heard:
        start = '"1 mm"' if side == "lower" else '"-1 mm"'
        assert f'such as {{"tip": {start}}}' in str(heard[0].message)
        at_rest = r"beyond a stop, stop by 1 mm \(first: trajectory 0, t = 0 s, tip = 0 m\)"
        with pytest.warns(SaltusWarning, match=at_rest):
            sl.simulate(made, t_end=1e-3)
        sign = 1 if side == "lower" else -1
        assert sl.simulate(made, {"tip": sign * 1.001e-3}, t_end=1e-3).status == "ok"


def test_long_equations_are_not_shown():
    size = 13
    chain = 900.0 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    stops = [sl.Contact("x3", 1e3, 0.01, side="both", name="stop")]
    made = sl.structure(np.eye(size), chain, modes=size, contacts=stops)
    shown = repr(made)
    assert "q1 [kg^0.5*m], q2 [kg^0.5*m], q3 [kg^0.5*m], ..., q13_rate [kg^0.5*m/s]" in shown
    assert ".equations() lists them" in shown
    assert "guards      stop lower, stop upper" in shown
    assert "dq1/dt" not in shown
    assert "dq1/dt = q1_rate" in made.equations()
    assert r"\dot" not in made._repr_html_()
    few = sl.structure(np.eye(2), chain[:2, :2], modes=2)
    assert "dq1/dt" in repr(few)


@pytest.mark.parametrize(("turns", "told"), [(1.0, False), (0.5, True)])
def test_a_base_record_that_leaves_the_base_in_motion_is_told(turns, told):
    """A half sine of 1 m/s^2 and 1 s leaves 2/pi m/s; a whole one nothing."""
    times = np.linspace(0, 1, 201)
    record = sl.recorded(times, np.sin(2 * np.pi * turns * times), "m/s^2")
    made = sl.structure(np.eye(2), np.diag([4e3, 9e3]), base=sl.Base("x1", record))
    assert ("leaves it at 0.637 m/s, 100 %" in made.description) == told
    assert ("subtract the record's mean, 0.637 m/s^2" in made.description) == told


def test_sensors_where_none_are_given():
    rigid = sl.Contact("x2", restitution=0.5, gap=0.1, to="x1", name="wall")
    pushed = sl.Force("x4", lambda t: 1.0)
    outputs = [
        sl.structure(MASS, CHAIN, **options).outputs.names
        for options in (
            {"modes": 3, "contacts": [rigid], "forces": [pushed]},
            {"modes": 3, "forces": [pushed]},
            {"modes": 3},
            {"modes": 3, "sensors": {}},
            {},
        )
    ]
    assert outputs == [
        ("deflection at wall", "velocity at wall"),
        ("deflection at force", "velocity at force"),
        ("deflection of x5", "velocity of x5"),
        (),
        (),
    ]
    many = [
        sl.Contact(f"x{i}", stiffness=1e3, gap=0.1, side="both", name=f"s{i}", friction=0.1,
            sliding=f"x{i + 1}")
        for i in range(1, 9)
    ]  # fmt: skip
    made = sl.structure(MASS, CHAIN, modes=9, contacts=many)
    assert (len(made.guards), len(made.outputs)) == (32, 10)  # of the 52 that both may be
    shown = sl.simulate(
        sl.structure(MASS, CHAIN, modes=3, contacts=[rigid]),
        {"deflection at wall": 0.01},
        t_end=0.1,
        progress=False,
    )
    assert shown["deflection at wall"].values[0] == pytest.approx(0.01)


@pytest.mark.parametrize(
    "drive",
    [
        {},
        {"base": sl.Base("x", lambda t: 1.0)},
        {"forces": [sl.Force("x1", "2 N", harmonic=0)]},
    ],
)
def test_a_frequency_that_no_drive_has_is_doubted(drive):
    with pytest.warns(SaltusWarning, match=r"^frequency = '4 Hz' isn't used, since .* out\.$"):
        made = sl.structure(MASS, CHAIN, frequency="4 Hz", **drive)
    assert made.forced_at is None
    assert "frequency" not in made.values
    used = sl.structure(MASS, CHAIN, frequency="4 Hz", forces=[sl.Force("x1", 0.0)])
    assert used.forced_at == "frequency"
