"""Energy balances of the published models, and impact statistics against closed forms of a bouncing
mass.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import bent, lab, pair
from saltus.errors import ParameterError
from saltus.language.derivatives import differentiate, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import state
from saltus.models import MODELS, energy, has_energy
from saltus.system.read_off import quantity

#: What the sums of a balance may lose: some hundred roundings of the largest part.
ROUNDING = 1e-13
SCALES = {
    "delangre": 1e-3, "chain": 2e-3, "gear_pair": 4e-5, "aeroelastic": 0.03, "jeffcott_rotor": 4e-4
}  # fmt: skip


# -- the published models --------------------------------------------------------------------------
@pytest.mark.parametrize("name", [name for name in MODELS if has_energy(name)])
def test_power_identity_of_every_model_in_every_mode(name):
    """dE/dt along the equations = supplied - dissipated, at random states, times and sides of the
    guards.
    """
    system = MODELS[name]()
    parts = {key: quantity(system, function) for key, function in energy(name).items()}
    assert all(guards == system.guards for _, guards in parts.values()), (
        "the same contacts as the equations, and no others"
    )
    stored = parts["energy"][0]
    slopes = [time_derivative(stored), *(differentiate(stored, state(y)) for y in system.states)]
    random = np.random.default_rng(3)
    for mode in range(2 ** len(system.guards)):
        bits = [bool(mode >> i & 1) for i in range(len(system.guards))]
        y = {one: random.uniform(-1, 1, 50) * SCALES[name] for one in system.states}
        here = {"t": random.uniform(0, 1, 50), "states": y, "values": system.values, "bits": bits}
        rates = evaluate(system.field, **here)
        gradients = evaluate(slopes, **here)
        supplied, dissipated = evaluate([parts["supplied"][0], parts["dissipated"][0]], **here)
        terms = [gradients[0], *(a * b for a, b in zip(gradients[1:], rates, strict=True))]
        size = sum(np.abs(term) for term in terms) + np.abs(supplied) + np.abs(dissipated)
        assert (np.abs(sum(terms) - supplied + dissipated) <= 1e-12 * size).all()


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("delangre", {"start": (1e-3, 0.0), "periods": 60, "transient": 10}),
        pytest.param(
            "aeroelastic",
            {
                "start": {"plunge": 0, "pitch": 0.02, "plunge_rate": 0, "pitch_rate": 0},
                "t_end": 5,
                "transient": "1 s",
            },
            marks=pytest.mark.nightly,
        ),
        pytest.param("chain", {"periods": 60}, marks=pytest.mark.nightly),
        pytest.param("gear_pair", {"start": (3e-5, 0.0), "periods": 60}, marks=pytest.mark.nightly),
    ],
)
def test_every_model_balances_along_its_motion(name, arguments):
    balance = sl.energy_balance(MODELS[name](), **arguments, **energy(name))
    assert float(balance.imbalance) < ROUNDING
    assert np.abs(balance.residual.values).max() < ROUNDING * np.abs(balance.supplied.values).max()
    assert balance.dissipated.values.min() > 0
    assert balance.sizes == ({"period": 60} if "periods" in arguments else {"time": 80})


def rig():
    return sl.models.delangre("b", force="4 N", frequency="15 Hz")


def test_a_missing_term_shows():
    """Without the energy of the contact springs, exactly that is left over."""
    parts = energy("delangre")

    def beams_only(x, v, *, mass, natural_frequency, cubic):
        return (
            mass * v**2 / 2
            + mass * (2 * sl.pi * natural_frequency) ** 2 * x**2 / 2
            + cubic * x**4 / 4
        )

    run = sl.energy_balance(rig(), (1e-3, 0.0), periods=10, **parts | {"energy": beams_only})
    whole = sl.energy_balance(rig(), (1e-3, 0.0), periods=10, **parts)
    left_over = np.diff(whole.energy.values - run.energy.values)
    assert float(run.imbalance) > 1e-2
    assert (
        np.abs(run.residual.values[1:] - left_over).max()
        < ROUNDING * np.abs(run.energy.values).max()
    )


def test_integrals_leave_the_motion_as_it_is():
    balance = sl.energy_balance(rig(), (1e-3, 0.0), periods=20, **energy("delangre"))
    plain = sl.simulate(rig(), (1e-3, 0.0), periods=20, samples=1, time_errors="local")
    assert abs(float(balance.end_x - plain.end_x)) < 1e-15
    assert abs(float(balance.end_v - plain.end_v)) < 1e-13


def test_on_a_periodic_orbit_work_is_dissipated():
    """Case b, 4 N, 15 Hz settles to 3T: over three periods nothing is stored."""
    balance = sl.energy_balance(rig(), (1e-3, 0.0), periods=3, transient=600, **energy("delangre"))
    supplied, dissipated, change = (
        balance[name].values for name in ("supplied", "dissipated", "change")
    )
    assert abs(supplied.sum() - dissipated.sum()) < 1e-9 * dissipated.sum()
    assert np.abs(change).max() > 0.1 * dissipated.sum()  # in each period something is


def test_many_trajectories_with_values_of_their_own():
    both = sl.energy_balance(
        rig(),
        {"x": [1e-3, 0.0], "v": 0.0},
        periods=5,
        values={"contact_stiffness": [1e4, 2e4]},
        **energy("delangre"),
    )
    assert both.residual.dims == ("trajectory", "period")
    assert (both.imbalance.values < ROUNDING).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"periods": 2, "intervals": 5}, "Leave intervals= out"),
        ({"t_end": 0.1}, "whole forcing periods"),
        ({}, "give periods="),
        ({"periods": 2.5}, "periods must be a whole number"),
    ],
)
def test_balances_that_cant_be_drawn(arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.energy_balance(rig(), **arguments, **energy("delangre"))


# -- undamped, unforced ----------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "frequency"),
    [
        pytest.param({}, 1 / 6.3, id="linear"),
        pytest.param({}, 0.2, id="linear_other_steps"),
        pytest.param({"stiffness": 20.0, "boundary": 0.2}, 1 / 6.3, id="stop"),
        pytest.param({"cubic": 0.5}, 1 / 6.3, id="cubic"),
    ],
)
def test_energy_wanders_as_roundings_do(values, frequency):
    """Sixteen amplitudes, 20 000 periods: as many gain energy as lose it, and none more than a walk
    of one rounding a step does.
    """
    periods, amplitude = 20_000, np.geomspace(0.3, 3.0, 16)
    values = {"spring": 1.0, "boundary": 99.0} | values
    system = (bent if "cubic" in values else lab).with_values(frequency=frequency, **values)
    run = sl.stroboscope(system, {"x": amplitude, "v": 0.0}, periods, keep=1)
    x, v = run.x.values[:, -1], run.v.values[:, -1]

    def stored(x, v):
        beyond = np.maximum(x - values["boundary"], 0.0)
        return (v**2 + x**2 + values.get("stiffness", 0.0) * beyond**2) / 2 + values.get(
            "cubic", 0.0
        ) * x**4 / 4

    drift = stored(x, v) / stored(amplitude, 0.0) - 1
    walk = 2.0**-53 * np.sqrt(run.steps.values)
    assert np.abs(drift.mean()) < 4 * drift.std() / np.sqrt(len(drift))
    assert np.all(np.abs(drift) < 6 * walk)
    assert 0 < (drift > 0).sum() < len(drift)


# -- impacts ---------------------------------------------------------------------------------------
#: A mass that falls with 9.81 m/s^2 from 0.2 m above a spring, on and on.
FALL = {"lift": 9.81, "boundary": 0.0, "stiffness": 4e3}
FORCE = {
    "boundary": lambda x, v, stiffness, boundary, dashpot: stiffness * (x - boundary) + dashpot * v
}


def bounce():
    """Speed at contact, duration of contact, duration of a bounce, impulse, of the closed form
    (unit mass).
    """
    g, w = FALL["lift"], math.sqrt(FALL["stiffness"])
    speed = math.sqrt(2 * g * 0.2)
    duration = 2 / w * (math.pi - math.atan(speed * w / g))
    return speed, duration, duration + 2 * speed / g, 2 * speed + g * duration


def test_statistics_of_a_bouncing_mass():
    speed, duration, cycle, impulse = bounce()
    found = sl.impact_statistics(
        lab,
        (-0.2, 0.0),
        periods=100,
        transient=1,
        force=FORCE,
        bins=[0, 1, 2, 3],
        values=FALL | {"frequency": 1 / cycle},
    )
    one = found.sel(guard="boundary")
    assert int(one.contact_side) == 1
    assert int(one.contacts) == found.sizes["contact"] == 100
    assert float(one.contacts_per_period) == pytest.approx(1.0, rel=1e-14)
    assert float(one.contacts_per_second) == pytest.approx(1 / cycle, rel=1e-14)
    for name in ("speed_mean", "speed_rms", "speed_max"):
        assert float(one[name]) == pytest.approx(speed, rel=1e-12)
    for name in ("duration_mean", "duration_min", "duration_max"):
        assert float(one[name]) == pytest.approx(duration, rel=1e-11)
    assert float(one.share_in_contact) == pytest.approx(duration / cycle, rel=1e-11)
    assert float(one.impulse_mean) == pytest.approx(impulse, rel=1e-11)
    assert one.speed_histogram.values.tolist() == [0, 100, 0]
    for name in (
        "contacts_per_second_error",
        "speed_mean_error",
        "share_in_contact_error",
        "impulse_mean_error",
    ):
        assert float(one[name]) < 1e-10  # every bounce is the same
    assert found.contact_exit_speed.values == pytest.approx(found.contact_speed.values, rel=1e-12)


def test_impulse_is_the_change_of_momentum_less_the_other_forces():
    """Gravity, a harmonic force and a dashpot: their impulses over a contact are elementary; the
    spring's and dashpot's is integrated.
    """
    values = FALL | {
        "dashpot": 3.0,
        "force": 2.0,
        "frequency": 1.7,
        "damping": 0.4,
        "boundary": 0.05,
    }
    found = sl.impact_statistics(lab, (-0.2, 0.0), periods=20, force=FORCE, values=values)
    begin, duration = found.contact_time.values, found.contact_duration.values
    w = 2 * math.pi * 1.7
    driven = 2.0 / w * (np.sin(w * (begin + duration)) - np.sin(w * begin))
    others = FALL["lift"] * duration + driven  # damping takes 0.4 (x_end - x_begin) = 0
    momentum = -found.contact_exit_speed.values - found.contact_speed.values
    ended = np.isfinite(duration)
    assert ended.sum() > 10
    assert found.contact_impulse.values[ended] == pytest.approx(
        (others - momentum)[ended], rel=1e-11
    )


def test_statistics_without_forcing():
    """The same bounces of one of two masses that don't feel each other; the other one rests far
    from its stop.
    """
    speed, duration, cycle, _ = bounce()
    values = {"lift": 9.81, "stop1": 0.0, "stiffness1": 4e3, "stop2": 1e6, "gap": 1e7}
    # from the top of a flight to the bottom of a bounce: 50 contacts and a half, the first of which
    # is transient
    t_end = 50.5 * cycle
    found = sl.impact_statistics(
        pair, (-0.2, 0.0, 0.0, 0.0), t_end=t_end, transient=cycle, values=values
    )
    one = found.sel(guard="stop1")
    assert int(one.contacts) == 50
    assert float(one.contacts_per_second) == pytest.approx(50 / (49.5 * cycle), rel=1e-13)
    assert float(one.share_in_contact) == pytest.approx(49.5 * duration / (49.5 * cycle), rel=1e-10)
    assert float(one.speed_mean) == pytest.approx(speed, rel=1e-11)
    assert int(found.contacts.sel(guard="stop2")) == 0
    assert np.isnan(float(found.speed_mean.sel(guard="stop2")))
    assert "contacts_per_period" not in found
    # the force stands in the equations: it turns the momentum, and carries the weight meanwhile
    assert float(one.impulse_mean) == pytest.approx(2 * speed + 9.81 * duration, rel=1e-11)


def test_a_contact_under_way_counts_in_the_share_only():
    _, duration, cycle, _ = bounce()
    fall = (cycle - duration) / 2
    begin = fall + duration / 2  # the first contact is half over
    found = sl.impact_statistics(
        lab, (-0.2, 0.0), t_end=begin, values=FALL | {"frequency": 0.01}, force=FORCE
    )
    assert found.contact_speed.values == pytest.approx([bounce()[0]], rel=1e-12)
    assert np.isnan(found.contact_duration.values).all()
    assert np.isnan(found.contact_impulse.values).all()
    assert float(found.share_in_contact[0]) == pytest.approx(duration / 2 / begin, rel=1e-12)
    inside = sl.impact_statistics(
        lab, (0.01, 0.0), t_end=1e-3, values=FALL | {"frequency": 0.01}, force=FORCE
    )
    assert inside.sizes["contact"] == 0
    assert float(inside.share_in_contact[0]) == 1.0
    w, sag = (
        math.sqrt(FALL["stiffness"]),
        FALL["lift"] / FALL["stiffness"],
    )  # from rest at 4 sag: x = sag (1 + 3 cos wt) leaves at cos = -1/3
    leaving = sl.impact_statistics(
        lab, (4 * sag, 0.0), t_end=0.05, values=FALL | {"frequency": 0.01}, force=FORCE
    )
    assert leaving.sizes["contact"] == 0
    assert float(leaving.share_in_contact[0]) == pytest.approx(
        math.acos(-1 / 3) / w / 0.05, rel=1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"force": {"boundry": lambda x: x}}, "force= names 'boundry'"),
        ({"contact_side": {"boundary": 2}}, "must be 1 or -1"),
        ({"method": sl.ODE45(events="ignore")}, "needs a method that locates contacts"),
        ({"bins": 0}, "bins must be a whole number"),
    ],
)
def test_statistics_that_cant_be_taken(arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.impact_statistics(lab, (0.0, 0.0), periods=1, **({"force": FORCE} | arguments))
