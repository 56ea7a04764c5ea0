"""Maps of basins, lists of attractors, agreements: what the schema promises, and files that bring
all of it back.
"""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import made_results
from saltus.errors import ParameterError
from saltus.results import AttractorTable, content_hash, describe, load, save, to_csv
from saltus.results.dataset import schema
from saltus.results.files import export
from unit.results.conftest import PROVENANCE, UNITS, sine_run

STATUS = {2: "ok", 3: "graze_unresolved", 10: "not_computed"}
TABLE = AttractorTable(
    kind=["periodic", "periodic", "chaotic"], period=np.array([1, 3, 0]),
    contacts=np.array([2.0, 6.0, 1.87]),
    itinerary=["0 1", "0 1 0 2", ""], peak=np.array([1e-3, 2e-3, 3e-3]),
    rms=np.array([7e-4, 1e-3, 2e-3]),
    margin=np.array([1e-4, 2e-5, np.nan]),
    multipliers=np.array([[0.5 + 0.1j, 0.5 - 0.1j], [-0.2, 0.9], [np.nan, np.nan]]),
    exponent=np.array([-0.9, -0.1, 1.2]), exponent_error=np.array([0.0, 0.0, 0.03]),
    points=[np.array([[1e-3, 0.1]]), np.arange(6.0).reshape(3, 2), np.zeros((0, 2))],
    fractions=(np.array([0.5, 0.25, 0.0]), np.array([0.4, 0.2, 0.0]), np.array([0.6, 0.3, 0.1])),
)  # fmt: skip
BASIN = np.array([[0, 1, -1], [0, -2, -4]])


def basins(**changes):
    arguments = {
        "states": ("x", "v"), "units": UNITS,
        "axes": {"x": np.array([0.0, 1e-3]), "v": np.array([-1.0, 0.0, 1.0])}, "basin": BASIN,
        "periods_to_settle": np.where(BASIN >= 0, 7, -1), "status": np.where(BASIN == -4, 10, 2),
        "status_meanings": STATUS,
        "grazes_unresolved": np.array([[0, 1, 10**6], [0, 0, 0]]), "attractors": TABLE,
        "gap_unit": "m",
        "attrs": {**PROVENANCE, "basin_entropy": 0.25, "uncertainty_exponent": np.nan,
            "unresolved_cells": 2, "numbers": [1, 2]},
    }  # fmt: skip
    return made_results.basins(**{**arguments, **changes})


def attractors(**changes):
    arguments = {
        "states": ("x", "v"), "units": UNITS, "attractors": TABLE, "basin": np.array([1, 0, -3]),
        "periods_to_settle": np.array([5, 70000, -1]), "gap_unit": "m", "attrs": PROVENANCE,
    }  # fmt: skip
    return made_results.attractors(**{**arguments, **changes})


def agreement(**changes):
    match = {
        "a": [0, 1, -1], "b": [1, -1, 0], "type": ["periodic", "chaotic", "periodic"],
        "period": [1, 0, 2],
        "fraction_a": [0.5, 0.5, np.nan], "fraction_b": [0.5, np.nan, 0.5],
        "agreeing_cells": [2, 0, 0],
        "orbit_distance": [1e-9, np.nan, np.nan],
    }  # fmt: skip
    cells = np.array([[1, 0, -1], [1, -1, -1]])
    arguments = {
        "states": ("x", "v"), "units": UNITS,
        "axes": {"v": np.array([0.0, 1.0]), "x": np.array([0.0, 1e-3, 2e-3])}, "agreement": cells,
        "basin_a": BASIN, "basin_b": BASIN, "match": match,
        "attrs": {"agreement": 2 / 3, "method_a": "taylor", "method_b": "ode45"},
    }  # fmt: skip
    return made_results.agreement(**{**arguments, **changes})


NONE = AttractorTable(
    [], *([np.zeros(0)] * 2), [], *([np.zeros(0)] * 3), np.zeros((0, 2)), *([np.zeros(0)] * 2), []
)
CASES = {
    "basins": basins,
    "no attractor": lambda: basins(attractors=NONE, basin=np.full((2, 3), -2)),
    "no words": lambda: basins(attractors=dataclasses.replace(TABLE, itinerary=["", "", ""])),
    "attractors": attractors,
    "fractions only": lambda: attractors(basin=None, periods_to_settle=None),
    "no fractions": lambda: attractors(attractors=dataclasses.replace(TABLE, fractions=None)),
    "agreement": agreement,
}


@pytest.fixture(params=["h5netcdf", "scipy"])
def engine(request, monkeypatch):
    """Both kinds of netCDF; without h5netcdf, save falls back to SciPy's."""
    if request.param == "scipy":
        monkeypatch.setattr(export, "_has", lambda _: False)
    return request.param


# -- what the schema promises ----------------------------------------------------------------------
@pytest.mark.parametrize("case", CASES)
def test_every_variable_says_what_it_is(case):
    for name, variable in CASES[case]().variables.items():
        assert isinstance(variable.attrs["units"], str), name
        assert variable.attrs["long_name"], name
        assert variable.dtype.kind in "fiU", name


def test_a_map_has_the_variables_dims_and_types_of_the_contract():
    ds = basins()
    assert ds.attrs["saltus_result"] == schema.kind_of(ds) == "basins"
    assert dict(ds.sizes) == {"x": 2, "v": 3, "attractor": 3, "multiplier": 2, "phase": 3}
    found = {
        name: (variable.dims, str(variable.dtype))
        for name, variable in ds.variables.items()
        if variable.dtype.kind != "U"
    }
    cells, each = ("x", "v"), ("attractor",)
    assert found == {
        "x": (("x",), "float64"), "v": (("v",), "float64"), "basin": (cells, "int16"),
        "periods_to_settle": (cells, "int32"),
        "status": (cells, "int8"), "grazes_unresolved": (cells, "int16"),
        "attractor": (each, "int64"), "attractor_period": (each, "int64"),
        **{f"attractor_{name}": (each, "float64") for name in ("contacts", "peak", "rms", "margin",
            "exponent", "exponent_error")},
        **{f"attractor_fraction{end}": (each, "float64") for end in ("", "_low", "_high")},
        **{f"attractor_multiplier_{part}": (("attractor", "multiplier"),
            "float64") for part in ("real", "imag")},
        **{f"attractor_{state}": (("attractor", "phase"), "float64") for state in ("x", "v")},
    }  # fmt: skip
    assert {name for name, variable in ds.variables.items() if variable.dtype.kind == "U"} == {
        "attractor_type",
        "attractor_itinerary",
    }
    assert set(ds.coords) == {"x", "v", "attractor"}


def test_units_follow_the_system():
    units = {
        name: variable.attrs["units"] for name, variable in basins(gap_unit="mm").variables.items()
    }
    names = (
        "x",
        "v",
        "attractor_x",
        "attractor_v",
        "attractor_peak",
        "attractor_rms",
        "attractor_margin",
        "attractor_exponent",
        "basin",
    )
    assert [units[name] for name in names] == ["m", "m/s", "m", "m/s", "m", "m", "mm", "1/s", "1"]


def test_codes_carry_their_meaning():
    basin, status = basins()["basin"], basins()["status"]
    assert basin.attrs["flag_values"].tolist() == [-4, -3, -2, -1, 0, 1, 2]
    assert basin.attrs["flag_meanings"] == (
        "not_computed failed unconverged escaped attractor_0 attractor_1 attractor_2"
    )
    assert basin.attrs["flag_values"].dtype == basin.dtype
    assert (
        dict(
            zip(
                status.attrs["flag_values"].tolist(),
                status.attrs["flag_meanings"].split(),
                strict=True,
            )
        )
        == STATUS
    )
    assert agreement()["agreement"].attrs["flag_meanings"] == "not_settled differ agree"


def test_points_are_padded_with_nan():
    ds = basins()
    np.testing.assert_array_equal(
        ds["attractor_x"], [[1e-3, np.nan, np.nan], [0.0, 2.0, 4.0], [np.nan] * 3]
    )
    np.testing.assert_array_equal(ds["attractor_v"][1], [1.0, 3.0, 5.0])


def test_multipliers_are_split():
    ds = basins()
    np.testing.assert_array_equal(
        ds["attractor_multiplier_real"], [[0.5, 0.5], [-0.2, 0.9], [np.nan, np.nan]]
    )
    np.testing.assert_array_equal(
        ds["attractor_multiplier_imag"], [[0.1, -0.1], [0.0, 0.0], [np.nan, np.nan]]
    )


def test_values_arrive_unchanged():
    ds = basins()
    np.testing.assert_array_equal(ds["basin"], BASIN)
    assert ds["grazes_unresolved"].values.tolist() == [[0, 1, 32767], [0, 0, 0]]
    assert attractors()["periods_to_settle"].values.tolist() == [5, 70000, -1]
    assert ds.attrs["numbers"] == "[1, 2]"
    assert ds.attrs["system"] == "sine"
    assert ds.attrs["result_hash"] == content_hash(ds)


def test_a_list_of_starts_has_the_dim_trajectory():
    assert attractors()["basin"].dims == ("trajectory",)
    assert "trajectory" in attractors().coords
    assert "trajectory" not in attractors(basin=None, periods_to_settle=None).dims
    assert "attractor_fraction" not in attractors(
        attractors=dataclasses.replace(TABLE, fractions=None)
    )


def test_a_number_too_large_is_refused_not_wrapped():
    with pytest.raises(ParameterError, match="basin holds 40000, which int16 can't"):
        basins(basin=np.full((2, 3), 40000))


def test_an_axis_too_many_is_refused():
    with pytest.raises(ValueError, match=r"basin has 1 axes; its dims are \('x', 'v'\)"):
        basins(basin=np.zeros(3))


@pytest.mark.parametrize("name", ["basin", "status", "phase", "attractor"])
def test_an_axis_can_not_take_a_name_of_the_result(name):
    with pytest.raises(ParameterError, match=f"state '{name}'.*Rename"):
        basins(states=("x", name), axes={"x": np.zeros(2), name: np.zeros(3)})


def test_a_state_called_peak_keeps_both_variables():
    assert schema.attractor_name("x") == "attractor_x"
    ds = basins(states=("x", "peak"), axes={"x": np.zeros(2), "peak": np.zeros(3)})
    assert ds["attractor_peak"].dims == ("attractor",)
    assert ds["attractor_state_peak"].values[1].tolist() == [1.0, 3.0, 5.0]


# -- files -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("case", CASES)
def test_save_and_load_return_the_same(case, engine, tmp_path):
    ds = CASES[case]()
    back = load(save(ds, tmp_path / "map.nc"))
    xr.testing.assert_identical(back, ds)
    for name, variable in ds.variables.items():
        assert back[name].dtype.kind == variable.dtype.kind, name
        assert variable.dtype.kind == "U" or back[name].dtype == variable.dtype, name
        assert {key: type(value) for key, value in back[name].attrs.items()} == {
            key: type(value) for key, value in variable.attrs.items()
        }
        if "flag_values" in variable.attrs:
            assert back[name].attrs["flag_values"].dtype == variable.attrs["flag_values"].dtype
    assert {key: type(value) for key, value in back.attrs.items()} == {
        key: type(value) for key, value in ds.attrs.items()
    }
    assert content_hash(back) == ds.attrs["result_hash"]


@pytest.mark.parametrize("case", CASES)
def test_netcdf_of_xarray_keeps_everything(case, engine, tmp_path, untried):
    ds = CASES[case]()
    ds.to_netcdf(tmp_path / "map.nc", engine=engine)
    xr.testing.assert_identical(load(tmp_path / "map.nc"), ds)


def test_a_single_code_comes_back_as_a_list(engine, tmp_path):
    ds = basins(status=np.full((2, 3), 2), status_meanings={2: "ok"})
    back = load(save(ds, tmp_path / "map.nc"))
    assert back["status"].attrs["flag_values"].tolist() == [2]
    xr.testing.assert_identical(back, ds)


def test_csv_says_that_it_is_for_trajectories(tmp_path):
    with pytest.raises(
        ParameterError,
        match=r"this Dataset is from sl.basins\. Write \.nc or "
        r"\.mat; or one table of it",
    ):
        to_csv(basins(), tmp_path / "map.csv")


def test_matlab_holds_the_map(tmp_path):
    from scipy.io import loadmat

    back = loadmat(save(basins(), tmp_path / "map.mat"), simplify_cells=True)
    np.testing.assert_array_equal(back["basin"], BASIN)
    np.testing.assert_array_equal(back["attractor_x"], basins()["attractor_x"])


# -- text ------------------------------------------------------------------------------------------
def test_describe_tells_what_a_map_holds():
    lines = describe(basins()).splitlines()
    assert lines[0].startswith("sine: gap = ")
    assert lines[2:] == [
        "extent   2 x 3 starts, x from 0 to 0.001 m, v from -1 to 1 m/s",
        "found    3 attractors",
        "  0: periodic 1T, peak 0.001 m, 50.00% of the starts",
        "  1: periodic 3T, peak 0.002 m, 25.00% of the starts",
        "  2: chaotic, peak 0.003 m, 0.00% of the starts",
        "settled  3 of 6 starts, 1 not_computed, 1 unconverged, 1 escaped",
        "untyped  An orbit is recognised up to 64 periods, which no argument raises: a longer one "
        "has no type. sl.stroboscope and sl.poincare show its points.",
        "missed   5 starts: other attractors with a basin below 60 % of where they lie may be "
        "missed",
        "trust    basin entropy 0.25, uncertainty exponent nan",
        f"hash     {basins().attrs['result_hash'][:16]}",
    ]


def test_mirror_images_of_one_size_are_told_apart_by_a_state_on_each():
    twins = dataclasses.replace(
        TABLE, kind=["periodic"] * 3, period=np.array([1, 1, 3]), peak=np.array([1e-3, 1e-3, 2e-3]),
        points=[np.array([[-1e-3, 0.25]]), np.array([[1e-3, -0.25]]), TABLE.points[1]],
    )  # fmt: skip
    lines = describe(basins(attractors=twins)).splitlines()
    assert (
        "  0: periodic 1T, peak 0.001 m, through x = -0.001 m, v = 0.25 m/s, 50.00% of the starts"
    ) in lines
    assert (
        "  1: periodic 1T, peak 0.001 m, through x = 0.001 m, v = -0.25 m/s, 25.00% of the starts"
    ) in lines
    assert not any("3T" in line and "through" in line for line in lines)


def test_scatter_stands_where_an_attractor_is_noisy(tmp_path):
    noisy = dataclasses.replace(
        TABLE,
        kind=["periodic", "noisy_periodic", "chaotic"],
        scatter=np.array([np.nan, 4.31e-6, np.nan]),
    )
    for ds in (basins(attractors=noisy), attractors(attractors=noisy)):
        np.testing.assert_array_equal(ds["attractor_scatter"], noisy.scatter)
        assert ds["attractor_scatter"].attrs["units"] == UNITS["x"]
        assert ("  1: noisy 3T, peak 0.002 m, scatter 4.3e-06 m, 25.00% of the starts") in describe(
            ds
        ).splitlines()
        xr.testing.assert_identical(load(save(ds, tmp_path / "noisy.nc")), ds)
    assert "attractor_scatter" not in basins()


def test_describe_tells_what_errors_of_ode45_have_to_do_with_starts_that_never_settled():
    def noise(**attrs):
        return [
            line
            for line in describe(basins(attrs={**PROVENANCE, **attrs})).splitlines()
            if line.startswith("noise")
        ]

    assert noise(method="Taylor") == []
    assert noise(method="ODE45") == [
        "noise    Errors of ode45 itself can keep a motion from "
        "settling. A smaller rtol, or Taylor, tells."
    ]
    (told,) = noise(method="ODE45", unconverged_exactly="3T, 24T", unconverged_stray=0.314)
    assert (
        "exact integration from where they stand settles to 3T, 24T, and ode45 strays from "
        "there by up to 31% of the range"
    ) in told
    (told,) = noise(method="ODE45", unconverged_exactly="", unconverged_stray=np.nan)
    assert told == (
        "noise    By exact integration from where they stand they settle to no orbit either."
    )


def test_describe_tells_what_the_others_hold():
    assert "extent   3 starts\nfound    3 attractors" in describe(attractors())
    assert "settled  2 of 3 starts, 1 failed" in describe(attractors())
    assert "settled" not in describe(attractors(basin=None, periods_to_settle=None))
    text = describe(agreement())
    assert (
        "maps     taylor and ode45\nagree    66.67% of the settled starts (2 agree, 1 "
        "differ, 3 "
        "not_settled)"
    ) in text
    assert "matched  1 attractors, 1 only in the first map, 1 only in the second" in text


def test_describe_survives_a_map_without_attractors_or_cells():
    assert "found    0 attractors" in describe(CASES["no attractor"]())
    empty = basins(axes={"x": np.zeros(0), "v": np.zeros(3)}, **dict.fromkeys(
        ("basin", "periods_to_settle", "status", "grazes_unresolved"),
        np.zeros((0, 3), int)))  # fmt: skip
    assert "0 x 3 starts, x empty" in describe(empty)


def test_many_attractors_are_counted():
    fields = {field.name: getattr(TABLE, field.name) for field in dataclasses.fields(TABLE)}
    fields["fractions"] = None
    many = AttractorTable(
        **{name: value if value is None else [value[0]] * 15 for name, value in fields.items()}
    )
    assert "  and 3 more" in describe(attractors(attractors=many))


# -- the right kind of Dataset ---------------------------------------------------------------------
@pytest.mark.parametrize(
    ("thing", "message"),
    [
        (sine_run(), "takes what sl.basins returns; this Dataset is from sl.simulate"),
        (agreement(), "from sl.compare"),
        (basins()[["basin", "status"]], "misses attractor_type"),
    ],
)
def test_check_teaches(thing, message):
    with pytest.raises(ParameterError, match=message):
        schema.check(thing, caller="plot.basins", kinds=[schema.BASINS])
