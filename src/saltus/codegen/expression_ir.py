"""Translate an expression of a generated head to LLVM IR.

Each operation becomes the instruction that codegen/lowering/lane_types.py makes of it in the
templates.
"""

from __future__ import annotations

import ast
import math
import struct
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from saltus.codegen.blocks import Line
from saltus.codegen.interface import ARRAY
from saltus.kernels.lanes import WHOLE_IN_LAST_BITS

# Kinds of values: a lane, a mask of lanes, a double, a truth value, a whole number; a table of
# doubles, of whole numbers.
LANE, MASK, NUMBER, TRUTH, INTEGER = "lane", "mask", "number", "truth", "integer"
TABLES = {"numbers": NUMBER, "integers": INTEGER}

_ARITHMETIC = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_BITWISE = {ast.RShift: "ashr", ast.LShift: "shl", ast.BitAnd: "and", ast.BitOr: "or"}
_WHOLE_ARITHMETIC = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
_COMPARE = {
    ast.Gt: "ogt",
    ast.Lt: "olt",
    ast.GtE: "oge",
    ast.LtE: "ole",
    ast.Eq: "oeq",
    ast.NotEq: "une",
}
_COMPARE_WHOLE = {
    ast.Gt: "sgt",
    ast.Lt: "slt",
    ast.GtE: "sge",
    ast.LtE: "sle",
    ast.Eq: "eq",
    ast.NotEq: "ne",
}
#: Functions that are instructions of LLVM; the others come from the C library.
_INTRINSIC = {
    "sin": "sin", "cos": "cos", "exp": "exp", "log": "log", "sqrt": "sqrt", "fabs": "fabs",
    "pow": "pow",
    "fma": "fma", "magnitude": "fabs", "root": "sqrt", "nearest_integer": "rint", "abs": "fabs",
}  # fmt: skip


class Value(NamedTuple):
    """An operand: its kind, and its text in the IR."""

    kind: str
    text: str


class UntranslatableError(TypeError):
    """A form of Python in which heads aren't written: a fault of the generator."""


def literal(number: float) -> str:
    """A double as LLVM reads it, to the bit."""
    return "0x" + struct.pack(">d", float(number)).hex().upper()


class Expressions:
    """The lines of one function while its expressions are translated."""

    def __init__(
        self,
        lanes: int,
        row: int,
        pointers: Iterable[str],
        names: Mapping[str, Value],
        declared: set[str],
    ) -> None:
        self.lanes, self.row, self.declared = lanes, row, declared
        self.lines: list[Line] = []
        self.names = dict(names)
        self.types = {
            LANE: f"<{lanes} x double>", MASK: f"<{lanes} x i1>", NUMBER: "double", TRUTH: "i1",
            INTEGER: "i64",
        }  # fmt: skip
        self.pointers = set(pointers)

    # -- lines -------------------------------------------------------------------------------------
    def new(self, kind: str, code: str, kind_of_line: str | None = None) -> Value:
        """Add a line with a value."""
        name = f"%r{len(self.lines)}"
        self.lines.append(
            Line(f"{name} = {code}", name, kind_of_line or self.types.get(kind, kind))
        )
        return Value(kind, name)

    def do(self, code: str) -> None:
        """Add a line without a value."""
        self.lines.append(Line(code, "", ""))

    # -- conversions -------------------------------------------------------------------------------
    def number(self, value: Value) -> Value:
        """A whole number as a double; any other value unchanged."""
        return (
            self.new(NUMBER, f"sitofp i64 {value.text} to double")
            if value.kind == INTEGER
            else value
        )

    def lane(self, value: Value) -> Value:
        """A number in every lane; a lane unchanged."""
        if value.kind == LANE:
            return value
        value = self.number(value)
        if not value.text.startswith("%"):
            return Value(LANE, f"splat (double {value.text})")
        vector = self.types[LANE]
        one = self.new(LANE, f"insertelement {vector} poison, double {value.text}, i32 0")
        return self.new(
            LANE,
            f"shufflevector {vector} {one.text}, {vector} poison, <{self.lanes} "
            f"x i32> zeroinitializer",
        )

    def _alike(self, a: Value, b: Value) -> tuple[str, Value, Value]:
        if LANE in (a.kind, b.kind):
            return LANE, self.lane(a), self.lane(b)
        return NUMBER, self.number(a), self.number(b)

    # -- expressions -------------------------------------------------------------------------------
    def value(self, node: ast.expr) -> Value:
        """Translate an expression."""
        name = f"_{type(node).__name__.lower()}"
        rule: Callable[[ast.expr], Value] | None = getattr(self, name, None)
        if rule is None:
            raise UntranslatableError(ast.unparse(node))
        return rule(node)

    def _constant(self, node: ast.Constant) -> Value:
        match node.value:
            case bool(truth):
                return Value(TRUTH, "true" if truth else "false")
            case int(whole):
                return Value(INTEGER, str(whole))
            case float(number):
                return Value(NUMBER, literal(number))
        raise UntranslatableError(ast.unparse(node))

    def _name(self, node: ast.Name) -> Value:
        if node.id not in self.names:
            raise UntranslatableError(node.id)
        return self.names[node.id]

    def _attribute(self, node: ast.Attribute) -> Value:
        if ast.unparse(node) != "math.pi":
            raise UntranslatableError(ast.unparse(node))
        return Value(NUMBER, literal(math.pi))

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.USub):
            if isinstance(node.operand, ast.Constant):
                return self._constant(ast.Constant(ast.literal_eval(node)))
            value = self.value(node.operand)
            return self.new(value.kind, f"fneg {self.types[value.kind]} {value.text}")
        value = self.value(node.operand)
        return self.new(
            value.kind, f"xor {self.types[value.kind]} {value.text}, {self._all_true(value.kind)}"
        )

    def _boolop(self, node: ast.BoolOp) -> Value:
        word = "and" if isinstance(node.op, ast.And) else "or"
        total = self.value(node.values[0])
        for other in node.values[1:]:
            total = self.new(TRUTH, f"{word} i1 {total.text}, {self.value(other).text}")
        return total

    def _ifexp(self, node: ast.IfExp) -> Value:
        condition, a, b = (
            self.value(node.test),
            self.number(self.value(node.body)),
            self.number(self.value(node.orelse)),
        )
        return self.new(NUMBER, f"select i1 {condition.text}, double {a.text}, double {b.text}")

    def _subscript(self, node: ast.Subscript) -> Value:
        assert isinstance(node.value, ast.Name)
        table = self.names.get(node.value.id)
        if table is not None and table.kind in TABLES:
            kind, index = TABLES[table.kind], self.value(node.slice)
            place = self.new(
                ARRAY, f"getelementptr {self.types[kind]}, ptr {table.text}, i64 {index.text}"
            )
            return self.new(kind, f"load {self.types[kind]}, ptr {place.text}, align 8")
        return self.new(
            NUMBER, f"load double, ptr {self.place(node.value.id, node.slice, 1)}, align 8"
        )

    def _call(self, node: ast.Call) -> Value:
        match node.func:
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                return self._library(name, NUMBER, [self.number(self.value(a)) for a in node.args])
            case ast.Name(id=name):
                return self._function(name, node.args)
        raise UntranslatableError(ast.unparse(node))

    @staticmethod
    def _all_true(kind: str) -> str:
        return "true" if kind == TRUTH else "splat (i1 true)"

    def _binop(self, node: ast.BinOp) -> Value:
        a, b, op = self.value(node.left), self.value(node.right), type(node.op)
        if op is ast.Pow:
            return self._library("pow", NUMBER, [self.number(a), self.number(b)])
        if a.kind == b.kind and a.kind in (MASK, TRUTH, INTEGER) and op in _BITWISE:
            return self.new(a.kind, f"{_BITWISE[op]} {self.types[a.kind]} {a.text}, {b.text}")
        if a.kind == b.kind == INTEGER:
            return self.new(INTEGER, f"{_WHOLE_ARITHMETIC[op]} i64 {a.text}, {b.text}")
        kind, a, b = self._alike(a, b)
        return self.new(kind, f"{_ARITHMETIC[op]} {self.types[kind]} {a.text}, {b.text}")

    def _compare(self, node: ast.Compare) -> Value:
        a, b, op = self.value(node.left), self.value(node.comparators[0]), type(node.ops[0])
        if a.kind == b.kind == INTEGER:
            return self.new(TRUTH, f"icmp {_COMPARE_WHOLE[op]} i64 {a.text}, {b.text}")
        kind, a, b = self._alike(a, b)
        return self.new(
            MASK if kind == LANE else TRUTH,
            f"fcmp {_COMPARE[op]} {self.types[kind]} {a.text}, {b.text}",
        )

    def _function(self, name: str, arguments: list[ast.expr]) -> Value:
        """A function of kernels/lanes.py, of trigonometry.py, or of Python."""
        if name == "load":
            table, row, *_ = arguments
            place = self.place(table.id, row, self.row)  # type: ignore[attr-defined]
            return self.new(LANE, f"load {self.types[LANE]}, ptr {place}, align 8")
        values = [
            self.value(a) for a in arguments if not (isinstance(a, ast.Name) and a.id == "LANES")
        ]
        match name:
            case "splat":
                return self.lane(values[0])
            case "float":
                return self.number(values[0])
            case "round":  # to a whole number, as Python's
                return self.new(
                    INTEGER, f"fptosi double {self._library('rint', NUMBER, values).text} to i64"
                )
            case "abs":
                return self._library("fabs", NUMBER, [self.number(values[0])])
            case "select":
                mask, a, b = values[0], self.lane(values[1]), self.lane(values[2])
                vector = self.types[LANE]
                return self.new(
                    LANE,
                    f"select {self.types[MASK]} {mask.text}, {vector} {a.text}, {vector} {b.text}",
                )
            case "is_odd":
                first = self._shifted(self.lane(values[0]), 63)
                zero = self._whole_lane(0)
                whole = f"<{self.lanes} x i64>"
                return self.new(MASK, f"icmp slt {whole} {first}, {zero}")
            case "turned_half":
                return self._turned_half(self.lane(values[0]), self.lane(values[1]))
            case "turned":
                given = ", ".join(f"{self.types[v.kind]} {v.text}" for v in values)
                return self.new(NUMBER, f"call double @saltus_turned({given})")
            case "fma" | "magnitude" | "root" | "nearest_integer":
                return self._library(name, LANE, [self.lane(v) for v in values])
        if name.startswith("libm_"):
            return self._lane_by_lane(name.removeprefix("libm_"), [self.lane(v) for v in values])
        raise UntranslatableError(name)

    def _whole_lane(self, value: int) -> str:
        """The same integer in every lane."""
        return f"<{', '.join([f'i64 {value}'] * self.lanes)}>"

    def _shifted(self, n: Value, by: int) -> str:
        """The last bits of a lane of whole numbers as first ones; see lowering/lane_types.py."""
        vector, whole = self.types[LANE], f"<{self.lanes} x i64>"
        high = self.lane(Value(NUMBER, literal(WHOLE_IN_LAST_BITS)))
        total = self.new(LANE, f"fadd {vector} {n.text}, {high.text}")
        last = self.new(LANE, f"bitcast {vector} {total.text} to {whole}")
        return self.new(LANE, f"shl {whole} {last.text}, {self._whole_lane(by)}").text

    def _turned_half(self, a: Value, n: Value) -> Value:
        vector, whole = self.types[LANE], f"<{self.lanes} x i64>"
        sign, first = self._whole_lane(-(2**63)), self._shifted(n, 62)
        turned = self.new(LANE, f"and {whole} {first}, {sign}")
        plain = self.new(LANE, f"bitcast {vector} {a.text} to {whole}")
        both = self.new(LANE, f"xor {whole} {plain.text}, {turned.text}")
        return self.new(LANE, f"bitcast {whole} {both.text} to {vector}")

    def _library(self, name: str, kind: str, values: list[Value]) -> Value:
        type_ = self.types[kind]
        intrinsic = _INTRINSIC.get(name, name if name == "rint" else "")
        full = (
            f"llvm.{intrinsic}.{f'v{self.lanes}f64' if kind == LANE else 'f64'}"
            if intrinsic
            else name
        )
        self.declared.add(f"declare {type_} @{full}({', '.join([type_] * len(values))})")
        return self.new(
            kind, f"call {type_} @{full}({', '.join(f'{type_} {v.text}' for v in values)})"
        )

    def _lane_by_lane(self, name: str, values: list[Value]) -> Value:
        result, vector = Value(LANE, "poison"), self.types[LANE]
        for i in range(self.lanes):
            ones = [self.new(NUMBER, f"extractelement {vector} {v.text}, i32 {i}") for v in values]
            one = self._library(name, NUMBER, ones)
            result = self.new(
                LANE, f"insertelement {vector} {result.text}, double {one.text}, i32 {i}"
            )
        return result

    # -- memory ------------------------------------------------------------------------------------
    def place(self, array: str, index: ast.expr, width: int) -> str:
        """Address of an entry, or of a row of lanes."""
        if array not in self.pointers:
            raise UntranslatableError(array)
        match index:
            case ast.Tuple(elts=[row, ast.Name(id="lane")]):
                start = self.new(
                    ARRAY,
                    f"getelementptr i8, ptr %{array}, i64 "
                    f"{8 * self.lanes * _whole(row, self.names)}",
                )
                return self.new(ARRAY, f"getelementptr double, ptr {start.text}, i64 %lane").text
            case _ if (whole := _whole_or_none(index, self.names)) is not None:
                return self.new(
                    ARRAY, f"getelementptr i8, ptr %{array}, i64 {8 * width * whole}"
                ).text
        computed = self.value(index)
        far = self.new(INTEGER, f"mul i64 {computed.text}, {8 * width}")
        return self.new(ARRAY, f"getelementptr i8, ptr %{array}, i64 {far.text}").text


def _whole_or_none(node: ast.expr, names: Mapping[str, Value]) -> int | None:
    """A row that is known; None for one that is computed."""
    try:
        return _whole(node, names)
    except UntranslatableError:
        return None


def _whole(node: ast.expr, names: Mapping[str, Value]) -> int:
    """A row: a whole number, or a sum of such numbers and names."""
    match node:
        case ast.Constant(value=int(number)):
            return number
        case ast.Name(id=name) if names[name].kind == INTEGER and names[name].text.isdigit():
            return int(names[name].text)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _whole(left, names) + _whole(right, names)
    raise UntranslatableError(ast.unparse(node))
