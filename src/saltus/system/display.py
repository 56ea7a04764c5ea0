"""Display of a System: text for the terminal, HTML with formulas for a notebook."""

from __future__ import annotations

import html
import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence

from saltus.contact.guards import Law, at_equality, is_hold
from saltus.contact.reduction import free_field
from saltus.errors import counted
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, depends_on, state, varies
from saltus.language.latex import LatexWriter, latex_name
from saltus.language.text import Writer
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.units import from_si

#: First words of the description of a structure.
STRUCTURE = "Structure of"
#: Most states whose equations are shown.
MOST_SHOWN = 24
#: Longest formula of an output that is shown [characters].
_LONG = 80


# -- text ------------------------------------------------------------------------------------------
def equation_lines(system: EquationsOfMotion) -> list[str]:
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


def _jumps(system: EquationsOfMotion, writer: Writer) -> Iterator[tuple[str, str, Expr]]:
    """Jumps of the state: the side where each happens, a state and its new value."""
    for number, guard in enumerate(system.guards):
        if guard.law is None:
            continue
        for name, entry in zip(system.states, guard.law.reset, strict=False):
            if entry is not state(name):
                yield writer.side(number, guard.law.side < 0), name, entry


def system_text(system: EquationsOfMotion) -> str:
    """The block that ``repr`` shows: equations, guards, parameters."""
    head = (
        f"System {system.name}: {counted(len(system.states), 'state')}, "
        f"{counted(_boundaries(system), 'guard')}{_forcing(system)}"
    )
    states = [
        f"{name} [{system.units[name]}]" if system.units[name] else name for name in system.states
    ]
    long = len(states) > MOST_SHOWN
    if long:
        states[3:-1] = ["..."]
    equations = ["not shown, as they are long: .equations() lists them"] if long else None
    blocks = [
        [head],
        _about(system),
        [f"states      {', '.join(states)}"],
        _labelled("equations", equations or equation_lines(system)),
    ]
    if system.guards and long:
        named = ", ".join(guard.name for guard in system.guards if not is_hold(guard))
        blocks.append(textwrap.wrap(f"guards      {named}", 100, subsequent_indent=" " * 12))
    elif system.guards:
        blocks.append(_labelled("guards", _aligned(_guard_rows(system))))
    if len(system.outputs):
        blocks.append(_labelled("outputs", _aligned(_output_rows(system))))
    if system.values:
        blocks.append(_labelled("parameters", _aligned(_parameter_rows(system))))
    if system.source:
        blocks.append([f"source      {system.source}"])
    return "\n".join(line for block in blocks for line in block)


def _about(system: EquationsOfMotion) -> list[str]:
    """The lines about a structure, whose equations alone don't show its frequencies."""
    words = system.description if system.description.startswith(STRUCTURE) else ""
    return textwrap.wrap(f"{'about':<12}{words}", 100, subsequent_indent=" " * 12) if words else []


def _boundaries(system: EquationsOfMotion) -> int:
    """Number of boundaries, hold guards not counted."""
    return sum(not is_hold(guard) for guard in system.guards)


def _output_rows(system: EquationsOfMotion) -> list[tuple[str, str]]:
    """Name, unit and formula of each output; a long formula isn't shown."""
    mine, rows = system.outputs, []
    formulas, guards = mine.behind(system.guards)
    for name, unit, formula in zip(mine.names, mine.units, formulas, strict=True):
        text = Writer(guards, limit=_LONG).text(formula)
        rows.append((f"{name} [{unit}]" if unit else name, "..." if "..." in text else text))
    return rows


def _forcing(system: EquationsOfMotion) -> str:
    if system.forced_at is None:
        driven = any(depends_on(entry, ("time",)) for entry in system.field)
        return ", driven by functions of the time" if driven else ", not forced"
    return (
        f", forced at {system.forced_at} = {_value(system, system.forced_at)} (T = "
        f"{from_si(system.period(), 's')})"
    )


def _guard_rows(system: EquationsOfMotion) -> list[tuple[str, str]]:
    """Name and equation of each guard."""
    writer = _writer(Writer, system, free_field(system.field, system.guards))
    rows = []
    for number, guard in enumerate(system.guards):
        if is_hold(guard):
            continue
        where = at_equality(writer.side(number))
        if guard.boundary is not None and guard.state is not None:
            (value,) = evaluate([guard.boundary], values=system.values)
            where += (
                f"  ({from_si(float(value) + 0.0, system.units[guard.state])})"
                if guard.boundary.op != "const"
                else ""
            )
        rows.append((guard.name, _by_law(guard.law, where, system, writer)))
    return rows


def _by_law(law: Law | None, where: str, system: EquationsOfMotion, writer: Writer) -> str:
    """The effect of a boundary in words, and its equation."""
    if law is None:
        return where
    if law.kind == "surface":
        limit = writer.text(law.limit) if law.limit is not None else "1"
        stronger = "" if limit == "1" else f", held by up to {limit} times the force of sliding"
        if law.support >= 0:
            contact = system.guards[law.support].law
            assert contact is not None
            return (
                f"sticks or slides at {where} while {system.guards[contact.partner].name!r} rests"
            )
        return f"sticks or slides at {where}{stronger}"
    if law.restitution is None:
        return f"jump at {where}"
    rough = "" if law.friction is None else f" and friction {_number(law.friction, system, writer)}"
    return f"impact with restitution {_number(law.restitution, system, writer)}{rough} at {where}"


def _number(part: Expr, system: EquationsOfMotion, writer: Writer) -> str:
    """A plain number of a law: its value, or its dependence on the state."""
    if varies(part):
        return writer.text(part)
    (value,) = evaluate([part], values=system.values)
    return from_si(float(value) + 0.0, "1")


def _parameter_rows(system: EquationsOfMotion) -> list[tuple[str, str]]:
    """Name and value of each parameter; an angle in degrees too."""
    texts = {name: _value(system, name) for name in system.values}
    degrees = {
        name: from_si(math.degrees(value), "")
        for name, value in system.values.items()
        if system.units[name] == "rad"
    }
    return [
        (name, f"{text} ({degrees[name]} deg)" if name in degrees else text)
        for name, text in texts.items()
    ]


def _value(system: EquationsOfMotion, parameter: str) -> str:
    """The value of a parameter in a readable unit."""
    return from_si(system.values[parameter], system.units[parameter])


def _writer(kind: type[Writer], system: EquationsOfMotion, field: Sequence[Expr]) -> Writer:
    roots = [*field, *(guard.gap for guard in system.guards if not is_hold(guard))]
    roots += [entry for guard in system.guards if guard.law for entry in guard.law.reset]
    return kind(system.guards, shared=roots, taken=(*system.states, *system.values, "t"))


def _labelled(label: str, lines: list[str]) -> list[str]:
    return [f"{label if number == 0 else '':<11} {line}" for number, line in enumerate(lines)]


def _aligned(rows: list[tuple[str, str]]) -> list[str]:
    width = max(len(name) for name, _ in rows)
    return [f"{name:<{width}}  {text}" for name, text in rows]


# -- formulas --------------------------------------------------------------------------------------
def latex_lines(system: EquationsOfMotion) -> list[str]:
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


def system_html(system: EquationsOfMotion) -> str:
    """The notebook view: formulas, guards and parameters."""
    long = len(system.states) > MOST_SHOWN
    parts = [
        f"<b>{html.escape(system.name)}</b> "
        f"<span>{html.escape(_forcing(system).lstrip(', '))}</span>"
    ]
    if system.description:
        parts.append(f"<p>{html.escape(system.description.splitlines()[0])}</p>")
    if not long:
        formulas = " \\\\ ".join(latex_lines(system))
        parts.append(f"$$\\begin{{aligned}} {html.escape(formulas)} \\end{{aligned}}$$")
    if system.guards and not long:
        parts.append(_table(("guard", "boundary"), _guard_rows(system)))
    if len(system.outputs):
        parts.append(_table(("output", "formula"), _output_rows(system)))
    if system.values:
        parts.append(_table(("parameter", "value"), _parameter_rows(system)))
    return "<div>" + "".join(parts) + "</div>"


def _table(head: tuple[str, str], rows: Iterable[tuple[str, str]]) -> str:
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
