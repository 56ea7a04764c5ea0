"""Seeds of branches from starts: what a budget leaves out, and in what order values are run."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.grid import grid_of
from saltus.analysis.branches import run_seeds
from saltus.errors import SaltusWarning
from saltus.flow.methods import check_method


def chain(size=2):
    """Masses between springs, the last one before a rigid stop; natural frequencies 6 to 32 Hz."""
    stiffness = 1e4 * (2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    return sl.structure(
        np.eye(size), stiffness, frequency="13 Hz", damping_ratio="5 %", modes=size,
        contacts=[sl.Contact(f"x{size}", restitution=0.6, gap="5 mm")],
        forces=[sl.Force("x1", 5.0)],
    )  # fmt: skip


def seeds(system, count=8, periods=2000):
    grid = grid_of(system, {"frequency": np.linspace(11, 15, count)}, None, None, None, 1, None)
    return run_seeds.seeds_in(grid, check_method(None, system), periods)


def values(found):
    return sorted(round(float(one.others[-1]), 9) for one in found)


def test_where_the_budget_lasts_every_value_is_run(monkeypatch):
    whole, left = seeds(chain())
    assert left == 0
    assert values(whole) == np.linspace(11, 15, 8).round(9).tolist()
    monkeypatch.setattr(run_seeds, "SEEDING_WORK", 1e6)  # less than the worst case, more than these
    again, left = seeds(chain())
    assert left == 0
    assert values(again) == values(whole)


def test_beyond_the_budget_values_spread_over_the_range_are_left(monkeypatch):
    monkeypatch.setattr(run_seeds, "SEEDING_WORK", 1.0)
    found, left = seeds(chain())
    assert left == 4
    assert values(found) == np.linspace(11, 15, 8)[::2].round(9).tolist()


def test_a_warning_says_how_many_values_were_left(monkeypatch):
    monkeypatch.setattr(run_seeds, "SEEDING_WORK", 1.0)
    with pytest.warns(SaltusWarning, match="4 of 8 values of frequency weren't run for seeds"):
        found = sl.branches(chain(), {"frequency": (11, 15)}, at=8, progress=False)
    assert found.sizes["branch"] == 1  # the rest of it is followed


def test_a_size_larger_costs_what_its_states_squared_say(monkeypatch):
    """Twenty modes against two, of as many periods: a hundred times the work a period."""
    spent = {}
    counted = run_seeds._work
    for size in (2, 20):
        monkeypatch.setattr(
            run_seeds, "_work", lambda found, periods, size=size: spent.setdefault(
                size, counted(found, periods) / np.maximum(found.motions.settled, 1).sum()
            )
        )  # fmt: skip
        _, left = seeds(chain(size), count=1)
        assert left == 0
    assert spent[20] > 100 * spent[2] * 0.9
