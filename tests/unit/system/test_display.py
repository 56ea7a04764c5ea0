"""How a System looks."""

import re

import numpy as np
import pytest

import saltus as sl
from saltus.language import abs, atan, piecewise, sqrt
from saltus.language.latex import latex_name
from saltus.models import MODELS, delangre
from saltus.system import system
from saltus.system.display import latex_lines

TEXT = """\
System delangre: 2 states, 2 guards, forced at frequency = 15 Hz (T = 66.6667 ms)
states      x [m], v [m/s]
equations   dx/dt = v
            dv/dt = -2*damping_ratio*(2*pi*natural_frequency)*v - (2*pi*natural_frequency)**2*x - \
cubic/mass*x**3 - contact_stiffness/mass*piecewise((x + lower_gap, x < -lower_gap), \
(x - upper_gap, x > upper_gap), otherwise=0) + \
force*(1 - 18/(2*pi*frequency)**2)*cos(2*pi*frequency*t)/mass
guards      lower_gap  x = -lower_gap  (0 m)
            upper_gap  x = upper_gap  (0.4 mm)
parameters  mass               3 kg
            damping_ratio      0.03
            natural_frequency  5 Hz
            cubic              700 MN/m^3
            contact_stiffness  14 kN/m
            lower_gap          0 m
            upper_gap          0.4 mm
            force              4 N
            frequency          15 Hz
"""


def test_repr_of_the_rig():
    assert repr(delangre()).startswith(TEXT)


def test_an_angle_is_shown_in_degrees_too():
    @system(states="a", units={"a": "rad"})
    def pendulum(t, a, *, stop="2 deg", slope=1.0):
        return -slope * (a - stop)

    assert "stop   0.0349066 rad (2 deg)" in repr(pendulum)
    assert "0.0349066 rad (2 deg)" in pendulum._repr_html_()


def test_equations_are_the_lines_of_repr():
    assert delangre().equations()[0] == "dx/dt = v"
    assert delangre().equations()[1] in TEXT


def test_a_system_without_anything():
    @system(states="x")
    def decay(t, x):
        return -x

    assert repr(decay) == (
        "System decay: 1 state, 0 guards, not forced\nstates      x\nequations   dx/dt = -x"
    )
    assert "table" not in decay._repr_html_()


def test_what_a_record_drives_is_not_called_free():
    shaken = sl.recorded([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, -1.0, 0.0], "N")

    @system(states="x")
    def driven(t, x):
        return shaken(t) - x

    assert "0 guards, driven by functions of the time" in repr(driven).splitlines()[0]


def test_the_guards_of_a_large_structure_fit_the_line():
    count = 13
    names = [f"a_node_{i}" for i in range(count)]
    stops = [sl.Contact(name, restitution=0.5, gap=1e-3, side="both") for name in names]
    matrix = np.eye(count)
    lines = repr(sl.structure(matrix, 1e6 * matrix, names=names, contacts=stops)).splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("guards"))
    block = [line for line in lines[begin:] if line.startswith(("guards", " " * 12))]
    assert max(map(len, lines)) <= 100
    assert "at rest" not in " ".join(block)  # hold guards count as no boundary in the first line


def test_shared_parts_are_named_and_names_do_not_clash():
    @system(states="x s1")
    def clash(t, x, s1, *, a_long_parameter_name=1.0, another_long_parameter_name=2.0):
        shared = (
            a_long_parameter_name * x**2
            + another_long_parameter_name * s1**2
            + abs(x) * a_long_parameter_name
        )
        return s1 * shared, -x * shared

    lines = clash.equations()
    assert lines[0].startswith("s2 = ")
    assert lines[1:] == ["dx/dt = s1*s2", "ds1/dt = -x*s2"]


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("x", "x"), ("x1", "x_{1}"), ("omega", r"\omega"), ("x_max", r"x_{\mathrm{max}}"),
        ("k_1", "k_{1}"), ("k_c", "k_{c}"),
        ("upper_gap", r"\mathrm{upper\_gap}"), ("zeta_n", r"\zeta_{n}"),
        ("m2_b", r"m_{\mathrm{2 b}}"), ("a_b_c", r"\mathrm{a\_b\_c}"),
        ("größe", r"\mathrm{gr\text{ö}\text{ß}e}"),
    ],
)  # fmt: skip
def test_names_in_formulas(name, latex):
    assert latex_name(name) == latex


def test_formulas_of_the_rig():
    first, second = latex_lines(delangre())
    assert first == r"\dot{x} &= v"
    assert second.startswith(
        r"\dot{v} &= -2 \, \mathrm{damping\_ratio} \, 2 \pi \, "
        r"\mathrm{natural\_frequency} \, v - {\left(2 \pi \, "
    )
    drive = (
        r"\frac{\mathrm{force} \, \left(1 - \frac{18}{{\left(2 \pi \, "
        r"\mathrm{frequency}\right)}^{2}}\right) \, \cos\left(2 \pi"
    )
    assert drive in second
    assert r"x + \mathrm{lower\_gap} & \text{if } x \lt -\mathrm{lower\_gap} \\" in second


def test_conditions_in_formulas():
    @system(states="x v")
    def rig(t, x, v):
        return v, piecewise((sqrt(1 + x**2) * 7e8, (x > 1) & ~(v < 0) | (v > 3)), otherwise=atan(x))

    formula = latex_lines(rig)[1]
    assert r"\left(x \gt 1\right) \;\text{and}\; \left(v \gt 0\right)" in formula
    assert r"\;\text{or}\; \left(v \gt 3\right)" in formula
    assert r"\sqrt{1 + x^{2}} \, 7 \cdot 10^{8}" in formula
    assert r"\arctan\left(x\right)" in formula


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_formulas_are_balanced(model):
    for line in latex_lines(model()):
        assert line.count("{") == line.count("}")
        assert line.count(r"\left(") == line.count(r"\right)")
        assert line.count(r"\begin") == line.count(r"\end")
        assert "**" not in line


def test_html_is_escaped():
    @system(states="x", name="<script>alert(1)</script>", source="<b>")
    def rig(t, x, *, gap=1.0):
        """<i>x</i> & y"""
        return abs(x) - gap

    view = rig._repr_html_()
    assert "<script>" not in view
    assert "<i>" not in view
    assert "&lt;i&gt;x&lt;/i&gt; &amp; y" in view
    assert not re.search(r"&(?!amp;|lt;|gt;|quot;|#x27;)", view)


def test_a_boundary_of_a_choice_keeps_the_comparison_in_it():
    @sl.system(states="x v")
    def stopped(t, x, v, *, k=3.0, gap=0.1):
        return v, -x - sl.piecewise((k * x, sl.abs(x) > gap), otherwise=0)

    assert "piecewise((x, x > 0), otherwise=-x) = gap" in str(stopped)
