"""What holds for all tests: files that take long begin first, and no flow is compiled a second time
because it has worked for long.
"""

from __future__ import annotations

import gc
import math
import os
import warnings
from pathlib import Path

import pytest

# A process a core runs the tests: threads of linear algebra would wait for one another. Before
# NumPy is imported, and for all processes that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

#: Files in which tests take longest, longest first: no process is to begin one of them when all
#: others have ended. Of the first four all tests are slow.
LONGEST = (
    "truth/test_basins.py",
    "faults/test_study_faults.py",
    "test_examples.py",
    "unit/study/test_divided.py",
    "conformance/test_tiers.py",
    "conformance/test_every_verb.py",
    "unit/analysis/branches/test_branches.py",
    "truth/test_responses.py",
    "paper/test_figures.py",
    "conformance/test_outputs.py",
    "conformance/test_every_method.py",
    "truth/test_unstable_cycles.py",
    "unit/analysis/branches/test_graze_curves.py",
    "unit/analysis/branches/test_backbone.py",
    "truth/test_unforced.py",
    "unit/study/test_questions.py",
    "unit/analysis/attractors/test_aperiodic.py",
    "conformance/test_random_memory.py",
    "test_docstrings.py",
    "unit/analysis/attractors/test_noisy.py",
    "unit/cli/test_cli_maps.py",
    "faults/test_result_files.py",
    "truth/test_attractors.py",
    "unit/analysis/branches/test_bifurcation_curve.py",
    "conformance/test_laws.py",
    "truth/test_contact_peaks.py",
    "truth/test_modal_motions.py",
    "truth/test_modal_impact_derivatives.py",
    "unit/test_startup.py",
    "truth/test_lyapunov.py",
    "truth/test_rotors.py",
    "truth/test_periodic_orbits.py",
    "truth/test_modal_blocks.py",
    "unit/study/test_maps_run.py",
    "unit/analysis/responses/test_arcs.py",
    "unit/codegen/test_jets.py",
    "unit/plot/test_responses.py",
    "truth/test_impacts_by_method.py",
    "conformance/test_long_equations.py",
    "truth/test_steep_contacts.py",
    "truth/test_modal_friction_and_stops.py",
    "truth/test_orbit_sensitivity.py",
    "truth/test_modal_friction.py",
    "truth/test_elements.py",
    "truth/test_orbit_measures.py",
    "truth/test_impact_branches.py",
    "truth/test_basin_measures.py",
    "truth/test_modal_sweeps.py",
    "unit/results/files/test_files.py",
    "property/test_invariance.py",
    "truth/test_order.py",
    "unit/analysis/branches/test_equilibrium_branches.py",
    "unit/analysis/branches/test_ladders.py",
    "test_docs.py",
    "truth/test_wolf.py",
    "truth/test_one_orbit.py",
    "faults/test_interrupted_runs.py",
    "test_readme.py",
    "conformance/test_breaks.py",
    "unit/codegen/test_cache.py",
)

#: Where results are written as users write them, as netCDF-4.
NETCDF_4 = (
    "conformance/test_every_verb.py",
    "faults/test_result_files.py",
    "test_readme.py",
    "unit/results",
    "unit/study/test_run.py",
)


def pytest_configure():
    """Collecting makes a million objects, all of which stay: it isn't looked again and again for
    some that don't.
    """
    gc.disable()


def pytest_collection_finish():
    """Nor later, while tests run. What they make is looked at once there is more of it than by
    default.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 10, 50)
    gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Every second process begins with the last file of a folder: in a new clone it then reads half
    of the files as the other one has compiled them.
    """
    report = yield
    odd = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579"
    if odd and isinstance(collector, pytest.Directory):
        report.result.reverse()
    return report


def pytest_collection_modifyitems(config, items):
    """Whole files, in the order of LONGEST, all others by their names. --no-loadscope-reorder
    keeps the order (pyproject.toml).
    """
    here = Path(__file__).parent
    order = {here / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (order.get(item.path, len(order)), item.path))


@pytest.fixture(autouse=True, scope="session")
def never_steady():
    """A flow would be compiled again, in a process beside it, after two seconds of work: no test
    works long enough to gain by it.
    """
    from saltus.codegen import kernels

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "STEADY_AFTER", math.inf)
        yield


@pytest.fixture(autouse=True, scope="session")
def compiled_here():
    """No process of its own for a compilation that takes long: it begins by importing what is here
    already. unit/codegen/test_cache.py asks for one.
    """
    from saltus.codegen import building

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(building, "OTHER_PROCESS", math.inf)
        yield


@pytest.fixture(autouse=True, scope="module")
def netcdf_3(request):
    """Elsewhere they are written as if [io] weren't installed: in a fifteenth of the time."""
    here = Path(__file__).parent
    if any(request.path.is_relative_to(here / name) for name in NETCDF_4):
        yield
        return
    from saltus.results.files import export

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(export, "_has", lambda _: False)
        yield


@pytest.fixture(scope="module")
def few_scouts():
    """Maps of some ten cells, before which no thousand starts look for attractors."""
    from saltus.analysis.basins import pipeline

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "SCOUTS", 64)
        yield


@pytest.fixture
def ctrl_c_may_leave_files_open():
    """What a Ctrl-C that comes while a file is opened leaves to the collector is collected here,
    where it isn't another test's fault.
    """
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()
