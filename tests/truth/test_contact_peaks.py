"""Peak force, depth, duration and impulse of each contact of a transient, by closed forms."""

import warnings
from math import gamma, pi, sqrt

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.motion import contact_peaks
from saltus.errors import ParameterError, SaltusWarning

SEED = 6703


@sl.system(states="x v", units={"x": "m", "v": "m/s"})
def onto_spring(t, x, v, *, m="1 kg", k="1e4 N/m", c="0 kg/s", gap="10 mm"):
    """A free mass between two springs with dampers."""
    contact = sl.piecewise(
        (k * (x - gap) + c * v, x > gap), (k * (x + gap) + c * v, x < -gap), otherwise=0
    )
    return v, -contact / m


@sl.system(states="x v", units={"x": "m", "v": "m/s"})
def onto_ball(t, x, v, *, m="2 kg", k="1e6 N/m^1.5"):
    """A free mass onto a curved surface at 0."""
    return v, -sl.hertz(x, stiffness=k) / m


def contacts(system, start, t_end, **more):
    return sl.impact_statistics(system, start, t_end=t_end, progress=False, **more)


def test_a_mass_on_a_spring_makes_half_a_sine():
    random = np.random.default_rng(SEED)
    stiffness, speed = 10 ** random.uniform(2, 8, 30), random.uniform(-3, 3, 30)
    found = contacts(
        onto_spring, {"x": 0.0, "v": speed}, 3.0, values={"k": stiffness, "m": np.full(30, 2.5)}
    )
    turn = np.sqrt(stiffness / 2.5)[found.contact_trajectory]
    speed = np.abs(speed)[found.contact_trajectory]
    ended = np.isfinite(found.contact_duration.values)
    assert ended.sum() > 1000
    for name, closed in {
        "contact_duration": pi / turn,
        "contact_depth": speed / turn,
        "contact_peak_force": speed * 2.5 * turn,
        "contact_impulse": 2 * 2.5 * speed,
    }.items():
        np.testing.assert_allclose(np.abs(found[name])[ended], closed[ended], rtol=1e-9)
    assert found.contact_peak_force.attrs["units"] == "N"
    assert found.contact_impulse.attrs["units"] == "N*s"
    assert found.contact_depth.attrs["units"] == "m"
    signs = np.sign(found.contact_peak_force.values)
    assert (signs == np.sign(found.contact_impulse.values))[ended].all()


def test_hertz_contact_has_its_published_time():
    """Johnson, Contact Mechanics (1985), eq. 11.24: 2.94 d/v with the depth d of eq. 11.23."""
    found = contacts(onto_ball, {"x": -0.01, "v": [0.5, 1.0, 3.0]}, 1.0)
    v = np.array([0.5, 1.0, 3.0])
    depth = (5 * 2.0 * v**2 / (4 * 1e6)) ** 0.4
    time = 4 / 5 * sqrt(pi) * gamma(2 / 5) / gamma(9 / 10) * depth / v
    assert abs(time[1] * v[1] / depth[1] - 2.94) < 0.005
    np.testing.assert_allclose(found.contact_duration, time, rtol=1e-11)
    np.testing.assert_allclose(found.contact_depth, depth, rtol=1e-12)
    np.testing.assert_allclose(found.contact_peak_force, 1e6 * depth**1.5, rtol=1e-11)
    np.testing.assert_allclose(found.contact_impulse, 2 * 2.0 * v, rtol=1e-12)


@pytest.mark.parametrize("damping", [3.0, 60.0, 150.0, 400.0])
def test_impulse_is_the_change_of_momentum_and_a_damper_moves_the_peak(damping):
    """Of c v + k y at y = 0: where the damper is strong the force is largest as contact begins."""
    found = contacts(onto_spring, (0.0, 1.3), 1.5, values={"c": damping}).isel(contact=0)
    momentum = 1.0 * (found.contact_speed + found.contact_exit_speed)
    np.testing.assert_allclose(found.contact_impulse, momentum, rtol=1e-12)
    times = float(found.contact_time) + np.linspace(0.0, 1.0, 20001) * min(
        float(np.nan_to_num(found.contact_duration, nan=0.1)), 0.1
    )
    run = sl.simulate(onto_spring, (0.0, 1.3), at=times, values={"c": damping}, progress=False)
    force = 1e4 * (run.x - 0.01) + damping * run.v
    np.testing.assert_allclose(found.contact_peak_force, force.max(), rtol=1e-7)
    assert found.contact_peak_force >= force.max() * (1 - 1e-13)
    np.testing.assert_allclose(found.contact_depth, (run.x - 0.01).max(), rtol=1e-7)


def test_forced_contacts_have_the_peaks_of_dense_samples_wherever_time_begins():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    ask = {"periods": 12, "progress": False}
    found = sl.impact_statistics(rig, ("1 mm", 0), **ask)
    later = sl.impact_statistics(rig, ("1 mm", 0), t_start=5 / 17, **ask)
    np.testing.assert_allclose(found.contact_peak_force, later.contact_peak_force, rtol=1e-9)
    run = sl.simulate(rig, ("1 mm", 0), periods=12, samples=20000, progress=False)
    for row in range(found.sizes["contact"]):
        one = found.isel(contact=row)
        if not np.isfinite(one.contact_duration):
            continue
        begin = float(one.contact_time)
        inside = run.sel(time=slice(begin, begin + float(one.contact_duration)))
        gap = 4e-4 if one.contact_guard == "upper_gap" else -4e-4
        force = 14e3 * (inside.x - gap)
        np.testing.assert_allclose(np.abs(one.contact_peak_force), np.abs(force).max(), rtol=1e-5)
        np.testing.assert_allclose(one.contact_impulse, force.integrate("time"), rtol=2e-4)


def test_a_force_that_is_given_is_that_in_the_equations():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    ask = {"periods": 12, "progress": False}
    given = {
        "upper_gap": lambda x, contact_stiffness, upper_gap: contact_stiffness * (x - upper_gap)
    }
    ours, theirs = (
        sl.impact_statistics(rig, ("1 mm", 0), **ask, **more) for more in ({}, {"force": given})
    )
    upper = ours.contact_guard == "upper_gap"
    for name in ("contact_peak_force", "contact_impulse"):
        np.testing.assert_allclose(ours[name][upper], theirs[name][upper], rtol=1e-9)


def test_other_methods_find_the_same():
    exact, other = (
        contacts(onto_spring, (0.0, 1.0), 1.0, method=method)
        for method in (sl.Taylor(), sl.ODE45(1e-10, 1e-12))
    )
    for name in ("contact_peak_force", "contact_impulse", "contact_depth"):
        np.testing.assert_allclose(exact[name], other[name], rtol=1e-6)


def test_a_structure_has_the_forces_of_its_stops():
    beam = sl.structure(
        np.eye(3), 1e4 * np.array([[2, -1, 0], [-1, 2, -1], [0, -1, 1.0]]), modes=3,
        contacts=[sl.Contact("x3", stiffness="1 MN/m", gap="0.1 mm", side="both")],
    )  # fmt: skip
    found = contacts(beam, (1e-3, 0, 0, 0, 0, 0), 0.2)
    assert found.contact_peak_force.attrs["units"] == "N"
    assert found.contact_impulse.attrs["units"] == "N*s"
    modal = contacts(beam, (1e-3, 0, 0, 0, 0, 0), 0.2, method=sl.Modal())
    np.testing.assert_allclose(modal.contact_peak_force, found.contact_peak_force, rtol=1e-8)
    assert found.sizes["contact"] > 10
    np.testing.assert_allclose(
        np.abs(found.contact_peak_force), 1e6 * found.contact_depth, rtol=1e-10
    )


def test_a_contact_that_does_not_end_has_its_peak_so_far():
    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def pressed(t, x, v, *, m="1 kg", k="100 N/m", c="30 kg/s", push="5 N"):
        return v, (push - sl.piecewise((k * x + c * v, x > 0), otherwise=0)) / m

    found = contacts(pressed, (-0.1, 0.0), 9.0)
    assert found.sizes["contact"] == 1
    assert np.isnan(found.contact_duration[0])
    assert np.isnan(found.contact_impulse[0])
    np.testing.assert_allclose(found.contact_peak_force[0], 30.0, rtol=1e-12)  # c v, as it begins
    np.testing.assert_allclose(found.contact_depth[0], 0.05, rtol=1e-6)


def test_a_rigid_stop_has_an_impulse_and_no_peak():
    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def rigid(t, x, v, *, m="3 kg"):
        return v, 0.0, sl.impact(x < 1, v, restitution=0.5, inertia=(m,))

    found = contacts(rigid, (0.0, 2.0), 2.0)
    np.testing.assert_allclose(np.abs(found.contact_impulse), 3.0 * 1.5 * 2.0, rtol=1e-12)
    assert np.isnan(found.contact_depth).all()
    assert "contact_peak_force" not in found


def test_what_is_no_contact_force_is_left_out():
    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def whole(t, x, v, *, k="1 1/s^2", stiff="9 1/s^2"):
        """The spring stands in both pieces."""
        return v, sl.piecewise((-stiff * x, x > 0), otherwise=-k * x)

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def two(t, x, v, *, k="9 1/s^2", c="1 1/s"):
        """Spring and damper are terms of their own."""
        return v, (
            -sl.piecewise((k * x, x > 0), otherwise=0)
            - c * v * sl.piecewise((1, x > 0), otherwise=0) - x * k
        )  # fmt: skip

    for system in (whole, two):
        found = contacts(system, (-1.0, 0.0), 9.0)
        assert found.sizes["contact"] > 0
        assert "contact_peak_force" not in found
        assert "contact_impulse" not in found
        assert np.isfinite(found.contact_depth).all()


def test_long_runs_leave_the_peaks_out_unless_asked(monkeypatch):
    monkeypatch.setattr(contact_peaks, "MOST_CONTACTS", 10)
    with pytest.warns(SaltusWarning, match="peaks=True") as heard:
        many = contacts(onto_spring, (0.0, 1.0), 1.0)
    (one,) = heard
    assert f"{many.sizes['contact']} contacts are more than the 10 " in str(one.message)
    assert one.filename == __file__
    assert "contact_depth" not in many
    with pytest.raises(ParameterError, match="peaks=True"):
        sl.plot.contact_forces(many)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "contact_depth" in contacts(onto_spring, (0.0, 1.0), 1.0, peaks=True)
        assert "contact_depth" not in contacts(onto_spring, (0.0, 1.0), 0.1, peaks=False)


def test_long_systems_have_fewer_peaks_by_default():
    """As many as their operations allow: a structure of twice the modes has half of them."""

    def beam(modes):
        stops = [sl.Contact("x1", stiffness=1e4, gap="1 mm")]
        return sl.structure(
            np.eye(modes), np.diag(np.linspace(1e4, 3e4, modes)), modes=modes, contacts=stops
        )

    few, many = contact_peaks.most(beam(100)), contact_peaks.most(beam(50))
    assert few < many < contact_peaks.most(onto_spring) == 10_000
    assert abs(many / few - 2.0) < 0.1


def test_each_of_many_guards_has_a_colour_of_its_own():
    stops = [sl.Contact(f"x{i}", stiffness=1e4, gap="1 mm") for i in range(1, 13)]
    row = sl.structure(np.eye(12), 1e3 * np.eye(12), modes=12, contacts=stops)
    axes = sl.plot.contact_forces(contacts(row, (0.0,) * 12 + (1.0,) * 12, 0.5))
    drawn = [line.get_color() for line in axes.lines if line.get_marker() == "o"]
    assert len(drawn) == len({tuple(colour) for colour in drawn}) == 12


def test_the_picture_has_a_stem_for_each_contact():
    found = contacts(onto_spring, (0.0, 1.0), 1.0)
    axes = sl.plot.contact_forces(found)
    drawn = sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() == "o")
    assert drawn == np.isfinite(found.contact_peak_force).sum()
    assert "N" in axes.get_ylabel()
    assert "peak force" in sl.describe(found)


def test_a_floor_at_zero_touches_where_it_pushes():
    """Of a ball that falls from h the first contact begins at sqrt(2 h/g)."""

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def ball(t, x, v, *, m="1 kg", k="10 kN/m", g="9.81 m/s^2"):
        return v, sl.piecewise((-k * x, x < 0), otherwise=0) / m - g

    found = contacts(ball, (1.0, 0.0), 2.0)
    assert found.contact_side[0] == -1
    np.testing.assert_allclose(found.contact_time[0], sqrt(2 / 9.81), rtol=1e-14)
    depth = 9.81e-4 + sqrt(9.81e-4**2 + 2 * 9.81e-4)  # energy: k d^2/2 = m g (h + d)
    np.testing.assert_allclose(found.contact_depth[0], depth, rtol=1e-12)
    np.testing.assert_allclose(found.contact_peak_force[0], 1e4 * depth, rtol=1e-12)


def one_mass(modes, contact):
    """A driven mass, as it is or as its mode, whose shape is 1/sqrt(4 kg)."""
    return sl.structure(
        [[4.0]], [[400.0]], [[0.4]], modes=modes, names="x", frequency=2,
        forces=[sl.Force("x", 5.0)], contacts=[contact],
    )  # fmt: skip


@pytest.mark.parametrize(
    "law",
    [
        {"stiffness": 1e5},
        {"stiffness": 1e7, "power": 1.5},
        {"stiffness": 1e5, "damping": 20.0, "side": "both"},
        {"restitution": 0.5},
        {"restitution": 0.6, "side": "lower"},
    ],
)
def test_a_mode_has_the_contacts_of_its_mass(law):
    """Gaps of modal coordinates are larger by sqrt(mass), forces on them smaller."""
    contact = sl.Contact("x", gap="5 mm", **law)
    whole, modal = (
        contacts(one_mass(modes, contact), (0, 0), 6.0).drop_vars("guard") for modes in (None, 1)
    )
    names = [name for name in whole.data_vars if name.startswith("contact_")]
    assert whole.sizes["contact"] > 8
    for name in [*names, "speed_mean", "impulse_max"]:
        assert modal[name].attrs["units"] == whole[name].attrs["units"], name
        if whole[name].dtype.kind == "f":
            np.testing.assert_allclose(modal[name], whole[name], rtol=1e-6, err_msg=name)
    units = {"contact_speed": "m/s", "contact_depth": "m", "contact_impulse": "N*s"}
    for name, unit in (units | {"contact_exit_speed": "m/s", "speed_max": "m/s"}).items():
        assert modal[name].attrs["units"] == unit
    assert set(modal.guard_units.values[:1]) == {"m"}


def two_masses(*stops):
    return sl.structure(
        np.eye(2), [[4e3, 0], [0, 9e3]], modes=2, damping_ratio="1 %", names="x y", frequency=5,
        forces=[sl.Force("x", 20.0), sl.Force("y", 30.0)], contacts=list(stops),
    )  # fmt: skip


@pytest.mark.parametrize(
    "second", [{"restitution": 0.5}, {"stiffness": "1 MN/m^1.5", "power": 1.5}]
)
def test_stops_of_two_kinds_have_each_its_impulse(second):
    """The masses are apart, so each stop does as if it were alone; only a chatter becomes two
    contacts where the other stop is met in it.
    """
    stops = [
        sl.Contact("x", stiffness="50 kN/m", gap="1 mm", name="soft"),
        sl.Contact("y", gap="0.5 mm", name="other", **second),
    ]
    rest, compared = (0.0,) * 4, ("contact_impulse", "contact_speed", "contact_exit_speed")
    found = contacts(two_masses(*stops), rest, 2.0)
    for stop in stops:
        part = contacts(two_masses(stop), rest, 2.0)
        mine, own = (one.isel(contact=one.contact_guard == stop.name) for one in (found, part))
        assert np.isfinite(own.contact_impulse[:-1]).all()
        np.testing.assert_allclose(
            np.nansum(mine.contact_impulse), np.nansum(own.contact_impulse), rtol=1e-6
        )
        for what in compared if mine.sizes == own.sizes else ():
            np.testing.assert_allclose(mine[what], own[what], rtol=1e-6, err_msg=what)
    for name in ("contact_impulse", "impulse_mean"):
        assert found[name].attrs["units"] == "N*s"
    assert found.contact_peak_force.attrs["units"] == "N"
    assert found.contact_depth.attrs["units"] == "m"
    assert found.speed_mean.attrs["units"] == "m/s"


def test_impulses_of_stops_in_another_unit_are_left_out_and_it_is_said():
    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def mixed(t, x, v, *, m="2 kg", k="1 kN/m", gap="1 cm", far="2 cm"):
        soft = sl.freeplay(x, stiffness=k, upper_gap=gap)
        return v, -soft / m, sl.impact(x > -far, -v, restitution=0.9)

    with pytest.warns(SaltusWarning, match="inertia=") as heard:
        found = contacts(mixed, (0.0, 1.0), 1.0)
    assert [one.filename for one in heard] == [__file__]
    soft = found.contact_guard.values == "gap"
    assert 1 < soft.sum() < soft.size
    assert found.contact_impulse.attrs["units"] == "N*s"
    speed = found.contact_speed.values[soft][:-1]
    np.testing.assert_allclose(np.abs(found.contact_impulse[soft][:-1]), 2 * 2 * speed, rtol=1e-12)
    assert np.isnan(found.contact_impulse[~soft]).all()


def test_no_contact_has_no_speed_in_words():
    none = contacts(one_mass(1, sl.Contact("x", stiffness=1e5, gap="9 m")), (0, 0), 1.0)
    assert "nan" not in sl.describe(none)
    sl.plot.contact_forces(none)


def test_a_chatter_on_a_boundary_with_a_factor_has_its_impulse():
    """That of all impacts of a pressed mass is (1 + e)/(1 - e) times the first closing speed."""

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def scaled(t, x, v, *, push=0.5, restitution=0.7):
        return v, -x - push, sl.impact(3 * x > 0, -3 * v, restitution=restitution, inertia=(1.0,))

    found = contacts(scaled, (0.0, 1.0), 12.0).isel(contact=0)
    # a unit of this impulse changes v by 3: it is a third of the momentum
    np.testing.assert_allclose(found.contact_impulse_of_impacts, 1.7 / 0.3 / 3, rtol=1e-11)
    np.testing.assert_allclose(found.contact_speed, 1.0, rtol=1e-13)


def test_a_curved_contact_that_a_stop_holds_at_its_boundary_has_peaks():
    """Nothing changes while the mass rests there: a series is one piece long."""
    stops = [
        sl.Contact("x", gap=0.0, restitution=0.0, name="rigid"),
        sl.Contact("x", gap=0.0, stiffness=2e4, power=1.5, name="curved"),
    ]
    made = sl.structure(
        np.eye(2), [[4e3, -5e2], [-5e2, 9e3]], names="x y", damping_ratio="1 %", contacts=stops,
        base=sl.Base({"x": 1.0, "y": 1.0}, lambda t: 30 * sl.sin(40 * t)),
    )  # fmt: skip
    with pytest.warns(SaltusWarning, match="inertia="):
        found = contacts(made, (-1e-3, 0, 0, 0), 0.3)
    curved = found.contact_guard == "curved"
    assert curved.sum() > 1
    np.testing.assert_allclose(found.contact_depth[curved], 0.0, atol=1e-15)
    np.testing.assert_allclose(found.contact_peak_force[curved], 0.0, atol=1e-15)
