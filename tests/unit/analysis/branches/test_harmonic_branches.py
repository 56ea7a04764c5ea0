"""Branches of motions of a few harmonics beside those of exact orbits."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.errors import ParameterError, SaltusError

STOP = sl.models.soft_stop()
with open(Path(__file__).parents[3] / "reference/backbones_hbm.csv") as table:
    KNOWN = {row["id"]: float(row["value"]) for row in csv.DictReader(table)}
RANGE = {"frequency": (1.38, 2.8)}
#: Folds of the exact branch: S01 and S03 of branches_soft_stop.csv.
FOLDS = (1.41029487283056, 2.64776845463872)
END = KNOWN["H10"], KNOWN["H11"]


def folds(ds):
    return np.sort(ds.event_frequency.values[ds.event_kind.values == "fold"])


@pytest.fixture(scope="module")
def balanced():
    return {
        count: sl.branches(
            STOP, RANGE, (1.5, 0.0), at=1, by=sl.HarmonicBalance(count), progress=False
        )
        for count in (3, 15)
    }


def test_folds_come_to_those_of_the_exact_branch(balanced):
    off = np.abs([folds(ds) - FOLDS for ds in balanced.values()])
    # forces with a kink: at least the second order; the contact at the lower fold, beside a graze,
    # is so short that its harmonics fall late
    assert off[1, 1] < off[0, 1] / 25
    assert off[1, 0] < off[0, 0]


def test_distance_to_the_exact_orbit_falls_by_its_order(balanced):
    """A force with kinks has harmonics that fall as k^-2, a deflection k^-4, a velocity k^-3: cut
    off behind H they are off by H^-3 and H^-2 at worst.
    """
    for ds in balanced.values():
        assert np.isfinite(ds.point_error.values).mean() > 0.95
    off = [
        np.nanmedian(ds.point_output_error.values[ds.point_contacts > 0], axis=0)
        for ds in balanced.values()
    ]
    order = np.log(off[0] / off[1]) / np.log(5)
    assert np.abs(order - [3, 2]).max() < 0.5


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def curved(t, x, v, *, power=1.5, w=0.8):
    return v, sl.cos(w * t) - 0.2 * v - x - sl.hertz(x - 0.3, stiffness=4.0, exponent=power)


@pytest.mark.slow
@pytest.mark.parametrize("power", [0.25, 1.5])
def test_order_by_the_power_of_a_depth(power):
    """Harmonics of the force fall as k^-(power + 1): deflections are off by H^-(power + 2),
    velocities by H^-(power + 1).
    """
    few, many = (
        sl.branches(
            curved.with_values(power=power), {"w": (0.7, 0.9)}, (0, 0), at=1, points=8, switch=(),
            by=sl.HarmonicBalance(harmonics), progress=False,
        ).point_output_error.max("point")
        for harmonics in (20, 80)
    )  # fmt: skip
    order = np.log(few / many) / np.log(4)
    assert np.abs(order - [power + 2, power + 1]).max() < 0.15


@pytest.mark.parametrize(("model", "order"), [("chain", 2), ("gear_pair", 2), ("den_hartog", 1)])
def test_models_come_to_their_exact_orbits(model, order):
    """Velocities by H^-2 where forces have kinks, by H^-1 where they jump."""
    system = getattr(sl.models, model)()
    over = {system.forced_at: system.values[system.forced_at] * np.array([0.999, 1.001])}
    few, many = (
        sl.branches(
            system, over, np.zeros(len(system.states)), at=1, points=2, switch=(), progress=False,
            by=sl.HarmonicBalance(harmonics),
        ).point_error.max()
        for harmonics in (15, 45)
    )  # fmt: skip
    assert np.log(few / many) / np.log(3) > order - 0.3


def test_distance_is_that_of_the_exact_orbit(balanced):
    ds = balanced[15]
    i = int(np.argmax(ds.point_peak.values * (ds.point_stable.values > 0)))
    system = STOP.with_values(frequency=float(ds.point_frequency[i]))
    start = np.array([float(ds.point_x[i, 0]), float(ds.point_v[i, 0])])
    run = sl.attractors(system, start[None], progress=False)
    apart = np.abs(run.attractor_peak.values - float(ds.point_peak[i])).min()
    assert 0 < apart <= float(ds.point_output_error.sel(output="x")[i])


def test_harmonics_are_those_of_the_motion(balanced):
    ds = balanced[15].isel(point=5)
    c = ds.point_harmonic_real.values + 1j * ds.point_harmonic_imag.values
    assert np.hypot(c[0, 0].real, np.linalg.norm(c[0, 1:]) / np.sqrt(2)) == pytest.approx(
        float(ds.point_rms), rel=1e-13
    )
    rate = float(ds.point_frequency)
    velocity = 1j * np.arange(16) * rate * c[0]
    assert np.abs(c[1] - velocity).max() < 1e-13 * np.abs(velocity).max()


def test_events_of_two_masses():
    """The exact fold is at 0.6534401345 (NLvib, example 03)."""
    found = sl.branches(
        sl.models.two_masses(), {"frequency": (0.648, 0.66)}, at=1,
        by=sl.HarmonicBalance(7), points=30, progress=False,
    )  # fmt: skip
    assert np.abs(folds(found) - 0.6534401345).min() < 1e-9


def beam():
    """A chain of eight masses with two stops, four of its modes kept."""
    size = 8
    stiffness = 1e4 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    return sl.structure(
        np.eye(size), stiffness, modes=4, damping_ratio=0.02, frequency="5 Hz", name="chain",
        contacts=[sl.Contact("x8", stiffness="30 kN/m", gap="1 mm"),
                  sl.Contact("x4", stiffness="20 kN/m", gap="1.5 mm", side="both")],
        forces=[sl.Force("x3", "8 N"), sl.Force("x1", "3 N", harmonic=2, phase="30 deg")],
    )  # fmt: skip


def test_a_structure_is_condensed_to_its_contacts():
    """The same motion with the deflections at the contacts for unknowns as with all modes."""
    system = beam()
    found = sl.branches(
        system, {"frequency": ("5 Hz", "5.6 Hz")}, at=1, by=sl.HarmonicBalance(9), points=12,
        switch=(), progress=False,
    )  # fmt: skip
    whole = HarmonicOrbits(replace(system, interfaces=None), ("frequency",), 9, 1, np.ones((1, 1)))
    few = HarmonicOrbits(system, ("frequency",), 9, 1, np.ones((1, 1)))
    assert (whole.count, few.count) == (4, 2)
    assert (found.point_contacts > 0).any()
    c = found.point_harmonic_real.values + 1j * found.point_harmonic_imag.values
    for i in (0, -1):
        states = np.concatenate([c[i, :4].real, -c[i, :4, 1:].imag], axis=1)
        z = np.append(states, float(found.point_frequency[i]))
        whole.scale = np.append(np.full(whole.size, np.abs(states).max()), 1.0)[None]
        residual = whole.evaluate(z[None], np.zeros(1, int))[0]
        assert np.abs(residual).max() < 1e-11


def test_subharmonic_motions():
    off = []
    for count in (12, 36):
        found = sl.branches(
            sl.models.bilinear_rig(), {"frequency": (0.83, 0.86)}, at=1, start=(0.1, 0.8), points=4,
            by=sl.HarmonicBalance(count, periods=2), progress=False,
        )  # fmt: skip
        assert (found.branch_periods == 2).all()
        assert (np.abs(found.point_harmonic_real.sel(output="x", harmonic=1)) > 1e-3).all()
        off.append(float(np.nanmedian(found.point_error)))
    assert off[1] < off[0] / 3


def test_branches_of_twice_the_period_leave():
    """The motions of 14 harmonics of half the frequency are those that start at an exact orbit of
    two periods, and come to the exact branch; the exact one leaves at 0.802033739.
    """
    rig, start, limits = sl.models.bilinear_rig(), (0.1, 0.8), {"frequency": (0.79, 0.81)}
    found = sl.branches(rig, limits, start, at=1, by=sl.HarmonicBalance(7), progress=False)
    assert found.branch_periods.values.tolist() == [1, 2]
    assert found.event_kind.values[0] == "period_doubling"
    assert found.branch_parent.values.tolist() == [-1, 0]
    assert (found.branch_begin.values[1], found.branch_end.values[1]) == ("branch", "range")
    assert found.sizes["harmonic"] == 15
    double = found.isel(point=found.point_branch == 1)
    assert float(double.point_frequency.min()) == pytest.approx(0.802033739, abs=1e-3)
    direct = sl.branches(
        rig, {"frequency": (0.8, 0.81)}, start, at=1, progress=False,
        by=sl.HarmonicBalance(14, periods=2),
    )  # fmt: skip
    peaks = [one.point_peak.values[one.point_frequency.values.argmax()] for one in (double, direct)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-12)
    single = found.isel(point=found.point_branch == 0)
    assert np.isnan(single.point_harmonic_real.values[..., 8:]).all()


def test_undamped_motions_are_found_from_rest():
    """By the describing function. The motion of a growing drive turns back before 1.7: only another
    one, in phase with the drive, is there.
    """
    for force in (1.0, 1.7, 3.0):
        found = sl.branches(
            STOP.with_values(damping=0.0, force=force), {"frequency": (1.5, 1.501)}, at=1, points=2,
            switch=(), by=sl.HarmonicBalance(1), progress=False,
        )  # fmt: skip
        amplitude = np.hypot(*(
            one.sel(output="x", harmonic=1).values
            for one in (found.point_harmonic_real, found.point_harmonic_imag)
        ))  # fmt: skip
        edge = np.minimum(1.0 / amplitude, 1.0)
        stop = (np.arccos(edge) - edge * np.sqrt(1 - edge**2)) * 2 / np.pi
        stiffness = 1 - found.point_frequency.values**2 + 9 * stop
        assert np.abs(stiffness * amplitude) == pytest.approx(force, rel=1e-12)


def test_what_is_refused_says_why():
    hb = sl.HarmonicBalance(3)
    for system, words in (
        (sl.models.impact_oscillator(), "rigid stop"),
        (sl.models.jenkins_oscillator(), "memory"),
        (sl.models.bang_bang(), "time alone decides"),
        (sl.models.aeroelastic(), "no forcing"),
    ):
        name = next(iter(system.values))
        with pytest.raises(ParameterError, match=words):
            sl.branches(system, {name: (0.9, 1.1)}, by=hb)
    with pytest.raises(ParameterError, match="HarmonicBalance"):
        sl.branches(STOP, RANGE, by="harmonics")
    for wrong in ({"harmonics": 0}, {"harmonics": 2.5}, {"harmonics": 10**6}, {"H": 3}):
        with pytest.raises(SaltusError):
            sl.HarmonicBalance(**wrong)


def test_several_results_in_one_picture(balanced):
    ax = sl.plot.branches(list(balanced.values()))
    named = {text.get_text() for text in ax.get_legend().get_texts()}
    assert named >= {"3 harmonics", "15 harmonics"}
    with pytest.raises(ParameterError, match="branches"):
        sl.plot.branches({"a": balanced[3], "b": 3})


@sl.system(states="x v")
def duffing(t, x, v, *, cubic=1.0):
    return v, -x - cubic * x**3


@pytest.mark.parametrize(("row", "cubic", "single"), [
    ("H01", 0.1, 1.03682206766639), ("H03", 1.0, 1.3228756555323),
])  # fmt: skip
def test_backbones_of_the_duffing_oscillator(row, cubic, single):
    """The exact one by many harmonics; by one the frequency sqrt(1 + 3/4 cubic amplitude^2)."""
    for count, known in ((1, single), (13, KNOWN[row])):
        found = sl.backbone(
            duffing.with_values(cubic=cubic), (0.5, 1.0), by=sl.HarmonicBalance(count),
            progress=False,
        )  # fmt: skip
        angular = 2 * np.pi * float(found.backbone_frequency[-1])
        assert angular == pytest.approx(known, rel=2e-13)
    assert float(found.point_error[-1]) < 1e-11


def test_distance_from_a_fast_free_vibration():
    """Of one harmonic from Jacobi's elliptic functions that pass rest with the same velocity: its
    frequency is ten times that of small vibrations.
    """
    from scipy.special import ellipj, ellipk

    cubic = 250.0
    found = sl.backbone(
        duffing.with_values(cubic=cubic), (0.5, 1.0), by=sl.HarmonicBalance(1), progress=False
    )
    rate = np.sqrt(1 + 0.75 * cubic)  # by one harmonic, amplitude 1
    square = (np.sqrt(1 + 2 * cubic * rate**2) - 1) / cubic  # of the exact amplitude
    share = cubic * square / (2 * (1 + cubic * square))
    angle = 2 * np.pi * np.arange(2000) / 2000
    sn, _, dn, _ = ellipj(4 * ellipk(share) * (angle / (2 * np.pi) + 0.75), share)
    velocity = -np.sqrt((1 + cubic * square) * square) * sn * dn  # passes rest at an angle of zero
    off = np.abs(velocity - rate * np.cos(angle)).max() / np.ptp(velocity)
    assert float(found.point_error[-1]) == pytest.approx(off, rel=1e-3)


def test_quadrature_of_few_harmonics():
    """Of one harmonic the stiffness of the describing function, and a force that the damper takes;
    of more, the exact family.
    """
    limits, given = (0.9, 2.0), {"phase": "quadrature", "progress": False}
    exact = sl.backbone(STOP, limits, **given)
    ends = {}
    for count in (1, 5, 15):
        found = sl.backbone(STOP, limits, by=sl.HarmonicBalance(count), **given)
        ends[count] = np.array([found.point_frequency.values[-1], found.point_force.values[-1]])
        assert float(found.point_error[0]) < 1e-12  # no contact yet
    edge = 0.5
    stiffness = 1 + 9 * (np.arccos(edge) - edge * np.sqrt(1 - edge**2)) * 2 / np.pi
    frequency = np.sqrt(stiffness)
    assert ends[1] == pytest.approx([frequency, 0.1 * frequency * 2.0], rel=1e-12)
    known = np.array([exact.point_frequency.values[-1], exact.point_force.values[-1]])
    off = {count: np.abs(one / known - 1).max() for count, one in ends.items()}
    assert off[1] > 25 * off[5] > 25**2 * off[15] / 2


def test_end_of_the_resonance_in_one_harmonic():
    """H10, H11: the largest amplitude of NLvib's example 01 is there, and nowhere beside it."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def forced(t, x, v, *, damping=0.05, cubic=0.1, force=0.18, w=1.0):
        return v, force * sl.cos(w * t) - damping * v - x - cubic * x**3

    orbits, (amplitude, w) = HarmonicOrbits(forced, ("w",), 1, 1, np.ones((1, 4))), END
    lag = np.arctan2(0.05 * w, 1 + 0.075 * amplitude**2 - w**2)
    series = amplitude * np.array([0.0, np.cos(lag), np.sin(lag)])
    residual, derivative = orbits.evaluate(np.append(series, w)[None], np.zeros(1, int))
    assert np.abs(residual).max() < 1e-14
    along = np.linalg.svd(derivative[0])[2][-1]
    assert abs(along[:3] @ series) < 1e-13


def test_as_many_harmonics_as_the_error_asks_for():
    found = sl.branches(
        STOP, {"frequency": (1.45, 1.6)}, (1.5, 0.0), at=1, progress=False,
        by=sl.HarmonicBalance("auto", accuracy=4e-3),
    )  # fmt: skip
    assert found.attrs["harmonics"] == 11
    assert float(np.nanmax(found.point_error)) < 4e-3
    few = sl.branches(
        STOP, {"frequency": (1.45, 1.6)}, (1.5, 0.0), at=1, progress=False, by=sl.HarmonicBalance(5)
    )
    assert float(np.nanmax(few.point_error)) > 4e-3


def test_residual_deflections_keep_the_flexibility():
    """The compliance at a contact beside that of the whole matrices, by a sparse factorisation."""
    from saltus.analysis.harmonics.signals import AtContacts

    size, at = 60, 45
    stiffness = 1e6 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    damping = 2e-4 * stiffness
    off = []
    for residual in (False, True):
        system = sl.structure(
            np.eye(size), stiffness, damping, modes=6, residual=residual, frequency="3 Hz",
            contacts=[sl.Contact(f"x{at + 1}", stiffness="1 kN/m", gap="1 mm")],
            forces=[sl.Force("x5", "1 N")],
        )  # fmt: skip
        rate = 2 * np.pi * 3.0
        real, imaginary = AtContacts(system).response(5, rate)[0][:, :, 0]
        found = real + 1j * imaginary
        loads = np.eye(size)[:, [at, 4]]
        for order, row in enumerate(found):
            w = order * rate
            whole = np.linalg.solve(stiffness - w**2 * np.eye(size) + 1j * w * damping, loads)
            off.append(np.abs(row / whole[at] - 1).max())
    assert max(off[6:]) < max(off[:6]) / 100
    assert off[6] < 1e-12  # static: nothing is lost
    with pytest.raises(ParameterError, match="modes="):
        sl.structure(np.eye(2), stiffness[:2, :2], residual=True)
