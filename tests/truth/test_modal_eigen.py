"""Eigenvalues and eigenvectors of contact states against mpmath's to 40 digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from saltus.flow import modal_eigen

SEED = 20261126


def contact_state(rng, modes, *, ratio=0.02, stops=2, stiffness=5e4, damper=0.0):
    """The matrix of a structure of unit modal masses where some stops touch."""
    rates = 40.0 * np.arange(1, modes + 1) ** 2 * rng.uniform(0.9, 1.1, modes)
    shapes, scale = rng.normal(size=(modes, stops)), rng.uniform(1, 2, stops)
    push = (shapes * scale) @ (shapes / scale).T  # symmetric to rounding
    held, lost = np.diag(rates**2) + stiffness * push, np.diag(2 * ratio * rates) + damper * push
    return np.block([[np.zeros((modes, modes)), np.eye(modes)], [-held, -lost]])


def exact(matrix):
    """Its eigenvalues with imaginary parts that aren't negative, ascending by size."""
    with mp.workdps(40):
        found = np.array([complex(one) for one in mp.eig(mp.matrix(matrix.tolist()))[0]])
    found = found[found.imag > -1e-30 * np.abs(found)]
    return found[np.argsort(np.abs(found))]


@pytest.mark.parametrize(
    ("modes", "given", "quick"),
    [
        (1, {}, True),
        (7, {}, True),
        (7, {"ratio": 0.0}, True),
        (5, {"stops": 0}, True),
        (6, {"ratio": 0.05, "stiffness": 1e7}, True),
        (6, {"damper": 3.0}, True),
        (6, {"damper": 3e3}, False),  # a mode that doesn't vibrate
    ],
)
def test_eigenvalues_are_those_of_40_digits(modes, given, quick):
    rng = np.random.default_rng(SEED + modes)
    matrix = contact_state(rng, modes, **given)
    assert (modal_eigen._of_structure(matrix) is not None) == quick
    values, vectors, inverse = modal_eigen.half_of(matrix)
    expected = exact(matrix)
    assert (np.abs(values - expected) <= (2e-14 if quick else 1e-10) * np.abs(expected)).all()
    weight = np.where(values.imag > 0, 2.0, 1.0)
    one = (vectors * weight @ inverse).real
    size = np.abs(vectors) @ np.abs(inverse)
    assert (np.abs(one - np.eye(2 * modes)) <= 1e-13 * size).all()
    again, size = (vectors * weight * values @ inverse).real, np.abs(vectors * values)
    assert (np.abs(again - matrix) <= 1e-12 * (size @ np.abs(inverse))).all()


def test_small_entries_of_eigenvectors_are_as_exact_as_large_ones():
    """By the equations row by row, in units of their terms there, where a row isn't nearly that of
    the mode: the entries for fast modes are a millionth of the largest.
    """
    matrix = contact_state(np.random.default_rng(SEED + 40), 40, stops=1)
    values, vectors, _ = modal_eigen.half_of(matrix)
    own, rate = -np.diag(matrix[40:, :40])[:, None], -np.diag(matrix[40:, 40:])[:, None]
    far = np.abs(own + values * (values + rate)) > 0.02 * np.maximum(own, np.abs(values) ** 2)
    left = np.abs(matrix @ vectors - vectors * values)[40:]
    size = (np.abs(matrix) @ np.abs(vectors))[40:]
    assert np.abs(vectors[:40]).min() < 1e-6 * np.abs(vectors[:40]).max()
    assert (left <= 4 * modal_eigen.ROUNDING / modal_eigen.CLEAR * size)[far].all()


@pytest.mark.parametrize(("damper", "alike"), [(0.0, True), (3.0, False)])
def test_left_vectors_are_made_of_shapes_where_damping_couples_none(damper, alike):
    matrix = contact_state(np.random.default_rng(SEED + 33), 33, damper=damper)
    half = modal_eigen.half_of(matrix)
    shared = modal_eigen.shared_of(matrix, half)
    assert (shared is not None) == alike
    if shared is not None:
        (values, vectors, _), (scale, damping) = half, shared
        shapes = vectors[:33]
        left = (
            scale[:, None] * np.concatenate([shapes * values + damping[:, None] * shapes, shapes]).T
        )
        one = 2 * (vectors @ left).real
        assert (np.abs(one - np.eye(66)) <= 1e-9 * (np.abs(vectors) @ np.abs(left))).all()


@pytest.mark.parametrize("change", ["none", "asymmetric", "rigid", "order", "other rates"])
def test_only_structures_take_the_quick_way(change):
    matrix = contact_state(np.random.default_rng(SEED), 4)
    if change == "asymmetric":
        matrix[5, 2] *= 1 + 1e-9
    elif change == "rigid":
        matrix[4, :] = matrix[:, 0] = 0.0
        matrix[0, 4] = 1.0
    elif change == "order":
        matrix = matrix[::-1, ::-1]
    elif change == "other rates":
        matrix[1, 5] = 1.0 + 1e-12
    assert (modal_eigen._of_structure(matrix) is not None) == (change == "none")


def test_sums_of_several_stops_are_symmetric_to_rounding_of_their_terms():
    matrix = contact_state(np.random.default_rng(SEED + 12), 12, stops=5)
    stiffness = matrix[12:, :12]
    apart = np.abs(stiffness - stiffness.T)
    assert (apart > modal_eigen.ROUNDING * np.abs(stiffness)).any()  # of an entry that cancels
    assert modal_eigen._of_structure(matrix) is not None
