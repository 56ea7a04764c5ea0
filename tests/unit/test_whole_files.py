"""Files that are there in full or not at all, and when they are on the disk."""

import os
import stat

import pytest

from saltus import whole_files


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
