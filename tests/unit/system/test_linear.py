"""Matrices of contact states: all of them from one reading of the equations, against a reading of
each.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.system.linearity import linear_pieces


def plate(rng, modes, stops):
    """A random structure with stops on both sides, some with dampers."""
    root = rng.normal(size=(modes, modes))
    contacts = [
        sl.Contact(
            f"x{k + 1}", stiffness=float(rng.uniform(1, 1e4)), gap=0.1 + k,
            side="both",
            damping=float(rng.uniform(0, 3)) if k % 2 else None, name=f"stop_{k}",
        )
        for k in range(stops)
    ]  # fmt: skip
    return sl.structure(
        np.eye(modes), root @ root.T, damping_ratio=0.02, modes=modes, contacts=contacts,
        forces=[sl.Force("x2", 2.0)], frequency=0.3,
    )  # fmt: skip


@sl.system(states="x v y", forced_at="frequency")
def nested(t, x, v, y, *, frequency=0.3, k=3.0, c=0.5):
    """Conditions within conditions, and one that two boundaries decide."""
    push = sl.where(x > 1, k * (x - 1) + sl.where(y > 2, c * v, 2 * y - x), 0.25)
    held = sl.where((x > 1) & (y > 2), push - y, 4 * push)
    return v, sl.cos(2 * sl.pi * frequency * t) - x - 0.5 * push + held / k, x - 3 * y


@sl.system(states="x v y", forced_at="frequency")
def switched(t, x, v, y, *, frequency=0.3):
    """A stiffness that is chosen: its product with a force isn't linear in both conditions."""
    force = sl.where(x > 1, 2.0, 3.0) * sl.where(y > 2, x + 0.5, x - v)
    return v, sl.cos(2 * sl.pi * frequency * t) - force, x - 3 * y


@pytest.mark.parametrize("system", [plate(np.random.default_rng(5), 6, 4), nested, switched])
def test_pieces_of_all_contact_states(system):
    linear = linear_pieces(system)
    assert not isinstance(linear, str), linear
    assert (linear._terms is None) == (system is switched)
    rng = np.random.default_rng(20261126)
    values = {name: one * rng.uniform(0.5, 2) for name, one in system.values.items()}
    found, modes = linear.every_piece(values), 1 << len(system.guards)
    for mode in {*range(min(modes, 32)), *rng.integers(modes, size=32).tolist()}:
        one, other = found(mode), linear.piece(values, mode)
        for name in ("matrix", "constant", "driven"):
            expected = getattr(other, name)
            np.testing.assert_allclose(
                getattr(one, name), expected, rtol=0, atol=1e-14 * np.abs(expected).max(initial=1)
            )
        assert ((one.matrix == 0) == (other.matrix == 0)).all()
