"""The comparison with printed and exact contact times, on a run made up for it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

from saltus.errors import StudyError
from saltus.results.files.sheets import write_table
from saltus.study.answers.compare import contact_table, exact_times, printed_rows


def made_up_run(method: str, times: list[float]) -> xr.Dataset:
    """Three contacts with the guards at 0 and 0.4 mm; the second lands 1e-17 m beside
    its boundary.
    """
    return xr.Dataset(
        {
            "contact_time": ("contact", times),
            "contact_guard": ("contact", ["upper", "lower", "upper"]),
            "contact_x": ("contact", [4e-4, 1e-17, 4e-4]),
            "contact_steps": ("contact", [6, 11, 14]),
            "guard_state": ("guard", ["x", "x"]),
            "guard_boundary": ("guard", [0.0, 4e-4]),
        },
        {"guard": ["lower", "upper"]},
        {"method": method},
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "printed.csv").write_text(
        "# a comment\nmarker,event_number,time_s,position_minus_boundary_m\n"
        "A,2,0.25,-4e-17\nB,3,0.5,1e-16\n"
    )
    (tmp_path / "exact.csv").write_text("event_number,time_s\n1,0.125\n2,0.2500001\n3,0.5\n")
    return tmp_path


def table(folder, exact="exact.csv", reference="Taylor"):
    printed = printed_rows((folder / "printed.csv").read_bytes(), folder / "printed.csv")
    times = exact_times((folder / exact).read_bytes(), folder / exact) if exact else {}
    second = made_up_run("Taylor", [0.125, 0.2500001, 0.5 + 1e-13]) if reference else None
    return contact_table(
        "title", made_up_run("ODE45", [0.125, 0.25 + 2**-50, 0.5]), printed, times, second
    )


def test_rows(folder):
    rows = table(folder).rows
    assert rows[0] == (
        "A",
        "2",
        "0.2500000000000009",
        "0.2500000000000000",
        "8.88e-16",
        "1.00e-17",
        "4.00e-17",
        "0.2500001000000000",
        "0.0e+00",
        "6 5",
    )
    assert rows[1][:2] == ("B", "3")
    assert math.isclose(float(rows[1][8]), 1e-13, rel_tol=1e-2)
    assert rows[1][9] == "3", "only the legs since the row before"


def test_notes_tell_the_largest_difference_of_all_contacts(folder):
    assert table(folder).notes[1:] == (
        "ODE45: 3 of 3 exact contact times compared; largest difference 1.00e-07 s.",
        "Taylor: 3 of 3 exact contact times compared; largest difference 1.00e-13 s.",
    )


def test_without_exact_times_and_second_method(folder):
    found = table(folder, exact=None, reference=None)
    assert len(found.notes) == 1
    assert found.rows[0][7:9] == ("", "")


def test_a_residual_off_the_states_is_unknown(folder):
    run = made_up_run("ODE45", [0.125, 0.25, 0.5])
    run["guard_state"] = ("guard", ["", "x"])
    found = contact_table(
        "title",
        run,
        printed_rows((folder / "printed.csv").read_bytes(), folder / "printed.csv"),
        {},
        None,
    )
    assert np.isnan(float(found.rows[0][5]))


@pytest.mark.parametrize(
    ("file", "text", "part"),
    [
        ("printed.csv", "marker,time_s\nA,0.25\n", "lacks the column 'event_number'"),
        (
            "printed.csv",
            "event_number,time_s\n2,hunter2\n",
            "printed.csv, line 2: what stands in the column 'time_s' is no finite number",
        ),
        (
            "printed.csv",
            "# from a book\nevent_number,time_s\n2,inf\n",
            "printed.csv, line 3: what stands in the column 'time_s'",
        ),
        ("printed.csv", "event_number,time_s\nnan,1\n", "is no finite number"),
        ("printed.csv", "event_number,time_s\n1e400,1\n", "is no finite number"),
        ("printed.csv", "event_number,time_s\n1.7,1\n", "is no whole number from 1 to 2^31"),
        ("printed.csv", "event_number,time_s\n0,1\n", "is no whole number from 1 to 2^31"),
        (
            "printed.csv",
            "event_number,time_s,position_minus_boundary_m\n1,1,x\n",
            "'position_minus_boundary_m' is no finite number",
        ),
        ("printed.csv", "", "lacks the column 'event_number'"),
        ("printed.csv", "a\0b", "line 1 holds the control character U+0000"),
        (
            "printed.csv",
            "event_number,time_s\n4,0.7\n",
            "names contact 4, but ODE45 had 3. Run longer.",
        ),
        ("exact.csv", "event_number\n1\n", "lacks the column 'time_s'"),
    ],
)
def test_refusals(folder, file, text, part):
    (folder / file).write_text(text)
    with pytest.raises(StudyError) as caught:
        table(folder)
    assert part in str(caught.value)
    assert "hunter2" not in str(caught.value)


def test_a_mark_of_windows_before_the_text_is_no_part_of_it(folder):
    (folder / "printed.csv").write_bytes(
        b"\xef\xbb\xbf" + (folder / "printed.csv").read_bytes().replace(b"\n", b"\r\n")
    )
    assert [row[1] for row in table(folder).rows] == ["2", "3"]


def test_csv_keeps_what_was_printed(folder):
    lines = write_table(table(folder), folder / "table.csv").read_text().splitlines()
    assert lines[0] == "# title"
    assert lines[4].startswith("marker,contact,ODE45 [s],printed [s],difference [s]")
    assert lines[5].startswith("A,2,0.2500000000000009,")


def test_exact_times_of_the_replication():
    from pathlib import Path

    path = Path(__file__).parents[3] / "replications" / "saunders2021" / "exact_events.csv"
    times = exact_times(path.read_bytes(), path)
    assert len(times) == 63
    assert times[1] == 0.027283034515573257
