"""Display of a System: text for the terminal, HTML with formulas for a notebook."""

from __future__ import annotations

import html
import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from saltus.errors import counted
from saltus.system.expression import ELEMENTARY, Condition, Expr, state, varies
from saltus.system.guards import Law, at_equality, is_hold
from saltus.system.reduction import free_field
from saltus.system.text import _ATOM, _PRODUCT, PI_MULTIPLES, Writer
from saltus.units import from_si

if TYPE_CHECKING:
    from saltus.system.system import System

#: How the description of a structure begins.
STRUCTURE = "Structure of"
_GREEK = frozenset(
    [
        "alpha",
        "beta",
        "gamma",
        "delta",
        "epsilon",
        "zeta",
        "eta",
        "theta",
        "iota",
        "kappa",
        "lambda",
        "mu",
        "nu",
        "xi",
        "pi",
        "rho",
        "sigma",
        "tau",
        "phi",
        "chi",
        "psi",
        "omega",
        "Gamma",
        "Delta",
        "Theta",
        "Lambda",
        "Xi",
        "Pi",
        "Sigma",
        "Phi",
        "Psi",
        "Omega",
    ]
)


# -- text ------------------------------------------------------------------------------------------
def equation_lines(system: System) -> list[str]:
    """The equations, one line each, named parts first."""
    field = free_field(system.field, system.guards)
    writer = _writer(Writer, system, field)
    lines = [
        f"d{name}/dt = {writer.text(entry)}"
        for name, entry in zip(system.states, field, strict=True)
    ]
    lines += [
        f"{place}: {name} becomes {writer.text(entry)}"
        for place, name, entry in _jumps(system, writer)
    ]
    return writer.lines + lines


def _jumps(system: System, writer: Writer) -> Iterator[tuple[str, str, Expr]]:
    """Where the state jumps: the place, a state and its new value."""
    for number, guard in enumerate(system.guards):
        if guard.law is None:
            continue
        for name, entry in zip(system.states, guard.law.reset, strict=False):
            if entry is not state(name):
                yield writer.side(number, guard.law.side < 0), name, entry


def system_text(system: System) -> str:
    """The block that ``repr`` shows: equations, guards, parameters."""
    head = (
        f"System {system.name}: {counted(len(system.states), 'state')}, "
        f"{counted(_boundaries(system), 'guard')}{_forcing(system)}"
    )
    states = [
        f"{name} [{system.units[name]}]" if system.units[name] else name for name in system.states
    ]
    blocks = [
        [head],
        _about(system),
        [f"states      {', '.join(states)}"],
        _labelled("equations", equation_lines(system)),
    ]
    if system.guards:
        blocks.append(_labelled("guards", _aligned(_guard_rows(system))))
    if system.values:
        blocks.append(_labelled("parameters", _aligned(_parameter_rows(system))))
    if system.source:
        blocks.append([f"source      {system.source}"])
    return "\n".join(line for block in blocks for line in block)


def _about(system: System) -> list[str]:
    """What is said of a structure, whose equations alone don't tell its frequencies."""
    words = system.description if system.description.startswith(STRUCTURE) else ""
    return textwrap.wrap(f"{'about':<12}{words}", 100, subsequent_indent=" " * 12) if words else []


def _boundaries(system: System) -> int:
    """How many boundaries there are: hold guards aren't any."""
    return sum(not is_hold(guard) for guard in system.guards)


def _forcing(system: System) -> str:
    if system.forced_at is None:
        return ", not forced"
    return (
        f", forced at {system.forced_at} = {system.parameter_text(system.forced_at)} (T = "
        f"{from_si(system.period(), 's')})"
    )


def _guard_rows(system: System) -> list[tuple[str, str]]:
    """Name and place of each guard."""
    from saltus.system.evaluate import evaluate

    writer = _writer(Writer, system, free_field(system.field, system.guards))
    rows = []
    for number, guard in enumerate(system.guards):
        if is_hold(guard):
            continue
        place = at_equality(writer.side(number))
        if guard.boundary is not None and guard.state is not None:
            (value,) = evaluate([guard.boundary], values=system.values)
            place += (
                f"  ({from_si(float(value) + 0.0, system.units[guard.state])})"
                if guard.boundary.op != "const"
                else ""
            )
        rows.append((guard.name, _by_law(guard.law, place, system, writer)))
    return rows


def _by_law(law: Law | None, place: str, system: System, writer: Writer) -> str:
    """What happens at a boundary, and where it is."""
    if law is None:
        return place
    if law.kind == "surface":
        limit = writer.text(law.limit) if law.limit is not None else "1"
        stronger = "" if limit == "1" else f", held by up to {limit} times the force of sliding"
        if law.support >= 0:
            contact = system.guards[law.support].law
            assert contact is not None
            return (
                f"sticks or slides at {place} while {system.guards[contact.partner].name!r} rests"
            )
        return f"sticks or slides at {place}{stronger}"
    if law.restitution is None:
        return f"jump at {place}"
    rough = "" if law.friction is None else f" and friction {_number(law.friction, system, writer)}"
    return f"impact with restitution {_number(law.restitution, system, writer)}{rough} at {place}"


def _number(part: Expr, system: System, writer: Writer) -> str:
    """A plain number of a law: its value, or how it depends on the state."""
    if varies(part):
        return writer.text(part)
    from saltus.system.evaluate import evaluate

    (value,) = evaluate([part], values=system.values)
    return from_si(float(value) + 0.0, "1")


def _parameter_rows(system: System) -> list[tuple[str, str]]:
    """Name and value of each parameter; an angle in degrees too."""
    texts = {name: system.parameter_text(name) for name in system.values}
    degrees = {
        name: from_si(math.degrees(value), "")
        for name, value in system.values.items()
        if system.units[name] == "rad"
    }
    return [
        (name, f"{text} ({degrees[name]} deg)" if name in degrees else text)
        for name, text in texts.items()
    ]


def _writer(kind: type, system: System, field: Sequence[Expr]) -> Writer:
    roots = [*field, *(guard.gap for guard in system.guards if not is_hold(guard))]
    roots += [entry for guard in system.guards if guard.law for entry in guard.law.reset]
    return kind(system.guards, shared=roots, taken=(*system.states, *system.values, "t"))


def _labelled(label: str, lines: list[str]) -> list[str]:
    return [f"{label if number == 0 else '':<11} {line}" for number, line in enumerate(lines)]


def _aligned(rows: list[tuple[str, str]]) -> list[str]:
    width = max(len(name) for name, _ in rows)
    return [f"{name:<{width}}  {text}" for name, text in rows]


# -- formulas --------------------------------------------------------------------------------------
class LatexWriter(Writer):
    """Writes expressions as LaTeX math."""

    name_from = 200
    greater, less = r" \gt ", r" \lt "

    def joint(self, both: bool) -> str:
        """The word between two conditions."""
        return r" \;\text{and}\; " if both else r" \;\text{or}\; "

    def name(self, name: str) -> str:
        """A name as a symbol."""
        return latex_name(name)

    def number(self, value: float) -> tuple[str, int]:
        """A constant, powers of ten written out."""
        if value in PI_MULTIPLES:
            return {"pi": r"\pi", "2*pi": r"2 \pi", "4*pi": r"4 \pi", "pi/2": r"\frac{\pi}{2}"}[
                PI_MULTIPLES[value]
            ], _ATOM
        text, strength = super().number(value)
        mantissa, _, exponent = text.partition("e")
        return (
            (text, strength)
            if not exponent
            else (
                rf"{mantissa} \cdot "
                rf"10^{{{exponent}}}",
                min(strength, _PRODUCT),
            )
        )

    def infix(self, op: str, left: Expr, right: Expr) -> tuple[str, int]:
        """Quotients as fractions, products without a sign."""
        if op == "div":
            return rf"\frac{{{self.text(left)}}}{{{self.text(right)}}}", _ATOM
        if op == "mul":
            return (
                rf"{self.part(left, _PRODUCT)} \, "
                rf"{self.part(right, _PRODUCT, after_sign=True)}"
            ), _PRODUCT
        return super().infix(op, left, right)

    def power(self, base: Expr, exponent: Expr) -> str:
        """A superscript."""
        text = self.part(base, _ATOM)
        braced = text if base.op in ("state", "param", "time") else f"{{{text}}}"
        return f"{braced}^{{{self.text(exponent)}}}"

    def call(self, function: str, *arguments: Expr) -> str:
        """A function or a root."""
        inner = ", ".join(map(self.text, arguments))
        if function == "sqrt":
            return rf"\sqrt{{{inner}}}"
        if function not in ELEMENTARY:
            return latex_name(function) + self.parentheses(inner)
        return rf"\{'arctan' if function == 'atan' else function}{self.parentheses(inner)}"

    def piece(self, value: Expr, condition: Condition) -> str:
        """One line of cases."""
        return rf"{self.text(value)} & \text{{if }} {self.condition(condition)} \\"

    def piecewise(self, pieces: list[str], otherwise: Expr) -> str:
        """Cases."""
        return (
            rf"\begin{{cases}} {' '.join(pieces)} {self.text(otherwise)} & \text{{otherwise}} "
            rf"\end{{cases}}"
        )

    def parentheses(self, text: str) -> str:
        """Parentheses that grow."""
        return rf"\left({text}\right)"

    def line(self, name: str, text: str) -> str:
        """An aligned line."""
        return f"{name} &= {text}"


def latex_name(name: str) -> str:
    r"""A name as LaTeX: one letter in italics, Greek letters by name, ``m_1`` with a subscript,
    words upright.
    """
    head, _, rest = name.partition("_")
    letters = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    if letters is None or not (len(letters[1]) == 1 or letters[1] in _GREEK) or "_" in rest:
        return (
            r"\mathrm{"
            + "".join(
                c if c.isalnum() and c.isascii() else r"\_" if c == "_" else rf"\text{{{c}}}"
                for c in name
            )
            + "}"
        )
    symbol = letters[1] if len(letters[1]) == 1 else "\\" + letters[1]
    below = rest or letters[2]
    if letters[2] and rest:  # m2_b
        return rf"{symbol}_{{\mathrm{{{letters[2]} {rest}}}}}"
    if not below:
        return symbol
    return f"{symbol}_{{{below if below.isdigit() or len(below) == 1 else latex_name(below)}}}"


def latex_lines(system: System) -> list[str]:
    """The equations as LaTeX, aligned at ``&=``."""
    field = free_field(system.field, system.guards)
    writer = _writer(LatexWriter, system, field)
    lines = [
        f"\\dot{{{latex_name(name)}}} &= {writer.text(entry)}"
        for name, entry in zip(system.states, field, strict=True)
    ]
    lines += [
        rf"{place}: \quad {latex_name(name)}^{{+}} &= {writer.text(entry)}"
        for place, name, entry in _jumps(system, writer)
    ]
    return writer.lines + lines


def system_html(system: System) -> str:
    """The notebook view: formulas, guards and parameters."""
    formulas = " \\\\ ".join(latex_lines(system))
    parts = [
        f"<b>{html.escape(system.name)}</b> "
        f"<span>{html.escape(_forcing(system).lstrip(', '))}</span>"
    ]
    if system.description:
        parts.append(f"<p>{html.escape(system.description.splitlines()[0])}</p>")
    parts.append(f"$$\\begin{{aligned}} {html.escape(formulas)} \\end{{aligned}}$$")
    if system.guards:
        parts.append(_table(("guard", "boundary"), _guard_rows(system)))
    if system.values:
        parts.append(_table(("parameter", "value"), _parameter_rows(system)))
    return "<div>" + "".join(parts) + "</div>"


def _table(head: tuple[str, str], rows: Iterable[tuple[str, str]]) -> str:
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
