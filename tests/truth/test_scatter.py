"""Scatter against closed forms: quantiles of a linear system, Sobol indices of Ishigami's function,
the range in which a response exists.
"""

import numpy as np
import pytest

import saltus as sl

RIG = sl.models.delangre("a", force="4 N", frequency="15 Hz")
#: The fold at which the resonance of this rig ends, by continuation: sl.branches(RIG, {"frequency":
#: (12.0, 20.0)}, start=("5 mm", 0), at=15.0).
FOLD = 17.73408655


def test_quantiles_of_a_linear_system_are_the_closed_form():
    """The peak falls with the stiffness, so its quantiles are those of the stiffness, reversed."""
    linear = RIG.with_values(cubic=0, contact_stiffness=0, frequency=10.0)
    natural = sl.truncated(sl.normal("5 Hz", "0.5 Hz"), "3.5 Hz", "6.5 Hz")
    found = sl.scatter(linear, {"natural_frequency": natural}, samples=256, seed=20261126)

    def peak(hertz):
        w, wn = 2 * np.pi * 10.0, 2 * np.pi * hertz
        return 4.0 * (1 - 18 / w**2) / 3.0 / np.hypot(wn**2 - w**2, 2 * 0.03 * wn * w)

    drawn, number = found["value"].values[:, 0], found["number"].sel(outcome="x peak").values[:, 0]
    assert number == pytest.approx(peak(drawn), rel=1e-8)
    ends = [
        float(natural.values(np.array([one]), "Hz", "f")[0]) for one in found["quantile"].values
    ]
    exact, own = peak(np.array(ends)), found.sel(outcome="x peak").isel(start=0)
    low, high = own["quantile_low"].values, own["quantile_high"].values
    assert ((np.isnan(low) | (low <= exact)) & (np.isnan(high) | (exact <= high))).all()
    assert own["quantile_of"].values[1:-1] == pytest.approx(exact[1:-1], rel=0.01)


def test_a_response_exists_up_to_its_fold():
    found = sl.scatter(
        RIG, {"frequency": sl.uniform("15.5 Hz", "17.9 Hz")}, ("5 mm", 0), samples=32, seed=7
    )
    frequency, exists = found["value"].values[:, 0], found["exists"].values.astype(bool)
    period, reached = found["response_period"].values, found["response_of"].values[:, 0]
    peak = found["response_quantile"].sel(quantile=0.5, outcome="x peak").values
    resonant = int(np.argmax(np.where(period == 1, peak, 0.0)))
    clear = np.abs(frequency - FOLD) > 0.003
    assert (exists[clear, resonant] == (frequency < FOLD)[clear]).all()
    low, high = (float(found[f"probability_exists_{end}"][resonant]) for end in ("low", "high"))
    assert low < (FOLD - 15.5) / 2.4 < high
    assert np.count_nonzero(reached == resonant) > 3
    assert exists[np.arange(32), reached].all()


def test_sobol_indices_of_ishigamis_function():
    """Ishigami & Homma (1990): sin x + 7 sin^2 y + 0.1 z^4 sin x on (-pi, pi)^3."""

    def ask(_, values):
        x, y, z = values["damping_ratio"], values["cubic"], values["force"]
        return {"f": np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)}

    box = sl.uniform(-np.pi, np.pi)
    names = ("damping_ratio", "cubic", "force")
    found = sl.scatter(RIG, dict.fromkeys(names, box), ask=ask, samples=2048, indices=True, seed=3)
    first = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2
    both = 0.1**2 * np.pi**8 * (1 / 18 - 1 / 50)
    of_y = 7**2 / 8
    whole = first + both + of_y
    exact = {
        "first": np.array([first, of_y, 0.0]) / whole,
        "total": np.array([first + both, of_y, both]) / whole,
    }
    for word, known in exact.items():
        one = found[f"{word}_index"].values[0, 0]
        low, high = (found[f"{word}_index_{end}"].values[0, 0] for end in ("low", "high"))
        assert one == pytest.approx(known, abs=0.02)
        assert (low - 1e-3 <= known).all()
        assert (known <= high + 1e-3).all()
