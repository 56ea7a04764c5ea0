"""Derivatives of the places of bifurcations: a closed form, and differences of places that are
found again.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning

#: Differences of fourth order, and their step.
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
SHIFTS, STEP = np.array([-2.0, -1.0, 1.0, 2.0]), 4e-6


@sl.system(states="x v", forced_at="f")
def hammer(t, x, v, *, f=1.5, pull=3.0, k=40.0, gap=0.08, e=0.6, d=0.4):
    law = sl.impact(x < gap, v, restitution=e)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v, law


def test_the_graze_of_a_rigid_stop_moves_as_its_formula_says():
    # the steady motion in the middle of the range
    found = sl.branches(hammer, {"f": (1.39, 1.45)}, (-0.0757, 0.06), at=1, switch=())
    event = found.sel(event=found.event[found.event_kind == "graze"][0])
    slopes = sl.event_sensitivity(hammer, event, to=["gap", "pull", "k", "d", "e"])
    # before the graze the motion is linear: its amplitude, pull / sqrt(s), is the gap
    p, w = hammer.values, 2 * np.pi * float(slopes.event_value)
    k, d = p["k"], p["d"]
    s = (k - w * w) ** 2 + (d * w) ** 2
    assert np.sqrt(s) * p["gap"] == pytest.approx(p["pull"], rel=1e-12)
    by = np.array([2 * s / p["gap"], -2 * s / p["pull"], 2 * (k - w * w), 2 * d * w * w, 0.0])
    by_f = 2 * np.pi * (2 * d * d * w - 4 * w * (k - w * w))
    assert slopes.event_derivative.values == pytest.approx(-by / by_f, rel=1e-11)
    assert abs(float(slopes.sqrt_coefficient)) > 0  # the orbit's own slope is infinite there
    assert "infinite" in sl.describe(slopes)
    near = np.abs(found.point_f - event.event_f).where(found.point_contacts > 0)
    with pytest.warns(SaltusWarning, match="nearly grazes gap"):
        sl.sensitivity(hammer, found.isel(point=int(np.nanargmin(near.values))), to="gap")


@pytest.mark.parametrize(
    ("system", "kind", "to", "vary", "start"),
    [
        (
            sl.models.delangre("b", force="4 N"),
            "period_doubling",
            ["force", "upper_gap", "damping_ratio"],
            {"frequency": (12.5, 13.19)},  # a graze is near
            (0, 0),
        ),
        (hammer, "fold", ["gap", "pull", "k", "d", "e"], {"f": (1.5, 1.7)}, (0, 0)),
    ],
)
@pytest.mark.slow
def test_places_move_as_differences_say(system, kind, to, vary, start):
    def located(shift, start):
        moved = system.with_values(**dict(zip(to, near + shift * along, strict=True)))
        found = sl.branches(moved, vary, start, at=2, switch=())
        return found.sel(event=found.event[found.event_kind == kind][0])

    near = np.array([system.values[name] for name in to])
    along = near * np.random.default_rng(261126).normal(size=len(to))
    event, place = located(0.0, start), f"event_{next(iter(vary))}"
    again = {name: float(event[f"event_{name}"][0]) for name in ("x", "v")}
    places = [float(located(shift, again)[place]) for shift in SHIFTS * STEP]
    found = sl.event_sensitivity(system, event, to=to)
    assert float(found.event_value) == pytest.approx(float(event[place]), rel=1e-12)
    expected = float(WEIGHTS @ places) / STEP
    assert found.event_derivative.values @ along == pytest.approx(expected, rel=1e-7)
