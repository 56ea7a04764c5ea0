"""Translate one function of a generated head to LLVM IR: the few forms of Python in which heads are
written.

A head is straight-line code on doubles and lanes; the text that runs as plain Python with the JIT
off is the text that is translated here, so there is one source.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from saltus.codegen import repeats, templates
from saltus.codegen.blocks import Line, in_blocks
from saltus.codegen.expression_ir import (
    INTEGER,
    LANE,
    MASK,
    NUMBER,
    TRUTH,
    Expressions,
    UntranslatableError,
    Value,
)
from saltus.codegen.head_text import Function
from saltus.codegen.interface import ARRAY, REAL, WHOLE

#: Functions of a head that its others call: their arguments, None before the first call.
Helpers = dict[str, tuple[str, ...] | None]


class _Body(Expressions):
    """The lines of one function while its statements are translated."""

    def __init__(
        self,
        lanes: int,
        row: int,
        pointers: Iterable[str],
        names: Mapping[str, Value],
        declared: set[str],
        helpers: Helpers,
    ) -> None:
        super().__init__(lanes, row, pointers, names, declared)
        self.helpers, self._labels = helpers, 0

    def _label(self) -> int:
        self._labels += 1
        return self._labels

    def run(self, statements: Iterable[str | ast.stmt]) -> None:
        """Translate statements."""
        for statement in statements:
            match statement:
                case str(text):
                    self._text(text)
                case ast.Pass() | ast.Expr(value=ast.Constant()):
                    pass
                case ast.Assign(targets=[target], value=value):
                    self._assign(target, value)
                case ast.AugAssign(
                    target=ast.Subscript(value=ast.Name(id=array), slice=index),
                    op=ast.Add(),
                    value=value,
                ):
                    self._add_to(self.place(array, index, 1), value)
                case ast.Expr(
                    value=ast.Call(func=ast.Name(id="store"), args=[ast.Name(id=array), row, value])
                ):
                    found = self.lane(self.value(value))
                    self.do(
                        f"store {self.types[LANE]} {found.text}, ptr "
                        f"{self.place(array, row, self.row)}, align 8"
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

    def _text(self, statement: str) -> None:
        """Translate a statement, or repeat what one of its shape became."""
        found = repeats.read(statement, self.names, self.lanes, self.row)
        if found is None:
            self.run(templates.tree_of(statement).body)
            return
        target, shape, numbers = found
        known = repeats.recorded(shape, self._alone)
        lines, value = repeats.lines_of(known, numbers, len(self.lines))
        self.lines += lines
        if known.declared:
            self.declared |= known.declared
        if target is not None and value is not None:
            self.names[target] = value

    def _alone(
        self, text: str, names: dict[str, Value], count: int
    ) -> tuple[list[Line], Value | None, set[str]]:
        """The lines of a statement on its own, behind those of its ``count`` operands."""
        body = _Body(self.lanes, self.row, self.pointers, names, set(), {})
        body.lines = [Line("", "", "")] * count
        body.run(templates.tree_of(text).body)
        return body.lines[count:], body.names.get(repeats.TARGET), body.declared

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
                self.do(f"store double {number.text}, ptr {self.place(array, index, 1)}, align 8")
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
                case ast.Name(id=array) if array in self.pointers:
                    given.append((ARRAY, f"%{array}"))
                case ast.Subscript(
                    value=ast.Name(id=array), slice=ast.Slice(lower=first, upper=None, step=None)
                ) if first:
                    given.append((ARRAY, self.place(array, first, self.row)))
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


class Signature(NamedTuple):
    """Arguments of a function, its result and attributes, and the numbers in a row of
    its arrays.
    """

    arguments: tuple[str, ...]
    result: str
    attributes: str
    row: int = 1


def function_ir(
    function: Function,
    signature: Signature,
    lanes: int,
    constants: Mapping[str, Value],
    declared: set[str],
    helpers: Helpers,
) -> str:
    """One function as IR text for some lanes of each row, in blocks if it is long."""
    kinds = {WHOLE: INTEGER, REAL: NUMBER}
    arguments = list(zip(function.arguments, signature.arguments, strict=True))
    given = {
        name: Value(kinds.get(type_, LANE), f"%{name}")
        for name, type_ in arguments
        if type_ != ARRAY
    }
    arrays = [name for name, type_ in arguments if type_ == ARRAY]
    body = _Body(lanes, signature.row, arrays, {**constants, **given}, declared, helpers)
    body.run(function.body)
    if signature.result == "void":
        body.do("ret void")
    parameters = ", ".join(f"{type_} %{name}" for name, type_ in arguments)
    return in_blocks(
        f"saltus_{function.name}",
        signature.result,
        parameters,
        signature.attributes,
        body.lines,
        lanes,
    )
