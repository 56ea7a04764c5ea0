"""Display units, regions and the palette."""

import math
import os
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from saltus.errors import ParameterError
from saltus.plot import regions
from saltus.plot.axes import draw_points
from saltus.plot.style import OKABE_ITO, display_scale, style


@pytest.mark.parametrize(
    ("unit", "largest", "shown", "factor"),
    [
        ("m", 4.7e-3, "mm", 1e3),
        ("m", 0.3, "mm", 1e3),
        ("m", 2.0, "m", 1.0),
        ("m", 2e-5, "µm", 1e6),
        ("m/s", 0.43, "m/s", 1.0),
        ("m/s", 0.03, "mm/s", 1e3),
        ("s", 4.0, "s", 1.0),
        ("s", 4000.0, "s", 1.0),
        ("s", 0.03, "ms", 1e3),
        ("N", 1.4e4, "kN", 1e-3),
        ("rad", 0.01, "rad", 1.0),
        ("rad/s", 1e-5, "rad/s", 1.0),
        ("kg", 1e-3, "kg", 1.0),
        ("", 1e-3, "", 1.0),
        ("1", 1e-9, "1", 1.0),
        ("m", 0.0, "m", 1.0),
    ],
)
def test_units_suit_the_numbers(unit, largest, shown, factor):
    scale = display_scale(unit, largest)
    assert scale.unit == shown
    assert math.isclose(scale.factor, factor)


@pytest.mark.parametrize(("unit", "wanted"), [("rad", "deg"), ("rad/s", "deg/s")])
def test_angles_are_shown_in_degrees_if_asked(unit, wanted):
    assert math.isclose(display_scale(unit, 0.01, wanted).factor, 180 / math.pi)
    with pytest.raises(ParameterError, match=f"Known: {unit}, m{unit}, {wanted}"):
        display_scale(unit, 0.01, "turn")


def test_texts():
    scale = display_scale("m", 1e-3)
    assert scale.label("x") == "x [mm]"
    assert display_scale("", 1.0).label("x") == "x"
    assert scale.text(-0.4e-3) == "\N{MINUS SIGN}0.4 mm"
    assert scale.text(-0.0) == "0 mm"


def dataset(names, values):
    n = len(names)
    return xr.Dataset(
        {
            "guard_state": ("guard", np.array(["x"] * n, dtype=np.str_)),
            "guard_boundary": ("guard", np.array(values, dtype=float)),
        },
        {"guard": np.array(names, dtype=np.str_)},
    )


@pytest.mark.parametrize(
    ("names", "values", "labels"),
    [
        (["lower_gap", "upper_gap"], [-1, 1], ["lower contact", "free", "upper contact"]),
        (["upper_gap", "lower_gap"], [1, -1], ["lower contact", "free", "upper contact"]),
        (["lower_gap", "upper_gap"], [0, 0], ["lower contact", "free", "upper contact"]),
        (["lower_gap", "upper_gap"], [0.2, 0.8], ["lower contact", "free", "upper contact"]),
        (["first_gap", "second_gap"], [0.4, 1.0], ["free", "first contact", "second contact"]),
        (["stop"], [0.3], ["free", "beyond stop"]),
        (["a = a_gap"], [0.3], ["free", "beyond a = a gap"]),
        (["stop"], [-0.3], ["beyond stop", "free"]),
        (["stop"], [0.0], ["free", "beyond stop"]),
        (["lower_gap"], [0.0], ["lower contact", "free"]),
    ],
)
def test_which_region_is_free(names, values, labels):
    found = regions.along(dataset(names, values), "x")
    assert [region.label for region in found.regions] == labels
    assert [region.contact for region in found.regions] == [label != "free" for label in labels]
    assert [region.color == OKABE_ITO["green"] for region in found.regions] == [
        label == "free" for label in labels
    ]


def test_bits_lead_to_regions_in_any_order():
    found = regions.along(dataset(["upper_gap", "lower_gap"], [1, -1]), "x")
    assert found.of(np.array([0b00, 0b10, 0b11])).tolist() == [0, 1, 2]


def test_opposite_gaps_keep_free_green():
    """Between two bodies the gaps of a freeplay may point away from each other: none positive is
    free.
    """
    ds = dataset(["a", "b"], [np.nan, np.nan]).assign(
        guard_state=("guard", np.array(["", ""])),
        mode=("time", [0, 1, 0, 2]),
        contact_mode_after=("contact", [1, 0]),
    )
    found = regions.find(ds, ["y"])
    assert [region.label for region in found.regions] == ["free", "beyond a", "beyond b"]
    assert found.regions[0].color == OKABE_ITO["green"]


@pytest.mark.parametrize(
    ("names", "modes", "labels"),
    [
        (["rub"], [0, 1], ["below rub", "above rub"]),
        (["x - y = gap"], [0, 1], ["x - y < gap", "x - y > gap"]),
        (["lower", "upper"], [0, 1, 3], ["beyond lower", "free", "beyond upper"]),
        # which of them is free isn't known
        (["lower", "upper"], [1, 3], ["below upper", "above upper"]),
        (["lower", "upper"], [1], [""]),  # nothing is met
    ],
)
def test_sides_of_guards_that_bound_no_state_have_names(names, modes, labels):
    ds = dataset(names, [np.nan] * len(names)).assign(
        guard_state=("guard", np.array([""] * len(names))),
        mode=("time", modes),
        contact_mode_after=("contact", modes[:1]),
    )
    assert [region.label for region in regions.find(ds, ["y"]).regions] == labels


def test_a_notebook_stays_interactive(tmp_path):
    """Notebooks' backend switches interaction on when it is loaded, which the first picture does;
    later pictures need it too.
    """
    (tmp_path / "notebook_backend.py").write_text(
        "import matplotlib\nfrom matplotlib.backends.backend_agg import FigureCanvas, "
        "FigureManager\nmatplotlib.interactive(True)\n"
    )
    program = (
        "import matplotlib, matplotlib.pyplot as plt, saltus as sl\nwith sl.plot.style(): "
        "plt.figure()\nassert matplotlib.is_interactive()"
    )
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    environment = os.environ | {"MPLBACKEND": "module://notebook_backend", "PYTHONPATH": paths}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


def test_micro_is_understood_as_keyboards_write_it():
    assert display_scale("m", 1e-4, "um") == display_scale("m", 1e-4, "µm")


def test_ticks_keep_what_a_picture_chose_and_the_style_where_it_chose_nothing():
    with style():
        _, ax = plt.subplots()
        top = ax.secondary_xaxis("top")
        top.tick_params(length=0)
    with plt.rc_context({"xtick.major.size": 77.0}):
        assert top.xaxis.get_major_ticks()[0].tick2line.get_markersize() == 0
        assert 0 < ax.xaxis.get_major_ticks()[0].tick1line.get_markersize() < 77
    plt.close("all")


def test_a_point_at_the_limit_is_drawn_whole_and_one_beyond_is_not():
    def ink(x):
        """Pixels left of the frame that a point at ``x`` blackens."""
        figure, ax = plt.subplots(dpi=100)
        ax.set_axis_off()
        draw_points(ax, np.array([x]), np.array([0.5]), marker="o", ms=20, color="black")
        ax.set_xlim(0, 1)
        ax.set_ylim(0, 1)
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())[:, : int(ax.bbox.x0), 0]
        plt.close(figure)
        return int((pixels < 128).sum())

    half = 0.5 * np.pi * (10 * 100 / 72) ** 2
    assert ink(0.0) == pytest.approx(half, rel=0.1)
    assert ink(-1.0) == 0
    assert ink(0.5) == 0
