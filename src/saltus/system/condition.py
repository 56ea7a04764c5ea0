"""Conditions at which a run ends: comparisons of time, states and parameters that a user adds to a
system, as text or as a function.

Text is a formula (:mod:`saltus.system.formula`) whose numbers may have units: ``"x > 2 mm"``. A
name of several words stands in quotes: ``"'stop force' > 5 N"``. Every comparison becomes a guard
of the system, behind its own, unless it means one of these.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from operator import or_
from typing import Any

from saltus.contact.boundaries import join_guards
from saltus.contact.guards import bits_in
from saltus.errors import ParameterError, TraceError, UnitError, nearest, shown
from saltus.language.dimensions import DimensionCheck
from saltus.language.evaluate import evaluate
from saltus.language.expression import (
    And,
    Bit,
    Condition,
    Expr,
    Not,
    Or,
    Relation,
    depends_on,
    observed,
    relations_in,
    select,
    substituted,
    varies,
    walk,
)
from saltus.system.formula import Formula, Formulas
from saltus.system.named_outputs import NamedOutputs
from saltus.system.quantity import with_surface
from saltus.system.read_off import called
from saltus.system.system import System
from saltus.units import coherent_unit, dimension, is_unit, to_si

#: A number and what may be its unit, in a formula.
_QUANTITY = re.compile(
    r"(?<![\w.])(?P<number>(?>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))\s*"
    r"(?P<unit>[^\W\d_]+(?:\^-?[\d.]+)?(?:[*/][^\W\d_]+(?:\^-?[\d.]+)?)*)(?![\w(])"
)
#: Pieces of forces that the comparisons of a condition are made of at most.
MOST_PIECES = 16
#: Words of formulas that may follow a number.
_WORDS = ("and", "or", "if", "else", "not")
#: The name of the parameter that holds a number with a unit, before its number.
_LEVEL = "until_level"
#: A name in quotes, and the beginning of the name that stands for it.
_QUOTED = re.compile(r"(['\"`])(?P<name>[^'\"`]*)\1")
_NAME = "until_name"


@dataclass(frozen=True)
class EndCondition:
    """A condition on the sides of guards.

    Attributes
    ----------
    system : System
        The system with the guards of the condition, and a parameter for each number with a unit.
    sides : Expr
        1 where the condition holds, 0 where it doesn't; it depends on sides alone.
    crossing : bool
        True if the user's function is a number: the condition is then that it has changed its sign.
    text : str
        The condition in words.
    """

    system: System
    sides: Expr
    crossing: bool
    text: str

    @property
    def guards(self) -> tuple[int, ...]:
        """Numbers of its guards."""
        return tuple(sorted(bits_in([self.sides])))


def end_condition(system: System, given: Any) -> EndCondition:
    """The condition of a user's text or function.

    Parameters
    ----------
    system : System
        Whose states and parameters it is about.
    given : str or callable
        A formula, or a function of (t, states, parameters), each by its name; see
        :func:`saltus.system.read_off.quantity`. A comparison, or several joined by ``and``, ``or``
        (in Python ``&``, ``|``), ends where it becomes true; a number where it crosses zero.

    Raises
    ------
    ParameterError, TraceError, UnitError
        If it can't be read, is about time or parameters alone, or compares different units.
    """
    outputs = system.outputs
    if isinstance(given, str):
        system, outputs, function = _from_text(system, given)
        text = " ".join(given.split())
    elif callable(given) and not isinstance(given, System):
        function, text = given, getattr(given, "text", "the condition")
    else:
        raise ParameterError(
            f'until must be a condition, such as "{system.states[0]} > 1 mm" or '
            f"lambda {system.states[0]}: {system.states[0]} > 1e-3, not {shown(given)}."
        )
    units = DimensionCheck(system.states, system.units)
    with observed(units):
        found = called(system, function, "the condition until", outputs)
    if isinstance(found, Condition):
        return _of_comparisons(system, _by_pieces(found, system.values, [MOST_PIECES]), text)
    if isinstance(found, Expr) and found.op != "const":
        extended = with_surface(system, lambda **_: found, "until")
        return EndCondition(extended, _sides(Bit(len(extended.guards) - 1)), True, f"{text} = 0")
    raise TraceError(
        f"the condition until of {system.name} is always {shown(found)}. Write a comparison of its "
        f"states, such as {system.states[0]} > 1e-3."
    )


def _sides(condition: Condition) -> Expr:
    return select(condition, 1.0, 0.0)


def _by_pieces(condition: Condition, values: Mapping[str, float], room: list[int]) -> Condition:
    """The same condition with comparisons of forces that have pieces as comparisons of these
    pieces: ``force > level`` as ``touches and spring > level``. Between contacts the pieces are
    linear where the whole isn't, so structures keep their method. ``room`` is the number of pieces
    that may be made yet.
    """
    match condition:
        case And(left, right):
            return _by_pieces(left, values, room) & _by_pieces(right, values, room)
        case Or(left, right):
            return _by_pieces(left, values, room) | _by_pieces(right, values, room)
        case Not(inner):
            return ~_by_pieces(inner, values, room)
        case Relation(gap=gap) if type(condition) is Relation and depends_on(gap, ("select",)):
            found = _piece_of(gap, values, room)
            return found if isinstance(found, Condition) else condition
    return condition


def _piece_of(gap: Expr, values: Mapping[str, float], room: list[int]) -> Condition | bool:
    """The condition that a gap with pieces is positive; a truth value if it is of levels alone."""
    piece = next((one for one in walk(gap) if one.op == "select"), None)
    if piece is None or not room[0]:
        names = {one.payload for one in walk(gap) if one.op == "param"}
        if varies(gap) or any(not name.startswith(_LEVEL) for name in names):
            return Relation(gap)
        return bool(evaluate([gap], values=values)[0] > 0)  # of numbers, which no run varies
    room[0] -= 1
    inside, outside = (
        _piece_of(substituted(gap, {piece: one}), values, room) for one in piece.args
    )
    there, parts = piece.payload, list[Condition]()
    for holds, truth in ((there, inside), (~there, outside)):
        if isinstance(truth, Condition):
            parts.append(holds & truth)
        elif truth:
            parts.append(holds)
    return functools.reduce(or_, parts) if parts else False


def _of_comparisons(system: System, condition: Condition, text: str) -> EndCondition:
    """The condition in terms of sides of guards."""
    try:
        (sides,), guards = join_guards([_sides(condition)], system.guards)
    except TraceError as error:
        raise TraceError(f"the condition until of {system.name}: ", error) from error
    if sides.op != "select":
        raise TraceError(
            f"the condition until of {system.name} is always {sides.payload == 1.0}: it compares "
            f"no states."
        )
    if next(relations_in(sides.payload), None) is not None:
        raise TraceError(
            lambda say: (
                f"the condition until of {system.name} compares the time. Give the end by "
                f"{say.key('t_end')}, and the rest of the condition by {say.key('until')}."
            )
        )
    return EndCondition(replace(system, guards=guards), sides, False, text)


# -- text ------------------------------------------------------------------------------------------
def _from_text(system: System, text: str) -> tuple[System, NamedOutputs, Callable[..., Any]]:
    """The system with a parameter for each number with a unit in a text, its outputs by the names
    that the text has for them, and the function that the text is.
    """
    levels: dict[str, tuple[float, str]] = {}
    known = ("t", *system.states, *system.outputs.names, *system.values)
    titles = {
        name if name.isidentifier() else f"{_NAME}_{i}": name
        for i, name in enumerate(system.outputs.names, 1)
    }
    outputs = replace(system.outputs, names=tuple(titles))

    def plain(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in known:
            raise ParameterError(
                f"until = {shown(text)}: {shown(name)} is neither t nor a state, an output or a "
                f"parameter of {system.name}. {nearest(name, known)}"
            )
        return next((short for short, title in titles.items() if title == name), name)

    def named(match: re.Match[str]) -> str:
        number, unit = match["number"], _unit(match, text, system)
        if not unit:
            return match[0]
        level = f"{_LEVEL}_{len(levels) + 1}"
        quantity = f"{number} {unit}"
        own = coherent_unit(quantity, "until")
        levels[level] = (to_si(quantity, own, "until"), own)
        return level + match["unit"][len(unit) :]

    written = _QUOTED.sub(plain, text)
    try:
        formula = Formula(_QUANTITY.sub(named, written), Formulas())
    except TraceError as error:
        _check_quotes(system, written, text)
        raise TraceError(f"until = {shown(text)}: ", error) from error
    values = {name: value for name, (value, _) in levels.items()}
    units = {name: unit for name, (_, unit) in levels.items()}
    for name in formula.names:
        if name not in known and name not in titles and name not in levels:
            _check_quotes(system, written, text)
            raise ParameterError(
                f"until = {shown(text)}: {shown(name)} is neither t nor a state or parameter of "
                f"{system.name}. {nearest(name, known)}"
            )
    if taken := [name for name in levels if name in system.units]:
        raise ParameterError(f"until: {system.name} has a name {taken[0]!r} already. Rename it.")
    own = dict(zip(titles, system.outputs.units, strict=True))
    _check_sides(formula, {**system.units, **own}, units, titles, text)
    extended = replace(system, values={**system.values, **values}, units={**system.units, **units})
    return extended, outputs, formula


def _check_quotes(system: System, written: str, text: str) -> None:
    """Raise a ParameterError for a name of several words without quotes."""
    for name in system.outputs.names:
        if not name.isidentifier() and name in written:
            raise ParameterError(
                f"until = {shown(text)}: write {name!r} in quotes, such as until=\"'{name}' > 0\"."
            )


def _check_sides(
    formula: Formula,
    units: dict[str, str],
    levels: dict[str, str],
    titles: dict[str, str],
    text: str,
) -> None:
    """Raise a UnitError where a name is compared with a number of another unit, or of none."""
    for node in ast.walk(formula.tree):
        if not isinstance(node, ast.Compare):
            continue
        sides = [node.left, *node.comparators]
        for one, other in [*pairwise(sides), *pairwise(sides[::-1])]:
            own = units.get(one.id, "") if isinstance(one, ast.Name) else ""
            if own in ("", "1"):
                continue
            what = titles.get(ast.unparse(one), ast.unparse(one))
            number = ast.unparse(other)
            if re.fullmatch(r"-?[\d.e+-]+", number) and float(number):
                raise UnitError(
                    f"until = {shown(text)}: {number} has no unit, and {what!r} is in {own}. Write "
                    f"{f'{number} {own}'!r}."
                )
            level = levels.get(number.lstrip("-"))
            if level and what in titles.values() and dimension(level) != dimension(own):
                raise UnitError(
                    f"until = {shown(text)}: {what!r} is in {own}, and is compared with a number "
                    f"in {level}."
                )


def _unit(match: re.Match[str], text: str, system: System) -> str:
    """The longest unit behind a number; "" if there is none.

    Raises
    ------
    ParameterError
        If a factor of it could be a state or a parameter as well.
    """
    unit = match["unit"]
    while unit and not is_unit(unit):
        cut = max(unit.rfind("*"), unit.rfind("/"), 0)
        unit = unit[:cut]
    if not unit and match["unit"] not in _WORDS:
        raise UnitError(
            f"until = {shown(text)}: the unit {shown(match['unit'])} can't be read. Write it like "
            f"2 mm, 0.5 m/s, 3 kN; a product with a sign: 2*{match['unit']}."
        )
    end = match.start("unit") + len(unit)
    before, behind = match.string[: match.start()].rstrip(), match.string[end:].lstrip()
    alone = before.endswith("(") and behind.startswith(")")
    factors = re.split(r"[*/]", unit)[1:]
    doubtful = [one for one in factors if one.partition("^")[0] in system.units]
    if doubtful and not alone:
        raise ParameterError(
            f"until = {shown(text)}: {doubtful[0]!r} could be a unit or the {doubtful[0]!r} of "
            f"{system.name}. Put a number with its unit into brackets: ({match['number']} {unit})."
        )
    return unit
