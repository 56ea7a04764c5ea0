"""Tables: the same numbers as people read them, and as programs do."""

from __future__ import annotations

import math

import pandas as pd

from saltus.results.files.sheets import write_table
from saltus.results.table import Column, interval, number, quantity, table, with_error, words

THIRD = 1 / 3e3


def made():
    """A row with everything, and one with nothing."""
    return table(
        "made up",
        [
            words("", range(2), "trajectory"),
            words("motion", ["=T", "chaotic"]),
            quantity("rms", [THIRD, math.nan], "m"),
            number("peak", [-2.5, math.nan], ".2f", "m/s"),
            interval("contacts", [2.0, math.nan], [4.0, math.nan], "{:g}".format),
            with_error("exponent", [-0.5, math.nan], [0.001, math.nan], unit="1/s"),
        ],
        ["one note"],
    )


def test_the_screen_shows_what_people_write():
    assert made().columns == ("", "motion", "rms", "peak [m/s]", "contacts", "exponent [1/s]")
    assert made().rows[0] == ("0", "=T", "0.3333 mm", "-2.50", "2 to 4", "-0.5 ± 0.001")
    assert made().rows[1][2:] == ("-", "-", "-", "-")


def test_the_file_holds_every_digit_in_si(tmp_path):
    file = write_table(made(), tmp_path / "table.csv")
    assert file.read_text().splitlines()[:2] == ["# made up", "# one note"]
    frame = pd.read_csv(file, comment="#")
    assert list(frame.columns) == [
        "trajectory", "motion", "rms [m]", "peak [m/s]", "contacts from", "contacts to",
        "exponent [1/s]", "exponent error [1/s]",
    ]  # fmt: skip
    assert frame.iloc[0].tolist() == [0, "'=T", THIRD, -2.5, 2.0, 4.0, -0.5, 0.001]
    assert frame.iloc[1, 2:].isna().all()
    assert made() == made()  # kept answers give the same table, missing numbers too


def test_the_file_holds_the_rows_that_the_screen_leaves_out(tmp_path):
    many = table(
        "many",
        [words("branch", range(100)), Column("share", "{} %".format, {"share": [0.01] * 100})],
    )
    assert len(many.rows) == 24
    assert len(pd.read_csv(write_table(many, tmp_path / "many.csv"), comment="#")) == 100
