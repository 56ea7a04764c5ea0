"""Benchmarks run, and rivals' labels of basins mean what ours mean. Rivals themselves are left out:
they take minutes.
"""

from pathlib import Path

import numpy as np
import pytest

from saltus.system.linearity import linear_pieces

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def basins():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        from benchmarks import basins

        yield basins


@pytest.fixture(scope="module")
def small_map(basins, few_scouts):
    return basins.ours(6, threads=1)


def test_our_part_runs(basins, small_map):
    seconds, ds = small_map
    assert seconds.cpu > 0
    assert seconds.wall > 0
    assert ds.basin.shape == (6, 6)
    row = basins.line("saltus, 1 thread", seconds, seconds, "", "all cells")
    assert row.count("|") == basins.line(
        "other", seconds.scaled(2.0), seconds, basins.percent(ds.basin.values >= 0), ""
    ).count("|")


def test_orbits_are_labelled_as_themselves_at_any_phase(basins, small_map):
    from benchmarks.rivals import known_orbits

    orbits = basins.orbits_of(small_map[1])
    points = np.stack([np.resize(np.roll(orbit, 7, axis=0), (48, 2)) for orbit in orbits])
    assert known_orbits.label(points, orbits).tolist() == list(range(len(orbits)))
    points[:, 20] += 2 * known_orbits.MATCH * known_orbits.RANGES
    assert (known_orbits.label(points, orbits) == -1).all()


def test_a_subset_leaves_out_starts_on_a_boundary(basins, small_map):
    on_boundary = small_map[1].assign_coords(x=np.linspace(-5e-3, 5e-3, 6) + 1e-3)
    assert 0.0 in on_boundary.x.values
    subset = basins.subset_of(on_boundary, 1000)
    assert len(subset.cells) == 30
    assert not (subset.x == 0.0).any()
    assert (subset.labels == small_map[1].basin.values.ravel()[subset.cells]).all()


@pytest.mark.parametrize("modes", [4, 60])
def test_rivals_move_the_same_beam(monkeypatch, modes):
    """With as many modes as degrees of freedom the matrix of shapes is square."""
    monkeypatch.syspath_prepend(ROOT)
    from benchmarks import structures

    squares, damping, shapes, push = structures.matrices(modes, 2)
    system = structures.structure(modes, 2)
    linear, values = linear_pieces(system), dict(system.values)
    gaps = linear.gaps(values)
    free = sum(1 << g for g, offset in enumerate(gaps.constant) if offset > 0)
    piece = linear.piece(values, free)
    assert np.abs(piece.matrix[modes:, :modes]) == pytest.approx(np.diag(squares))
    assert np.abs(piece.matrix[modes:, modes:]) == pytest.approx(np.diag(damping))
    assert np.abs(piece.driven[modes:, 0]) == pytest.approx(np.abs(push))
    assert np.abs(gaps.matrix[[0, 2], :modes]) == pytest.approx(np.abs(shapes))


def test_what_it_costs_to_begin(monkeypatch):
    monkeypatch.syspath_prepend(ROOT)
    from benchmarks import startup

    monkeypatch.setattr(startup, "PROGRAMS", {"nothing": "pass", "saltus": "import saltus"})
    monkeypatch.setattr(startup, "PERIODS", (2,))
    plain = startup.engine.run
    assert all(cpu > 0 and wall > 0 for _, cpu, wall in startup.processes(1))
    rows = startup.calls(2)
    assert [name for name, *_ in rows] == [
        '2 periods, time_errors="measured"',
        '2 periods, time_errors="local"',
    ]
    assert all(0 < inside < cpu and wall > 0 for _, cpu, inside, wall in rows)
    assert startup.engine.run is plain


@pytest.fixture
def releases(monkeypatch):
    monkeypatch.syspath_prepend(ROOT)
    from benchmarks import releases

    return releases


def test_a_release_has_one_row_a_machine(releases, monkeypatch, tmp_path):
    file = tmp_path / "releases.csv"
    assert releases.as_text(releases.kept(file)).startswith("no release")
    monkeypatch.setattr(releases, "MEASURED", {"map [s]": (lambda: 1.25, ".1f")})
    for version, machine in (("0.1", "a"), ("0.2", "a"), ("0.2", "b"), ("0.2", "a")):
        monkeypatch.setattr(releases.sl, "__version__", version)
        monkeypatch.setattr(releases, "machine", lambda machine=machine: machine)
        releases.keep(releases.measured(), file)
    rows = releases.kept(file)
    assert [(row["version"], row["machine"]) for row in rows] == [
        ("0.1", "a"),
        ("0.2", "b"),
        ("0.2", "a"),
    ]
    assert {row["map [s]"] for row in rows} == {"1.2"}
    assert releases.as_text(rows).splitlines()[1].split()[0] == "0.1"


def test_a_column_that_is_new_is_empty_in_older_rows(releases, tmp_path):
    file = tmp_path / "releases.csv"
    releases.keep({"version": "0.1", "machine": "a"}, file)
    releases.keep({"version": "0.2", "machine": "a", "map [s]": "1.2"}, file)
    assert [row["map [s]"] for row in releases.kept(file)] == ["", "1.2"]
    assert "1.2" in releases.as_text(releases.kept(file))


@pytest.mark.slow
def test_all_that_a_release_takes_can_be_measured(releases, monkeypatch, few_scouts):
    monkeypatch.setattr(releases.compile, "measured", lambda *_: (0.5, 0.6))  # takes long, else
    monkeypatch.setattr(releases.size, "SOURCE", releases.size.SOURCE / "cache")
    small = {"import [s]": (1,), "period [us]": (32,), "map [s]": (4,), "diagram [s]": (3,)}
    for name, (measure, form) in releases.MEASURED.items():
        assert float(format(measure(*small.get(name, ())), form)) > 0, name
