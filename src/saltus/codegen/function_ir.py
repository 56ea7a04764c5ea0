"""Translate one function of a generated head to LLVM IR: the few forms of Python in which heads are
written.

A head is straight-line code on doubles and lanes; the text that runs as plain Python with the JIT
off is the text that is translated here, so there is one source. Each operation becomes the
instruction that codegen/lowering/lane_types.py makes of it in the templates.
"""

from __future__ import annotations

import ast
import math
import struct
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from saltus.codegen.blocks import Line, in_blocks
from saltus.codegen.interface import ARRAY, REAL, WHOLE

# Kinds of values: a lane, a mask of lanes, a double, a truth value, a whole number; a table of
# doubles, of whole numbers.
LANE, MASK, NUMBER, TRUTH, INTEGER = "lane", "mask", "number", "truth", "integer"
TABLES = {"numbers": NUMBER, "integers": INTEGER}

#: Functions of a head that its others call: their arguments, None before the first call.
Helpers = dict[str, tuple[str, ...] | None]

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


class _Body:
    """The lines of one function while it is translated."""

    def __init__(
        self,
        lanes: int,
        row: int,
        pointers: Iterable[str],
        names: Mapping[str, Value],
        declared: set[str],
        helpers: Helpers,
    ) -> None:
        self.lanes, self.row, self.declared, self.helpers = lanes, row, declared, helpers
        self.lines: list[Line] = []
        self.names = dict(names)
        self.types = {
            LANE: f"<{lanes} x double>", MASK: f"<{lanes} x i1>", NUMBER: "double", TRUTH: "i1",
            INTEGER: "i64",
        }  # fmt: skip
        self._pointers = set(pointers)
        self._labels = 0

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

    def _label(self) -> int:
        self._labels += 1
        return self._labels

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
            NUMBER, f"load double, ptr {self._place(node.value.id, node.slice, 1)}, align 8"
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
            place = self._place(table.id, row, self.row)  # type: ignore[attr-defined]
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
            case "turned":
                given = ", ".join(f"{self.types[v.kind]} {v.text}" for v in values)
                return self.new(NUMBER, f"call double @saltus_turned({given})")
            case "fma" | "magnitude" | "root" | "nearest_integer":
                return self._library(name, LANE, [self.lane(v) for v in values])
        if name.startswith("libm_"):
            return self._lane_by_lane(name.removeprefix("libm_"), [self.lane(v) for v in values])
        raise UntranslatableError(name)

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
    def _place(self, array: str, index: ast.expr, width: int) -> str:
        """Address of an entry, or of a row of lanes."""
        if array not in self._pointers:
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

    # -- statements --------------------------------------------------------------------------------
    def run(self, statements: list[ast.stmt]) -> None:
        """Translate statements."""
        for statement in statements:
            match statement:
                case ast.Pass() | ast.Expr(value=ast.Constant()):
                    pass
                case ast.Assign(targets=[target], value=value):
                    self._assign(target, value)
                case ast.AugAssign(
                    target=ast.Subscript(value=ast.Name(id=array), slice=index),
                    op=ast.Add(),
                    value=value,
                ):
                    self._add_to(self._place(array, index, 1), value)
                case ast.Expr(
                    value=ast.Call(func=ast.Name(id="store"), args=[ast.Name(id=array), row, value])
                ):
                    found = self.lane(self.value(value))
                    self.do(
                        f"store {self.types[LANE]} {found.text}, ptr "
                        f"{self._place(array, row, self.row)}, align 8"
                    )
                case ast.Expr(value=ast.Call(func=ast.Name(id=function), args=arguments)) if (
                    function in self.helpers
                ):
                    self._helper(function, arguments)
                case ast.If(test=test, body=body, orelse=[]):
                    self._if(test, body)
                case ast.For(
                    target=ast.Name(id=name),
                    iter=ast.Call(func=ast.Name(id="range"), args=[begin, end]),
                    body=body,
                ):
                    self._for(name, self.value(begin), self.value(end), body)
                case ast.Return(value=value):
                    self._leave(value)
                case _:
                    raise UntranslatableError(ast.unparse(statement))

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        match target, value:
            case ast.Tuple(elts=targets), ast.Tuple(elts=values):
                for one, found in zip(targets, [self.value(one) for one in values], strict=True):
                    self._give(one, found)
            case ast.Tuple(elts=names), ast.Call(func=ast.Name(id=function), args=arguments):
                self._call_for_two(
                    [ast.unparse(name) for name in names],
                    function,
                    [self.value(a) for a in arguments],
                )
            case _:
                self._give(target, self.value(value))

    def _give(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a name, or to an entry of an array."""
        match target:
            case ast.Name(id=name):
                self.names[name] = value
            case ast.Subscript(value=ast.Name(id=array), slice=index):
                number = self.number(value)
                self.do(f"store double {number.text}, ptr {self._place(array, index, 1)}, align 8")
            case _:
                raise UntranslatableError(ast.unparse(target))

    def _add_to(self, place: str, value: ast.expr) -> None:
        before, more = (
            self.new(NUMBER, f"load double, ptr {place}, align 8"),
            self.number(self.value(value)),
        )
        total = self.new(NUMBER, f"fadd double {before.text}, {more.text}")
        self.do(f"store double {total.text}, ptr {place}, align 8")

    def _if(self, test: ast.expr, body: list[ast.stmt]) -> None:
        match test, body:
            case ast.Call(func=ast.Name(id="any_lane"), args=[mask]), _:
                self._where_any(self.value(mask), body)
            case _, [ast.Return(value=value)]:
                condition, label = self.value(test), self._label()
                self.do(f"br i1 {condition.text}, label %leave{label}, label %go{label}")
                self.do(f"leave{label}:")
                self._leave(value)
                self.do(f"go{label}:")
            case _:
                condition, before, first = self.value(test), dict(self.names), len(self.lines)
                self.run(body)
                if any(not line.name for line in self.lines[first:]):
                    raise UntranslatableError(ast.unparse(body[0]))  # it would act in any case
                for name, old in before.items():
                    if (new := self.names[name]) != old:
                        a, b = self.number(new), self.number(old)
                        self.names[name] = self.new(
                            NUMBER, f"select i1 {condition.text}, double {a.text}, double {b.text}"
                        )

    def _for(self, index: str, first: Value, last: Value, body: list[ast.stmt]) -> None:
        """A loop over whole numbers; names that its body assigns, and that stood before, go round
        with it.
        """
        label = self._label()
        assigned = {
            name.id
            for statement in body
            for name in ast.walk(statement)
            if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)
        }
        carried = sorted(name for name in assigned if name in self.names and name != index)
        self.do(f"br label %from{label}")
        self.do(f"from{label}:")
        self.do(f"br label %loop{label}")
        self.do(f"loop{label}:")
        places = len(self.lines)  # of the phis, completed when the body is known
        before = {index: first, **{name: self.names[name] for name in carried}}
        for name, value in before.items():
            self.names[name] = self.new(value.kind, "phi")
        round_ = {name: self.names[name] for name in before}
        going = self.new(TRUTH, f"icmp slt i64 {round_[index].text}, {last.text}")
        self.do(f"br i1 {going.text}, label %body{label}, label %done{label}")
        self.do(f"body{label}:")
        self.run(body)
        after = {name: self.names[name] for name in carried}
        after[index] = self.new(INTEGER, f"add i64 {round_[index].text}, 1")
        self.do(f"br label %back{label}")
        self.do(f"back{label}:")
        self.do(f"br label %loop{label}")
        self.do(f"done{label}:")
        for i, (name, value) in enumerate(before.items()):
            line = self.lines[places + i]
            self.lines[places + i] = line._replace(
                text=f"{line.name} = phi {line.type} [ {value.text}, %from{label} ], "
                f"[ {after[name].text}, %back{label} ]"
            )
        self.names |= round_

    def _leave(self, value: ast.expr | None) -> None:
        match value:
            case None:
                self.do("ret void")
            case ast.Tuple(elts=elements):
                given = [self.value(e) for e in elements]
                pair = "{ " + ", ".join(self.types[v.kind] for v in given) + " }"
                whole = "poison"
                for i, v in enumerate(given):
                    whole = self.new(
                        pair, f"insertvalue {pair} {whole}, {self.types[v.kind]} {v.text}, {i}"
                    ).text
                self.do(f"ret {pair} {whole}")
            case _:
                found = self.value(value)
                if found.kind == TRUTH:
                    found = self.new(INTEGER, f"zext i1 {found.text} to i64")
                self.do(f"ret {self.types[found.kind]} {found.text}")

    def _helper(self, name: str, arguments: list[ast.expr]) -> None:
        """Call another function of the head with values and with arrays, whole or from
        some row on.
        """
        given = []
        for argument in arguments:
            match argument:
                case ast.Name(id=array) if array in self._pointers:
                    given.append((ARRAY, f"%{array}"))
                case ast.Subscript(
                    value=ast.Name(id=array), slice=ast.Slice(lower=first, upper=None, step=None)
                ) if first:
                    given.append((ARRAY, self._place(array, first, self.row)))
                case _:
                    value = self.value(argument)
                    given.append((self.types[value.kind], value.text))
        self.helpers[name] = tuple(kind for kind, _ in given)
        self.do(f"call void @saltus_{name}({', '.join(f'{kind} {text}' for kind, text in given)})")

    def _call_for_two(self, names: list[str], function: str, values: list[Value]) -> None:
        kind = LANE if function == "sincos" else NUMBER
        pair = f"{{ {self.types[kind]}, {self.types[kind]} }}"
        given = ", ".join(f"{self.types[v.kind]} {v.text}" for v in values)
        both = self.new(pair, f"call {pair} @saltus_{function}({given})")
        for i, name in enumerate(names):
            self.names[name] = self.new(kind, f"extractvalue {pair} {both.text}, {i}")

    def _where_any(self, mask: Value, body: list[ast.stmt]) -> None:
        """Do work only if the mask holds in any lane."""
        label, before = self._label(), dict(self.names)
        bits = self.new(
            f"i{self.lanes}", f"bitcast {self.types[MASK]} {mask.text} to i{self.lanes}"
        )
        some = self.new(TRUTH, f"icmp ne i{self.lanes} {bits.text}, 0")
        self.do(f"br label %here{label}")
        self.do(f"here{label}:")
        self.do(f"br i1 {some.text}, label %some{label}, label %none{label}")
        self.do(f"some{label}:")
        self.run(body)
        self.do(f"br label %none{label}")
        self.do(f"none{label}:")
        for name, old in before.items():
            if (new := self.names[name]) != old:
                type_ = self.types[old.kind]
                self.names[name] = self.new(
                    old.kind,
                    f"phi {type_} [ {old.text}, %here{label} ], [ {new.text}, %some{label} ]",
                )


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


class Signature(NamedTuple):
    """Arguments of a function, its result and attributes, and the numbers in a row of
    its arrays.
    """

    arguments: tuple[str, ...]
    result: str
    attributes: str
    row: int = 1


def function_ir(
    tree: ast.FunctionDef,
    signature: Signature,
    lanes: int,
    constants: Mapping[str, Value],
    declared: set[str],
    helpers: Helpers,
) -> str:
    """One function as IR text for some lanes of each row, in blocks if it is long."""
    kinds = {WHOLE: INTEGER, REAL: NUMBER}
    arguments = list(
        zip((argument.arg for argument in tree.args.args), signature.arguments, strict=True)
    )
    given = {
        name: Value(kinds.get(type_, LANE), f"%{name}")
        for name, type_ in arguments
        if type_ != ARRAY
    }
    arrays = [name for name, type_ in arguments if type_ == ARRAY]
    body = _Body(lanes, signature.row, arrays, {**constants, **given}, declared, helpers)
    body.run(tree.body)
    if signature.result == "void":
        body.do("ret void")
    parameters = ", ".join(f"{type_} %{name}" for name, type_ in arguments)
    return in_blocks(
        f"saltus_{tree.name}", signature.result, parameters, signature.attributes, body.lines, lanes
    )
