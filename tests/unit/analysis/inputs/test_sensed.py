"""Starts by sensors, against static deflections and blows of the full matrices."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, StudyError
from saltus.study.setting import quantities

SIZE = 6


def structure(modes=SIZE, free=False):
    """A chain with an uneven mass matrix, held at one end or free, and its matrices."""
    stiffness = 400.0 * (2 * np.eye(SIZE) - np.eye(SIZE, k=1) - np.eye(SIZE, k=-1))
    stiffness[-1, -1] = 400.0
    if free:
        stiffness[0, 0] = 400.0
    mass = np.diag(np.arange(1.0, SIZE + 1)) + 0.2 * (np.eye(SIZE, k=1) + np.eye(SIZE, k=-1))
    system = sl.structure(
        mass, stiffness, modes=modes, damping_ratio=0.02, frequency=0.7, name="chain",
        forces=[sl.Force("x1", 2.0)],
        contacts=[sl.Contact("x6", stiffness=900.0, gap=0.02, side="both")],
        sensors={
            **{f"x{i}": f"x{i}" for i in range(1, SIZE + 1)},
            **{f"v{i}": sl.velocity(f"x{i}") for i in range(1, SIZE + 1)},
            "shake": sl.acceleration("x2"), "stop force": sl.contact_force("x6"),
        },
    )  # fmt: skip
    return system, mass, stiffness


def begun(system, start, **kw):
    """What the sensors show at the start: float64[..., 12]."""
    run = sl.simulate(system, start, periods=1, samples=4, progress=False, **kw)
    names = [f"{kind}{i}" for kind in "xv" for i in range(1, SIZE + 1)]
    return np.stack([run[name].values[..., 0] for name in names], axis=-1)


def test_a_deflection_is_static_and_a_velocity_that_of_blows():
    system, mass, stiffness = structure()
    at = np.eye(SIZE)[[1, 4]]
    pulled = np.linalg.solve(stiffness, at.T) @ np.linalg.solve(
        at @ np.linalg.solve(stiffness, at.T), [1e-3, -2e-3]
    )
    struck = np.linalg.solve(mass, np.eye(SIZE)[3])
    found = begun(system, {"x2": "1 mm", "x5": -2e-3, "v4": "50 mm/s"})
    expected = np.concatenate([pulled, 0.05 * struck / struck[3]])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_nothing_given_is_rest():
    system, _, _ = structure(modes=4)
    np.testing.assert_array_equal(begun(system, {}), 0.0)
    assert quantities.start(system, {}, "simulate") == {}


def test_a_free_body_is_moved_as_a_whole():
    system, _, _ = structure(free=True)
    np.testing.assert_allclose(begun(system, {"x2": 1e-3})[:SIZE], 1e-3, rtol=1e-9)


def test_many_starts_of_few_modes():
    """Of a system whose sensors are read off at contacts too."""
    system, _, _ = structure(modes=3)
    found = begun(system, {"x6": [1e-3, 0.05, -0.05], "v6": "1 m/s"})
    np.testing.assert_allclose(found[:, 5], [1e-3, 0.05, -0.05], rtol=1e-12)
    np.testing.assert_allclose(found[:, 11], 1.0, rtol=1e-12)
    again = begun(system, {"x6": 0.05, "v6": 1.0}, values={"frequency": [0.7, 0.8]})
    np.testing.assert_allclose(again[0], found[1], rtol=0, atol=1e-15)


def test_what_is_asked_back():
    system, _, _ = structure(modes=2)
    for start, words in (
        ({"w3": 1e-3}, r"no sensor 'w3'.*q1, q2, q1_rate, q2_rate.*sensors=\{'w3'"),
        ({"shake": 1.0}, "'shake' is neither a deflection nor a velocity"),
        ({"stop force": 1.0}, "'stop force' is neither a deflection nor a velocity"),
        ({"x1": 1e-3, "x2": 1e-3, "x6": -1e-3}, "no motion of the 2 modes.*x1, x2, x6 at once"),
        ({"x1": [1e-3, 2e-3], "x6": [0, 0, 1]}, "one length: x1 has 2"),
        ({"x1": 1e-3, "q1": 0.0}, "x1, which a sensor shows, and q1, the coordinate of a mode"),
        ({"q1": 0.0}, "gives no 'q2'"),
    ):
        with pytest.raises(ParameterError, match=words):
            sl.simulate(system, start, periods=1)


def test_study_files_give_such_starts():
    system, _, _ = structure(modes=3)
    found = quantities.start(system, {"x6": ["1 mm", "2 mm"], "v6": ["1 m/s", "0 m/s"]}, "simulate")
    assert found == {"x6": [1e-3, 2e-3], "v6": [1.0, 0.0]}
    with pytest.raises(StudyError, match="'y6' is unknown to chain"):
        quantities.start(system, {"y6": "1 mm"}, "simulate")
    with pytest.raises(StudyError, match="start lacks q2"):
        quantities.start(system, {"q1": 0.0}, "simulate")
