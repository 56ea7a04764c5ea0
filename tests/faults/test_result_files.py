"""Result files that something befell: each is refused in a sentence before a parser sees it; none
keeps anybody waiting.
"""

import os
import random
import shutil
import sys

import pytest
import xarray as xr

from saltus.errors import ParameterError
from saltus.fence import has_control
from saltus.results import ResultFileError, load, save
from saltus.results.files import ending, export, known
from unit.results.conftest import sine_run

ENDING = 80


@pytest.fixture(params=["h5netcdf", "scipy"])
def saved(request, tmp_path, monkeypatch):
    if request.param == "scipy":
        monkeypatch.setattr(export, "_has", lambda _: False)
    return save(sine_run(samples=50), tmp_path / "run.nc")


def damaged(data: bytes, draw: random.Random) -> bytes:
    """A bit flipped, a block zeroed, or a block put in another place; mostly near the beginning,
    where files keep their structure.
    """
    inside = bytearray(data[:-ENDING])
    place = draw.randrange(min(8192, len(inside)) if draw.random() < 0.7 else len(inside))
    size = draw.choice([8, 16, 64, 128, 512])
    match draw.randrange(4):
        case 0:
            inside[place] ^= 1 << draw.randrange(8)
        case 1 | 2:
            inside[place : place + size] = bytes(len(inside[place : place + size]))
        case 3:
            other = draw.randrange(len(inside) - size)
            inside[place : place + size] = inside[other : other + len(inside[place : place + size])]
    return bytes(inside) + data[-ENDING:]


def test_a_damaged_file_meets_no_parser(saved, monkeypatch):
    """HDF5 loops for ever over some of these; so nobody asks it."""
    data, draw, refused = saved.read_bytes(), random.Random(11), 0
    monkeypatch.setattr(xr, "load_dataset", lambda *_, **__: pytest.fail("a parser was asked"))
    for _ in range(500):
        bad = damaged(data, draw)
        if bad == data:
            continue
        saved.write_bytes(bad)
        with pytest.raises(ResultFileError, match="is damaged") as told:
            load(saved)
        assert "\n" not in str(told.value)
        refused += 1
    assert refused > 300


def test_a_result_moved_alone_is_read(saved, tmp_path):
    run = load(saved)
    (tmp_path / "elsewhere").mkdir()
    moved = shutil.move(saved, tmp_path / "elsewhere" / "other name.nc")
    xr.testing.assert_identical(load(moved), run)
    with xr.open_dataset(moved) as plain:
        assert plain.sizes["time"] == run.sizes["time"], "other readers stop where the data end"


def test_a_file_that_xarray_wrote_is_read(saved, tmp_path):
    run = load(saved)
    run.to_netcdf(
        tmp_path / "by_xarray.nc",
        engine="h5netcdf" if saved.read_bytes()[:4] == b"\x89HDF" else "scipy",
    )
    xr.testing.assert_identical(load(tmp_path / "by_xarray.nc"), run)


@pytest.mark.parametrize("cut", [1, ENDING])
def test_a_file_that_lost_its_ending_only_is_read(saved, cut):
    run = load(saved)
    saved.write_bytes(saved.read_bytes()[:-cut])
    xr.testing.assert_identical(load(saved), run)


def test_a_file_that_lost_more_is_refused(saved):
    saved.write_bytes(saved.read_bytes()[:-2000])
    with pytest.raises(ResultFileError, match=r"is damaged: .*compute it again\.$"):
        load(saved)


def test_reading_that_comes_to_no_end_is_stopped(saved, monkeypatch):
    saved.write_bytes(saved.read_bytes()[:-ENDING])
    monkeypatch.setattr(ending, "_TRIAL", "while True: pass")
    monkeypatch.setattr(ending, "PATIENCE", 0.2)
    with pytest.raises(
        ResultFileError,
        match=r"reading it came to no end within 0 s\. Restore it "
        r"from a copy or compute it again\.",
    ):
        load(saved)


def test_reading_that_lasts_says_so_before_it_is_given_up(saved, monkeypatch, capfd):
    saved.write_bytes(saved.read_bytes()[:-ENDING])
    monkeypatch.setattr(ending, "_TRIAL", "while True: pass")
    monkeypatch.setattr(ending, "PATIENCE", 1.0)
    monkeypatch.setattr(ending, "SILENT", 0.0)
    with pytest.raises(ResultFileError, match="came to no end"):
        load(saved)
    assert f"saltus tries {saved} in another process first: at most 1 s" in capfd.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="pipes are POSIX")
def test_what_is_no_file_is_told_apart(tmp_path):
    os.mkfifo(tmp_path / "pipe.nc")
    known = {tmp_path: "it is a folder", tmp_path / "pipe.nc": "a pipe", "/dev/zero": "a device"}
    for path, told in known.items():
        with pytest.raises(ResultFileError, match=told):
            load(path)
    for call in (lambda: load(5), lambda: load("a\0.nc"), lambda: save(sine_run(), None)):
        with pytest.raises(ParameterError, match="the path of a file"):
            call()


def test_a_nul_in_a_text_is_told(tmp_path):
    for name in ("run.nc", "run.csv", "run.mat"):
        with pytest.raises(ParameterError, match="the attribute 'study' holds control characters"):
            save(sine_run().assign_attrs(study="a\0b"), tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "where", ["attribute", "attribute of a variable", "text", "turn of the direction"]
)
def test_a_file_that_would_write_to_the_terminal_is_refused(tmp_path, where, monkeypatch):
    """Whole, with all its checksums: the sequence sets the title of a terminal; others rewrite what
    is seen.
    """
    run = sine_run()
    if where == "attribute":
        run = run.assign_attrs(source="\x1b]0;owned\x07")
    elif where == "attribute of a variable":
        run["x"].attrs["long_name"] = "\x1b[2J"
    elif where == "text":
        run = run.assign_coords(guard=["gap\x9b31m"])
    else:
        run = run.assign_attrs(source="\u202egpj.exe")
    with pytest.raises(ParameterError, match="holds control characters"):
        save(run, tmp_path / "run.nc")
    # as another program would write it
    monkeypatch.setattr("saltus.results.files.export.place_of_control", lambda _: "")
    save(run, tmp_path / "run.nc")
    with pytest.raises(
        ResultFileError, match="holds control characters, which a terminal would obey"
    ) as refused:
        load(tmp_path / "run.nc")
    assert not has_control(str(refused.value))


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    """Somebody else's files: the folder of what this user's saltus wrote is empty."""
    monkeypatch.setattr(known, "folder", lambda: tmp_path / "known")
    monkeypatch.setattr(known, "_HERE", set())
    return tmp_path


def test_only_what_was_not_written_here_is_tried_elsewhere_and_once(stranger, monkeypatch):
    """Anybody can write a right checksum over a file that HDF5 reads for ever."""
    tried = []
    monkeypatch.setattr(
        sys.modules["saltus.results.files.load"],
        "try_elsewhere",
        lambda path, _engine: tried.append(path.name),
    )
    mine = save(sine_run(samples=50), stranger / "mine.nc")
    content = sine_run(samples=51).to_netcdf(engine="h5netcdf")
    (stranger / "theirs.nc").write_bytes(ending.with_ending(content))
    for _ in range(2):  # as this process knows them, and as another one does
        load(mine)
        load(stranger / "theirs.nc")
        known._HERE.clear()
    assert tried == ["theirs.nc"]
    (stranger / "known").chmod(0o777)  # others could have written there
    load(mine)
    assert tried == ["theirs.nc", "mine.nc"]


@pytest.mark.skipif(sys.platform == "win32", reason="memory is bounded on POSIX only")
@pytest.mark.parametrize(
    ("made", "told"),
    [
        ("stored elsewhere", "leads to other files"),
        ("linked", "leads to other files"),
        ("huge", "allocate"),
    ],
)
def test_a_forged_file_reads_no_other_file_and_takes_no_memory(stranger, made, told):
    """Its checksums are right. Data stored elsewhere would be those of any file, and a pipe there
    would be waited on for ever.
    """
    h5py = pytest.importorskip("h5py")
    (stranger / "secret").write_bytes(bytes(range(100)))
    with h5py.File(stranger / "raw", "w") as file:
        file.attrs["saltus_result"] = "trajectory"
        if made == "stored elsewhere":
            file.create_dataset(
                "time", shape=(100,), dtype="i1", external=[(str(stranger / "secret"), 0, 100)]
            ).make_scale("time")
        elif made == "linked":
            file["time"] = h5py.ExternalLink(str(stranger / "secret"), "/x")
        else:
            file.create_dataset(
                "time", shape=(3 * 10**9,), dtype="f8", chunks=(1 << 20,)
            ).make_scale("time")
    (stranger / "run.nc").write_bytes(ending.with_ending((stranger / "raw").read_bytes()))
    with pytest.raises(ResultFileError, match=told):
        load(stranger / "run.nc")
