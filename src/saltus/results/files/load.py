"""Loading of result files."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import xarray as xr

from saltus.fence import RefusedError, regular
from saltus.results.dataset.schema import kind_of, restore
from saltus.results.files import known
from saltus.results.files.atomic import ResultFileError, path_of
from saltus.results.files.ending import checksum, try_elsewhere
from saltus.results.files.texts import place_of_control
from saltus.results.provenance import file_hash

#: First bytes of a file and the xarray engine that reads it.
_ENGINES = {b"CDF\x01": "scipy", b"CDF\x02": "scipy", b"\x89HDF": "h5netcdf"}


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a result that :func:`saltus.results.save` (or ``to_netcdf``) wrote; it is identical to
    the one that was written.

    Parameters
    ----------
    path : str or path
        A ``.nc`` file. One that wasn't written by this user's saltus on this machine, or by
        ``to_netcdf`` of xarray, is tried in another process first, which takes some tenths of a
        second: a damaged or malicious file can keep its reader busy for ever.

    Returns
    -------
    Dataset
        In memory; the file is closed.

    Raises
    ------
    ResultFileError
        If the file is missing, damaged, changed since, or not a result of saltus.

    Examples
    --------
    >>> import saltus as sl
    >>> run = sl.simulate(sl.models.delangre("a", force="4 N"), periods=2)
    >>> file = sl.save(run, "run.nc")
    >>> sl.load(file).attrs["result_hash"] == run.attrs["result_hash"]
    True
    """
    path = path_of(path)
    ds = _read(path)
    expected = ds.attrs.pop("file_hash", None)
    if expected is not None and expected != file_hash(ds):
        raise ResultFileError(
            f"{path}: what is in the file doesn't match the checksum saved with it. The file is "
            f"damaged, or was changed by other means "
            f"than saltus.save. Compute it again, or read it as it is with "
            f"xarray.open_dataset({str(path)!r})."
        )
    return ds


def _read(path: Path) -> xr.Dataset:
    """The result that the file holds, with its checksum."""
    if path.suffix in (".csv", ".mat"):
        raise ResultFileError(
            f"{path}: only .nc files hold everything that a result is made of. "
            f"Save it as {path.stem}.nc too."
        )
    try:
        regular(path)
        engine = _engine(path)
        digest = checksum(path)
        # A file from elsewhere is tried first: anybody can write a checksum.
        if digest is None or not known.is_known(digest):
            try_elsewhere(path, engine)
            if digest is not None:
                known.note(digest)
        ds = _content(path, engine)
        if not kind_of(ds):
            raise ResultFileError(
                f"{path} is a netCDF file, but not a result of saltus. Read it "
                f"with xarray.open_dataset({str(path)!r})."
            )
        ds = restore(ds)
        place = place_of_control(ds)
        if place:
            raise ResultFileError(
                f"{path}: {place} holds control characters, which a terminal "
                f"would obey. saltus wrote no such file."
            )
        return ds
    except ResultFileError:
        raise
    except RefusedError as refused:
        if not os.path.exists(path):  # asked so, a name that is too long is one that isn't there
            raise ResultFileError(
                f"there is no file {path} (looked in {os.path.abspath(path.parent)})."
            ) from None
        raise ResultFileError(f"{path} {refused} Name a .nc file that saltus.save wrote.") from None
    # a damaged file makes the readers raise almost anything, struct.error and KeyError among it
    except Exception as error:
        raise ResultFileError(
            f"{path} is damaged: {type(error).__name__}: {error}. Restore it "
            f"from a copy or compute it again."
        ) from error


def _content(path: Path, engine: str) -> xr.Dataset:
    if engine == "scipy":
        return xr.load_dataset(path, engine="scipy")
    from saltus.results.files import hdf5

    return hdf5.dataset(path)


def _engine(path: Path) -> str:
    """The xarray engine that reads the file."""
    with path.open("rb") as file:
        engine = _ENGINES.get(file.read(4))
    if engine is None:
        raise ResultFileError(
            f"{path} is not a netCDF file, or its beginning is damaged. "
            f"saltus.save makes the files that load reads."
        )
    if engine == "h5netcdf" and not all(
        importlib.util.find_spec(package) for package in ("h5netcdf", "h5py")
    ):
        raise ResultFileError(f'{path} is a netCDF-4 file. Install "saltus[io]" to read it.')
    return engine
