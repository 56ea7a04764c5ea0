"""A file is there in full or not at all, and one that isn't what it was is refused."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import xarray as xr

from saltus.errors import SaltusError
from saltus.results import ResultFileError, load, save, usable_folder
from saltus.results.files import export
from saltus.results.files.atomic import replacing
from unit.results.conftest import sine_run


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file sizes are POSIX")
@pytest.mark.slow
def test_a_write_that_the_system_refuses_leaves_nothing(tmp_path):
    """The kernel refuses to let any file grow beyond 20 kB, which is what a full disk looks like
    from inside.
    """
    names = ["run.nc", "run3.nc", "run.csv", "run.mat"]
    old = [tmp_path / f"old_{name}" for name in names]
    for path in old:
        path.write_bytes(b"what stood here before")
    paths = [
        path for name, before in zip(names, old, strict=True) for path in (tmp_path / name, before)
    ]
    script = f"""
        import resource, sys
        sys.dont_write_bytecode = True  # Python would leave what it writes cut off
        sys.path[:0] = {[str(Path(__file__).parents[2]), *sys.path]!r}
        from results.conftest import sine_run
        from saltus.results import save
        from saltus.results.files import export
        run, installed = sine_run(samples=4000), export._has
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
        for path in {list(map(str, paths))!r}:
            export._has = installed if "run3" not in path else lambda _: False
            try:
                save(run, path)
            except Exception as error:
                print(type(error).__name__, error)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    lines = done.stdout.splitlines()
    assert len(lines) == 8, done
    for line, path in zip(lines, paths, strict=True):
        assert line.startswith(f"ResultFileError {path} can't be written: File too large")
    assert done.returncode == 0, done.stderr
    assert sorted(tmp_path.iterdir()) == sorted(old)
    assert {path.read_bytes() for path in old} == {b"what stood here before"}


def test_a_crash_on_the_way_leaves_the_old_file(tmp_path, monkeypatch):
    path = save(sine_run(), tmp_path / "run.csv")
    before = {one.name: one.read_bytes() for one in tmp_path.iterdir()}

    def crash(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(export, "notes_of", crash)
    with pytest.raises(KeyboardInterrupt):
        save(sine_run((3e-3,)), path)
    assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == before


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(ResultFileError, match=r"there is no folder .*nowhere"):
        save(sine_run(), tmp_path / "nowhere" / "run.nc")


def test_a_folder_in_the_way_is_reported(tmp_path):
    (tmp_path / "run.nc").mkdir()
    with pytest.raises(ResultFileError, match=r"run\.nc can't be written"):
        save(sine_run(), tmp_path / "run.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.nc").write_bytes(b"")
    (tmp_path / "link.nc").symlink_to(tmp_path / "real.nc")
    save(sine_run(), tmp_path / "link.nc")
    assert (tmp_path / "link.nc").is_symlink()
    assert load(tmp_path / "real.nc").attrs["system"] == "sine"


def test_a_link_out_of_the_folder_is_not_written_through(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "out" / "run.nc").symlink_to(tmp_path / "precious")
    with pytest.raises(ResultFileError, match=r"is a link to .*precious, in another folder"):
        save(sine_run(), tmp_path / "out" / "run.nc")
    assert (tmp_path / "precious").read_text() == "mine"
    (tmp_path / "linked").symlink_to(tmp_path / "out")
    assert save(sine_run(), tmp_path / "linked" / "other.nc").exists(), (
        "a folder may be a link: it was named by whoever asked"
    )


def test_old_drafts_are_removed_and_nothing_else(tmp_path):
    names = [
        ".run.nc.0123abcd.part",
        ".0123abcd.part",
        ".run.nc.part",
        "run.nc.0123abcd.part",
        ".run.nc.0123abcd.part.nc",
    ]
    for name in [*names, ".young.nc.0123abcd.part"]:
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (0, 0) if "young" not in name else None)
    usable_folder(tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted(
        [*names[2:], ".young.nc.0123abcd.part"]
    )


def test_nothing_is_visible_before_the_end(tmp_path):
    with replacing(tmp_path / "a", tmp_path / "b") as (a, b):
        a.write_text("1")
        b.write_text("2")
        assert not (tmp_path / "a").exists()
        assert not (tmp_path / "b").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


# -- load ------------------------------------------------------------------------------------------
@pytest.fixture(params=["h5netcdf", "scipy"])
def saved(request, tmp_path, monkeypatch):
    if request.param == "scipy":
        monkeypatch.setattr(export, "_has", lambda _: False)
    return save(sine_run(samples=200), tmp_path / "run.nc")


@pytest.mark.parametrize("keep", [0, 3, 100, 0.5, 0.99])
def test_a_file_that_was_cut_is_refused(saved, keep):
    data = saved.read_bytes()
    saved.write_bytes(data[: int(keep * len(data) if keep < 1 else keep)])
    with pytest.raises(ResultFileError, match=r"run\.nc"):
        load(saved)


def test_no_flipped_byte_goes_unnoticed(saved):
    """Whichever byte is changed, load refuses the file or returns exactly what was saved (the byte
    was padding).
    """
    data, run = saved.read_bytes(), load(saved)
    refused = 0
    for place in range(50, len(data), len(data) // 150):
        saved.write_bytes(data[:place] + bytes([data[place] ^ 0x15]) + data[place + 1 :])
        try:
            xr.testing.assert_identical(load(saved), run)
        except ResultFileError:
            refused += 1
    assert refused > 30


def test_a_changed_file_says_so(saved):
    changed = load(saved)
    with xr.open_dataset(saved) as opened:
        changed.attrs["file_hash"] = opened.attrs["file_hash"]
    changed["x"] = changed["x"] * 2
    changed.to_netcdf(saved)
    with pytest.raises(ResultFileError, match="checksum"):
        load(saved)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("run.nc", b"hello", "not a netCDF file"),
        ("run.csv", b"a,b", r"only \.nc files"),
        ("gone.nc", None, "there is no file"),
    ],
)
def test_other_files_are_told_apart(name, content, message, tmp_path):
    if content:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SaltusError, match=message):
        load(tmp_path / name)


def test_a_foreign_netcdf_is_told_apart(tmp_path):
    xr.Dataset({"sst": ("time", [1.0])}).to_netcdf(tmp_path / "ocean.nc")
    with pytest.raises(ResultFileError, match="not a result of saltus"):
        load(tmp_path / "ocean.nc")
