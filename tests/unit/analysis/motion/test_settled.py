"""`settled` against sequences whose period is known by construction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import made_results
import saltus as sl
from saltus.analysis.motion.settled import settled
from saltus.errors import ParameterError
from saltus.results import Guards

NONE = Guards((), (), np.empty(0))


def stroboscope(*strobes: np.ndarray, status: str = "ok"):
    """A stroboscope of one state with these rows."""
    rows = np.stack(strobes)
    return made_results.stroboscope(
        states=("x",),
        units={"x": "m"},
        period=np.arange(rows.shape[1]),
        values={"x": rows},
        status=[status] * len(rows),
        guards=NONE,
    )


def cycle(n: int, length: int = 97, seed: int = 1) -> np.ndarray:
    """A sequence of smallest period n."""
    return np.resize(np.random.default_rng(seed).normal(size=n), length) * 1e-3


@pytest.mark.nojit
@pytest.mark.parametrize("n", [1, 2, 3, 12, 24, 48])
def test_period_by_construction(n):
    assert settled(stroboscope(cycle(n)))["response_period"].item() == n


def test_longer_than_half_of_what_was_kept():
    found = settled(stroboscope(cycle(49)))
    assert found["response_period"].item() == 0
    assert found.attrs["longest_period"] == 48
    assert found["mismatch"].item() > 1e-3


def test_a_doubled_orbit_is_not_its_half():
    """Every second repeat of 12T off by 1e-4 of the range: 24T, as the rig does at 15 Hz from x =
    0.4 mm.
    """
    doubled = cycle(12)
    doubled[np.arange(97) % 24 == 5] += 1e-4 * np.abs(doubled).max()
    assert settled(stroboscope(doubled))["response_period"].item() == 24


def test_a_transient_is_not_settled():
    """A residue that loses 1 % a period, at 1e-3 of the motion."""
    slow = cycle(3) * (1 + 1e-3 * 0.99 ** np.arange(97))
    assert settled(stroboscope(slow))["response_period"].item() == 0


def test_a_turning_transient_is_not_taken_for_a_multiple():
    """A residue of 5T whose multiplier turns by a third each 5 periods repeats better after 15:
    that isn't a 15T response.
    """
    k = np.arange(97)
    turning = cycle(5) * (1 + 1e-6 * 0.999**k * np.cos(2 * np.pi * k / 15))
    assert settled(stroboscope(turning))["response_period"].item() == 0


def test_a_transient_in_the_part_left_out_does_not_matter():
    early = cycle(3)
    early[:40] += 1.0
    assert settled(stroboscope(early), last=50)["response_period"].item() == 3


def test_rest_is_t_periodic():
    assert settled(stroboscope(np.zeros(97)))["response_period"].item() == 1


def test_rounding_does_not_hide_a_period():
    noisy = cycle(4) * (1 + 1e-15 * np.random.default_rng(2).normal(size=97))
    assert settled(stroboscope(noisy))["response_period"].item() == 4


def test_a_lane_does_not_see_its_neighbours():
    found = settled(stroboscope(cycle(3), np.full(97, np.nan), cycle(5) * 1e6))
    assert found["response_period"].values.tolist() == [3, 0, 5]
    assert found["response_period"].dims == ("trajectory",)


def test_a_failed_trajectory_has_no_period():
    assert settled(stroboscope(cycle(3), status="budget_steps"))["response_period"].item() == 0


@pytest.mark.parametrize("last", [1, 97])
def test_too_little_kept(last):
    with pytest.raises(ParameterError, match="whole forcing periods"):
        settled(stroboscope(cycle(3)), last=last)


# -- runs of closed forms --------------------------------------------------------------------------
NO_CONTACTS = made_results.Contacts(*[np.empty(0)] * 3, np.empty(0, int), *[np.empty(0)] * 7)


def run(per_period: int = 20, periods: int = 96, contacts=NO_CONTACTS, **states):
    """A run of T = 1 s. A state is its values (n,) or (trajectory, n) over time, and its unit."""
    rows = np.stack([np.atleast_2d(values) for values, _ in states.values()], axis=-1)
    time = np.arange(periods * per_period + 1) / per_period
    return made_results.trajectory(
        states=tuple(states),
        units={name: unit for name, (_, unit) in states.items()},
        time=time,
        period=time,
        values=rows,
        mode=np.zeros(rows.shape[:2], int),
        contacts=contacts,
        guards=NONE,
        status=["ok"] * len(rows),
        counters={},
        minima={},
        end_time=np.full(len(rows), time[-1]),
        end=rows[:, -1],
        forcing_period=1.0,
        batch=len(rows) > 1,
    )


def times(per_period: int = 20, periods: int = 96) -> np.ndarray:
    return np.arange(periods * per_period + 1) / per_period


def response(period: int = 1, size: float = 1.0, **more: int) -> np.ndarray:
    """A motion of smallest period ``period``, of range 2 ``size`` at most."""
    return size * np.cos(2 * np.pi * times(**more) / period + 0.3)


DEAD = 1e-20 * np.exp(-times())
RUNS_ON = np.floor(times() + 0.5) + 1e-3 * response()


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("states", "n"),
    [
        pytest.param({"x": (response(3), "m"), "y": (0.0 * DEAD, "m")}, 3, id="one rests"),
        pytest.param({"x": (response(3), "m"), "y": (DEAD, "m")}, 3, id="one has died away"),
        pytest.param({"x": (response(3), ""), "y": (DEAD, "")}, 3, id="without units"),
        pytest.param({"x": (response(3), "m"), "y": (DEAD**9, "rad")}, 3, id="alone of its unit"),
        pytest.param({"x": (DEAD**9, "m"), "v": (-(DEAD**9), "m/s")}, 1, id="all have died away"),
        pytest.param({"x": (1e-9 * response(3), "m"), "v": (response(3), "m/s")}, 3, id="units"),
        pytest.param({"x": (1e-9 * response(3), "m"), "v": (response(), "m/s")}, 3, id="small"),
        pytest.param({"x": (1e6 + 1e-3 * response(2), "m")}, 2, id="far from zero"),
        pytest.param(
            {"x": (1e-3 * response(2), "m"), "y": (1e6 + 1e-12 * response(7), "m")}, 2, id="ripple"
        ),
        pytest.param({"x": (response(), "m"), "y": (RUNS_ON, "rad")}, 0, id="one runs on"),
        pytest.param({"x": (response(), "m"), "y": (RUNS_ON, "m")}, 0, id="runs on, same unit"),
        pytest.param(
            {"x": (response(), "m"), "y": (1e-3 * np.exp(-0.01 * times()), "m")}, 0, id="slow"
        ),
        pytest.param(
            {"x": (response(), "m"), "y": (1e-3 * np.exp(-0.01 * times()), "V")}, 0, id="slow, V"
        ),
    ],
)
def test_period_beside_states_that_rest_die_away_or_run_on(states, n):
    assert settled(run(**states))["response_period"].item() == n


@pytest.mark.nojit
def test_a_decay_counts_by_the_largest_range_of_its_unit():
    """From exp(-20) of the largest range on nothing of it shows at a tolerance of 1e-6."""
    decay = np.exp(-0.2 * times())
    late = settled(run(x=(response(), "m"), y=(decay, "m")), last=4)
    early = settled(run(x=(response(), "m"), y=(decay, "m")))
    assert (late["response_period"].item(), early["response_period"].item()) == (1, 0)
    drop = np.exp(-0.2 * 92) * (1 - np.exp(-0.2))
    assert late["mismatch"].item() == pytest.approx(drop / np.ptp(response()), rel=1e-9)


@pytest.mark.nojit
def test_one_sample_a_period_is_measured_by_magnitudes():
    """The range of a T response seen once a period is what is left of its transient."""
    seen = 1e-3 * (1 + 1e-9 * np.exp(-0.1 * times(1)))
    found = settled(run(1, x=(seen, "m"), y=(1e-30 * np.exp(-0.1 * times(1)), "m")))
    assert found["response_period"].item() == 1
    assert found["mismatch"].item() == pytest.approx(1e-9 * (1 - np.exp(-0.1)), rel=1e-3)


@settings(max_examples=40, deadline=None)
@given(
    modes=some.lists(
        some.tuples(
            some.floats(-18, 1),  # log10 of the rate of decay [1/s]
            some.floats(-30, 0),  # log10 of its size at first
            some.sampled_from([0, 1, 2, 3]),  # response period, 0 for a mode that isn't driven
        ),
        min_size=1,
        max_size=4,
    )
)
def test_driven_modes_repeat_when_their_transients_are_small(modes):
    """Linear modes in closed form beside one of period T: their common period as soon as no
    transient changes by a hundredth of the tolerance in that time; never while one changes by more.
    """
    t, n = times(10, 24), int(np.lcm.reduce([max(period, 1) for *_, period in modes]))
    transients = [10.0**size * np.exp(-(10.0**rate) * t) for rate, size, _ in modes]
    values = [response(per_period=10, periods=24)] + [
        transient + (response(period, per_period=10, periods=24) if period else 0.0)
        for transient, (*_, period) in zip(transients, modes, strict=True)
    ]
    found = settled(run(10, 24, **{f"q{i}": (value, "m") for i, value in enumerate(values)}))
    change = max(of[0] - of[10 * n] for of in transients) / max(np.ptp(of) for of in values)
    if change < 1e-8:
        assert found["response_period"].item() == n
    if change > 1.1e-6:
        assert found["response_period"].item() != n


def test_modes_that_die_away_beside_one_that_is_driven():
    """The motion of x is one of period T in closed form; a and b only die away."""

    @sl.system(states="x v a b", forced_at="f", units={"f": "Hz"})
    def two(t, x, v, a, b, *, f=1.0):
        return v, sl.cos(2 * sl.pi * f * t) - 4 * x - 0.4 * v, b, -9 * a - 0.4 * b

    for samples, keep in ((200, 20), (1, 20), (3, 20)):
        late = sl.simulate(two, (0, 0, 0.1, 0), periods=400, keep=keep, samples=samples)
        found = sl.settled(late)
        assert found["response_period"].item() == 1
        assert found["mismatch"].item() < 1e-13
    w = 2 * np.pi
    assert sl.settled(sl.simulate(two, (0, 0, 0.1, 0), periods=400, keep=20))[
        "x_peak"
    ].item() == pytest.approx(1 / abs(4 - w**2 + 0.4j * w), rel=1e-4)
    assert sl.settled(sl.stroboscope(two, (0, 0, 0.1, 0), 400))["response_period"].item() == 1
    assert sl.settled(sl.simulate(two, (0, 0, 0.1, 0), periods=20))["response_period"].item() == 0


# -- many trajectories -----------------------------------------------------------------------------
def table_of_contacts(trajectory: np.ndarray, time: np.ndarray):
    count = len(time)
    zeros, words = np.zeros(count), ["crossing"] * count
    return made_results.Contacts(
        trajectory, time, zeros, zeros.astype(int), zeros, zeros, words, zeros[:, None],
        zeros, zeros, zeros,
    )  # fmt: skip


def several():
    """Trajectories of 1, 3 and 2 periods, and one of none, with contacts: as many a period of the
    forcing as their number.
    """
    rows = np.stack([response(1), response(3), response(2), response(89)])
    who = np.repeat(np.arange(4), 96 * np.arange(4))
    when = np.concatenate([(np.arange(96 * i) + 0.5) / i for i in range(1, 4)])
    return run(x=(rows, "m"), contacts=table_of_contacts(who, when))


@pytest.mark.nojit
def test_each_of_many_as_if_it_were_alone():
    many = settled(several())
    assert many["response_period"].values.tolist() == [1, 3, 2, 0]
    np.testing.assert_array_equal(many["contacts_per_response"], [0, 3, 4, np.nan])
    for i in range(4):
        x = several()["x"].values[i]
        alone = settled(several().isel(trajectory=i))
        assert alone["x_peak"].item() == many["x_peak"].values[i] == np.abs(x[:-1]).max()
        assert alone["x_rms"].item() == pytest.approx(np.sqrt(np.mean(x[:-1] ** 2)), rel=1e-14)
        for name in ("response_period", "mismatch", "contacts_per_response", "x_rms"):
            np.testing.assert_array_equal(alone[name].values, many[name].values[i])


@pytest.mark.nojit
def test_contacts_of_the_trajectories_that_were_chosen():
    found = settled(several().isel(trajectory=[2, 1]))
    assert found["contacts_per_response"].values.tolist() == [4, 3]


@pytest.mark.nojit
def test_many_are_never_taken_apart_one_by_one(monkeypatch):
    """Selecting each of thousands out of a Dataset took ten times as long as to simulate them."""
    many = several()
    monkeypatch.setattr(type(many), "isel", None)
    assert settled(many)["response_period"].values.tolist() == [1, 3, 2, 0]


@pytest.mark.nojit
def test_a_tolerance_is_above_zero():
    with pytest.raises(ParameterError, match="tolerance must be a positive number"):
        settled(several(), tolerance=0.0)
