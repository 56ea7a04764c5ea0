"""Expressions as text: the way Python would write them, order of operations included.

Text is written bottom-up without recursion. A part that is used more than once and is long gets a
name and a line of its own, so the text of a system grows with its graph, not with the tree that the
graph unfolds to.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Protocol

from saltus.language.expression import (
    And,
    Bit,
    Condition,
    Expr,
    Not,
    Or,
    Relation,
    answers,
    operands,
    walk,
)
from saltus.language.operations import ARITHMETIC, ATOM, NEGATIVE, POWER, PRODUCT
from saltus.language.roots import with_root

#: Constants that people write with pi.
PI_MULTIPLES = {math.pi: "pi", 2 * math.pi: "2*pi", 4 * math.pi: "4*pi", math.pi / 2: "pi/2"}


class NamedBoundary(Protocol):
    """Interface of a guard to a writer."""

    @property
    def name(self) -> str:
        """The name of the guard."""

    @property
    def gap(self) -> Expr:
        """Signed distance."""

    @property
    def state(self) -> str | None:
        """The state of which the boundary is a level."""

    @property
    def boundary(self) -> Expr | None:
        """The level of that state."""

    @property
    def law(self) -> object:
        """The law of contact."""


class Writer:
    """Writes expressions, each part once.

    Parameters
    ----------
    guards : sequence of Guard
        Guards of the bits in the conditions.
    shared : iterable of Expr
        Roots that will be written; parts that they use more than once and that are long get lines
        of their own in :attr:`lines`.
    taken : iterable of str
        Names that such parts may not have.
    limit : int or None
        Longest text of a part; longer ones become ``...`` where they are used.
    """

    #: Length from which a part used twice gets a name; ten times that for any part.
    name_from = 60

    def __init__(
        self,
        guards: Sequence[NamedBoundary] = (),
        shared: Iterable[Expr] = (),
        taken: Iterable[str] = (),
        limit: int | None = None,
    ) -> None:
        self.lines: list[str] = []
        self.limit = limit
        roots = tuple(shared)
        self._naming = bool(roots)
        self._uses = (
            Counter(child for node in walk(*roots) for child in operands(node))
            if roots
            else Counter()
        )
        self._taken = set(taken)
        self._texts: dict[Expr, tuple[str, int]] = {}
        self._pieces: dict[Expr, list[str]] = {}
        self._sides: list[tuple[str, str]] = []
        for guard in guards:
            self._sides.append(self._guard_sides(guard))

    # -- asked from outside ------------------------------------------------------------------------
    def text(self, root: Expr) -> str:
        """The text of an expression."""
        for node in walk(root, known=self._texts):
            self._texts[node] = self._named(node, *self._write(node))
        return self._texts[root][0]

    def condition(self, condition: Condition, positive: bool = True) -> str:
        """The text of a condition, or of its opposite."""
        match condition:
            case Bit(guard):
                sides = (
                    self._sides[guard]
                    if guard < len(self._sides)
                    else (f"guard{guard} > 0", f"guard{guard} < 0")
                )
                return sides[0 if positive else 1]
            case Relation(gap):
                return self._compare(gap, positive)
            case Not(inner):
                return self.condition(inner, not positive)
            case And(left, right) | Or(left, right):
                joint = self.joint(isinstance(condition, And) == positive)
                return (
                    self._group(self.condition(left, positive))
                    + joint
                    + self._group(self.condition(right, positive))
                )
        raise TypeError(condition)

    def side(self, guard: int, positive: bool = True) -> str:
        """The text of one side of a guard, such as ``x > upper_gap``."""
        return self._sides[guard][0 if positive else 1]

    # -- notation, which a subclass may override ---------------------------------------------------
    greater, less = " > ", " < "

    def joint(self, both: bool) -> str:
        """The text that joins two conditions."""
        return " & " if both else " | "

    def name(self, name: str) -> str:
        """A state or parameter."""
        return name

    def number(self, value: float) -> tuple[str, int]:
        """A constant and its binding strength."""
        if value in PI_MULTIPLES:
            return PI_MULTIPLES[value], ATOM if value == math.pi else PRODUCT
        short = f"{value:.6g}"
        text = re.sub(
            r"e([+-])0*",
            lambda match: "e" + match[1].strip("+"),
            short if float(short) == value else repr(value),
        )
        return text, NEGATIVE if text.startswith("-") else ATOM

    def infix(self, op: str, left: Expr, right: Expr) -> tuple[str, int]:
        """A sum, difference, product or quotient and its binding strength."""
        sign, strength = ARITHMETIC[op].sign, ARITHMETIC[op].strength
        return self.part(left, strength) + sign + self.part(
            right, strength + 1, after_sign=True
        ), strength

    def power(self, base: Expr, exponent: Expr) -> str:
        """A power."""
        return f"{self.part(base, ATOM)}**{self.part(exponent, ATOM)}"

    def call(self, function: str, *arguments: Expr) -> str:
        """A function."""
        return f"{function}({', '.join(map(self.text, arguments))})"

    def piece(self, value: Expr, condition: Condition) -> str:
        """One branch of a piecewise expression."""
        return f"({self.text(value)}, {self.condition(condition)})"

    def piecewise(self, pieces: list[str], otherwise: Expr) -> str:
        """A piecewise expression."""
        return f"piecewise({', '.join(pieces)}, otherwise={self.text(otherwise)})"

    def parentheses(self, text: str) -> str:
        """A text in parentheses."""
        return f"({text})"

    def line(self, name: str, text: str) -> str:
        """The line that names a part."""
        return f"{name} = {text}"

    # -- inner working -----------------------------------------------------------------------------
    def part(self, node: Expr, strength: int, after_sign: bool = False) -> str:
        """The text of an operand, in parentheses if it binds more weakly than ``strength``."""
        text, own = self._texts[node]
        return (
            self.parentheses(text)
            if own < strength or (after_sign and text.startswith("-"))
            else text
        )

    def _write(self, node: Expr) -> tuple[str, int]:
        match node.op:
            case "const":
                return self.number(node.payload)
            case "param" | "state":
                return self.name(node.payload), ATOM
            case "time":
                return self.name("t"), ATOM
            case "neg":
                return "-" + self.part(node.args[0], POWER), NEGATIVE
            case "pow":
                return self.power(*node.args), POWER
            case "select":
                return self._select(node), ATOM
            case op if op in ARITHMETIC:
                return self.infix(op, *node.args)
        return self.call(node.payload.name if node.op == "table" else node.op, *node.args), ATOM

    def _select(self, node: Expr) -> str:
        """A select and those nested in its second branch as one list of pieces."""
        value, otherwise = node.args
        pieces = [self.piece(value, node.payload)]
        if otherwise in self._pieces:
            pieces += self._pieces[otherwise]
            while otherwise.op == "select" and otherwise in self._pieces:
                otherwise = otherwise.args[1]
        self._pieces[node] = pieces
        return self.piecewise(pieces, otherwise)

    def _named(self, node: Expr, text: str, strength: int) -> tuple[str, int]:
        """The text as it is used from now on: itself, a name, or dots."""
        if self.limit is not None and len(text) > self.limit:
            self._pieces.pop(node, None)
            return "...", ATOM
        long = len(text) > self.name_from
        if not (
            self._naming and long and (self._uses[node] > 1 or len(text) > 10 * self.name_from)
        ):
            return text, strength
        number = len(self.lines) + 1
        while f"s{number}" in self._taken:
            number += 1
        name = f"s{number}"
        self._taken.add(name)
        self._pieces.pop(node, None)
        self.lines.append(self.line(self.name(name), text))
        return self.name(name), ATOM

    def _guard_sides(self, guard: NamedBoundary) -> tuple[str, str]:
        if getattr(guard.law, "kind", None) == "hold":  # its gap is no boundary that the user wrote
            return guard.name, f"not {guard.name}"
        if guard.state is not None and guard.boundary is not None:
            state, boundary = self.name(guard.state), self.text(guard.boundary)
            return state + self.greater + boundary, state + self.less + boundary
        return self._compare(guard.gap, True), self._compare(guard.gap, False)

    def _compare(self, gap: Expr, positive: bool) -> str:
        gap = with_root(gap)
        left, right = gap.args if gap.op == "sub" else (gap, None)
        return (
            self.text(left)
            + (self.greater if positive else self.less)
            + (self.text(right) if right is not None else "0")
        )

    def _group(self, text: str) -> str:
        return self.parentheses(text)


@answers("__repr__")
def to_text(node: Expr, limit: int = 300) -> str:
    """An expression as Python would write it; parts longer than ``limit`` characters become
    ``...``.
    """
    return Writer(limit=limit).text(node)
