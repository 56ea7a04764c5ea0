"""What sl.sensitivity takes, refuses and says."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


@pytest.mark.parametrize(
    ("to", "message"),
    [
        ("upper_gab", r"no parameter or start 'upper_gab'\. Did you mean 'upper_gap'\?"),
        (["upper_gap", "upper_gap"], "to names something twice"),
        ([], r"to must be parameters, such as \[\"gap\"\]"),
        ([3], r"to must be parameters, such as \[\"gap\"\]"),
        ("y(0)", "no parameter or start"),
    ],
)
def test_what_derivatives_are_with_respect_to_is_checked(to, message):
    with pytest.raises(ParameterError, match=message):
        sl.sensitivity(RIG, periods=2, to=to)


def test_times_and_samples_exclude_each_other():
    with pytest.raises(ParameterError, match="only one of them"):
        sl.sensitivity(RIG, at=[0.1], samples=10, to="force")


def test_frequencies_of_their_own_ask_for_equal_parts_of_the_periods():
    with pytest.raises(ParameterError, match="forcing periods of their own"):
        sl.sensitivity(RIG, at=[0.1], values={"frequency": [14.0, 15.0]}, to="frequency")


def test_an_account_says_what_the_largest_values_depend_on():
    found = sl.sensitivity(RIG, ("1 mm", 0), periods=2, to=["upper_gap", "force"], samples=10)
    said = str(sl.describe(found))
    assert "derivatives with respect to upper_gap, force" in said
    share = (
        found.maximum_derivative.sel(output="x", to="force") * 4.0 / found.maximum.sel(output="x")
    )
    assert f"{float(share):+.3g} % for 1 % of force" in said
    assert list(found.to_units.values) == ["m", "N"]


def test_derivatives_of_a_chaotic_motion_are_said_to_be_beyond_use():
    chaotic = RIG.with_values(frequency=14.2)
    with pytest.warns(SaltusWarning, match=r"grow beyond use: from t = [\d.]+ s on"):
        sl.sensitivity(chaotic, ("1 mm", 0), periods=400, samples=4, to="force", extremes=False)


def test_a_resting_contact_has_no_time_of_its_own():
    @sl.system(states="h v")
    def ball(t, h, v, *, g=9.81, e=0.5):
        return v, -g, sl.impact(h > 0, -v, restitution=e)

    found = sl.sensitivity(ball, (0.1, 0), t_end=1.0, to=["g"])
    at_rest = found.contact_kind.values == "hold"
    assert np.isnan(found.contact_time_derivative.values[at_rest]).all()
    assert np.isfinite(found.contact_time_derivative.values[~at_rest]).all()
    assert found.end_derivative.values == pytest.approx(np.zeros((2, 1)), abs=1e-12)
