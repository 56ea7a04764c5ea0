"""Which terms have no Taylor series on a boundary, and which laws are refused."""

from __future__ import annotations

import pytest

import saltus as sl
from saltus.contact.singular import set_aside
from saltus.errors import TraceError
from saltus.language.evaluate import evaluate


def traced(law, states="x v"):
    @sl.system(states=states)
    def system(t, x, v, *, K=2.0, g=0.1, n=1.5):
        return v, -law(x, v, K, g, n)

    return system


def own(system):
    aside = set_aside(system.field, system.guards)
    return [system.guards[number].name for number in aside.guards]


@pytest.mark.parametrize(
    "law",
    [
        lambda x, v, K, g, n: n * sl.piecewise((K * (x - g) ** 1.5, x > g), otherwise=0),
        lambda x, v, K, g, n: sl.piecewise((K * (x - g) ** n, x > g), otherwise=0),
        lambda x, v, K, g, n: (
            n * sl.piecewise(((x / g - 1) ** 1.5 * (1 + K * v), x > g), otherwise=0)
        ),
        lambda x, v, K, g, n: n * K * sl.max(x - g, 0) ** 1.5,
        lambda x, v, K, g, n: (
            n * sl.piecewise(((x - g) * sl.sqrt(K * x - K * g), x > g), otherwise=0)
        ),
        lambda x, v, K, g, n: (
            n * K * sl.piecewise(((x - g) * sl.log((x - g) / g), x > g), otherwise=0)
        ),
        lambda x, v, K, g, n: (
            n * K * sl.piecewise((sl.sqrt(K * sl.sqrt(x - g)), x > g), otherwise=0)
        ),
        lambda x, v, K, g, n: n * K * sl.piecewise(((x - g) / sl.sqrt(x - g), x > g), otherwise=0),
        lambda x, v, K, g, n: n * K * sl.piecewise(((x**2 - g**2) ** 1.5, x > g), otherwise=0),
        lambda x, v, K, g, n: n * K * sl.piecewise(((x - g) ** (1.5 + v), x > g), otherwise=0),
    ],
)
def test_terms_without_a_series_are_found(law):
    assert own(traced(law)) == ["g"]


@pytest.mark.parametrize(
    "law",
    [
        lambda x, v, K, g, n: n * sl.piecewise((K * (x - g) ** 3, x > g), otherwise=0),
        lambda x, v, K, g, n: (
            n * sl.piecewise((K * (x - g), x > g), otherwise=0) + sl.sqrt(1 + x * x)
        ),
        lambda x, v, K, g, n: (
            n * sl.piecewise((K * sl.sqrt(1 + x - g), x > g), otherwise=0) + 1 / (2 + x)
        ),
        lambda x, v, K, g, n: n * K * sl.piecewise((sl.atan2(v, x), x > g), otherwise=0),
    ],
)
def test_analytic_laws_are_left_alone(law):
    system = traced(law)
    aside = set_aside(system.field, system.guards)
    assert aside.guards == ()
    assert all(new is old for new, old in zip(aside.field, system.field, strict=True))


def test_terms_are_switched_off_and_nothing_else():
    system = traced(
        lambda x, v, K, g, n: 3 * x + n * sl.piecewise((K * (x - g) ** 1.5 + v, x > g), otherwise=0)
    )
    aside = set_aside(system.field, system.guards)
    (_, calm) = evaluate(
        aside.without(0), states={"x": 0.2, "v": 0.5}, values=system.values, bits=[True]
    )
    assert calm == -(3 * 0.2 + 1.5 * 0.5)


@pytest.mark.parametrize(
    "law",
    [
        lambda x, v, K, g, n: n * sl.piecewise((K * (x - g) ** -0.5, x > g), otherwise=0),
        lambda x, v, K, g, n: n * sl.piecewise((K / (x - g), x > g), otherwise=0),
        lambda x, v, K, g, n: n * sl.piecewise((K * sl.log(x - g), x > g), otherwise=0),
    ],
)
def test_a_force_that_is_infinite_on_its_boundary_is_refused(law):
    with pytest.raises(
        TraceError,
        match=r"dv/dt is infinite on the boundary 'g'.*Write a law that "
        r"is finite there",
    ):
        traced(law)


def test_a_sign_of_a_power_of_a_piece_is_refused_and_the_same_law_as_one_piece_is_not():
    """Hunt and Crossley's contact without tension: as max(force, 0) its gap is zero wherever there
    is no contact.
    """
    with pytest.raises(
        TraceError,
        match=r"asks for the sign of a law "
        r".*sl\.piecewise\(\(K\*d\*\*1\.5",
    ):
        traced(lambda x, v, K, g, n: n * sl.max(K * sl.max(x - g, 0) ** 1.5 * (1 + v), 0))
    law = traced(
        lambda x, v, K, g, n: (
            n * sl.piecewise((K * (x - g) ** 1.5 * (1 + v), (x > g) & (1 + v > 0)), otherwise=0)
        )
    )
    assert len(law.guards) == 2


def test_a_power_of_a_piece_is_a_piece_of_powers():
    """The other branch has no power of zero, whose series would be no number."""
    system = traced(lambda x, v, K, g, n: n * K * sl.max(x - g, 0) ** 1.5)
    assert "piecewise(((x - g)**1.5, guard0 > 0), otherwise=0)" in repr(system.field[1])
