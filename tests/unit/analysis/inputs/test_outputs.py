"""Outputs: their units follow from their formulas, and what is said of them must fit."""

import pytest

import saltus as sl
from saltus.analysis.dataset_parts import gap_unit, gap_units
from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import UnitError

CHAIN = sl.models.chain()


@pytest.mark.parametrize(
    ("formula", "unit"),
    [
        (lambda x1, x2: x2 - x1, "m"),
        (lambda x1, ground_stiffness: ground_stiffness * x1, "N"),
        (
            lambda x1, ground_stiffness, ground_gap: ground_stiffness * sl.max(x1 - ground_gap, 0),
            "N",
        ),
        (lambda v1, ground_damping: ground_damping * v1**2, "W"),
        (lambda x1: 3.7 * x1, ""),  # a number of any unit
        (lambda x1, v1: x1 + v1, ""),
        (lambda x1, x2: x1 / x2, ""),  # a plain number, or an angle
    ],
)
def test_a_formula_tells_its_unit(formula, unit):
    assert outputs_of(CHAIN, {"one": formula}).units[-1] == unit


def test_a_unit_that_does_not_fit_the_formula_is_refused():
    with pytest.raises(UnitError, match="'one' is said to be in m, but its formula is in N"):
        outputs_of(CHAIN, {"one": (lambda x1, ground_stiffness: ground_stiffness * x1, "m")})
    torque = outputs_of(
        sl.models.aeroelastic(),
        {"one": (lambda pitch, pitch_stiffness: pitch_stiffness * pitch, "N")},
    )
    assert torque.units[-1] == "N"  # per metre of span


def test_nothing_is_said_of_equations_whose_units_are_not_checked():
    @sl.system(states="x v", units={"x": "m", "v": "m/s"}, check_units=False)
    def loose(t, x, v, *, stiffness="3 N/m"):
        return v, -stiffness * x

    assert (
        outputs_of(loose, {"one": (lambda x, stiffness: stiffness * x, "m/s^2")}).units[-1]
        == "m/s^2"
    )


def test_gaps_between_states_have_a_unit_too():
    assert gap_units(CHAIN) == ["m"] * 4
    assert gap_unit(CHAIN) == "m"
    assert gap_units(sl.models.aeroelastic()) == ["rad", "rad"]
