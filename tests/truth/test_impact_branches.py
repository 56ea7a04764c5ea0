"""Branches of orbits with impacts, against closed forms."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import saltus as sl

REFERENCE = Path(__file__).parents[1] / "reference"


@cache
def rows(name):
    with (REFERENCE / f"{name}.csv").open() as file:
        return {row["id"]: row["value"] for row in csv.DictReader(file)}


def nearest(found, kind, exact):
    at = found[f"event_{found.attrs['parameter']}"].values[found.event_kind.values == kind]
    return at[np.abs(at - exact).argmin()]


IMPACT = sl.models.impact_oscillator


@pytest.mark.parametrize(("number", "restitution"), [("I10", 0.8), ("I12", 0.5)])
def test_an_oscillator_whose_stop_is_at_its_place_of_rest(number, restitution):
    system, exact = IMPACT("thompson", restitution=restitution), float(rows("laws_impact")[number])
    found = sl.branches(
        system, {"frequency": (2.6, 2.7)}, (-0.5, 0.0), at=1, switch=(), progress=False
    )
    assert nearest(found, "period_doubling", exact) == pytest.approx(exact, rel=1e-14)


def test_an_oscillator_that_leaves_its_stop():
    exact = rows("laws_impact")
    system = IMPACT(damping=0.04, gap=0.2, restitution=0.7)
    seeds = sl.bifurcation_diagram(system, {"frequency": [2.114]}, start=(0, 0), progress=False)
    found = sl.branches(system, {"frequency": (2.1, 2.6)}, seeds, switch=(), progress=False)
    for kind, number in (("period_doubling", "I20"), ("graze", "I22")):
        value = float(exact[number])
        assert nearest(found, kind, value) == pytest.approx(value, rel=1e-14)
    assert found.event_outcome.values[found.event_kind.values == "graze"] == ["persistence"]


def test_a_ball_on_a_shaken_table():
    fold, doubling = (float(rows("laws_ball")[number]) for number in ("B01a", "B01b"))
    system = sl.models.bouncing_ball()
    # one impact a period, at the phase where G cos(phase) = pi (1 - e)/(1 + e); v after it is pi
    phase = np.arccos(np.pi / 3 / 1.3)
    since = 2 * np.pi - phase
    start = (1.3 * np.sin(phase) + np.pi * since - since**2 / 2, np.pi - since)
    found = sl.branches(system, {"amplitude": (1.0, 1.6)}, start, at=1, switch=(), progress=False)
    assert nearest(found, "fold", fold) == pytest.approx(fold, rel=1e-14)
    assert nearest(found, "period_doubling", doubling) == pytest.approx(doubling, rel=1e-14)


def test_a_ball_in_a_shaken_box():
    exact = rows("laws_ball")
    box = sl.models.ball_in_box()
    found = sl.branches(
        box, {"length": (2.9, 13)}, "random 4", box={"x": (-1, 1), "v": (-2, 2)}, at=1,
        switch=(), progress=False,
    )  # fmt: skip
    fold = float(exact["B30"])
    assert nearest(found, "fold", fold) == pytest.approx(fold, rel=1e-14)
