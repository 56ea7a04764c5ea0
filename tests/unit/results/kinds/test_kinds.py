"""A kind of result is one file, and all that is said of it stands there."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import pytest
import xarray as xr

from saltus.results import kinds
from saltus.results.dataset.schema import KINDS, METHODS, NAMES, SETTLED, ResultKind

FOLDER = Path(kinds.__file__).parent
HOUSE = FOLDER.parents[1]


def test_every_kind_has_its_file_and_every_file_its_kind():
    files = {path.stem for path in FOLDER.glob("*.py")} - {"__init__"}
    assert files == set(NAMES) == set(KINDS)
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_file_of_a_kind_holds_variables_an_account_and_rows(name):
    kind = KINDS[name]
    assert kind.makers.startswith("sl.")
    assert set(kind.needed) - {"<state>"} <= set(kind.variables)
    assert all(one.long_name for one in kind.variables.values())
    for said in (kind.account, kind.rows):
        assert said.__module__.startswith("saltus.results.kinds."), said
        assert said.__doc__


def test_a_kind_without_one_of_them_can_not_be_made():
    whole = {field.name: None for field in dataclasses.fields(ResultKind)}
    for lacking in ("variables", "account", "rows"):
        with pytest.raises(TypeError, match=lacking):
            ResultKind(**{name: one for name, one in whole.items() if name != lacking})


def test_tables_of_results_are_made_in_the_files_of_their_kinds_only():
    """Else what a study says of a result would be written anew beside what ``describe`` says.
    Comparisons with printed numbers, claims, and reports of the program are no results.
    """
    others = {
        "study/answers/compare.py", "study/run/status.py", "cli/demo.py",
        "cli/doctor.py", "cli/commands.py", "cli/cache_commands.py", "replication/tables.py",
    }  # fmt: skip
    makers = {
        str(path.relative_to(HOUSE).as_posix())
        for path in HOUSE.rglob("*.py")
        if FOLDER not in path.parents and _makes_a_table(path)
    }
    assert makers == others


def _makes_a_table(path: Path) -> bool:
    text = path.read_text(encoding="utf-8")
    return "saltus.results.table" in text and any(
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in ("TextTable", "table", "Column")
        for node in ast.walk(ast.parse(text))
    )


def test_methods_side_by_side_are_told_beside_the_reference():
    found = xr.Dataset(
        {
            "method_agreement": ("method", [1.0, 0.875], {"units": "1"}),
            "method_agreement_low": ("method", [0.7, 0.5], {"units": "1"}),
            "method_agreement_high": ("method", [1.0, 0.98], {"units": "1"}),
            "method_cpu_seconds": ("method", [0.5, 2.0], {"units": "s"}),
        },
        {"method": ["Taylor", "RK4"]},
        {"analysis": "basins"},
    )
    assert KINDS[METHODS].account(found) == [
        "found    basins by 2 methods",
        "  Taylor: the reference, 0.5 s of processor time",
        "  RK4: 87.50% of the settled starts as by the reference, 2 s of processor time",
    ]
    (rows,) = KINDS[METHODS].rows("two", found)
    assert rows.rows[1] == ("RK4", "87.50%", "50.00% to 98.00%", "2 s")


def test_a_run_that_does_not_repeat_says_how_long_was_looked():
    found = xr.Dataset(
        {
            "response_period": ("trajectory", [0, 3]),
            "mismatch": ("trajectory", [0.1, 1e-12]),
            "contacts_per_response": ("trajectory", [float("nan"), 8.0]),
        },
        {"trajectory": [0, 1]},
        {"longest_period": 48, "states": "x v"},
    )
    assert KINDS[SETTLED].account(found) == ["found    1 not periodic within 48T, 1 3T"]
    (rows,) = KINDS[SETTLED].rows("two", found)
    assert [row[1:] for row in rows.rows] == [
        ("not periodic within 48T", "1.0e-01", "-"),
        ("3T", "1.0e-12", "8"),
    ]
