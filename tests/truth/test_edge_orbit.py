"""The orbit on a boundary of basins against closed forms and against the search for all orbits."""

import csv
from pathlib import Path

import numpy as np
import pytest

import impact_orbits
import saltus as sl

RIG = sl.models.delangre("a", force="4 N", frequency="17 Hz")
RECIPES = {
    "stiffness": 1.0, "damping": 0.1, "gap": 1.0, "restitution": 0.8, "force": 0.3,
    "frequency": 1.2,
}  # fmt: skip


def test_the_saddle_of_an_impact_oscillator_between_impacts_and_none():
    """Its closed form: the slower of the two orbits with one impact (row I04m its multiplier)."""
    with (Path(__file__).parents[1] / "reference" / "laws_impact.csv").open() as file:
        known = {row["id"]: row["value"] for row in csv.DictReader(file)}
    (_, saddle), (_, stable) = impact_orbits.oscillator(**RECIPES)
    z = RECIPES["force"] / (1.0 - 1.44 + 0.12j)
    free = (z.real, (1.2j * z).real)
    found = sl.edge_orbit(sl.models.impact_oscillator(**RECIPES), free, tuple(stable))
    assert found.orbit_stability.values.tolist() == ["saddle"]
    point = [found.orbit_x.values[0, 0], found.orbit_v.values[0, 0]]
    assert point == pytest.approx(saddle, abs=1e-11)
    assert found.orbit_multiplier_real.values[0, 0] == pytest.approx(float(known["I04m"]), rel=1e-9)
    assert found.leads_to_a != found.leads_to_b
    assert set(found.beside.split(" | ")) == {found.leads_to_a, found.leads_to_b}


def test_it_is_one_of_all_orbits_and_repels_to_both_sides():
    """On the boundary of the small response of the rig: the saddle of the 3T response."""
    edge = sl.edge_orbit(RIG, (0.0, 0.0), (2.5e-3, 0.56))
    box = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
    every = sl.periodic_orbits(RIG, "random 400", box=box)
    n = int(edge.orbit_period[0])
    alike = every.isel(orbit=(every.orbit_period == n) & (every.orbit_stable == 0))
    apart = np.abs(alike.orbit_x.values[:, :n] - edge.orbit_x.values[:, :n]).max(axis=1)
    assert apart.min() < 1e-11
    assert edge.orbit_unstable_directions.values.tolist() == [1]
    one, other = edge.beside.split(" | ")
    assert one != other
    assert edge.leads_to_a in (one, other)


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ((0.0, 0.0), (1e-6, 0.0), "same attractor"),
        ((0.0, 0.0), ([0.0, 1e-3], 0.0), "one start"),
    ],
)
def test_what_has_no_boundary_between_is_refused(a, b, words):
    with pytest.raises(sl.SaltusError, match=words):
        sl.edge_orbit(RIG, a, {"x": b[0], "v": b[1]})
