"""Files that are there in full or not at all, and when they are on the disk."""

import os
import stat
from pathlib import Path

import pytest

import saltus
from saltus import whole_files
from saltus.errors import CacheError


def test_a_file_is_whole_and_private_as_asked(tmp_path):
    file, draft = tmp_path / "a", tmp_path / ".a.part"
    whole_files.put(file, b"whole", draft, lasting=False, mode=0o400)
    assert file.read_bytes() == b"whole"
    assert os.name == "nt" or stat.S_IMODE(file.stat().st_mode) == 0o400
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("lasting", [True, False])
@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_what_stood_there_stays_when_the_disk_fails(tmp_path, monkeypatch, step, lasting):
    def full(*_):
        raise OSError(28, "No space left on device")

    file = tmp_path / "a"
    file.write_bytes(b"before")
    monkeypatch.setattr(os, step, full)
    if step == "replace" or lasting:
        with pytest.raises(OSError, match="No space left"):
            whole_files.put(file, b"after", tmp_path / ".a.part", lasting=lasting)
    else:  # what needn't last waits for no disk
        whole_files.put(file, b"after", tmp_path / ".a.part", lasting=lasting)
    assert file.read_bytes() == (b"before" if step == "replace" or lasting else b"after")
    assert os.listdir(tmp_path) == ["a"]


def test_what_is_to_last_is_on_the_disk_before_its_name_is(tmp_path, monkeypatch):
    steps, flush, replace = [], os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (steps.append("flush"), flush(handle)))
    monkeypatch.setattr(os, "replace", lambda *both: (steps.append("name"), replace(*both)))
    whole_files.put(tmp_path / "a", b"whole", tmp_path / ".a.part")
    assert steps == ["flush", "name"] + ["flush"] * (os.name != "nt")


def test_what_the_disk_refuses_is_said_once_in_words():
    class RefusedError(OSError):
        pass

    def refused(error):
        with whole_files.refused_as(RefusedError, "a can't be written", "Make room."):
            raise error

    with pytest.raises(RefusedError, match=r"a can't be written: No space left\. Make room\."):
        refused(OSError(28, "No space left"))
    with pytest.raises(CacheError, match=r"^own words$"):
        refused(CacheError("own words"))


def test_no_other_file_gives_a_draft_its_name():
    """A draft that takes its name elsewhere may not be on the disk by then."""
    root = Path(saltus.__file__).parent
    naming = [file.name for file in root.rglob("*.py") if "os.replace(" in file.read_text("utf-8")]
    assert naming == ["whole_files.py"]
