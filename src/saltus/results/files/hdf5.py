"""netCDF-4: datasets to the bytes of an HDF5 file, and back."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import h5netcdf
import h5py
import xarray as xr
from xarray.backends import H5NetCDFStore

from saltus.interrupt import ctrl_c_waits


def content(ds: xr.Dataset) -> bytes:
    """The bytes of a file, those that ``ds.to_netcdf(engine="h5netcdf")`` gives."""
    memory = io.BytesIO()
    with _store(memory, mode="w") as store:
        ds.dump_to_store(store)
    return memory.getvalue()


def dataset(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return the Dataset of a file, loaded into memory."""
    with _store(path, mode="r") as store:
        return xr.load_dataset(store)


@contextmanager
def _store(place: Any, mode: str) -> Iterator[H5NetCDFStore]:
    # variables in the order in which they were written: h5netcdf asks for that too
    with _Hdf5File(place, mode, track_order=True) as file:
        with ctrl_c_waits():  # h5netcdf can't close what is half open
            netcdf = h5netcdf.File(file, mode, decode_vlen_strings=True)
        with netcdf:
            yield H5NetCDFStore(netcdf)


class _Hdf5File(h5py.File):
    """HDF5 file that remembers its objects. h5netcdf looks each variable up by name 40 times:
    without this, a result takes twice as long to write and to read.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self._found: dict[str, Any] = {}
        super().__init__(*arguments, **options)

    def __getitem__(self, name: Any) -> Any:
        if not isinstance(name, str):
            return super().__getitem__(name)
        name = name.strip("/")
        if not name:
            return self
        if name not in self._found:
            self._found[name] = super().__getitem__(name)
        return self._found[name]

    @property
    def attrs(self) -> Any:
        """Attributes of the first folder: the file's attributes have lost their order."""
        return super().__getitem__("/").attrs

    def __delitem__(self, name: str) -> None:
        self._found.clear()
        super().__delitem__(name)
