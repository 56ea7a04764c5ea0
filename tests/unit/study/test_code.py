"""The hash of code: what the code does counts, what is said about it doesn't."""

from __future__ import annotations

import pytest

from edited_copy import edited_copy
from saltus import cache
from saltus.study import code
from saltus.study.code import statement_hash

SOURCE = '''
"""A module."""
LIMIT = 0.5  # a limit


class Thing:
    """A thing."""

    size: int = 3

    def grow(self, by=1, *, most=LIMIT):
        """Grow it."""
        return f"{self.size + by:.3f}{by:>{most}}", [one for one in range(by) if one < most], -1e-300, None
'''  # noqa: E501


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# a limit", "# the largest that there is"),
        ('"""A module."""', '"""Another\n\ntext."""'),
        ('"""A module."""\n', ""),
        ('"""A thing."""', '"""Some thing."""'),
        ('        """Grow it."""\n', ""),
        ("LIMIT = 0.5", "LIMIT=5e-1"),
        ("by=1, *, most=LIMIT", "by = 1,\n        *, most=LIMIT,\n    "),
    ],
)
def test_what_is_said_about_code_does_not_count(old, new):
    assert old in SOURCE
    assert statement_hash(SOURCE.replace(old, new).encode()) == statement_hash(SOURCE.encode())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.5", "0.50000000000000011"),
        ("-1e-300", "1e-300"),
        ("None", "False"),
        ("size: int = 3", "size: int = 3.0"),
        (":.3f", ":.4f"),
        ("self.size + by", "by + self.size"),
        ("one < most", "one <= most"),
        ("by=1, *, most", "by=1, most"),
        ("def grow", "async def grow"),
        ('"""Grow it."""', "pass"),
        ("return", 'more = "a text"\n        return'),
        ("LIMIT = 0.5", 'LIMIT = "0.5"'),
    ],
)
def test_what_code_does_counts(old, new):
    assert old in SOURCE
    assert statement_hash(SOURCE.replace(old, new).encode()) != statement_hash(SOURCE.encode())


def test_versions_of_python_agree():
    """Computed by 3.11, 3.12 and 3.13, whose syntax trees differ in what is empty."""
    assert (
        statement_hash(SOURCE.encode())
        == "386fca3623d5e77946fb0e619b6564f4c5df016104d20092acede8a0bd6472ec"
    )


@pytest.mark.slow
def test_a_comment_in_saltus_throws_nothing_away_and_a_statement_does(tmp_path, monkeypatch):
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path / "cache"))
    before = code.code_hash.__wrapped__()
    assert len(list((tmp_path / "cache").glob(f"*{cache.HASH}"))) == 1
    monkeypatch.setattr(code, "statement_hash", lambda _: pytest.fail("read again"))
    assert code.code_hash.__wrapped__() == before, "kept from one process to the next"
    monkeypatch.undo()
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path / "cache"))
    edited_copy(tmp_path, "labels.py", monkeypatch, "# a remark\n")
    assert code.code_hash.__wrapped__() == before
    (edited,) = code.PACKAGE.rglob("labels.py")
    edited.write_text(edited.read_text() + "EDITED = True\n")
    assert code.code_hash.__wrapped__() != before


def test_a_damaged_entry_is_made_again(tmp_path, monkeypatch):
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path))
    before = code.code_hash.__wrapped__("fence")
    (entry,) = tmp_path.glob(f"*{cache.HASH}")
    data = entry.read_bytes()
    entry.chmod(0o600)
    entry.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    with pytest.warns(UserWarning, match="the hash of the code .* is damaged; building it again"):
        assert code.code_hash.__wrapped__("fence") == before
    assert entry.read_bytes() == data
