"""Branches of motions of a few harmonics beside those of exact orbits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.errors import ParameterError, SaltusError

STOP = sl.models.soft_stop()
RANGE = {"frequency": (1.38, 2.8)}
#: Folds of the exact branch: S01 and S03 of branches_soft_stop.csv.
FOLDS = (1.41029487283056, 2.64776845463872)


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
        progress=False,
    )  # fmt: skip
    whole = HarmonicOrbits(replace(system, interfaces=None), "frequency", 9, 1, np.ones((1, 1)))
    few = HarmonicOrbits(system, "frequency", 9, 1, np.ones((1, 1)))
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
