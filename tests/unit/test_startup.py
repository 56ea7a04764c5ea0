"""What a process imports that does one thing: told by the modules, since a clock would depend on
the load.
"""

import subprocess
import sys

import pytest

#: What takes long to import, installed or not. pandas isn't among them: xarray imports it.
HEAVY = {
    "scipy.stats", "scipy.optimize", "scipy.spatial", "scipy.interpolate", "scipy.io", "matplotlib",
    "pydantic", "typer", "rich",
    "zarr", "h5py", "h5netcdf", "netCDF4", "dask.array", "distributed", "pint", "sympy", "heyoka",
}  # fmt: skip
RIG = 'rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")\n'


def imported(code: str) -> set[str]:
    """Modules in a process that did this."""
    command = f"import sys\nimport saltus as sl\n{code}\nprint(*sorted(sys.modules))"
    return set(
        subprocess.run(
            [sys.executable, "-c", command], check=True, capture_output=True, text=True
        ).stdout.split()
    )


def test_the_package_alone_is_next_to_nothing():
    rooms = {f"saltus.{room}" for room in ("language", "contact", "system", "analysis")}
    assert not imported("") & (HEAVY | rooms | {"numpy", "numba", "llvmlite", "pandas", "xarray"})


@pytest.mark.parametrize("start", ["(0.0, 0.0)", '{"x": [0.0, 1e-3], "v": 0.0}'])
def test_a_run_imports_what_it_needs(start):
    """Trajectories, their contacts, time errors and the Dataset with its provenance: NumPy, xarray
    and the kernels.
    """
    modules = imported(
        f"{RIG}run = sl.simulate(rig, start={start}, periods=2, "
        f"progress=False)\nassert run.sizes['contact'] > 0"
    )
    assert not modules & HEAVY
    rooms = {
        "motion",
        "motion.motion_arrays",
        "motion.sample_times",
        "motion.simulate",
        "motion.time_errors",
        "inputs",
        "inputs.axes",
        "inputs.outputs",
        "inputs.spans",
        "inputs.starts",
        "inputs.verb",
        "dataset_parts",
        "outcome_messages",
    }
    assert {name for name in modules if name.startswith("saltus.analysis.")} == {
        f"saltus.analysis.{name}" for name in rooms
    }


def test_other_verbs_leave_out_what_is_for_others():
    modules = imported("sl.basins, sl.attractors, sl.stroboscope, sl.load, sl.save")
    assert not modules & (HEAVY - {"scipy.optimize", "scipy.spatial"})


def test_colours_come_without_matplotlib():
    modules = imported("from saltus.plot.palette import hues\nassert hues(3).shape == (3, 3)")
    assert not modules & HEAVY


def test_every_picture_has_a_home():
    from saltus import plot

    assert all(callable(getattr(plot, one)) for one in plot.__all__ if one != "OKABE_ITO")
    assert "blue" in plot.OKABE_ITO


@pytest.mark.slow
@pytest.mark.parametrize("name", ["basins", "style"])
def test_a_picture_is_itself_whether_or_not_its_file_is_imported_first(name):
    imported(
        f"import saltus.plot.{name}\nfrom saltus import plot\n"
        f"assert plot.{name}.__name__ == {name!r} and callable(plot.{name})"
    )
