"""netCDF-4 whose objects stay found: the bytes and the results are those of xarray alone."""

import numpy as np
import pytest
import xarray as xr

import saltus as sl
from saltus.results.files import hdf5


@pytest.fixture(scope="module")
def results():
    """Texts, truth values, whole numbers, dates-like units, dims with and without coordinates."""
    rig = sl.models.delangre("a", force="4 N")
    run = sl.simulate(rig, periods=3)
    bare = xr.Dataset({"point": ("point", np.arange(3)), "x": (("row", "point"), np.eye(3))})
    return {"run": run, "points": sl.stroboscope(rig, periods=5), "bare": bare}


@pytest.mark.parametrize("name", ["run", "points", "bare"])
def test_bytes_and_content_are_those_of_xarray(results, name, tmp_path):
    ds = results[name]
    content = hdf5.content(ds)
    assert content == bytes(ds.to_netcdf(engine="h5netcdf"))
    file = tmp_path / "one.nc"
    file.write_bytes(content)
    back = hdf5.dataset(file)
    assert back.identical(ds)
    # in the same order too
    assert hdf5.content(back) == hdf5.content(xr.load_dataset(file, engine="h5netcdf"))


def test_an_object_that_was_replaced_is_not_the_one_found_before(tmp_path):
    with hdf5._Hdf5File(tmp_path / "one.h5", "w") as file:
        file["x"] = np.zeros(2)
        assert file["x"] is file["/x"]
        del file["x"]
        file["x"] = np.ones(3)
        assert file["/x"].shape == (3,)
