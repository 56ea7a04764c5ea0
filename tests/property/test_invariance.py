"""What must not change: units, mirror, origin of time, order of the batch. Held for any rig and any
start.
"""

from __future__ import annotations

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

import saltus as sl
from conformance.systems import bent, bits, contacts

RIG = sl.models.delangre("b")
PERIODS = 6


def numbers(low, high):
    """Floats of ordinary size, zero included where it lies between."""
    return st.floats(low, high, allow_subnormal=False, width=64).map(
        lambda value: 0.0 if abs(value) < 1e-12 * (high - low) else value
    )


def rigs():
    """Values of the rig: dampings, stiffnesses, gaps (zero too), forces and frequencies."""
    return st.fixed_dictionaries(
        {
            "damping_ratio": numbers(0.001, 0.3),
            "cubic": st.sampled_from([0.0, 1e6, 7e8]),
            "contact_stiffness": numbers(2.0, 6.0).map(lambda power: 10.0**power),
            "lower_gap": st.one_of(st.just(0.0), numbers(0.0, 1e-3)),
            "upper_gap": numbers(1e-5, 1e-3),
            "force": numbers(0.0, 8.0),
            "frequency": numbers(3.0, 30.0),
        }
    )


starts = st.tuples(numbers(-5e-3, 5e-3), numbers(-1.0, 1.0))


def _near_a_graze(run):
    """Whether rounding may decide about a contact: then two runs may differ by it, and have nothing
    to be compared by.
    """
    slow = float(run.smallest_contact_speed) < 1e-4 * float(np.abs(run.v).max())
    return (
        slow
        or float(run.smallest_gap_margin) < 1e-9 * float(np.abs(run.x).max())
        or str(run.status.values) != "ok"
    )


def _same(ours, theirs, length=1.0, time=1.0):
    """Whether two runs agree to rounding, theirs being in units of length and time so many times
    smaller.
    """
    assert [(c.guard, c.direction, c.kind) for c in contacts(theirs)] == [
        (c.guard, c.direction, c.kind) for c in contacts(ours)
    ]
    for name, unit in (
        ("x", length),
        ("v", length / time),
        ("contact_time", time),
        ("contact_velocity", length / time),
    ):
        largest = float(np.abs(ours[name]).max()) if ours[name].size else 0.0
        assert (
            np.abs(theirs[name].values / unit - ours[name].values).max(initial=0) <= 1e-11 * largest
        ), name


# -- units -----------------------------------------------------------------------------------------
@given(values=rigs(), start=starts, power=st.integers(-40, 40))
@example(values={**RIG.values, "lower_gap": 0.0}, start=(0.0, 0.0), power=-30)
def test_unit_of_length(values, start, power):
    """Lengths in units of 2^k m: displacements, velocities and gaps scale, times and sides stay (to
    rounding: steps may differ).
    """
    k = 2.0**power
    scaled = {name: values[name] * k for name in ("lower_gap", "upper_gap", "force")} | {
        "cubic": values["cubic"] / k**2
    }
    plain = sl.simulate(RIG, start, periods=PERIODS, samples=5, values=values)
    other = sl.simulate(
        RIG, (start[0] * k, start[1] * k), periods=PERIODS, samples=5, values={**values, **scaled}
    )
    assert int(other.mode_violations) == 0
    if not _near_a_graze(plain):
        _same(plain, other, length=k)
        assert str(other.status.values) == "ok"
        assert abs(int(other.steps) - int(plain.steps)) <= 1


@given(values=rigs(), start=starts, power=st.integers(-40, 40))
def test_unit_of_mass(values, start, power):
    """Masses in units of 2^k kg, stiffnesses and forces with them: the same motion to the bit."""
    k = 2.0**power
    scaled = {name: values[name] * k for name in ("contact_stiffness", "force", "cubic")}
    plain = sl.simulate(RIG, start, periods=PERIODS, samples=5, values=values)
    other = sl.simulate(
        RIG, start, periods=PERIODS, samples=5, values={**values, **scaled, "mass": 3.0 * k}
    )
    assert {n: c for n, c in bits(other).items() if n != "mass"} == bits(plain)


@given(
    values=st.fixed_dictionaries(
        {
            "spring": numbers(0.0, 4.0), "damping": numbers(0.0, 0.2), "cubic": numbers(0.0, 1.0),
            "force": numbers(0.0, 3.0),
            "lift": numbers(-1.0, 1.0), "boundary": numbers(-0.5, 1.0),
            "stiffness": numbers(0.0, 1e3), "frequency": numbers(0.05, 1.0),
        }
    ),
    start=st.tuples(numbers(-2.0, 2.0), numbers(-2.0, 2.0)),
    power=st.integers(-20, 20),
)  # fmt: skip
def test_unit_of_time(values, start, power):
    """Times in units of 2^k s: rates scale with 2^-k, accelerations with 4^-k, displacements and
    sides stay.
    """
    k = 2.0**power
    once, twice = ("damping", "frequency"), ("spring", "cubic", "force", "lift", "stiffness")
    scaled = {**values, **{n: values[n] / k for n in once}, **{n: values[n] / k**2 for n in twice}}
    plain = sl.simulate(bent, start, periods=PERIODS, samples=5, values=values)
    other = sl.simulate(bent, (start[0], start[1] / k), periods=PERIODS, samples=5, values=scaled)
    assert str(other.status.values) == str(plain.status.values)
    if not _near_a_graze(plain):
        _same(plain, other, time=k)


# -- mirror ----------------------------------------------------------------------------------------
@given(values=rigs(), start=starts)
@example(values={**RIG.values, "lower_gap": 0.0}, start=(0.0, 0.0))
@example(values={**RIG.values, "lower_gap": 4e-4}, start=(4e-4, 0.0))
def test_mirror(values, start):
    """x -> -x with the gaps exchanged and the force turned round: the same bits with the other
    sign, the other guards, the other bits.
    """
    mirrored = {
        **values,
        "lower_gap": values["upper_gap"],
        "upper_gap": values["lower_gap"],
        "force": -values["force"],
    }
    plain = sl.simulate(RIG, start, periods=PERIODS, samples=5, values=values)
    other = sl.simulate(RIG, (-start[0], -start[1]), periods=PERIODS, samples=5, values=mirrored)
    assert (other.x.values == -plain.x.values).all()
    assert (other.v.values == -plain.v.values).all()
    assert (other.contact_time.values == plain.contact_time.values).all()
    twin = {"lower_gap": "upper_gap", "upper_gap": "lower_gap"}
    assert [(twin[c.guard], -c.direction, c.kind) for c in contacts(other)] == [
        (c.guard, c.direction, c.kind) for c in contacts(plain)
    ]
    swapped = plain.mode.values  # bit 0: above the lower boundary, bit 1: above the upper one
    moving = (plain.x.values != values["upper_gap"]) & (plain.x.values != -values["lower_gap"])
    assert (other.mode.values == (1 - (swapped >> 1 & 1)) + 2 * (1 - (swapped & 1)))[moving].all()


@given(values=rigs(), start=starts)
def test_mirror_by_half_a_period(values, start):
    """The force turned round is the force half a period later: the mirror image started at T/2.
    Times agree to rounding.
    """
    mirrored = {**values, "lower_gap": values["upper_gap"], "upper_gap": values["lower_gap"]}
    half = 0.5 / values["frequency"]
    plain = sl.simulate(RIG, start, periods=2, samples=1, values=values)
    other = sl.simulate(
        RIG, (-start[0], -start[1]), periods=2, samples=1, t_start=half, values=mirrored
    )
    if _near_a_graze(plain):
        return
    assert np.abs(other.x.values + plain.x.values).max() < 1e-13
    assert (
        np.abs(other.contact_time.values - half - plain.contact_time.values).max(initial=0) < 1e-11
    )


# -- origin of time --------------------------------------------------------------------------------
@given(values=rigs(), start=starts, whole=st.integers(-10_000, 10_000))
def test_shift_by_whole_periods(values, start, whole):
    """Started n periods later: the same motion, to what rounding of t_start means for the phase."""
    begin = whole / values["frequency"]
    plain = sl.simulate(RIG, start, periods=2, samples=1, values=values)
    other = sl.simulate(RIG, start, periods=2, samples=1, t_start=begin, values=values)
    if _near_a_graze(plain):
        return
    slack = 1e-14 + abs(whole) * 1e-17
    assert np.abs(other.x.values - plain.x.values).max() < slack
    assert np.abs(other.contact_time.values - begin - plain.contact_time.values).max(
        initial=0
    ) < 1e-11 + 4 * np.spacing(abs(begin))


# -- company ---------------------------------------------------------------------------------------
@given(
    values=st.lists(rigs(), min_size=2, max_size=20),
    start=st.lists(starts, min_size=20, max_size=20),
    seed=st.integers(0, 2**32 - 1),
)
def test_permutation(values, start, seed):
    """Any rigs, each with its own values, in any order: the same bits."""
    count = len(values)
    columns = {name: np.array([rig[name] for rig in values]) for name in values[0]}
    place = {
        "x": np.array([s[0] for s in start[:count]]),
        "v": np.array([s[1] for s in start[:count]]),
    }
    order = np.random.default_rng(seed).permutation(count)
    plain = sl.simulate(RIG, place, periods=PERIODS, samples=3, values=columns)
    other = sl.simulate(
        RIG,
        {n: a[order] for n, a in place.items()},
        periods=PERIODS,
        samples=3,
        values={n: a[order] for n, a in columns.items()},
    )
    assert [bits(other, i) for i in range(count)] == [bits(plain, int(i)) for i in order]
