"""The tangent flow: determinants by Liouville's rule, published multipliers, finite differences
where the force jumps.
"""

import csv
import math
import runpy
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from function_maps import attracts, orbit_near
from jumps import jumping
from saltus.flow.maps import Stroboscope

REFERENCE = Path(__file__).parents[1] / "reference"
ORBITS = list(csv.DictReader((REFERENCE / "orbits.csv").open()))
SCALE = np.array([1e-3, 0.1])


def rig_of(row):
    return sl.models.delangre(
        "c", force=float(row["p_N"]), frequency=float(row["f_Hz"]),
        contact_stiffness=float(row["Kc_N_per_m"]),
        lower_gap=float(row["j1_m"]), upper_gap=float(row["j2_m"]),
    )  # fmt: skip


def multipliers_of(row):
    texts = row["floquet_multipliers"].replace(" ", "").replace("i", "j").split(";")
    return np.sort_complex([complex(text.strip("()")) for text in texts])


@pytest.mark.parametrize("row", ORBITS, ids=lambda row: row["name"])
def test_multipliers_and_determinant_of_published_orbits(row):
    stroboscope = Stroboscope(rig_of(row), sl.Taylor())
    n, start = int(row["period_in_T"]), np.array([[float(row["x0_m"]), float(row["v0_m_per_s"])]])
    end, monodromy = stroboscope.tangent(start, n)
    assert np.abs(end - start).max() < 1e-14
    assert (
        np.abs(np.sort_complex(np.linalg.eigvals(monodromy[0])) - multipliers_of(row)).max() < 1e-12
    )
    damping = 2 * 0.03 * 2 * math.pi * 5.0
    assert (
        abs(np.linalg.det(monodromy[0]) / math.exp(-damping * n / float(row["f_Hz"])) - 1) < 1e-13
    )


@pytest.mark.parametrize("row", ORBITS, ids=lambda row: row["name"])
def test_newton_finds_the_orbit_from_nearby(row):
    exact = np.array([float(row["x0_m"]), float(row["v0_m_per_s"])])
    n = int(row["period_in_T"])
    orbit = orbit_near(Stroboscope(rig_of(row), sl.Taylor()), exact + 1e-3 * SCALE, 2 * n, SCALE)
    assert orbit.period == n  # asked for twice the period, it finds the smallest
    assert np.abs(orbit.points - exact).max(axis=1).min() < 2e-14
    assert attracts(orbit)


def test_multipliers_by_ode45_agree_to_its_tolerance():
    row = next(row for row in ORBITS if row["name"] == "B4_15_P3")
    start = np.array([[float(row["x0_m"]), float(row["v0_m_per_s"])]])
    _, exact = Stroboscope(rig_of(row), sl.Taylor()).tangent(start, 3)
    _, matrix = Stroboscope(rig_of(row), sl.ODE45(1e-9, 1e-12)).tangent(start, 3)
    assert np.abs(matrix - exact).max() < 1e-5 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("method", "tolerance"),
    [(sl.Taylor(), 1e-8), (sl.ODE45(1e-11, 1e-13), 1e-6)],
    ids=["Taylor", "ODE45"],
)
def test_saltation_where_the_force_jumps_against_finite_differences(method, tolerance):
    starts = np.array([[0.9, 0.1], [-0.8, 0.3], [0.0, 1.0], [0.1, -1.4]])
    stroboscope = Stroboscope(jumping, method)
    _, matrix = stroboscope.tangent(starts, 2)
    _, met = stroboscope.sequences(starts, 2)
    assert min(map(len, met)) >= 4
    step = 1e-5
    for j in range(2):
        ahead, _ = stroboscope.sequences(starts + step * np.eye(2)[j], 2)
        behind, _ = stroboscope.sequences(starts - step * np.eye(2)[j], 2)
        slope = (ahead - behind) / (2 * step)
        assert np.abs(slope - matrix[:, :, j]).max() < tolerance * 100 * np.abs(matrix).max()


def test_without_the_jump_the_tangent_is_wrong():
    """The same system, its saltation left out: far from the finite differences, so the test above
    can fail.
    """
    start = np.array([[0.9, 0.1]])
    right = Stroboscope(jumping, sl.Taylor()).tangent(start, 2)[1]
    smooth = Stroboscope(jumping, sl.ODE45(1e-11, 1e-13, events="ignore")).tangent(start, 2)[1]
    assert np.abs(right - smooth).max() > 0.05 * np.abs(right).max()


def test_two_masses_against_finite_differences():
    chain = runpy.run_path(
        str(Path(__file__).parents[2] / "examples" / "two_masses" / "two_masses.py")
    )["rig"]
    size = len(chain.states)
    start = (
        1e-2
        * np.random.default_rng(1).standard_normal((2, size))
        * np.array([1.0, 30.0, 1.0, 30.0])
    )
    _, contacts = Stroboscope(chain, sl.Taylor()).sequences(start, 1)
    assert all(len(one) for one in contacts)
    _, matrix = Stroboscope(chain, sl.Taylor()).tangent(start, 1)
    assert np.isfinite(matrix).all()
    step = 1e-7
    end = np.stack(
        [Stroboscope(chain, sl.Taylor()).sequences(start + step * e, 1)[0] for e in np.eye(size)],
        axis=2,
    )
    back = np.stack(
        [Stroboscope(chain, sl.Taylor()).sequences(start - step * e, 1)[0] for e in np.eye(size)],
        axis=2,
    )
    assert np.abs((end - back) / (2 * step) - matrix).max() < 1e-5 * np.abs(matrix).max()


def row_of_masses(masses):
    """Masses in a row between springs; the first beats against a spring, the second against one
    under load, whose force begins at once.
    """

    @sl.system(states=" ".join(f"{name}{i}" for name in "xv" for i in range(masses)), forced_at="f")
    def row(t, *y, k=50.0, c=0.1, stiffness=500.0, gap=0.1, load=2.0, f=1.0, force=6.0):
        x, v = y[:masses], y[masses:]
        stops = [stiffness * (x[0] - gap), load + stiffness * (x[1] - gap)]
        rates = [force * sl.cos(2 * sl.pi * f * t)] + [0.0] * (masses - 1)
        for i in range(masses):
            left, right = (x[i - 1] if i else 0.0), (x[i + 1] if i + 1 < masses else 0.0)
            rates[i] += k * (left - 2 * x[i] + right) - c * v[i]
            rates[i] -= sl.piecewise((stops[i], x[i] > gap), otherwise=0) if i < 2 else 0.0
        return (*v, *rates)

    return row


@pytest.mark.parametrize("method", [sl.Taylor(), sl.ODE45(1e-10, 1e-12)], ids=["Taylor", "ODE45"])
def test_six_masses_against_finite_differences(method):
    """Every entry of a tangent with twelve columns, across contacts where the force jumps and where
    it doesn't.
    """
    row, start = row_of_masses(6), 0.3 * np.random.default_rng(3).standard_normal((1, 12))
    _, matrix = Stroboscope(row, method).tangent(start, 1)
    step = 1e-6 * np.concatenate([np.eye(12), -np.eye(12)])
    ends, met = Stroboscope(row, sl.Taylor()).sequences(start + step, 1)
    assert len(set(met[0].tolist())) == 4  # both stops, in and out
    assert all(len(one) == len(met[0]) for one in met)
    slopes = (ends[:12] - ends[12:]).T / 2e-6
    assert np.abs(slopes - matrix[0]).max() < 1e-5 * np.abs(matrix).max()
