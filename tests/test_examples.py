"""The examples run as they stand but for their grids: a system of one's own through every question
of one study.
"""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import saltus as sl
from saltus.analysis.basins import pipeline
from saltus.cli.commands import app

PLATE = Path(__file__).parents[1] / "examples" / "plate"
BEAM = Path(__file__).parents[1] / "examples" / "beam"
EXAMPLE = Path(__file__).parents[1] / "examples" / "two_masses"

pytestmark = pytest.mark.slow


def saltus(*arguments):
    """The result of a command; faults that should have been caught surface as exceptions."""
    result = CliRunner().invoke(app, [str(one) for one in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """The output folder of the study on small grids, with what the command printed."""
    place = tmp_path_factory.mktemp("two_masses")
    shutil.copy(EXAMPLE / "two_masses.py", place)
    text = (EXAMPLE / "study.toml").read_text(encoding="utf-8")
    text = re.sub(r"count = \d+", "count = 8", text).replace("periods = 2000", "periods = 200")
    (place / "study.toml").write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "SCOUTS", 64)
        patch.setattr(pipeline, "CHECKED", 16)
        yield (
            place,
            saltus(
                "run",
                place / "study.toml",
                "--system",
                f"{place / 'two_masses.py'}:rig",
                "--out",
                place / "out",
            ),
        )


def test_every_question_is_answered(answered):
    place, printed = answered
    for name in (
        "run",
        "frequency-response",
        "bifurcation-diagram",
        "lyapunov-exponents",
        "basins",
    ):
        ds = sl.load(place / "out" / f"{name}.nc")
        assert ds.attrs["system"] == "rig"
        assert (place / "out" / f"{name}.png").stat().st_size > 5000, name
    for title in (
        "Frequency response",
        "Bifurcation diagram",
        "Lyapunov exponents",
        "share of starts",
    ):
        assert title in printed
    assert saltus("status", place / "out").count("done") >= 4


def test_the_sum_of_the_exponents_is_the_trace_of_damping(answered):
    """The divergence of the equations is constant: -(c1 + c2)/m1 - c2/m2 = -10 /s."""
    ds = sl.load(answered[0] / "out" / "lyapunov-exponents.nc")
    assert ds["exponent_sum"].values == pytest.approx([-10.0, -10.0], rel=1e-6)


def test_far_below_the_stop_the_response_is_linear(answered):
    """At 14 Hz the second mass stays off the stop: amplitude of the linear system, its complex
    stiffness solved by hand.
    """
    ds = sl.load(answered[0] / "out" / "frequency-response.nc")
    w = 2 * np.pi * 14
    dynamic = np.array(
        [[6000 - 2 * w**2 + 12j * w, -2000 - 4j * w], [-2000 - 4j * w, 2000 - w**2 + 4j * w]]
    )
    amplitude = abs(np.linalg.solve(dynamic, [2.0, 0.0])[0])
    assert ds["peak"].sel(frequency=14).values == pytest.approx([amplitude] * 3, rel=1e-6)


def test_the_beam_is_that_of_the_textbook(tmp_path):
    """Its frequencies are (beta L)^2 sqrt(EI/(rho A L^4)), its flexibility is L^3/(3 EI)."""
    beam = runpy.run_path(str(BEAM / "beam.py"))
    length, width, thickness = beam["LENGTH"], beam["WIDTH"], beam["THICKNESS"]
    rigidity = beam["YOUNG"] * width * thickness**3 / 12
    line = beam["DENSITY"] * width * thickness
    table = sl.structure_modes(*beam["matrices"](), 3, at=beam["TIP"], names=beam["NAMES"])
    roots = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])
    truth = roots**2 * np.sqrt(rigidity / (line * length**4)) / (2 * np.pi)
    assert np.abs(table.frequency.values / truth - 1).max() < 2e-5  # order 4 in the elements
    assert table.flexibility.item() == pytest.approx(length**3 / (3 * rigidity), rel=1e-7)
    text = (BEAM / "study.toml").read_text(encoding="utf-8")
    text = text.replace('"14 Hz", count = 21', '"9.2 Hz", count = 2')
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    saltus("run", tmp_path / "study.toml", "--system", f"{BEAM / 'beam.py'}:beam",
           "--out", tmp_path / "out")  # fmt: skip
    assert sl.load(tmp_path / "out" / "run.nc").sizes["contact"] == 6 * 12  # of those that are kept


def test_the_plate_is_that_of_the_textbook():
    """Square cantilevers of Poisson's ratio 0.3: omega a^2 sqrt(rho h/D) of Leissa, The free
    vibration of rectangular plates, J. Sound Vib. 31 (1973) 257-293, table C13 (by Ritz's method).
    """
    plate = runpy.run_path(str(PLATE / "plate.py"))["plate"]
    plate.__globals__.update(LENGTH=0.5, WIDTH=0.5, POISSON=0.3, THICKNESS=2e-3)
    mass, stiffness, names = plate(12, 12)
    young, density = plate.__globals__["YOUNG"], plate.__globals__["DENSITY"]
    rigidity = young * 2e-3**3 / 12 / (1 - 0.3**2)
    table = sl.structure_modes(mass, stiffness, 5, names=names)
    angular = 2 * np.pi * table.frequency.values
    found = angular * 0.5**2 * np.sqrt(density * 2e-3 / rigidity)
    assert found == pytest.approx([3.4917, 8.5246, 21.429, 27.331, 31.111], rel=6e-3)


def test_the_plate_in_a_study_is_that_in_python(tmp_path):
    """The quake of the study, its first stretch, and the contacts there."""
    example = runpy.run_path(str(PLATE / "plate.py"))
    example["write"](tmp_path)
    text = (PLATE / "study.toml").read_text(encoding="utf-8").replace('"2 s"', '"0.7 s"')
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    saltus("run", tmp_path / "study.toml", "--out", tmp_path / "out")
    run = sl.load(tmp_path / "out" / "run.nc")
    stops = [
        sl.Contact(f"w_9_{edge}", "100 kN/m", "0.5 mm", side="both", name=name)
        for edge, name in ((0, "left"), (7, "right"))
    ]
    times, values = np.loadtxt(tmp_path / "quake.csv", delimiter=",", skiprows=1).T
    plate = sl.structure(
        tmp_path / "plate.npz", modes=8, damping_ratio=0.01, contacts=stops,
        base=sl.Base("w", sl.recorded(times, values, "m/s^2")),
    )  # fmt: skip
    truth = sl.simulate(plate, np.zeros(16), t_end=0.7, progress=False)
    assert run.sizes["contact"] == truth.sizes["contact"] > 20
    names = {f"{name} {side}" for name in ("left", "right") for side in ("lower", "upper")}
    assert set(run["contact_guard"].values) == names
    for kind in (plate.states[:8], plate.states[8:]):  # a mode that isn't excited is rounding
        scale = max(float(abs(truth[name]).max()) for name in kind)
        for name in kind:
            assert abs(run[f"end_{name}"] - truth[f"end_{name}"]) < 1e-9 * scale


def test_a_buckled_beam_rests_on_either_side(tmp_path):
    """At +-sqrt(8/2) m it is stable, straight it isn't."""
    study = Path(__file__).parents[1] / "examples" / "buckled" / "study.toml"
    assert "Equilibria" in saltus("run", study, "--out", tmp_path / "out")
    ds = sl.load(tmp_path / "out" / "equilibria.nc")
    assert ds["equilibrium_x"].values == pytest.approx([-2, 0, 2], abs=1e-12)
    assert ds["equilibrium_stable"].values.tolist() == [1, 0, 1]
