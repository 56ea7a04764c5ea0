"""Models of contacts with a memory, against closed forms and an independent solver."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

import saltus as sl
from oracles.memory_textbook import TABLE
from saltus.models import drifting_oscillator, jenkins_oscillator, latch, play


def test_the_drift_after_sixty_periods():
    """Against the exact solver mode by mode (reference/memory.csv), which has no part in saltus."""
    with TABLE.open(newline="") as file:
        rows = {(r["case"], r["quantity"]): r for r in csv.DictReader(file)}
    for case, given in (
        ("drift_pieces_100", {"t_end": 100.0}),
        ("drift_pieces_60_periods", {"periods": 60}),
    ):
        row = rows[case, "v"]
        run = sl.simulate(drifting_oscillator(), (0.0, 0.0, 0.0, 0.0), **given)
        assert run.status.item() == "ok"
        assert run.end_v.item() == pytest.approx(
            float(row["value"]), abs=max(float(row["error"]), 1e-8)
        )


def taken(system, force, loss, amplitude):
    """Work of the drive less that of the damper, in a period of the motion that is settled."""
    states = sl.simulate(system, (0.0, 0.0), periods=400)
    run = sl.simulate(
        system, [states[f"end_{name}"].item() for name in system.states], periods=1, samples=40_000
    )
    w = 2 * math.pi / system.period()
    power = force * np.cos(w * run.time.values) * run.v.values - loss * run.v.values**2
    most = float(abs(run.x).max())
    return float(np.trapezoid(power, run.time.values)), amplitude(most)


def test_the_energy_of_the_joint():
    found, expected = taken(jenkins_oscillator(), 1.5, 0.05, lambda X: 4 * 1.0 * (X - 0.5))
    assert found == pytest.approx(expected, rel=1e-6)


def test_the_play_forgets():
    """Multipliers of the load alone, and zero; the part's rests at both ends."""
    system = play()
    found = sl.attractors(system, (0.0, 0.0))
    assert found.attractor_period.values.tolist() == [1]
    sizes = np.hypot(found.attractor_multiplier_real, found.attractor_multiplier_imag).values
    free = math.exp(-math.pi * 0.1 / 1.3)
    assert np.sort(sizes.ravel()) == pytest.approx([0.0, free, free], abs=1e-12)
    run = sl.simulate(system, (0.0, 0.0), periods=3, keep=1)
    phase = (run.contact_time.values * 1.3) % (2 * math.pi)
    rest = math.acos(1 - 2 * 0.3)
    for instant in (rest, math.pi + rest):
        assert abs(phase - instant).min() < 1e-12


def test_the_latch_gives_energy_in_each_turn():
    """k (h^2 - l^2)/2 = 1.125 a turn, and instants between by arcs of harmonic motion."""
    run = sl.simulate(latch(), (0.0, 1.5, 0.0), t_end=20.0)
    energy = (run.end_v**2 + (1 + 3 * run.end_m) * run.end_x**2).item() / 2
    kinds = run.contact_guard.values[run.contact_kind.values == "impact"]
    engaged, left = (int(np.sum(kinds == name)) for name in ("upper", "lower"))
    held = 1.5 * (engaged - left)  # its spring is drawn to 1
    assert engaged >= 3
    assert energy == pytest.approx(1.5**2 / 2 + 1.125 * left + held, abs=1e-12)
    first = run.contact_time.values[run.contact_guard.values == "upper"][0]
    assert first == pytest.approx(math.asin(1 / 1.5), abs=1e-14)
