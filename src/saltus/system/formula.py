"""Formulas: equations written as text, for files that must not hold code.

Text is parsed into Python's syntax tree and read node by node; nothing of it is ever run. A node
that has no meaning here is refused, so a formula can do arithmetic, compare, and call the functions
in :data:`FUNCTIONS`. What it gives is what the same line of an equation would.
"""

from __future__ import annotations

import ast
import inspect
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial, reduce
from typing import Any

from saltus import language
from saltus.contact.forces import flores, freeplay, hertz, hunt_crossley, lankarani_nikravesh
from saltus.contact.memory import play, slider
from saltus.errors import SaltusError, TraceError, nearest, shown
from saltus.language import functions, operations
from saltus.language.clocks import mod
from saltus.language.expression import Condition
from saltus.language.inputs import pulse, sawtooth, square
from saltus.language.names import why_no_name
from saltus.language.sweeps import sweep
from saltus.language.tables import Table, look_up

#: Longest formula [characters].
LONGEST = 1000
#: Deepest nesting of a formula: each level takes a few of Python's thousand nested calls.
DEPTH = 200


def _swept(
    t: Any = None, first: Any = None, last: Any = None, rate: Any = None, **named: Any
) -> Any:
    """A sine whose frequency is swept, at a time. Raises TraceError unless all are given."""
    if rate is None or named:
        raise TraceError(
            "in a formula a sweep is a value at a time: write sweep(t, first, last, rate), such "
            "as 2*sweep(t, 5, 40, 5), from 5 Hz to 40 Hz by 5 Hz/s."
        )
    return sweep(first, last, rate)(t)


#: Functions of formulas.
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(language, name) for name in operations.FUNCTIONS},
    "freeplay": freeplay, "hertz": hertz, "hunt_crossley": hunt_crossley,
    "lankarani_nikravesh": lankarani_nikravesh, "flores": flores, "mod": mod, "play": play,
    "slider": slider,
    "square": square, "sawtooth": sawtooth, "pulse": pulse,
    "sweep": _swept,
}  # fmt: skip
_CONSTANTS = {"pi": functions.pi}
_BINARY: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Mod: operator.mod, ast.BitAnd: operator.and_, ast.BitOr: operator.or_,
}  # fmt: skip
_COMPARED: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip
_NODES = (
    ast.Name, ast.Load, ast.Constant, ast.UnaryOp, ast.USub, ast.UAdd, ast.Not, ast.Invert,
    ast.BinOp, *_BINARY, ast.BoolOp, ast.And,
    ast.Or, ast.Compare, *_COMPARED, ast.IfExp, ast.Tuple, ast.Call, ast.keyword,
)  # fmt: skip
_MEANINGS = "a formula holds numbers, names, + - * / **, comparisons, functions"
_INSTEAD: dict[type[ast.AST], str] = {
    ast.BitXor: "a power is written x**2",
    ast.FloorDiv: "of a time the whole part is (t - mod(t, T))/T",
    ast.Attribute: "functions stand without a name before them: write sin(x)",
    ast.Eq: "write the two sides of a boundary with < or >",
    ast.NotEq: "write the two sides of a boundary with < or >",
}


class Formula:
    """A function of time, states and parameters written as text. It is called with them by name.

    Attributes
    ----------
    text : str
        As it was written.
    names : tuple of str
        What it needs, in the order of their first mention: the terms that it uses are looked
        through.
    tree : ast.expr
        Its syntax tree.
    """

    def __init__(self, text: str, book: Formulas):
        self.text, self.book, self.tree = text, book, _parsed(text)
        named = list(dict.fromkeys(_names(self.tree)))
        self._terms = [name for name in named if name in book.terms]
        inner = [name for term in self._terms for name in book.terms[term].names]
        self.names: tuple[str, ...] = tuple(
            dict.fromkeys([*(name for name in named if name not in book.terms), *inner])
        )
        self.place = f"the formula {shown(text)}"
        self.__signature__ = inspect.Signature(
            [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY) for name in self.names]
        )

    def __call__(self, **values: Any) -> Any:
        """The value for symbols or numbers. Raises TraceError if there is none."""
        terms = {
            term: self.book.terms[term](
                **{name: values[name] for name in self.book.terms[term].names}
            )
            for term in self._terms
        }
        try:
            return self._value(self.tree, {**_CONSTANTS, **values, **terms})
        except SaltusError as error:
            raise type(error)(f"{self.place}: ", error) from error
        except (ArithmeticError, TypeError, ValueError) as error:
            raise TraceError(f"{self.place} has no value: {error}.") from error

    def data(self) -> list[Any]:
        """All that the formula depends on, as JSON-able data: its text, those of its terms, and the
        fingerprints of the tables.
        """
        tables = {
            node.func.id
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        return [
            self.text,
            {term: self.book.terms[term].data() for term in self._terms},
            {
                name: self.book.tables[name].fingerprint
                for name in sorted(tables & self.book.tables.keys())
            },
        ]

    # -- reading -----------------------------------------------------------------------------------
    def _value(self, node: ast.AST, scope: Mapping[str, Any]) -> Any:
        match node:
            case ast.Constant(value=number):
                return float(number)  # type: ignore[arg-type]
            case ast.Name(id=name):
                return scope[name]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self._value(inner, scope)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self._value(inner, scope)
            case ast.UnaryOp(op=ast.Not() | ast.Invert(), operand=inner):
                condition = self._condition(inner, scope)
                return ~condition if isinstance(condition, Condition) else not condition
            case ast.BinOp(left=left, op=op, right=right):
                return _BINARY[type(op)](self._value(left, scope), self._value(right, scope))
            case ast.BoolOp(op=op, values=parts):
                join = operator.and_ if isinstance(op, ast.And) else operator.or_
                return reduce(join, [self._condition(part, scope) for part in parts])
            case ast.Compare(left=first, ops=ops, comparators=others):
                values = [self._value(one, scope) for one in (first, *others)]
                pairs = zip(ops, values[:-1], values[1:], strict=True)
                return reduce(operator.and_, [_COMPARED[type(op)](a, b) for op, a, b in pairs])
            case ast.IfExp(test=test, body=body, orelse=otherwise):
                piece = (self._value(body, scope), self._condition(test, scope))
                return functions.piecewise(piece, otherwise=self._value(otherwise, scope))
            case ast.Tuple(elts=parts):
                return tuple(self._value(part, scope) for part in parts)
            case ast.Call(func=ast.Name(id=name), args=given, keywords=named):
                arguments = [self._value(one, scope) for one in given]
                return self._called(name)(
                    *arguments, **{str(one.arg): self._value(one.value, scope) for one in named}
                )
        raise TypeError(node)

    def _condition(self, node: ast.AST, scope: Mapping[str, Any]) -> Any:
        found = self._value(node, scope)
        if not isinstance(found, Condition | bool):
            raise TraceError(
                f"{_written(node)} is no condition. Write a comparison, such as x > gap."
            )
        return found

    def _called(self, name: str) -> Callable[..., Any]:
        known: dict[str, Callable[..., Any]] = {
            **FUNCTIONS,
            **{table: partial(look_up, data=data) for table, data in self.book.tables.items()},
        }
        if name not in known:
            raise TraceError(f"there is no function {shown(name)}. {nearest(name, known)}")
        return known[name]


class Formulas:
    """The names that the formulas of one file share.

    Parameters
    ----------
    terms : mapping of str to str, optional
        Formulas by name, for others to use. A term may use those before it.
    tables : mapping of str to Table, optional
        Curves by name, for formulas to call: ``stop(x)``.

    Raises
    ------
    TraceError
        If a name is taken or can't be one, or a formula can't be read.
    """

    def __init__(
        self, terms: Mapping[str, str] | None = None, tables: Mapping[str, Table] | None = None
    ):
        self.tables, self.terms = dict(tables or {}), dict[str, Formula]()
        for name in (*self.tables, *(terms or {})):
            why = why_no_name(name) or (
                "a formula calls a function by this name"
                if name in FUNCTIONS or name in _CONSTANTS
                else None
            )
            if why or (name in self.tables and name in (terms or {})):
                raise TraceError(
                    f"{shown(name)} can't be the name of a term or a table: "
                    f"{why or 'it is one of both'}."
                )
        for name, text in (terms or {}).items():
            self.terms[name] = Formula(text, self)

    def formula(self, text: str) -> Formula:
        """A formula from its text. Raises TraceError if it can't be read."""
        return Formula(text, self)


class Equations:
    """An equation of motion from formulas, from which :func:`saltus.system` makes a System.

    Parameters
    ----------
    rates : mapping of str to Formula
        Time derivative of each state.
    parameters : mapping of str to value
        Parameters and their values, as defaults of arguments.
    description : str
        What it is.

    Raises
    ------
    TraceError
        If a parameter or a state has the name of a term, or a parameter is used by no formula.
    """

    def __init__(
        self, rates: Mapping[str, Formula], parameters: Mapping[str, Any], description: str = ""
    ):
        self._rates, self.place, self.__doc__ = (
            dict(rates),
            ("the formulas of its rates"),
            description,
        )
        for name in (*rates, *parameters):
            if why := why_no_name(name):
                raise TraceError(
                    f"{shown(name)} can't be the name of a state or a parameter: {why}."
                )
        both = [
            name
            for name in (*rates, *parameters)
            if name in _CONSTANTS or any(name in rate.book.terms for rate in rates.values())
        ]
        if both:
            raise TraceError(
                f"{shown(both[0])} is the name of a term or a constant, so it can't "
                f"be a state or a parameter too."
            )
        positional = [
            inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD)
            for name in ("t", *rates)
        ]
        named = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=value)
            for name, value in parameters.items()
        ]
        self.__signature__ = inspect.Signature([*positional, *named])

    def __call__(self, t: Any, *y: Any, **parameters: Any) -> list[Any]:
        """Time derivatives of the states."""
        known = {"t": t, **dict(zip(self._rates, y, strict=True)), **parameters}
        for rate in self._rates.values():
            if unknown := [name for name in rate.names if name not in known]:
                raise TraceError(
                    f"{rate.place}: {shown(unknown[0])} is no state, parameter, term or table. "
                    f"{nearest(unknown[0], known)} "
                    f"A parameter is declared by its value."
                )
        return [rate(**{name: known[name] for name in rate.names}) for rate in self._rates.values()]


# -- text ------------------------------------------------------------------------------------------
def _parsed(text: str) -> ast.expr:
    """The syntax tree of a formula."""
    if not isinstance(text, str) or not text.strip() or len(text) > LONGEST:
        raise TraceError(
            f"a formula is text of 1 to {LONGEST} characters, such as k*(x - gap), "
            f"not {shown(text)}."
        )
    try:
        with warnings.catch_warnings():
            # about numbers that touch words: the tree gives the better message
            warnings.simplefilter("ignore")
            tree = ast.parse(f"({text.strip()}\n)", mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        fault = (
            error.msg.split(".")[0] if isinstance(error, SyntaxError) else "it is nested too deeply"
        )
        raise TraceError(
            f"the formula {shown(text)} can't be read: {fault}. Write it like k*(x - gap)."
        ) from None
    if _depth(tree) > DEPTH:
        raise TraceError(
            f"the formula {shown(text)} can't be read: it is nested too deeply. Give "
            f"a part of it a name, as a term."
        )
    _check(tree, text)
    return tree


def _depth(tree: ast.AST) -> int:
    deepest, waiting = 0, [(tree, 1)]
    while waiting:
        node, level = waiting.pop()
        deepest = max(deepest, level)
        waiting += [(child, level + 1) for child in ast.iter_child_nodes(node)]
    return deepest


def _names(tree: ast.AST) -> Iterator[str]:
    """Names of values in a formula, in its order; names of called functions are left out."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    found = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and id(node) not in called and node.id not in _CONSTANTS
    ]
    yield from (node.id for node in sorted(found, key=lambda node: (node.lineno, node.col_offset)))


def _written(node: ast.AST) -> str:
    return shown(ast.unparse(node))


def _check(tree: ast.AST, text: str) -> None:
    """Raise a TraceError for the first part of a formula that isn't allowed."""
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=number):
                fits = isinstance(number, int | float) and not isinstance(number, bool)
            case ast.Call(func=called, keywords=named):
                fits = isinstance(called, ast.Name) and all(one.arg is not None for one in named)
            case _:
                fits = isinstance(node, _NODES)
        strange = [child for child in ast.iter_child_nodes(node) if not isinstance(child, _NODES)]
        if not fits or any(isinstance(child, ast.operator | ast.cmpop) for child in strange):
            advice = next(
                (_INSTEAD[type(one)] for one in (node, *strange) if type(one) in _INSTEAD),
                _MEANINGS,
            )
            raise TraceError(
                f"the formula {shown(text)}: {_written(node)} has no meaning in a "
                f"formula; {advice}."
            )
