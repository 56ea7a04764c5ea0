"""Responses made by hand: a T branch, a 3T branch that ends, a chaotic one; two starts."""

from __future__ import annotations

import numpy as np

import made_results
from made_results import Events, Responses, Starts
from saltus.results import AttractorTable, Guards
from unit.results.conftest import PROVENANCE, UNITS

FREQUENCY = np.array([4.0, 5.0, 6.0])
#: Start by frequency: the second start leads to the 3T response, escapes, and leads to chaos.
RESPONSE_OF = np.array([[0, 1], [2, -1], [3, 4]])
TABLE = AttractorTable(
    kind=["periodic", "periodic", "periodic", "periodic", "chaotic"],
    period=np.array([1, 3, 1, 1, 0]),
    contacts=np.array([2.0, 9.0, 2.0, 4.0, 2.4]), itinerary=[""] * 5,
    peak=np.arange(1.0, 6.0) * 1e-3, rms=np.arange(1.0, 6.0) * 5e-4,
    margin=np.array([1e-4, 2e-5, 1e-4, 1e-5, 1e-6]),
    multipliers=np.array([[0.5 + 0.1j, 0.5 - 0.1j]] * 4 + [[np.nan, np.nan]]),
    exponent=np.array([-0.9, -0.2, -0.8, -0.7, 1.1]),
    exponent_error=np.array([0.0, 0.0, 0.0, 0.0, 0.03]),
    points=[np.array([[1e-3, 0.1]]), np.arange(6.0).reshape(3, 2), np.array([[2e-3, 0.1]]),
        np.array([[3e-3, 0.1]]), np.ones((7, 2))],
    fractions=(np.array([0.5, 0.5, 0.5, 0.5, 0.5]), np.full(5, 0.1), np.full(5, 0.9)),
)  # fmt: skip
NO_RESPONSE = AttractorTable(
    [], *([np.zeros(0)] * 2), [], *([np.zeros(0)] * 3), np.zeros((0, 2)), *([np.zeros(0)] * 2), []
)


def responses(**changes):
    arguments = {
        "states": ("x", "v"), "units": UNITS, "axes": {"frequency": FREQUENCY},
        "starts": Starts({"x": np.array([0.0, 1e-3]), "v": np.zeros(2)}),
        "response_of": RESPONSE_OF,
        "responses": Responses(TABLE, np.array([[0], [0], [1], [2], [2]]),
            np.array([0, 1, 0, 0, 2])),
        "events": Events({"frequency": np.array([5.5])}, ["graze"], np.array([0])),
        "guards": Guards(("stop",), ("x",), np.array([1e-3])), "gap_unit": "m", "attrs": PROVENANCE,
    }  # fmt: skip
    return made_results.responses(**{**arguments, **changes})


def two_parameters(**changes):
    place = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [2, 1]])
    arguments = {
        "axes": {"frequency": FREQUENCY, "gap": np.array([1e-3, 2e-3])},
        "starts": Starts({"x": [0.0], "v": [0.0]}),
        "response_of": np.array([[[0], [1]], [[2], [3]], [[-2], [4]]]),
        "responses": Responses(TABLE, place, np.arange(5)), "events": None,
    }  # fmt: skip
    return responses(**{**arguments, **changes})
