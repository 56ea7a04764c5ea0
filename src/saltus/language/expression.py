"""Expressions, the nodes of a traced equation.

An :class:`Expr` is one node of a directed acyclic graph. Nodes are interned: the same operation on
the same operands is the same object, so common subexpressions are shared from the start, and the
order of operations is the order in which the user wrote them (a computer algebra system would sort
the terms; MATLAB's digits depend on that order, see docs/decisions/0002).

Conditions (:class:`Relation`, :class:`And`, :class:`Or`, :class:`Not`) never become Python
booleans: asking for their truth raises a :class:`~saltus.errors.TraceError` that says what to write
instead.
"""

from __future__ import annotations

import math
import threading
import weakref
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, Union, runtime_checkable

from saltus.errors import TraceError, shown
from saltus.language.operations import ELEMENTARY, FUNCTIONS
from saltus.sentences import Dialect

#: The functions that an equation may call, as a sentence.
OWN_FUNCTIONS = (
    f"Use saltus's own: {', '.join(f'sl.{name}' for name in FUNCTIONS)}; "
    "sl.mod(t, T) for a time that repeats, sl.square, sl.sawtooth, sl.pulse; sl.table(x, points, "
    "values) for measured points, in place of np.interp or a spline."
)

_MATH = {name: getattr(math, name) for name in ELEMENTARY}
_INTERNED: weakref.WeakValueDictionary[tuple[Any, ...], Expr] = weakref.WeakValueDictionary()
_JOINED: weakref.WeakValueDictionary[tuple[Any, ...], Condition] = weakref.WeakValueDictionary()
_LOCK = threading.RLock()  # two nodes for one state would make a derivative silently zero
_OBSERVER: ContextVar[Callable[[Expr], None] | None] = ContextVar("observer", default=None)
#: Most comparisons in one condition as it would be written out: a chain in which each condition
#: uses the one before twice doubles at each.
MOST_JOINED = 1000
#: Most nested brackets of a condition; Python reads 200.
DEEPEST = 150
#: Bit of each operation, in the order in which they were met.
_OPS: dict[str, int] = {}
Number = int | float
Operand = Union["Expr", int, float]


def _number_of(op: str) -> int:
    return _OPS.setdefault(op, 1 << len(_OPS))


class Expr:
    """One node of an expression graph.

    Attributes
    ----------
    op : str
        ``const``, ``param``, ``state``, ``time``, ``add``, ``sub``, ``mul``, ``div``, ``neg``,
        ``pow``, ``select``, ``mod``, ``table`` or one of
        :data:`~saltus.language.operations.ELEMENTARY`.
    args : tuple of Expr
        Operands in the order written. ``pow`` holds base and exponent, ``select`` the value where
        its condition holds and the other.
    payload : object
        The number of a ``const``, the name of a ``param`` or ``state``, the condition of a
        ``select``, the data of a ``table``; else None.
    ops, bits : int
        What stands at and below the node, conditions and the gaps in them included: operations
        (:func:`depends_on`), and guards whose bits it asks for, guard i as ``1 << i``.
    """

    __slots__ = ("__weakref__", "args", "bits", "op", "ops", "payload")

    op: str
    args: tuple[Expr, ...]
    payload: Any
    ops: int
    bits: int

    def __new__(cls, op: str, args: tuple[Expr, ...] = (), payload: Any = None) -> Expr:
        """Return the one node of this operation on these operands."""
        tag = payload.hex() if isinstance(payload, float) else payload
        key = (op, tag, tuple(map(id, args)))
        with _LOCK:
            node = _INTERNED.get(key)
            if node is None:
                node = object.__new__(cls)
                node.op, node.args, node.payload = op, args, payload
                node.ops, node.bits = _number_of(op), 0
                for below in args:
                    node.ops |= below.ops
                    node.bits |= below.bits
                if isinstance(payload, Condition):
                    node.ops |= payload.ops
                    node.bits |= payload.bits
                _INTERNED[key] = node
        observer = _OBSERVER.get()
        if observer is not None:
            observer(node)
        return node

    # -- arithmetic --------------------------------------------------------------------------------
    def __add__(self, other: Operand) -> Expr:
        return add(self, other)

    def __radd__(self, other: Operand) -> Expr:
        return add(other, self)

    def __sub__(self, other: Operand) -> Expr:
        return sub(self, other)

    def __rsub__(self, other: Operand) -> Expr:
        return sub(other, self)

    def __mul__(self, other: Operand) -> Expr:
        return mul(self, other)

    def __rmul__(self, other: Operand) -> Expr:
        return mul(other, self)

    def __truediv__(self, other: Operand) -> Expr:
        return div(self, other)

    def __rtruediv__(self, other: Operand) -> Expr:
        return div(other, self)

    def __pow__(self, other: Operand) -> Expr:
        return power(self, other)

    def __rpow__(self, other: Operand) -> Expr:
        return power(other, self)

    def __neg__(self) -> Expr:
        return neg(self)

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        return absolute(self)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **keywords: Any) -> Any:
        """Apply saltus's function of the same name to traced values."""
        return _ANSWERS["__array_ufunc__"](ufunc, method, inputs, keywords)

    # -- what has no meaning here ------------------------------------------------------------------
    def __mod__(self, other: Operand) -> Expr:
        remainder: Expr = _ANSWERS["__mod__"](self, other)
        return remainder

    def __rmod__(self, other: Operand) -> Expr:
        raise TraceError(
            f"an equation took the remainder {other!r} % {self!r}: the divisor must "
            f"be a number or a parameter."
        )

    def __floordiv__(self, other: Operand) -> Expr:
        raise TraceError(
            f"an equation took the whole part {self!r} // {other!r}. Of a time it is (t - "
            f"sl.mod(t, T))/T; of a state there is none."
        )

    __rfloordiv__ = __floordiv__

    def __call__(self, *_arguments: object) -> Expr:
        """Refuse: a state can't be taken at another time."""
        raise TraceError(
            f"an equation called {self!r} as a function. There are no delays, x(t - tau): a rate "
            f"depends on the states at the time t only. "
            f"A product is written with *."
        )

    # -- comparisons make guards -------------------------------------------------------------------
    def __lt__(self, other: Operand) -> Relation:
        return Relation(sub(other, self))

    def __le__(self, other: Operand) -> Relation:
        return Relation(sub(other, self))

    def __gt__(self, other: Operand) -> Relation:
        return Relation(sub(self, other))

    def __ge__(self, other: Operand) -> Relation:
        return Relation(sub(self, other))

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        raise TraceError(
            "an equation compared a traced value with ==, which holds only on a set of measure "
            "zero. "
            "Write the two sides of the boundary with < or > inside sl.piecewise(...)."
        )

    __hash__ = object.__hash__  # equal nodes are one object

    # -- everything that would need a number -------------------------------------------------------
    def __and__(self, other: object) -> Expr:
        raise TraceError(
            "an equation joined two values by & or |, which bind tighter than comparisons: put "
            "each comparison in brackets, (x > gap) & (v > 0)."
        )

    __or__ = __rand__ = __ror__ = __and__

    def __xor__(self, _other: object) -> Expr:
        raise TraceError("a power is written x**2; ^ is something else in Python.")

    __rxor__ = __xor__

    def __bool__(self) -> bool:
        raise TraceError(
            "an equation asked whether a traced value is true. It is a symbol here, not a number: "
            "write sl.piecewise((value, condition), otherwise=...) in place of `if`, `and`, `or`."
        )

    def __float__(self) -> float:
        raise TraceError(
            "an equation passed a traced value to a function that needs a plain number (math.cos, "
            "float, int, np.interp, a spline, ...). "
            "Write sl.cos in place of math.cos, sl.atan2 in place of math.atan2, and "
            "so on. " + OWN_FUNCTIONS
        )

    __int__ = __float__
    __index__ = None

    def __iter__(self) -> Iterator[Expr]:
        raise TraceError(
            "an equation iterated over a traced value, which is a single number. List "
            "every state in states=."
        )

    def __repr__(self) -> str:
        text: str = _ANSWERS["__repr__"](self)
        return text

    def __copy__(self) -> Expr:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Expr:
        return self


#: Functions that answer for an expression, by the method that Python asks: see :func:`answers`.
_ANSWERS: dict[str, Callable[..., Any]] = {}
Answer = TypeVar("Answer", bound=Callable[..., Any])


def answers(method: str) -> Callable[[Answer], Answer]:
    """Register a function that answers for every expression: ``__repr__``, ``__mod__``,
    ``__array_ufunc__``.

    Such a function is built of expressions, so it stands in a file above this one.
    """

    def handed_in(function: Answer) -> Answer:
        _ANSWERS[method] = function
        return function

    return handed_in


def _no_number(say: Dialect) -> str:
    return say.either(
        "a comparison was used as a number. Write sl.piecewise((1, x > gap), otherwise=0), or the "
        "whole term in place of the 1: sl.piecewise((k*(x - gap), x > gap), otherwise=0).",
        "a comparison is no number. Write 1 if x > gap else 0.",
    )


@contextmanager
def observed(observer: Callable[[Expr], None] | None) -> Iterator[None]:
    """Show every node that is asked for inside to the observer, which may raise: the error then has
    the line of the user's function.
    """
    token = _OBSERVER.set(observer)
    try:
        yield
    finally:
        _OBSERVER.reset(token)


def with_own_unit(make: Callable[[], Any]) -> Any:
    """Return ``make()``, made unobserved. Its unit is left open: numbers in it carry units of their
    own.
    """
    observer = _OBSERVER.get()
    with observed(None):
        made = make()
    if isinstance(observer, _LeavesOpen) and isinstance(made, Expr):
        observer.leave_open(made)
    return made


@runtime_checkable
class _LeavesOpen(Protocol):
    """An observer that can leave the unit of a node open."""

    def leave_open(self, node: Expr) -> None:
        """Accept the node as it is."""


# -- conditions ------------------------------------------------------------------------------------
class _MadeOnce(type):
    """Makes equal conditions one object, as equal nodes are, so that comparing long ones is
    quick.
    """

    def __call__(cls, *parts: Condition | int) -> Any:
        key = (cls, *(id(part) if isinstance(part, Condition) else part for part in parts))
        with _LOCK:
            made = _JOINED.get(key)
            if made is None:
                made = _JOINED[key] = super().__call__(*parts)
        return made


class Condition:
    """A truth value that depends on the state: sides of guards, joined by ``&``,
    ``|`` and ``~``.

    Attributes
    ----------
    ops, bits : int
        What stands in it, as :class:`Expr` has them.
    length, depth : int
        Comparisons in it, as they would be written out, and brackets within one another.
    """

    ops: int
    bits: int
    length: int
    depth: int

    def __post_init__(self) -> None:
        ops, bits, length, depth = 0, 0, 0, 0
        for part in self._parts():
            ops, bits = ops | part.ops, bits | part.bits
            length += part.length if isinstance(part, Condition) else 1
            depth = max(depth, part.depth + 1) if isinstance(part, Condition) else 1
        self._set(ops=ops, bits=bits, length=length, depth=depth)

    def _set(self, **values: int) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _parts(self) -> tuple[Expr | Condition, ...]:
        raise NotImplementedError

    def __and__(self, other: Condition) -> Condition:
        return _not_too_long(And(self, _condition(other)))

    def __or__(self, other: Condition) -> Condition:
        return _not_too_long(Or(self, _condition(other)))

    def __invert__(self) -> Condition:
        return Not(self)

    def __bool__(self) -> bool:
        raise TraceError(
            "an equation used a comparison of traced values as a Python truth value (`if x > "
            "gap:`, `a < x < b`, `and`, `or`, "
            "`not`, min(), max()). Write the branches as sl.piecewise((value, x > gap), ..., "
            "otherwise=...); join conditions with "
            "& | ~; use sl.min and sl.max."
        )

    def __neg__(self, *_others: object) -> Expr:
        """Refuse, as every operation that would need a number."""
        raise TraceError(_no_number)

    __pos__ = __abs__ = __float__ = __int__ = __neg__
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __neg__
    __truediv__ = __rtruediv__ = __pow__ = __rpow__ = __mod__ = __rmod__ = __neg__
    __lt__ = __le__ = __gt__ = __ge__ = __neg__


@dataclass(frozen=True, eq=False)
class Relation(Condition):
    """``gap > 0``. While tracing, any comparison. In a system's conditions, one of time and
    parameters only: no guard, but a switch at known instants; a comparison of states is a
    :class:`Bit` there.
    """

    gap: Expr

    def _parts(self) -> tuple[Expr | Condition, ...]:
        return (self.gap,)


@dataclass(frozen=True, eq=False)
class Friction(Relation):
    """A comparison that decides the direction of friction forces. These are ``levels`` in motion;
    at rest they may be ``limit`` times as large, if that is given.
    """

    limit: Expr | None
    levels: tuple[Expr, ...]


@dataclass(frozen=True, eq=False)
class Bit(Condition, metaclass=_MadeOnce):
    """Side of guard number ``guard`` in a system's list: true where its gap is positive."""

    guard: int

    def __post_init__(self) -> None:
        self._set(ops=0, bits=1 << self.guard, length=1, depth=1)


@dataclass(frozen=True, eq=False)
class _Joint(Condition, metaclass=_MadeOnce):
    """Two joined conditions."""

    left: Condition
    right: Condition

    def _parts(self) -> tuple[Expr | Condition, ...]:
        return self.left, self.right


class And(_Joint):
    """Both conditions hold."""


class Or(_Joint):
    """At least one condition holds."""


@dataclass(frozen=True, eq=False)
class Not(Condition, metaclass=_MadeOnce):
    """The condition does not hold."""

    inner: Condition

    def _parts(self) -> tuple[Expr | Condition, ...]:
        return (self.inner,)


def _not_too_long(condition: Condition) -> Condition:
    if condition.length > MOST_JOINED or condition.depth > DEEPEST:
        raise TraceError(
            f"an equation joined {condition.length} comparisons in one condition, "
            f"{condition.depth} within one another; at most {MOST_JOINED} can be, {DEEPEST} within "
            f"one another, and each use of a condition in another one counts. Write one piecewise "
            f"inside the other in place of joining conditions."
        )
    return condition


def _condition(value: object) -> Condition:
    if not isinstance(value, Condition):
        raise TraceError(f"a condition must be a comparison such as x > gap, not {shown(value)}.")
    return value


# -- leaves ----------------------------------------------------------------------------------------
def constant(value: Number) -> Expr:
    """A literal number; it must be finite. Zero has no sign."""
    value = float(value) + 0.0
    if not math.isfinite(value):
        raise TraceError(
            f"an equation holds the constant {value}; every number in it must be finite."
        )
    return Expr("const", (), value)


def parameter(name: str) -> Expr:
    """A named parameter of the system."""
    return Expr("param", (), name)


def state(name: str) -> Expr:
    """A named state variable."""
    return Expr("state", (), name)


#: The independent variable t [s].
TIME = Expr("time")


def as_expr(value: Operand) -> Expr:
    """``value`` as an expression; numbers become constants. Raises TraceError for anything else."""
    if isinstance(value, Expr):
        return value
    if isinstance(value, Condition):
        raise TraceError(_no_number)
    if isinstance(value, str | bytes):
        raise TraceError(
            f"an equation holds the text {shown(value)}. Text with units is for parameter values; "
            f"inside an equation write SI numbers."
        )
    # dates and spans of time of NumPy, which turn into numbers of ticks
    if getattr(getattr(value, "dtype", None), "kind", "f") in "mM":
        raise TraceError(
            f"an equation holds the date or span {shown(value)}. Inside an equation "
            f"write SI numbers."
        )
    if getattr(value, "shape", ()) != ():
        raise TraceError(
            "an equation holds an array. A traced value is a single number: write out "
            "the components."
        )
    if callable(value):
        raise TraceError(
            f"an equation holds the function {shown(value)} itself. Call it: of a record "
            f"record(t), of a table sl.table(t, points, values)."
        )
    try:
        return constant(value)
    except (TypeError, ValueError, OverflowError):
        raise TraceError(
            f"an equation holds {shown(value)}, which is neither a number nor a traced value."
        ) from None


# -- operations: constants are folded, nothing else is rearranged ----------------------------------
def add(a: Operand, b: Operand) -> Expr:
    """``a + b``"""
    a, b = as_expr(a), as_expr(b)
    if a.op == "const" and b.op == "const":
        return constant(a.payload + b.payload)
    if a.op == "const" and a.payload == 0:
        return b
    if b.op == "const" and b.payload == 0:
        return a
    return Expr("add", (a, b))


def sub(a: Operand, b: Operand) -> Expr:
    """``a - b``"""
    a, b = as_expr(a), as_expr(b)
    if a.op == "const" and b.op == "const":
        return constant(a.payload - b.payload)
    if a is b:
        return constant(0.0)
    if a.op == "const" and a.payload == 0:
        return neg(b)
    if b.op == "const" and b.payload == 0:
        return a
    return Expr("sub", (a, b))


def mul(a: Operand, b: Operand) -> Expr:
    """``a * b``"""
    a, b = as_expr(a), as_expr(b)
    if a.op == "const" and b.op == "const":
        return constant(a.payload * b.payload)
    for one, other in ((a, b), (b, a)):
        if one.op == "const" and one.payload == 0:
            return constant(0.0)
        if one.op == "const" and one.payload == 1:
            return other
    return Expr("mul", (a, b))


def div(a: Operand, b: Operand) -> Expr:
    """``a / b``"""
    a, b = as_expr(a), as_expr(b)
    if b.op == "const" and b.payload == 0:
        raise TraceError("an equation divides by the constant zero.")
    if a.op == "const" and b.op == "const":
        return constant(a.payload / b.payload)
    if a.op == "const" and a.payload == 0:
        return constant(0.0)
    if b.op == "const" and b.payload == 1:
        return a
    return Expr("div", (a, b))


def neg(a: Operand) -> Expr:
    """``-a``"""
    a = as_expr(a)
    if a.op == "const":
        return constant(-a.payload)
    if a.op == "neg":
        return a.args[0]
    return Expr("neg", (a,))


def power(base: Operand, exponent: Operand) -> Expr:
    """``base ** exponent``; the exponent must not depend on time or state."""
    base, exponent = as_expr(base), as_expr(exponent)
    if varies(exponent):
        return elementary("exp", mul(exponent, elementary("log", base)))
    if base.op == "const" and exponent.op == "const":
        try:
            value = base.payload**exponent.payload
        except (ZeroDivisionError, OverflowError):
            value = math.inf
        if isinstance(value, complex):
            raise TraceError(
                f"an equation holds {base.payload} ** {exponent.payload}, which is not real."
            )
        return constant(value)
    if exponent.op == "const" and exponent.payload == 0:
        return constant(1.0)
    if exponent.op == "const" and exponent.payload == 1:
        return base
    return Expr("pow", (base, exponent))


def elementary(name: str, a: Operand) -> Expr:
    """One of the functions in :data:`~saltus.language.operations.ELEMENTARY` of ``a``."""
    a = as_expr(a)
    if a.op == "const":
        try:
            return constant(_MATH[name](a.payload))
        except (ValueError, OverflowError):
            raise TraceError(
                f"an equation holds {name}({a.payload}), which is not a finite real number."
            ) from None
    return Expr(name, (a,))


def select(condition: Condition, where: Operand, otherwise: Operand) -> Expr:
    """``where`` if the condition holds, else ``otherwise``."""
    condition, a, b = _condition(condition), as_expr(where), as_expr(otherwise)
    return a if a is b else Expr("select", (a, b), condition)


def absolute(a: Operand) -> Expr:
    """``|a|``: a guard at ``a = 0`` and its two sides."""
    a = as_expr(a)
    if a.op == "const":
        return constant(abs(a.payload))
    return select(Relation(a), a, neg(a)) if varies(a) else elementary("sqrt", mul(a, a))


# -- walking ---------------------------------------------------------------------------------------
def relations_in(condition: Condition) -> Iterator[Relation]:
    """Every relation in a condition, left to right; a repeated one may come once."""
    seen: set[Condition] = set()
    stack = [condition]
    while stack:
        top = stack.pop()
        if not top.ops or top in seen:  # bits only
            continue
        seen.add(top)
        if isinstance(top, Relation):
            yield top
        elif isinstance(top, And | Or):
            stack += (top.right, top.left)
        elif isinstance(top, Not):
            stack.append(top.inner)


def operands(node: Expr) -> tuple[Expr, ...]:
    """The operands of a node, the gaps of a select's condition first."""
    if node.op == "select":
        return tuple(relation.gap for relation in relations_in(node.payload)) + node.args
    return node.args


def walk(
    *roots: Expr, conditions: bool = True, known: Container[Expr] = (), bits: int = -1
) -> Iterator[Expr]:
    """Every node below the roots once, operands before the nodes that use them (iterative: deep
    sums don't overflow the stack).

    Those that only comparisons in conditions use are left out if ``conditions`` is False. Nothing
    is entered that is ``known`` or, unless ``bits`` is -1, asks for none of these bits.
    """
    seen: set[Expr] = set()
    stack = [(root, False) for root in reversed(roots)]
    while stack:
        node, ready = stack.pop()
        if ready:
            yield node
        elif node not in seen and node not in known and (bits == -1 or node.bits & bits):
            seen.add(node)
            below = operands(node) if conditions else node.args
            if not below:
                yield node
                continue
            stack.append((node, True))
            stack.extend([(child, False) for child in reversed(below) if child not in seen])


def rebuild(node: Expr, args: tuple[Expr, ...], payload: Any) -> Expr:
    """The same operation on other operands, constants folded; the node itself if nothing
    differs.
    """
    if payload is node.payload and all(
        new is old for new, old in zip(args, node.args, strict=True)
    ):
        return node
    if node.op == "select":
        return select(payload, *args)
    if node.op in ELEMENTARY:
        return elementary(node.op, *args)
    if node.op in ("mod", "table"):
        return Expr(node.op, args, payload)
    return _OPERATIONS[node.op](*args)


def substituted(root: Expr, new: Mapping[Expr, Expr]) -> Expr:
    """The expression with some nodes replaced; conditions are kept."""
    return all_substituted([root], new)[0]


def all_substituted(roots: Sequence[Expr], new: Mapping[Expr, Expr]) -> tuple[Expr, ...]:
    """Expressions with some nodes replaced; what they share is rebuilt once."""
    memo: dict[Expr, Expr] = {}
    for node in walk(*roots):
        memo[node] = (
            new[node]
            if node in new
            else rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        )
    return tuple(memo[root] for root in roots)


def depends_on(node: Expr, ops: tuple[str, ...]) -> bool:
    """True if a leaf of one of the kinds ``ops`` is at or below ``node``."""
    return any(node.ops & _number_of(op) for op in ops)


def varies(node: Expr) -> bool:
    """True if the value changes along a trajectory (depends on time, state or mode)."""
    return depends_on(node, ("time", "state", "select"))


_OPERATIONS: dict[str, Callable[..., Expr]] = {
    "add": add,
    "sub": sub,
    "mul": mul,
    "div": div,
    "neg": neg,
    "pow": power,
}
