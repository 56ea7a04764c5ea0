"""Play, Jenkins and Iwan elements: closed forms of their turning points, the energy that they take,
the rules of Masing, and the same by hand, in every verb.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusError


def along(path, t):
    """Rate of an input that goes from place to place in straight lines, one a second."""
    steps = [(float(step), t < end) for end, step in enumerate(np.diff(path)[:-1], 1)]
    return sl.piecewise(*steps, otherwise=float(path[-1] - path[-2]))


def after_turns(x, k, limit):
    """Force of a Jenkins element after its input has gone straight from each place to the next."""
    force = 0.0
    for step in np.diff(x):
        force = float(np.clip(force + k * step, -limit, limit))
    return force


@pytest.mark.parametrize("seed", range(7))
def test_forces_after_turns(seed):
    """An input that goes between random places in straight lines: each element is clipped there."""
    rng = np.random.default_rng(seed)
    places = np.concatenate([[0.0], rng.uniform(-2, 2, 5)])
    k, limits, gap = rng.uniform(0.5, 3, 3), rng.uniform(0.3, 1.5, 3), rng.uniform(0.2, 0.9)

    @sl.system(states="x force part")
    def path(t, x, force, part):
        return (
            along(places, t),
            sl.iwan(x, stiffnesses=list(k), limits=list(limits)),
            sl.play(x, gap=gap),
        )

    run = sl.simulate(path, (0.0, 0.0, 0.0), t_end=5.0)
    assert run.status.item() == "ok"
    deflections = [run[f"end_iwan_{i}"].item() for i in (1, 2, 3)]
    expected = [after_turns(places, 1.0, limit / ki) for ki, limit in zip(k, limits, strict=True)]
    assert deflections == pytest.approx(expected, abs=1e-12)
    assert run.end_play.item() == pytest.approx(after_turns(places, 1.0, gap), abs=1e-12)


def test_the_energy_of_a_joint():
    """A slider takes 4 R (X - R/k) out of each period between -X and X; several their sum."""
    amplitude, k, limits = 1.7, np.array([2.0, 0.7]), np.array([1.0, 0.4])

    @sl.system(states="x work", forced_at="w", units={"w": "rad/s"})
    def shaken(t, x, work, *, w=2.0):
        v = amplitude * w * sl.cos(w * t)
        return v, v * sl.iwan(x, stiffnesses=k, limits=limits)

    one, two = (sl.simulate(shaken, (0.0, 0.0), periods=n).end_work.item() for n in (1, 2))
    assert two - one == pytest.approx(4 * np.sum(limits * (amplitude - limits / k)), abs=1e-12)


def test_masing():
    """From a turning point a loop is the virgin curve at twice its size."""
    k, limits = np.array([1.0, 2.0, 0.5]), np.array([0.3, 1.0, 0.4])

    def force(path):
        @sl.system(states="x q")
        def there(t, x, q):
            return along(path, t), sl.iwan(x, stiffnesses=k, limits=limits)

        run = sl.simulate(there, (0.0, 0.0), t_end=len(path) - 1.0)
        return sum(k[i] * run[f"end_iwan_{i + 1}"].item() for i in range(3))

    for depth in (0.2, 0.5, 0.9):
        virgin = force([0.0, depth])
        back = force([0.0, 1.1, 1.1 - 2 * depth])
        assert force([0.0, 1.1]) - back == pytest.approx(2 * virgin, abs=1e-12)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def joint(t, x, v, *, w=0.9):
    return v, 1.5 * sl.cos(w * t) - 0.2 * x - 0.05 * v - sl.slider(x, stiffness=2.0, limit=1.0)


@sl.system(states="x v f", forced_at="w", units={"w": "rad/s"})
def by_hand(t, x, v, f, *, w=0.9):
    held = ((f >= 1.0) & (v > 0)) | ((f <= -1.0) & (v < 0))
    rates = sl.piecewise((0.0, held), otherwise=2.0 * v)
    return v, 1.5 * sl.cos(w * t) - 0.2 * x - 0.05 * v - f, rates


def test_the_same_by_hand_in_every_verb(few_scouts):
    ours, hand = (sl.simulate(one, (0.5, 0.0, 0.0), periods=30) for one in (joint, by_hand))
    short = sl.simulate(joint, (0.5, 0.0), periods=30)
    assert short.end_x.item() == ours.end_x.item()
    assert ours.end_x.item() == pytest.approx(hand.end_x.item(), abs=1e-12)
    assert 2 * ours.end_slider.item() == pytest.approx(hand.end_f.item(), abs=1e-12)
    found = [sl.attractors(one, start) for one, start in ((joint, (0, 0)), (by_hand, (0, 0, 0)))]
    assert [one.attractor_period.values.tolist() for one in found] == [[1], [1]]
    peaks = [one.attractor_peak.values[0] for one in found]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-12)
    sizes = np.hypot(found[0].attractor_multiplier_real, found[0].attractor_multiplier_imag)
    assert sorted(sizes.values.ravel())[0] < 1e-12  # it forgets where the joint was
    exponents = sl.lyapunov(joint, (0.0, 0.0))
    assert exponents.lyapunov_exponent.values.ravel()[-1] == -math.inf
    curve = [sl.frequency_response(one, (0.8, 1.0, 3)) for one in (joint, by_hand)]
    assert curve[0].response_peak.values == pytest.approx(curve[1].response_peak.values, rel=1e-10)
    map_ = sl.basins(joint, x=(-1, 1, 3), v=(-1, 1, 3))
    assert map_.attractor_fraction.values.tolist() == [1.0]


def test_multipliers_are_those_of_differences():
    """The other two multipliers by differences of the stroboscopic map, at the attractor."""
    start = sl.simulate(joint, (0.0, 0.0), periods=300)
    at = np.array([start[f"end_{name}"].item() for name in joint.states])
    rows, step = [], 1e-6
    for i in range(3):
        pair = []
        for sign in (1, -1):
            moved = at.copy()
            moved[i] += sign * step
            run = sl.simulate(joint, moved, periods=1)
            pair.append([run[f"end_{name}"].item() for name in joint.states])
        rows.append(np.subtract(*pair) / (2 * step))
    expected = np.sort(np.abs(np.linalg.eigvals(np.array(rows).T)))
    found = sl.attractors(joint, (0.0, 0.0))
    sizes = np.hypot(found.attractor_multiplier_real, found.attractor_multiplier_imag)
    assert np.sort(sizes.values.ravel()) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda x: sl.play(x, gap=0.0), "gap = 0 must be positive"),
        (lambda x: sl.slider(x, stiffness=-1.0, limit=1.0), "stiffness = -1 must be positive"),
        (lambda x: sl.slider(x, stiffness=1.0, limit=-2.0), "limit = -2 must be positive"),
        (lambda x: sl.iwan(x, stiffnesses=[1.0], limits=[1.0, 2.0]), "1 stiffnesses and 2 limits"),
        (lambda x: sl.iwan(x, stiffnesses=1.0, limits=[1.0]), "stiffnesses is a list"),
        (lambda x: sl.play(x, gap=1.0, name="v"), "another: name="),
        (lambda x: sl.play(x, gap=1.0, name="1a"), "can't be the name"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(SaltusError, match=words):
        sl.system(states="x v", name="bad")(lambda t, x, v: (v, -x - make(x)))


def test_outside_an_equation():
    with pytest.raises(SaltusError, match="inside the function"):
        sl.play(1.0, gap=1.0)
