"""Sizes over two parameters, and shares of basins over one, as pictures."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection, QuadMesh
from scipy.stats import binomtest

import made_results
from made_results import Responses, Starts
from saltus.errors import ParameterError
from saltus.plot import amplitude_map, motion_colors, shares
from saltus.plot.unsettled import UNSETTLED
from saltus.results import AttractorTable

from .responses_data import PROVENANCE, UNITS, kinds_map, resonance


def sized():
    """A map over two parameters whose peak is 1 mm (1 + 2 i + j / 7) at the cell (i, j)."""
    ds = kinds_map()
    i, j = (axis.ravel() for axis in np.meshgrid(range(40), range(30), indexing="ij"))
    return ds.assign(response_peak=("response", 1e-3 * (1 + 2 * i + j / 7), ds.response_peak.attrs))


def hatched(ax):
    """The collection of each hatched kind, by its code."""
    return {
        int(one.get_gid().removeprefix("kind ")): one
        for one in ax.collections
        if isinstance(one, PolyCollection) and str(one.get_gid()).startswith("kind ")
    }


def test_each_cell_has_the_colour_of_its_size_and_the_hatching_of_its_kind():
    ds = sized()
    ax = amplitude_map(ds)
    bar = ax.figure.axes[1]
    assert bar.get_title(loc="left") == "peak |x| [mm]"
    (mesh,) = (one for one in ax.collections if isinstance(one, QuadMesh))
    painted = mesh.get_array().reshape(30, 40, 3)
    scale = next(one for one in bar.collections if isinstance(one, QuadMesh))
    reached = ds.response_of.values[..., 0]
    code = np.where(reached < 0, reached, motion_colors.of(ds)[reached])
    centres = np.stack(np.meshgrid(ds.frequency, ds.contact_stiffness, indexing="ij"), axis=-1)
    kinds = hatched(ax)
    assert set(kinds) == set(range(2, 10)) | {motion_colors.CHAOTIC}
    inside = {key: np.zeros((40, 30), int) for key in kinds}
    for key, boxes in kinds.items():
        for path in boxes.get_paths():
            inside[key] += path.contains_points(centres.reshape(-1, 2)).reshape(40, 30)
    for key, count in inside.items():
        np.testing.assert_array_equal(count, code == key)
    size = 1 + 2 * np.arange(40)[:, None] + np.arange(30) / 7
    largest = size[reached >= 0].max()
    assert bar.get_ylim() == pytest.approx((0.0, largest))
    expected = np.round(255 * scale.cmap(size / largest)[..., :3])
    for left, look in UNSETTLED.items():
        expected[code == left] = [int(look.color[k : k + 2], 16) for k in (1, 3, 5)]
    np.testing.assert_array_equal(painted, expected.swapaxes(0, 1))


def test_what_fits_no_map_of_sizes_is_refused():
    ds = sized()
    for call, says in (
        (lambda: amplitude_map(ds, start=3), "there is no start 3"),
        (lambda: amplitude_map(ds, output="w"), "has no output 'w'"),
        (lambda: amplitude_map(ds, quantity="loud"), "quantity='loud'"),
        (lambda: amplitude_map(ds, quantity="amplitud"), "Did you mean 'amplitude'?"),
        (lambda: amplitude_map(ds, bifurcations=[]), "has no curves"),
        (lambda: amplitude_map(ds, bifurcations=ds), r"\(bifurcations=\) takes"),
        (lambda: amplitude_map(resonance(20)), "two parameters"),
        (
            lambda: amplitude_map(ds.assign(response_peak=-ds.response_peak), log=True),
            "isn't above zero",
        ),
    ):
        with pytest.raises(ParameterError, match=says):
            call()


def mixed(count=12, starts=40):
    """Starts that lead to more and more of one T branch, fewer of another, a 3T branch at some
    values, and nothing.
    """
    f = np.linspace(10.0, 21.0, count)
    reached, rows = np.full((count, starts), -1), []
    shares_of = []
    for i in range(count):
        counts = (3 * i, 5 if i > 5 else 0, starts - 3 * i - (5 if i > 5 else 0) - i % 2)
        shares_of.append(counts)
        first = 0
        for branch, many in zip((2, 7, 1), counts, strict=True):
            if many:
                reached[i, first : first + many] = len(rows)
                rows.append((i, branch))
                first += many
    place, branch = (np.array(column) for column in zip(*rows, strict=True))
    m = len(rows)
    peak = np.where(branch == 2, 1e-3, np.where(branch == 7, 5e-4, 4e-3))
    table = AttractorTable(
        kind=["periodic"] * m, period=np.where(branch == 7, 3, 1), contacts=np.ones(m),
        itinerary=[""] * m, peak=peak, rms=peak, margin=np.ones(m),
        multipliers=np.ones((m, 2)), exponent=np.ones(m), exponent_error=np.ones(m),
        points=[np.zeros((1, 2))] * m,
    )  # fmt: skip
    ds = made_results.responses(
        states=("x", "v"), units=UNITS, axes={"frequency": f},
        starts=Starts({"x": np.zeros(starts), "v": np.zeros(starts)}), response_of=reached,
        responses=Responses(table, place[:, None], branch), gap_unit="m",
        attrs=PROVENANCE | {"random_starts": 1},
    )  # fmt: skip
    return ds, np.array(shares_of)


def test_bands_are_as_high_as_shares_and_edges_have_wilsons_intervals():
    ds, counts = mixed()
    ax = shares(ds)
    names = [text.get_text() for text in ax.get_legend().get_texts()][::-1]
    assert names == [
        "T, to 1 mm (branch 2)", "T, to 4 mm (branch 1)", "3T, to 0.5 mm (branch 7)", "escaped"
    ]  # fmt: skip
    total = np.column_stack([counts[:, 0], counts[:, 2], counts[:, 1], 40 - counts.sum(axis=1)])
    named = {str(one.get_gid()): one for one in ax.collections}
    for k, name in enumerate(names):
        x, y = named[f"band {name}"].get_paths()[0].vertices.T
        for i, f in enumerate(ds.frequency.values):
            here = (x >= max(f - 0.5, 10.0)) & (x <= min(f + 0.5, 21.0))
            below = total[i, :k].sum() / 40
            assert np.isclose(y[here], below).any()
            assert np.isclose(y[here], below + total[i, k] / 40).any()
    for k, name in enumerate(names):
        strips = named[f"interval {name}"].get_paths()
        corners = np.concatenate([path.vertices for path in strips] or [np.zeros((1, 2))])
        for i, f in enumerate(ds.frequency.values):
            hits = int(total[i, : k + 1].sum())
            if total[i, k] == 0 or hits == 40:
                continue
            low, high = binomtest(hits, 40).proportion_ci(method="wilson")
            here = corners[np.abs(corners[:, 0] - f) <= 0.5 + 1e-9, 1]
            assert np.isclose(here, low).any()
            assert np.isclose(here, high).any()


def test_shares_need_random_starts_over_one_parameter():
    with pytest.raises(ParameterError, match="weren't drawn at random"):
        shares(resonance(20))
    with pytest.raises(ParameterError, match="responses over one parameter"):
        shares(kinds_map())
    ds, _ = mixed()
    with pytest.raises(ParameterError, match="quantity='mean' isn't known"):
        shares(ds, quantity="mean")
