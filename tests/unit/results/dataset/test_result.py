"""A result is a Dataset that doesn't multiply its tables."""

import copy
import pickle

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from saltus.errors import ParameterError
from saltus.results import Result, load, save


@pytest.mark.parametrize("call", ["to_dataframe", "to_dataarray", "to_dask_dataframe"])
def test_the_product_of_samples_contacts_and_guards_is_refused(batch, call):
    rows = (
        batch.sizes["trajectory"]
        * batch.sizes["time"]
        * batch.sizes["contact"]
        * batch.sizes["guard"]
    )
    says = (
        rf"{call} of this result would multiply its tables \(trajectory x time and contact "
        rf".*\) "
        rf"to {rows} rows\. Take one: "
    )
    with pytest.raises(
        ParameterError,
        match=says + rf"sl\.samples\(run\), sl\.contacts\(run\) or "
        rf"run\[\['x', 'v'\]\]\.{call}\(\)",
    ):
        getattr(batch, call)()


def test_tables_of_a_run_without_contacts_are_not_lost_in_an_empty_frame(batch):
    says = "lose its tables .*, because there is no contact. Take one: sl.samples"
    with pytest.raises(ParameterError, match=says):
        batch.isel(contact=slice(0, 0)).to_dataframe()


def test_variables_of_one_table_become_a_frame_as_of_any_dataset(batch):
    frame = batch[["x", "v"]].to_dataframe()
    pd.testing.assert_frame_equal(
        frame, xr.Dataset(dict(batch[["x", "v"]].variables)).to_dataframe(), check_like=True
    )
    assert len(frame) == batch.sizes["trajectory"] * batch.sizes["time"]
    assert len(batch[["status", "events"]].to_dataframe()) == 3
    assert len(batch[["contact_time", "contact_guard"]].to_dataframe()) == batch.sizes["contact"]
    with pytest.raises(ParameterError, match="multiply"):
        batch[["x", "contact_time"]].to_dataframe()


def test_it_stays_what_it_is(batch, tmp_path):
    kept = [
        batch.isel(trajectory=0), batch.sel(time=slice(0, 1)), batch[["x"]],
        batch.assign_attrs(a=1), batch.drop_vars("mode"), batch.copy(),
        copy.deepcopy(batch), pickle.loads(pickle.dumps(batch)), batch.assign(twice=2 * batch["x"]),
        xr.concat([batch, batch], "run"),
        load(save(batch, tmp_path / "run.nc")), batch.rename(x="y"), batch.transpose(),
        batch.load(),
    ]  # fmt: skip
    assert {type(one) for one in kept} == {Result}
    assert kept[7].identical(batch)
    assert kept[10].identical(batch)
    assert isinstance(batch, xr.Dataset)
    assert float(batch["x"].mean()) == pytest.approx(float(np.mean(batch["x"].values)))


@pytest.mark.parametrize("name", ["run", "batch"])
def test_it_is_what_xarray_makes_of_the_same_variables(name, request):
    """The builder goes past xarray's constructor; the two agree, the order included."""
    made = request.getfixturevalue(name)
    again = Result(
        {name: made.variables[name] for name in made.data_vars},
        xr.Coordinates(dict(made.coords.variables), dict(made.xindexes)),
        made.attrs,
    )
    xr.testing.assert_identical(made, again)
    assert list(made.variables) == list(again.variables)
    assert list(made.sizes.items()) == list(again.sizes.items())
    assert (
        set(made.xindexes)
        == set(again.xindexes)
        == {name for name, one in made.coords.items() if one.dims == (name,)}
    )
    assert [type(one) for one in made.variables.values()] == [
        type(one) for one in again.variables.values()
    ]


def test_a_dim_has_one_length():
    with pytest.raises(ValueError, match="conflicting sizes"):
        Result.of({"a": xr.Variable("t", [1.0, 2.0]), "b": xr.Variable("t", [1.0])}, (), {}, {})
