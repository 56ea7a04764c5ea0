"""The ready models: their equations against a second way of writing them, and their
known results.
"""

import math

import numpy as np
import pytest

from saltus.errors import ParameterError
from saltus.language import functions
from saltus.language.evaluate import evaluate
from saltus.models import (
    MODELS,
    aeroelastic,
    chain,
    delangre,
    describe,
    energy,
    find,
    gear_pair,
    has_energy,
)
from saltus.system.modes import field, mode_number, sides

solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
brentq = pytest.importorskip("scipy.optimize").brentq


def matrix(made, bits, **values):
    """The Jacobian at rest in a mode."""
    values = {**made.values, **values}
    return np.array(
        [
            evaluate(row, states=dict.fromkeys(made.states, 0.0), values=values, bits=bits)
            for row in made.jacobian
        ],
        dtype=float,
    )


def as_python(made):
    """The field as a function of numbers, from the text of the equations: fast enough
    for a solver.
    """
    scope = {name: getattr(functions, name) for name in ("piecewise", "cos", "sqrt", "pi")} | dict(
        made.values
    )
    left, right = zip(*(line.split(" = ", 1) for line in made.equations()), strict=True)
    body = [
        f"    {name} = {text}" for name, text in zip(left, right, strict=True) if "/" not in name
    ]
    entries = [text for name, text in zip(left, right, strict=True) if "/" in name]
    exec(
        "\n".join(
            [f"def f(t, {', '.join(made.states)}):", *body, f"    return {', '.join(entries)}"]
        ),
        scope,
    )
    return lambda t, y: scope["f"](t, *map(float, y))


def settled(made, start, span, samples=2001, **options):
    """Times and states in the last part of a run."""
    run = solve_ivp(
        as_python(made), (0, span[1]), start, rtol=1e-7, atol=1e-12, dense_output=True, **options
    )
    t = np.linspace(*span, samples)
    return t, run.sol(t)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_model_is_complete(model):
    made = model()
    assert made.source
    assert made.description
    assert all(made.units[name] for name in (*made.states, *made.values)), (
        "every state and parameter has a unit"
    )
    assert all(name in model.__doc__ for name in (*made.states, *made.values))
    assert model().field is made.field


def test_the_registry():
    assert find("delangre") is delangre
    assert describe()["gear_pair"].startswith("Spur gear pair")
    assert list(describe()) == list(MODELS)
    with pytest.raises(ParameterError, match="Did you mean 'delangre'"):
        find("delange")


def test_energies_of_models():
    """That they are right is shown in tests/truth/test_energy.py."""
    having = [name for name in MODELS if has_energy(name)]
    assert having == ["delangre", "chain", "gear_pair", "aeroelastic", "jeffcott_rotor"]
    assert all(list(energy(name)) == ["energy", "supplied", "dissipated"] for name in having)
    with pytest.raises(ParameterError, match="double_scroll brings no energies along"):
        energy("double_scroll")
    with pytest.raises(ParameterError, match="Did you mean 'chain'"):
        energy("chian")


@pytest.mark.parametrize(
    ("case", "gaps"), [("a", (0.4e-3, 0.4e-3)), ("b", (0.0, 0.4e-3)), ("c", (0.0, 0.8e-3))]
)
def test_cases_of_the_rig(case, gaps):
    made = delangre(case, force="1.5 N", frequency="900 rpm")
    assert (made.values["lower_gap"], made.values["upper_gap"]) == gaps
    assert (made.values["force"], made.values["frequency"]) == (1.5, 15.0)
    assert [(guard.name, guard.state) for guard in made.guards] == [
        ("lower_gap", "x"),
        ("upper_gap", "x"),
    ]
    assert delangre(case, upper_gap="2 mm").values["upper_gap"] == 2e-3


def test_an_unknown_case():
    with pytest.raises(ParameterError, match="no case 'd'"):
        delangre("d")


def test_the_rig_is_linear_and_damped_as_its_parameters_say():
    eigenvalues = np.linalg.eigvals(matrix(delangre("a"), [True, False]))
    assert np.abs(eigenvalues) == pytest.approx(10 * math.pi, rel=1e-12)
    assert eigenvalues.real == pytest.approx(-0.94247779607693797, rel=1e-12)
    # with both springs off and on: bilinear frequency of k, Kc = 14 kN/m, one-sided
    inside, outside = (
        np.abs(np.linalg.eigvals(matrix(delangre("b", damping_ratio=0), [True, upper]))[0])
        for upper in (False, True)
    )
    assert 2 / (2 * math.pi / inside + 2 * math.pi / outside) == pytest.approx(
        7.0530955250738664, rel=1e-12
    )


def test_first_contact_of_the_rig():
    made = delangre("b", force=4.0, frequency=7.0)

    def upper(t, y):
        return y[0] - 0.4e-3

    upper.terminal = True
    run = solve_ivp(
        lambda t, y: field(made, t, y, bits=[True, False]),
        (0, 0.1),
        [0, 0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-15,
        events=upper,
    )
    assert run.t_events[0][0] == pytest.approx(0.02728303451557326, abs=1e-12)


def test_the_chain_against_matrices():
    made = chain()
    m, c, k = (
        np.diag([1.0, 0.5]),
        np.array([[6.0, -2.0], [-2.0, 2.0]]),
        np.array([[1400.0, -400.0], [-400.0, 400.0]]),
    )
    random = np.random.default_rng(1)
    for _ in range(20):
        x, v, t = random.uniform(-3e-3, 3e-3, 2), random.uniform(-0.1, 0.1, 2), random.uniform(0, 1)
        ground = 2e4 * (x[0] - np.clip(x[0], -1e-3, 1e-3))
        between = 1e4 * (x[1] - x[0] - np.clip(x[1] - x[0], -0.5e-3, 0.5e-3))
        force = np.array([2 * math.cos(14 * math.pi * t) - ground + between, -between])
        assert field(made, t, (*x, *v)) == pytest.approx(
            np.concatenate([v, np.linalg.solve(m, force - c @ v - k @ x)]), rel=1e-12
        )
    assert [guard.name for guard in made.guards] == [
        "x1 = -ground_gap",
        "x1 = ground_gap",
        "x2 - x1 = -coupling_gap",
        "x2 - x1 = coupling_gap",
    ]
    frequencies = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(m, k)))) / (2 * math.pi)
    free = np.linalg.eigvals(
        matrix(made, [True, False, True, False], ground_damping=0, coupling_damping=0)
    )
    assert np.sort(np.abs(free))[::2] / (2 * math.pi) == pytest.approx(frequencies, rel=1e-12)
    assert frequencies == pytest.approx([3.412, 6.639], abs=5e-4)


def test_the_chain_settles_with_twelve_contacts_a_period():
    made = chain()
    period = made.period()
    t, y = settled(made, [0, 0, 0, 0], (40 * period, 42 * period), max_step=period / 30)
    assert np.abs(y[:, 0] - y[:, 1000]).max() < 2e-5
    assert np.count_nonzero(np.diff(mode_number(sides(made, t, y)))) == 24


def test_the_gear_pair_in_contact_is_linear():
    made = gear_pair(stiffness_variation=0)
    contact = np.linalg.eigvals(matrix(made, [True, True]))
    assert np.abs(contact) == pytest.approx(math.sqrt(4e8 / 0.25), rel=1e-12)
    assert contact.real == pytest.approx(-0.05 * math.sqrt(4e8 / 0.25), rel=1e-12)
    assert field(made, 0.25 / 6e3, (22e-6, 0.0), {"alternating_force": 0.0})[1] == pytest.approx(
        0.0, abs=1e-9
    )


@pytest.mark.parametrize(("frequency", "contacts"), [("5 kHz", 0), ("6 kHz", 2)])
def test_the_gear_pair_loses_contact_near_resonance(frequency, contacts):
    made = gear_pair(mesh_frequency=frequency)
    period = made.period()
    t, y = settled(made, [22e-6, 0], (60 * period, 62 * period), max_step=period / 20)
    assert np.count_nonzero(np.diff(mode_number(sides(made, t, y)))) == 2 * contacts
    if contacts:
        assert (y[0].min(), y[0].max()) == (
            pytest.approx(18.05e-6, abs=2e-8),
            pytest.approx(25.74e-6, abs=2e-8),
        )


def test_the_section_against_its_matrices():
    made = aeroelastic()
    value = made.values
    m, b, u = value["mass"], value["half_chord"], value["airspeed"]
    inertia = np.array([[m, m * 0.25 * b], [m * 0.25 * b, 0.065]])
    random = np.random.default_rng(1)
    for _ in range(20):
        q, rate = random.uniform(-0.1, 0.1, 2), random.uniform(-1, 1, 2)
        angle = q[1] + rate[0] / u + 1.1 * b * rate[1] / u
        loads = 1.225 * u**2 * b * 6.28 * angle * np.array([-1, b * -0.1])
        springs = np.array([2840 * q[0], 40 * (q[1] - np.clip(q[1], -0.01, 0.01))])
        exact = np.linalg.solve(inertia, loads - springs - np.array([27.4, 0.036]) * rate)
        assert field(made, 0.0, (*q, *rate)) == pytest.approx(
            np.concatenate([rate, exact]), rel=1e-11
        )


def wing_matrix(speed, pitch_stiffness=40.0):
    """First-order matrix of the section without freeplay, from its mass, damping and stiffness
    matrices.
    """
    inertia = np.array([[12.4, 12.4 * 0.25 * 0.135], [12.4 * 0.25 * 0.135, 0.065]])
    load = 1.225 * speed**2 * 0.135 * 6.28 * np.array([-1.0, (0.5 - 0.6) * 0.135])
    damping = np.diag([27.4, 0.036]) - np.outer(load, [1 / speed, (0.5 + 0.6) * 0.135 / speed])
    stiffness = np.diag([2840.0, pitch_stiffness]) - np.outer(load, [0.0, 1.0])
    return np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, damping)],
        ]
    )


def test_the_section_without_freeplay_flutters_at_the_speed_in_its_docstring():
    def growth(speed):
        return np.linalg.eigvals(wing_matrix(speed)).real.max()

    flutter = brentq(growth, 12.0, 15.0, xtol=1e-12)
    assert f"{flutter:.4f} m/s" in aeroelastic.__doc__
    for speed in (8.0, flutter, 15.0):
        # beyond the freeplay: pitch > -gap, pitch > gap
        own = matrix(aeroelastic(airspeed=speed), [False, True])
        exact = np.linalg.eigvals(wing_matrix(speed))
        own_values = np.linalg.eigvals(own)
        assert np.abs(own_values[:, None] - exact).min(axis=1).max() < 1e-9


@pytest.mark.parametrize(
    "model", [chain, gear_pair, aeroelastic, lambda *given: delangre("b", *given)]
)
def test_a_value_without_a_name_is_answered_by_the_names(model):
    with pytest.raises(
        ParameterError,
        match=r"values by name, and 3 has no name\. Write "
        r"\w+\(\w+=\.\.\.\); its parameters are ",
    ):
        model(3)


def test_the_section_oscillates_by_itself_and_rest_is_stable():
    made = aeroelastic()
    t, y = settled(made, [0, 0.02, 0, 0], (20, 24), max_step=0.02)
    assert y[1].max() == pytest.approx(0.0452, abs=2e-4)
    upward = np.flatnonzero((y[1][:-1] < 0) & (y[1][1:] >= 0))
    assert (len(upward) - 1) / (t[upward[-1]] - t[upward[0]]) == pytest.approx(3.73, abs=0.02)
    assert np.linalg.eigvals(matrix(made, [True, False])).real.max() < 0
