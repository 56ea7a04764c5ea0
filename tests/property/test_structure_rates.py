"""Rates of random structures against matrices and formulas of NumPy, in both kinds of
coordinates.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl

SEED = 7919


def pushed(contact, d, w, values, label):
    """Force of a contact along its deflection, and the size of the force that presses it."""
    total, normal = 0.0, 0.0
    p, c = contact.power or 1.0, values.get(f"{label}_damping", 0.0)
    gap, k = values[f"{label}_gap"], values[f"{label}_stiffness"]
    for side, sign in (("upper", 1.0), ("lower", -1.0)):
        depth, closing = sign * d - gap, sign * w
        if contact.side in (side, "both") and depth > 0:
            force = k * depth**p + c * closing
            if contact.friction is not None:
                force = max(force, 0.0)
            total, normal = total - sign * force, normal + force
    sign = 1.0 if contact.side == "upper" else -1.0
    return total + sign * values.get(f"{label}_preload", 0.0), normal


def drawn(random, n):
    """A random structure: matrices, contacts, forces, base."""
    root = random.normal(size=(n, n))
    mass = root @ root.T / n + np.eye(n)
    root = random.normal(size=(n, n))
    stiffness = 30 * root @ root.T + np.diag(random.uniform(10, 90, n))
    root = random.normal(size=(n, n))
    damping = 0.1 * root @ root.T
    names = [f"x{i + 1}" for i in range(n)]
    contacts = []
    for number in range(random.integers(1, 4)):
        at, to, sliding = random.permutation(n)[:3]
        side = str(random.choice(["upper", "lower", "both"]))
        rough = random.random() < 0.4
        contacts.append(sl.Contact(
            names[at], to=names[to] if random.random() < 0.4 else None, side=side,
            stiffness=float(random.uniform(1e2, 1e4)), gap=float(random.uniform(0, 0.5)),
            damping=float(random.uniform(1, 300)) if random.random() < 0.5 else None,
            power=float(random.choice([1.5, 2.0, 2.3])) if random.random() < 0.4 else None,
            preload=float(random.normal()) if side != "both" and random.random() < 0.5 else None,
            friction=float(random.uniform(0.1, 0.9)) if rough else None,
            sliding=names[sliding] if rough else None, name=f"stop{number}",
        ))  # fmt: skip
    times, values = np.sort(random.uniform(0, 2, 9)), random.normal(size=9)
    record, run_up = sl.recorded(times, values), sl.sweep(2.0, 5.0, 3.0)
    forces = [sl.Force(names[0], record), sl.Force(names[-1], 2.0, 0.3, harmonic=2)]
    moved = random.normal(size=n)
    return mass, stiffness, damping, contacts, forces, sl.Base(moved, run_up), record, run_up


@pytest.mark.parametrize("number", range(12))
def test_rates_of_a_random_structure(number):
    random = np.random.default_rng([SEED, number])
    n, frequency = int(random.integers(3, 6)), 1.7
    mass, stiffness, damping, contacts, forces, base, record, run_up = drawn(random, n)
    given = {"contacts": contacts, "forces": forces, "base": base, "frequency": frequency}
    made, modal = (
        sl.structure(mass, stiffness, damping, modes=modes, **given) for modes in (None, n)
    )
    shapes = sl.structure_modes(mass, stiffness)["shape"].values
    inverse, unit = np.linalg.inv(shapes), np.eye(n)
    places = {f"x{i + 1}": unit[i] for i in range(n)}
    values = dict(made.values)
    touched = 0
    for _ in range(20):
        t, x, v = random.uniform(0, 2), random.normal(size=n), 3 * random.normal(size=n)
        load = places["x1"] * record(t) - mass @ base.direction * run_up(t)
        load = load + places[f"x{n}"] * 2 * math.cos(4 * math.pi * frequency * t + 0.3)
        for contact in contacts:
            along = places[contact.at] - (places[contact.to] if contact.to else 0.0)
            force, normal = pushed(contact, along @ x, along @ v, values, contact.name)
            load, touched = load + along * force, touched + (normal > 0)
            if contact.friction is not None:
                slide = places[contact.sliding]
                load = load - slide * contact.friction * normal * np.sign(slide @ v)
        truth = np.linalg.solve(mass, load - stiffness @ x - damping @ v)
        size = np.abs(np.linalg.inv(mass)).max() * np.abs([load, stiffness @ x]).sum()
        found = made.rhs(t, np.concatenate([x, v]))
        assert np.abs(found[n:] - truth).max() < 1e-12 * size
        assert found[:n] == pytest.approx(v, abs=1e-15)
        found = modal.rhs(t, np.concatenate([inverse @ x, inverse @ v]))
        assert np.abs(shapes @ found[n:] - truth).max() < 1e-11 * size
    assert touched > 4
