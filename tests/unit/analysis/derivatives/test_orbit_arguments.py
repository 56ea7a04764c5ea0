"""What `sensitivity` of orbits and `event_sensitivity` say of arguments that they can't use."""

import pytest

import saltus as sl

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


@pytest.fixture(scope="module")
def orbits():
    box = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
    return sl.periodic_orbits(RIG, "random 60", box=box, periods=2)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"periods": 3}, "a period and values of their own. Leave periods= out"),
        ({"values": {"force": 3.0}}, "Leave values= out"),
        ({"to": "x(0)"}, "no start of its own"),
        ({"to": "frce"}, "no parameter or start"),
    ],
)
def test_orbits_have_their_own_period_and_values(orbits, more, words):
    with pytest.raises(sl.SaltusError, match=words.replace("(", r"\(")):
        sl.sensitivity(RIG, orbits.isel(orbit=0), **{"to": "force", **more})


def test_orbits_that_do_not_fit_are_told_apart(orbits):
    assert set(orbits.orbit_period.values) == {1, 2}
    with pytest.raises(sl.SaltusError, match="orbits of several periods"):
        sl.sensitivity(RIG, orbits, to="force")
    with pytest.raises(sl.SaltusError, match="doesn't close"):
        sl.sensitivity(
            RIG, orbits.isel(orbit=0).assign(orbit_x=orbits.orbit_x[0] + 0.03), to="force"
        )
    with pytest.raises(sl.SaltusError, match="start= takes orbits that"):
        sl.sensitivity(RIG, sl.simulate(RIG, periods=1), to="force")
    with pytest.raises(sl.SaltusError, match=r"branches.sel\(event=0\)"):
        sl.event_sensitivity(RIG, orbits, to="force")


def test_a_motion_that_ends_before_its_period_is_no_orbit(orbits):
    with pytest.raises(sl.SaltusError, match="ends before its period does, budget_steps"):
        sl.sensitivity(RIG, orbits.isel(orbit=0), to="force", method=sl.Taylor(max_steps=3))


def test_saddles_of_one_period_are_trajectories(orbits):
    saddles = orbits.isel(orbit=(orbits.orbit_period == 1).values)
    found = sl.sensitivity(RIG, saddles, to=["force", "frequency"])
    assert found.sizes["trajectory"] == 3
    # the multipliers have the product exp(-2 zeta w T): no force changes it
    first = found.multiplier_real.values + 1j * found.multiplier_imag.values
    by = found.multiplier_real_derivative.values + 1j * found.multiplier_imag_derivative.values
    change = first[:, 0, None] * by[:, 1] + first[:, 1, None] * by[:, 0]
    zeta, w = RIG.values["damping_ratio"], RIG.values["natural_frequency"]
    product, f = first.prod(axis=1), RIG.values["frequency"]
    rate = -4 * 3.141592653589793 * zeta * w
    assert product == pytest.approx([2.718281828459045 ** (rate / f)] * 3, rel=1e-10)
    expected = product[:, None] * [[0.0, -rate / f**2]]
    assert abs(change - expected).max() < 1e-8
