"""Formulas: text that means what the same line of an equation means, and nothing else."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import TraceError
from saltus.language import curve
from saltus.models import MODELS
from saltus.system.formula import DEPTH, LONGEST, Equations, Formulas
from saltus.system.read_off import quantity

RIG = sl.models.delangre("b")


def expression(text, book=None):
    return quantity(RIG, (book or Formulas()).formula(text))[0]


# the rates are read without the laws behind them, whose parameters are then unused
@pytest.mark.filterwarnings("ignore::saltus.errors.UnusedParameterWarning")
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_printed_equations_are_formulas_of_the_same_system(model):
    made = model()
    terms, rates = {}, {}
    resets = [guard for guard in made.guards if guard.law and guard.law.reset]
    lines = [line for line in made.equations() if " becomes " not in line]
    for line in lines:
        left, right = line.split(" = ", 1)
        (rates if "/" in left else terms)[left.removeprefix("d").removesuffix("/dt")] = right
    book = Formulas(terms)
    equations = Equations({name: book.formula(text) for name, text in rates.items()}, made.values)
    again = sl.system(
        states=list(rates), units=made.units, forced_at=made.forced_at, name=made.name
    )(equations)
    y = np.random.default_rng(1).uniform(-3e-3, 3e-3, (len(made.states), 50))
    np.testing.assert_allclose(again.rhs(0.01, y), made.rhs(0.01, y), rtol=1e-13)
    assert resets or len(again.guards) == len(made.guards)


@pytest.mark.parametrize(
    ("text", "function"),
    [
        ("force*cos(2*pi*t) - -mass*x**2/3", lambda t, x, force,
            mass: force * sl.cos(2 * sl.pi * t) + mass * x**2 / 3),
        ("x if x > upper_gap else -v", lambda x, v,
            upper_gap: sl.piecewise((x, x > upper_gap), otherwise=-v)),
        ("where(-1 < x < 1 and not v > 0, 1, 2)", lambda x,
            v: sl.where((x > -1) & (x < 1) & ~(v > 0), 1, 2)),
        ("where((x > 0) | (v < 0), 1, 2)", lambda x, v: sl.where((x > 0) | (v < 0), 1, 2)),
        ("max(x, v, 1) + abs(+x)", lambda x, v: sl.max(x, v, 1) + abs(x)),
        ("freeplay(x, stiffness=mass, gap=upper_gap)", lambda x, mass,
            upper_gap: sl.freeplay(x, stiffness=mass, gap=upper_gap)),
        ("mod(t, 1/frequency) + t % 2", lambda t,
            frequency: sl.mod(t, 1 / frequency) + sl.mod(t, 2)),
        ("2 if 3 > 1 else x", lambda: 2.0),
        ("(x\n + v)", lambda x, v: x + v),
    ],
)  # fmt: skip
def test_a_formula_is_what_the_line_of_an_equation_is(text, function):
    random = np.random.default_rng(2)
    values = {name: random.uniform(-2, 2, 40) for name in ("x", "v")}
    ours, theirs = (quantity(RIG, one) for one in (Formulas().formula(text), function))
    from saltus.language.evaluate import evaluate

    def numbers(found):
        bits = []
        for guard in found[1]:
            bits.append(
                evaluate([guard.gap], t=0.3, states=values, values=RIG.values, bits=bits)[0] > 0
            )
        return np.broadcast_to(
            evaluate([found[0]], t=0.3, states=values, values=RIG.values, bits=bits)[0], 40
        )

    np.testing.assert_allclose(numbers(ours), numbers(theirs), rtol=1e-14)


def test_terms_and_tables_are_shared():
    book = Formulas(
        {"a": "x + v", "b": "2*a"}, {"stop": curve([0, 1], [0, 5], "linear", "extend", "stop")}
    )
    formula = book.formula("b*mass + stop(t)")
    assert formula.names == ("mass", "t", "x", "v")
    assert formula(mass=3.0, t=0.5, x=1.0, v=2.0) == 20.5
    assert formula.data() == [
        "b*mass + stop(t)",
        {"b": ["2*a", {"a": ["x + v", {}, {}]}, {}]},
        {"stop": book.tables["stop"].fingerprint},
    ]
    with pytest.raises(TraceError, match="asks for 'later'"):
        expression("first", Formulas({"first": "later", "later": "x"}))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("__import__('os').system('ls')", "has no meaning in a formula"),
        ("x.__class__", "functions "
            "stand without a name before them"),
        ("sl.sin(x)", "write sin\\(x\\)"), ("x^2", "a power is written x\\*\\*2"),
        ("[x]", "no meaning"), ("x[0]", "no meaning"),
        ("lambda: x", "no meaning"), ("(x := 1)", "no meaning"), ("'x'", "no meaning"),
        ("f'{x}'", "no meaning"), ("1j", "no meaning"),
        ("True", "no meaning"), ("...", "no meaning"), ("sin(*x)", "no meaning"),
        ("sin(**x)", "no meaning"), ("x @ v", "'x @ v' has no"),
        ("x << 2", "no meaning"), ("x is v", "no meaning"), ("x == v", "two sides of a boundary"),
        ("(lambda: 0)()", "no meaning"),
        ("[x for x in (1, 2)]", "no meaning"), ("yield x", "no meaning"), ("x; v", "can't be read"),
        ("", "1 to 1000 characters"),
        ("(" * 300 + "x" + ")" * 300, "can't be read"),
        ("-" * (DEPTH + 1) + "x", "nested too deeply"), ("x +", "can't be read"),
        ("x" * (LONGEST + 1), "1 to 1000 characters"), ("9**9**9**9", "has no value"),
        ("1/0", "has no value"),
        ("sin(x, v)", "has no value"),
        ("sweep(5, 40, 5)", "write sweep\\(t, first, last, rate\\)"),
        ("sweep(t, 5, 40, 5, amplitude=2)", "as 2\\*sweep\\(t, 5, 40, 5\\)"),
        ("nothing(x)", "there is no function 'nothing'"), ("xx", "Did you mean 'x'"),
        ("x if v else 1", "'v' is no condition"),
        ("~x", "'x' is no condition"), ("1e999*x", "must be finite"),
        ("x if 1 else v", "'1' is no condition"),
    ],
)  # fmt: skip
def test_what_has_no_meaning_is_refused_in_a_sentence(text, told):
    with pytest.raises(TraceError, match=told):
        expression(text)


@pytest.mark.parametrize(
    ("terms", "tables", "told"),
    [
        ({"sin": "x"}, (), "'sin' can't be the name"), ({"pi": "3"}, (), "'pi' can't be the name"),
        ({"a b": "x"}, (), "letters, digits"),
        ({"stop": "x"}, ("stop",), "it is one of both"), ({"t": "x"}, (), "means something else"),
    ],
)  # fmt: skip
def test_names_of_terms_and_tables(terms, tables, told):
    with pytest.raises(TraceError, match=told):
        Formulas(terms, {name: curve([0, 1], [0, 1], "linear", "hold", name) for name in tables})


def test_names_of_states_and_parameters():
    book = Formulas({"pull": "2*x"})
    rates = {"x": book.formula("pull - a*x")}
    assert sl.system(states="x", name="one")(Equations(rates, {"a": 3.0})).rhs(
        0.0, [2.0]
    ).tolist() == [-2.0]
    for parameters, told in (
        ({"pull": 1.0}, "'pull' is the name of a term"),
        ({"pi": 1.0}, "'pi'"),
        ({"a b": 1.0}, "letters, digits"),
        ({}, "'a' is no"),
    ):
        with pytest.raises(TraceError, match=told):
            sl.system(states="x", name="one")(Equations(rates, parameters))
