"""The folders of templates name their files in the order in which codegen puts them together."""

from importlib import import_module
from pathlib import Path

import pytest

from saltus.codegen.templates import BITCODE


def listed(folder):
    """The files that the table of a folder names, in order."""
    _, rows, _ = import_module(f"saltus.kernels.{folder}").__doc__.split("=" * 16 + "  " + "=" * 82)
    return [name for row in rows.splitlines() for name in row[:16].replace(",", " ").split()]


@pytest.mark.parametrize("folder", ["taylor", "modal", "stepping", "harmonics", "waves"])
def test_a_folder_lists_its_templates_in_their_order(folder):
    names = listed(folder)
    package = Path(import_module(f"saltus.kernels.{folder}").__file__).parent
    assert set(names) == {file.stem for file in package.glob("*.py")} - {"__init__"}
    for name, (interface, _) in BITCODE.items():
        used = [
            place.removeprefix(f"{folder}/")
            for place in (interface.layout, *interface.templates)
            if place.startswith(f"{folder}/")
        ]
        assert used == [one for one in names if one in used], name
