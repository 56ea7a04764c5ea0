"""A name of a class means one thing in the whole package."""

import re
from collections import defaultdict
from pathlib import Path

import saltus

ROOT = Path(saltus.__file__).parent


def homes() -> dict[str, list[str]]:
    """Files by the classes that they define."""
    found = defaultdict(list)
    for file in sorted(ROOT.rglob("*.py")):
        for name in re.findall(r"^class (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE):
            found[name].append(file.relative_to(ROOT).as_posix())
    return found


def test_no_two_classes_share_a_name():
    assert {name: files for name, files in homes().items() if len(files) > 1} == {}
    assert "System" in homes()
