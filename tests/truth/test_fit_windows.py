"""Fits through windows: what one motion from the start gives where it can be followed, and the
truth where it can't.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits import windows
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.motion import Motions
from saltus.analysis.fits.search import MisfitSearch
from saltus.analysis.fits.unknowns import Unknowns
from saltus.analysis.fits.verdict import verdict
from saltus.flow.methods import check_method

FREE = {"upper_gap": (1e-4, 2e-3), "contact_stiffness": (1e3, 1e5), "damping_ratio": (0.005, 0.1)}
#: A chaotic motion of the rig: over 240 periods roundings grow to its size.
CHAOTIC = {"upper_gap": 2.1466e-4, "contact_stiffness": 4.8169e4, "damping_ratio": 0.019154}
RIG = sl.models.delangre("a", force="4 N", frequency="8 Hz")


def made_up(truth, periods, seed):
    """A measurement with noise of 1 %, and its noise."""
    at = np.arange(1, periods * 24 + 1) / (24 * 8.0)
    exact = sl.simulate(RIG.with_values(**truth), at=at).x.values
    noise = 0.01 * np.sqrt(np.mean(exact**2))
    return at, exact + noise * np.random.default_rng(seed).standard_normal(len(at)), noise


def searched(at, x, free, noise):
    unknowns = Unknowns.of(RIG, free)
    data = measurement(RIG, {"t": at, "x": x}, missing=False)
    model = Motions.of(RIG, check_method(None, RIG), data, unknowns, (0, 0), 0.0, 1)
    return MisfitSearch(model, unknowns, data.values, np.full((len(at), 1), noise), 10_000)


def test_windows_give_what_one_motion_gives_where_it_can_be_followed(monkeypatch):
    # as the windows' ends meet, their starts are no unknowns: values and errors are the same
    free = FREE | {"v(0)": (-0.1, 0.1)}
    truth = {"upper_gap": 6e-4, "contact_stiffness": 2e4, "damping_ratio": 0.05}
    at, x, noise = made_up(truth, 12, 3)
    search = searched(at, x, free, noise)
    near = search.unknowns.shares(np.array([*truth.values(), 0.0])) + 0.003
    search.descend(near, None)
    search.descend(search.minima[0].shares, None)
    alone = search.minima[0]
    part = search.beginning(100)
    part.descend(near, None)
    monkeypatch.setattr(windows, "GROWTH", 2.0)
    search.best = search.at(search.unknowns.shares(np.array([5e-4, 3e4, 0.03, 0.05])))
    search.minima.clear()
    assert windows.shoot(search, part.minima[0], 1)
    assert search.windows > 5
    search.reweigh(np.full((len(at), 1), noise))
    said, expected = verdict(search.best), verdict(alone)
    assert said.error == pytest.approx(expected.error, rel=1e-3)
    assert np.abs((search.best.shares - alone.shares) / expected.error).max() < 0.02
    assert search.best.fitted == pytest.approx(alone.fitted, abs=0.02 * noise)


@pytest.mark.slow
def test_a_chaotic_history_of_240_periods_gives_the_values_that_made_it(monkeypatch):
    """Stopped in its third pass, the fit has what the second one has found."""
    at, x, noise = made_up(CHAOTIC, 240, 5)
    search = searched(at, x, FREE, noise)
    truth = search.unknowns.shares(np.array([*CHAOTIC.values()]))
    here = truth + 0.0005
    for count in (100, 250, 400):
        part = search.beginning(count)
        part.descend(here, None)
        here = part.minima[0].shares
    search.at(part.minima[0].shares)
    assert search.best.misfit > 25 * len(at)  # from the start it can't be followed
    shares, passes, fly_all = [], [], windows.Windows.passed

    def passed(self, *place):
        passes.append(self.doing)
        if len(passes) == 3:
            raise KeyboardInterrupt
        return fly_all(self, *place)

    with monkeypatch.context() as patch:
        patch.setattr(windows.Windows, "passed", passed)
        with pytest.raises(KeyboardInterrupt):
            windows.shoot(search, part.minima[0], 3, shares.append)
    assert (np.diff(shares) > 0).all()
    assert len(shares) > 20
    assert "pass 2 of" in passes[-1]
    assert search.windows > 20
    assert search.best.misfit < 25 * len(at)
    assert windows.shoot(search, part.minima[0], 3)
    assert search.windows > 20
    assert len(search.minima) == 3
    left = (search.best.fitted - x[:, None])[:, 0]
    assert np.std(left) == pytest.approx(noise, rel=0.05)
    search.reweigh(np.full((len(at), 1), noise))
    off = (search.best.shares - truth) / verdict(search.best).error
    assert np.abs(off).max() < 3.5
    assert np.abs(search.best.shares - truth).max() < 2e-3


@pytest.mark.slow
def test_a_fit_of_a_sensitive_motion_goes_through_windows_and_says_so():
    at, x, noise = made_up(CHAOTIC, 240, 74)
    free = {name: (0.9 * one, 1.1 * one) for name, one in CHAOTIC.items()}
    found = sl.fit(RIG.with_values(upper_gap=2e-4), {"t": at, "x": x}, free, starts=4)
    assert found.windows.item() > 20
    assert "fitted through" in str(sl.describe(found))
    assert found.noise.item() == pytest.approx(noise, rel=0.05)
    off = (found.value.values - [*CHAOTIC.values()]) / found.standard_error.values
    assert np.abs(off).max() < 3.5
