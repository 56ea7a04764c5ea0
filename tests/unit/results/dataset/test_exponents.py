"""Datasets of exponents: names, units, files."""

import numpy as np
import pytest

import made_results
import saltus as sl
from saltus.errors import ParameterError
from saltus.results.dataset import schema


def made(**changes):
    arguments = {
        "columns": {
            "kind": ["periodic", "chaotic"], "response_period": [3, 0],
            "lyapunov_exponent": [[-0.5, -1.0], [0.5, -2.0]],
            "lyapunov_high": [[-0.5, -1.0], [0.6, -1.9]], "near_graze": [1, 0],
            "smallest_gap_margin": [1e-4, np.inf],
            "running_exponent": np.zeros((2, 2, 5)), "running_time": np.ones((2, 5)),
            "status": ["ok", "ok"],
        },
        "rate": "bit/s", "states": ("x", "v"), "gap_unit": "m", "units": {"frequency": "Hz"},
        "varied": {"frequency": np.array([5.0, 7.0])},
        "attrs": {"algorithm": "by hand", "parameters": "{}", "settings": [1, 2]},
    }  # fmt: skip
    return made_results.exponents(**{**arguments, **changes})


def test_names_dims_and_units():
    ds = made()
    assert ds["lyapunov_exponent"].dims == ("trajectory", "exponent")
    assert ds["lyapunov_exponent"].attrs["units"] == "bit/s"
    assert ds["smallest_gap_margin"].attrs["units"] == "m"
    assert ds["frequency"].dims == ("trajectory",)
    assert ds["frequency"].attrs["units"] == "Hz"
    assert ds["near_graze"].attrs["flag_meanings"] == "clear_of_grazes near_graze"
    assert ds.attrs["settings"] == "[1, 2]"
    for name, variable in ds.variables.items():
        assert variable.attrs["long_name"], name


@pytest.mark.parametrize("suffix", [".nc"])
def test_files_keep_everything(tmp_path, suffix):
    ds = made()
    sl.save(ds, tmp_path / f"exponents{suffix}")
    assert sl.load(tmp_path / f"exponents{suffix}").identical(ds)


def test_description():
    lines = sl.describe(made()).splitlines()
    assert "measured by hand, 2 trajectories" in lines
    assert "  0: 3T, -0.5, -1 bit/s, the first +- 0.0e+00, near a graze" in lines
    assert "  1: chaotic, 0.5, -2 bit/s, the first +- 1.0e-01" in lines


def test_a_parameter_can_not_take_a_name_of_the_result():
    with pytest.raises(ParameterError, match="'kind' has the name"):
        made(varied={"kind": np.array([1.0, 2.0])})


def test_check_knows_the_kind():
    schema.check(made(), caller="plot.exponents", kinds=[schema.EXPONENTS])
    with pytest.raises(ParameterError, match="misses running_exponent"):
        schema.check(
            made().drop_vars("running_exponent"), caller="plot.exponents", kinds=[schema.EXPONENTS]
        )
    with pytest.raises(ParameterError, match=r"this Dataset is from sl\.lyapunov"):
        sl.settled(made())
