"""Derivatives of periodic orbits with respect to parameters: closed forms, and differences of
orbits that are found again.
"""

import mpmath as mp
import numpy as np
import pytest

import saltus as sl

#: Differences of fourth order, and their steps.
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
SHIFTS, STEP = np.array([-2.0, -1.0, 1.0, 2.0]), 1e-5


@sl.system(states="x v", forced_at="f")
def linear(t, x, v, *, f=2.0, pull=3.0, k=40.0, d=0.9):
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v


@sl.system(states="x v", forced_at="f")
def hammer(t, x, v, *, f=2.0, pull=3.0, k=40.0, gap=0.01, e=0.6):
    law = sl.impact(x < gap, v, restitution=e)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x, law


@sl.system(states="x v", forced_at="f")
def slider(t, x, v, *, f=2.0, pull=3.0, k=30.0, limit=2.2):
    friction = sl.friction(v, slip=limit, stick=limit)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - friction


@sl.system(states="x v")
def oscillator(t, x, v, *, mu=0.8, gap=1.2, stop=9.0):
    return v, mu * (1 - x * x) * v - x - sl.where(x > gap, stop * (x - gap), 0)


def test_a_linear_oscillator_has_the_derivatives_of_its_formulas():
    found = sl.sensitivity(
        linear, sl.attractors(linear, (0, 0)).isel(attractor=0), to=["k", "d", "pull", "f"]
    )
    p = linear.values
    w, k, d, period = 2 * np.pi * p["f"], p["k"], p["d"], 1 / p["f"]
    size = (k - w * w) ** 2 + (d * w) ** 2
    amplitude = p["pull"] / np.sqrt(size)
    by_w = -amplitude / size * (d * d * w - 2 * w * (k - w * w))
    expected = [-(k - w * w) / size, -d * w * w / size, 1 / p["pull"], 2 * np.pi * by_w / amplitude]
    assert found.maximum.values[0] == pytest.approx(amplitude, rel=1e-13)
    assert found.maximum_derivative.values[0] / amplitude == pytest.approx(expected, rel=1e-12)
    root = np.sqrt(k - d * d / 4)
    multiplier = np.exp((-d / 2 + 1j * root) * period)
    slopes = (
        multiplier
        * period
        * np.array([0.5j / root, -0.5 - 0.25j * d / root, 0, (d / 2 - 1j * root) * period])
    )
    computed = found.multiplier_real_derivative + 1j * found.multiplier_imag_derivative
    side = int(np.sign(found.multiplier_imag.values[0] * multiplier.imag))
    assert np.real(computed.values[0]) == pytest.approx(slopes.real, abs=1e-9)
    assert np.imag(computed.values[0]) == pytest.approx(side * slopes.imag, abs=1e-9)
    assert found.period_derivative.values == pytest.approx([0, 0, 0, -(period**2)], rel=1e-12)


def test_an_impact_oscillator_has_those_of_its_orbit_in_closed_form():
    names = ["gap", "e", "k", "pull", "f"]
    orbit = sl.attractors(hammer, (0, 0)).isel(attractor=0)
    found = sl.sensitivity(hammer, orbit, to=names)
    assert found.sizes["contact"] == 1
    guess = float(found.contact_time[0]), abs(float(found.contact_velocity[0]))

    def impact(*values):
        """Time of the impact of an orbit with one impact in each period."""
        gap, e, k, pull, f = map(mp.mpf, values)
        w, root = 2 * mp.pi * f, mp.sqrt(k)
        forced = pull / (k - w * w)

        def free(when, since, speed):  # since the impact at ``when``, after which it has a speed
            x0, v0 = gap - forced * mp.cos(w * when), speed + forced * w * mp.sin(w * when)
            own = x0 * mp.cos(root * since) + v0 / root * mp.sin(root * since)
            rate = -x0 * root * mp.sin(root * since) + v0 * mp.cos(root * since)
            turn = w * (when + since)
            return own + forced * mp.cos(turn), rate - forced * w * mp.sin(turn)

        def closes(when, speed):
            x, v = free(when, 1 / f, -e * speed)
            return x - gap, v - speed

        return mp.findroot(closes, guess)[0]

    with mp.workdps(40):
        values = [hammer.values[name] for name in names]
        assert found.contact_time.values[0] == pytest.approx(float(impact(*values)), rel=1e-12)
        for i, name in enumerate(names):
            slope = mp.diff(lambda one, i=i: impact(*values[:i], one, *values[i + 1 :]), values[i])
            computed = float(found.contact_time_derivative[0, i])
            assert computed == pytest.approx(float(slope), rel=1e-9), name
    # nothing but impacts changes areas: the multipliers have the product e^2
    real, by = found.multiplier_real.values, found.multiplier_real_derivative.values
    change = real[0] * by[1] + real[1] * by[0]
    assert change == pytest.approx([0, 2 * hammer.values["e"], 0, 0, 0], abs=1e-8)


@pytest.mark.parametrize(
    ("system", "contact"), [(hammer, "impact"), (slider, "hold"), (oscillator, "crossing")]
)
def test_random_orbits_agree_with_differences(system, contact):
    random, seen = np.random.default_rng(261126), set()
    to = [*system.values]
    for _ in range(1 if system is oscillator else 2):
        values = np.array([*system.values.values()]) * random.uniform(0.95, 1.05, len(to))
        along = random.normal(size=len(to)) * values
        own = system.with_values(**dict(zip(to, values, strict=True)))
        orbit = sl.attractors(own, (0.0, 0.1)).isel(attractor=0)
        found = sl.sensitivity(own, orbit, to=to)
        seen |= set(found.contact_kind.values.tolist())
        start, each = [orbit[f"attractor_{name}"].values[0] for name in system.states], []
        for shift in SHIFTS * STEP:
            moved = own.with_values(**dict(zip(to, values + shift * along, strict=True)))
            there = sl.attractors(moved, start).isel(attractor=0)
            each.append(sl.sensitivity(moved, there, to=to))
        for word in ("maximum", "minimum", "contact_time", "period", "multiplier_real"):
            if word == "contact_time" and system is oscillator:
                continue  # its time counts from another point
            rows = np.array([one[word].values for one in each])
            expected = np.tensordot(WEIGHTS, rows, 1) / STEP
            slope = found[f"{word}_derivative"].values @ along
            size = max(np.abs(expected).max(), np.abs(found[word].values).max())
            assert slope == pytest.approx(expected, abs=1e-7 * size), word
    assert contact in seen


def test_the_largest_velocity_of_an_impact_oscillator_is_that_before_the_impact():
    system = hammer.with_values(f=1.9, k=41.0)  # the velocity grows until the impact
    names, values = [*system.values], np.array([*system.values.values()])
    found = sl.sensitivity(system, sl.attractors(system, (0, 0)).isel(attractor=0), to=names)
    (speed,) = found.contact_velocity.values
    assert found.maximum.values[1] == pytest.approx(speed, rel=1e-13)
    assert found.minimum.values[1] == pytest.approx(-system.values["e"] * speed, rel=1e-13)
    for column in range(len(names)):
        each = []
        for shift in SHIFTS * STEP:
            moved = values * np.where(np.arange(len(names)) == column, 1 + shift, 1.0)
            own = system.with_values(**dict(zip(names, moved, strict=True)))
            orbit = sl.attractors(own, (0, 0)).isel(attractor=0)
            each.append(sl.sensitivity(own, orbit, to=names).contact_velocity.values[0])
        by = WEIGHTS @ np.array(each) / (STEP * values[column])
        assert found.maximum_derivative.values[1, column] == pytest.approx(by, rel=1e-7)


@sl.system(states="x v", forced_at="f")
def creeping(t, x, v, *, f=1.0, pull=0.4, k=20.0, d=0.5, stiffness=30.0, limit=2.0):
    held = sl.slider(x, stiffness=stiffness, limit=limit)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v - held


def test_an_orbit_of_a_family_has_no_derivatives_and_stays_what_it_is():
    """Its slider stays where the past has left it, and may stay elsewhere too."""
    orbit = sl.attractors(creeping, (0.4, 0.0, 0.0)).isel(attractor=0)
    with pytest.warns(sl.errors.SaltusWarning, match="one of a family"):
        found = sl.sensitivity(creeping, orbit, to=["k"])
    assert found.end_slider.item() == pytest.approx(orbit.attractor_slider.values[0], rel=1e-14)
    assert np.isnan(found.end_derivative.values).all()
    assert np.isfinite(found.multiplier_real.values).all()
