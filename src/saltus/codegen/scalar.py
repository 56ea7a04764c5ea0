"""Scalar code from expressions: one assignment per shared node, operations in the order in which
the user wrote them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from saltus.language import expression as ex
from saltus.language.expression import Expr
from saltus.system import System

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


def indented(lines: list[str]) -> str:
    """Lines as a function body."""
    return "\n".join("    " + line for line in lines) if lines else "    pass"


def parameter_leaf(
    system: System, states: str | None = None, clocked: Callable[[Expr], str | None] | None = None
) -> Callable[[Expr], str | None]:
    """Code for parameters ``p[i]``, states ``y[i]`` and time ``t`` in scalar functions, and for the
    nodes of ``clocked``.
    """
    names, state_names = tuple(system.values), system.states

    def leaf(node: Expr) -> str | None:
        if node.op == "param":
            return f"p[{names.index(node.payload)}]"
        if states and node.op == "state":
            return f"{states}[{state_names.index(node.payload)}]"
        if clocked is not None and (code := clocked(node)) is not None:
            return code
        return "t" if states and node.op == "time" else None

    return leaf


def condition_code(
    condition: ex.Condition,
    bit: Callable[[int], str],
    switch: Callable[[ex.Relation], str],
    words: tuple[str, str, str] = ("and", "or", "not"),
) -> str:
    """A condition as code: ``bit(i)`` is the code for side i, ``switch(relation)`` that for a
    comparison of time, ``words`` are the operators (``& | ~`` for lane masks).
    """
    match condition:
        case ex.Bit(guard):
            return bit(guard)
        case ex.Relation():
            return switch(condition)
        case ex.And(left, right):
            return (
                f"({condition_code(left, bit, switch, words)} {words[0]} "
                f"{condition_code(right, bit, switch, words)})"
            )
        case ex.Or(left, right):
            return (
                f"({condition_code(left, bit, switch, words)} {words[1]} "
                f"{condition_code(right, bit, switch, words)})"
            )
        case ex.Not(inner):
            return f"({words[2]} {condition_code(inner, bit, switch, words)})"
    raise TypeError(condition)


class ScalarCode:
    """Collects assignments that compute expressions in plain doubles.

    Parameters
    ----------
    leaf : callable
        ``leaf(node) -> str | None``: code for a node that is available already (a parameter, a
        state, a constant slot), None otherwise.
    side : callable
        ``side(guard) -> str``: code that is true where the guard is positive.
    prefix : str
        Start of the names of temporaries.
    switch : callable
        ``switch(relation) -> str``: code that is true where what time alone decides holds.
    """

    def __init__(
        self,
        leaf: Callable[[Expr], str | None],
        side: Callable[[int], str] | None = None,
        prefix: str = "q",
        switch: Callable[[ex.Relation], str] | None = None,
    ):
        self.lines: list[str] = []
        self._leaf, self._side, self._prefix, self._switch = leaf, side, prefix, switch
        self._names: dict[Expr, str] = {}

    def value(self, root: Expr) -> str:
        """Code for the value of an expression; emits the lines before it."""
        self._emit(self._needed(root))
        return self._name(root)

    def values(self, roots: Iterable[Expr]) -> list[str]:
        """Code for several values."""
        return [self.value(root) for root in roots]

    def _needed(self, root: Expr) -> list[Expr]:
        order, seen, stack = [], set(), [(root, False)]
        while stack:
            node, ready = stack.pop()
            if ready:
                order.append(node)
            elif (
                node not in seen
                and node not in self._names
                and node.op != "const"
                and self._leaf(node) is None
            ):
                seen.add(node)
                stack.append((node, True))
                stack.extend((child, False) for child in reversed(node.args))
        return order

    def _emit(self, order: list[Expr]) -> None:
        for node in order:
            name = f"{self._prefix}{len(self._names)}"
            self.lines.append(f"{name} = {self._operation(node)}")
            self._names[node] = name

    def _name(self, node: Expr) -> str:
        if node.op == "const":
            return f"({node.payload!r})" if node.payload < 0 else repr(node.payload)
        return self._names.get(node) or self._leaf(node) or ""

    def _operation(self, node: Expr) -> str:
        a = [self._name(child) for child in node.args]
        if node.op in _INFIX:
            return f"{a[0]} {_INFIX[node.op]} {a[1]}"
        if node.op == "neg":
            return f"-{a[0]}"
        if node.op == "pow":
            return self._power(a[0], node.args[1], a[1])
        if node.op == "select":
            assert self._side is not None, "a mode-dependent value where none is allowed"
            assert self._switch is not None, "a value that switches where none is allowed"
            return f"{a[0]} if {condition_code(node.payload, self._side, self._switch)} else {a[1]}"
        return f"math.{node.op}({a[0]})"

    @staticmethod
    def _power(base: str, exponent: Expr, code: str) -> str:
        if exponent.op == "const" and exponent.payload in (2.0, 3.0, 4.0):
            # multiplied out: MATLAB's digits for whole powers
            return "*".join([base] * int(exponent.payload))
        return f"{base} ** {code}"
