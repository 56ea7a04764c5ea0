"""The table of a map of basins: what it says of attractors that errors of the method blur, and of
starts that they keep from settling.
"""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest

import made_results
from saltus.results import AttractorTable
from saltus.results.files.sheets import write_table
from saltus.results.kinds.basins import rows

SCATTER = 4.3e-6 / 3
TABLE = AttractorTable(
    kind=["periodic", "periodic"], period=np.array([3, 24]), contacts=np.array([8.0, 60.0]),
    itinerary=["", ""],
    peak=np.array([1e-3, 8e-4]), rms=np.array([5e-4, 3e-4]),
    margin=np.array([1e-4, 5e-6]), multipliers=np.full((2, 2), 0.5 + 0j),
    exponent=np.array([-0.9, -0.2]),
    exponent_error=np.zeros(2), points=[np.zeros((3, 2)), np.zeros((24, 2))],
    fractions=(np.array([0.75, 0.25]), np.array([0.7, 0.2]), np.array([0.8, 0.3])),
)  # fmt: skip
NOISY = dataclasses.replace(
    TABLE, kind=["periodic", "noisy_periodic"], scatter=np.array([math.nan, SCATTER])
)


def made(table=TABLE, basin=((0, 0), (0, 1)), **attrs):
    basin = np.array(basin)
    trust = {
        "smallest_basin_seen": 0.1,
        "flip_checked": 0,
        "uncertainty_exponent": math.nan,
        "unresolved_cells": 0,
        "method": "ODE45",
    }
    (table,) = rows("made up", made_results.basins(
        states=("x", "v"), units={"x": "m", "v": "m/s"},
        axes={"x": np.array([0.0, 1.0]), "v": np.array([0.0, 1.0])}, basin=basin,
        periods_to_settle=0 * basin, status=0 * basin + 2, status_meanings={2: "ok"},
        grazes_unresolved=0 * basin, attractors=table,
        gap_unit="m", attrs={**trust, "unsettled_cells": int((basin < 0).sum()), **attrs},
    ))  # fmt: skip
    return table


def test_a_noisy_attractor_has_a_name_a_scatter_with_its_unit_and_a_note(tmp_path):
    table = made(NOISY)
    column = table.columns.index("scatter x")
    assert [row[1] for row in table.rows] == ["3T", "noisy 24T"]
    assert [row[column] for row in table.rows] == ["-", "1.4 µm"]
    assert any(note.startswith("Noisy: errors of the method") for note in table.notes)
    frame = pd.read_csv(write_table(table, tmp_path / "table.csv"), comment="#")
    assert frame["scatter x [m]"].iloc[1] == SCATTER
    assert math.isnan(frame["scatter x [m]"].iloc[0])


def test_without_noise_there_is_no_word_of_it():
    assert "scatter x" not in made().columns
    assert not any("Noisy" in note for note in made().notes)


@pytest.mark.parametrize(
    ("attrs", "words"),
    [
        ({"unconverged_exactly": "24T", "unconverged_stray": 0.314}, "settles to 24T, and ode45 "
            "strays from there by up to 31%"),
        ({"unconverged_exactly": "", "unconverged_stray": math.nan}, "By exact integration from "
            "where they stand they settle to no orbit"),
        ({}, "Errors of ode45 itself can keep a motion from settling."),
        ({"method": "Taylor"}, "1 starts lead to no known attractor within the periods allowed."),
    ],
)  # fmt: skip
def test_starts_that_never_settled_are_told_with_what_errors_have_to_do_with_it(attrs, words):
    (note,) = [
        note
        for note in made(basin=((0, 0), (-2, 1)), **attrs).notes
        if "no known attractor" in note
    ]
    assert words in note
    assert ("ode45" in note) == (
        attrs.get("method") != "Taylor" and attrs.get("unconverged_exactly") != ""
    )
