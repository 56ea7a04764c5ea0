"""The generated head of a Taylor module: sizes, constants, jets and gaps of one system."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.codegen.clocks import Clocks
from saltus.codegen.head import Constant, Head
from saltus.codegen.jets import MOVING, Constants, JetCode
from saltus.codegen.long_sums import LongSums, long_sums
from saltus.codegen.loops import LoopCode, loops_of
from saltus.codegen.saltation import (
    jump_function,
    levels_function,
    levels_of,
    reset_function,
    settle_function,
    size_of_terms,
)
from saltus.codegen.scalar import ScalarCode, indented, parameter_leaf
from saltus.codegen.series import Linear, SeriesBuilder, is_constant
from saltus.contact.guards import Guard, is_hold
from saltus.contact.singular import set_aside
from saltus.kernels.status import LAW_KINDS, NO_LAW
from saltus.language import all_assuming
from saltus.language import expression as ex
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.quantity import is_remembered
from saltus.system.tangent import first_column

#: Rows of the clock before the phases of harmonics (kernels/taylor/layout.py: TAU, BASE).
FIRST_TURN = 2


def gaps_function(system: System, clocks: Clocks) -> str:
    """Code of ``gaps(t, y, p, h, out)``: the value of every guard, with sides from the state; h is
    the data of the clocks.

    Whether a contact is held, and the side of a gap that is zero or on whose boundary the state is
    known to stand (twice the side), are taken from out. Behind the gaps come, for a guard whose
    contact can be held, the rate at which its constraint is left without its own force, what that
    force changes of it (of an impact, over what it changes without friction), and the constraint
    itself; then of every guard the size of its gap, and of such constraints their sizes.
    """
    laws = any(guard.law for guard in system.guards)
    code = ScalarCode(
        parameter_leaf(system, "y", clocks.value),
        side=lambda i: f"up_{i}" if laws else f"(out[{i}] > 0.0)",
        switch=clocks.side,
    )
    if laws:
        for i in range(len(system.guards)):
            code.lines += [f"side_{i} = out[{i}]", f"up_{i} = side_{i} > 0.0"]
    for i in evaluation_order(system):
        value = code.value(system.guards[i].gap)
        code.lines.append(f"out[{i}] = {value}")
        if laws:
            above = f"({value} > 0.0 and side_{i} > -1.5) or side_{i} > 1.5"
            code.lines.append(f"up_{i} = {above} or ({value} == 0.0 and up_{i})")
    count, held = len(system.guards), []
    for i, guard in enumerate(system.guards):
        if guard.law and guard.law.kind == "hold":
            held.append(f"out[{i}] = {code.value(guard.gap)}")
        if guard.law is None or guard.law.constraint is None:
            held.append(f"out[{4 * count + i}] = {code.value(size_of_terms(guard.gap))}")
        if guard.law and guard.law.kind != "hold":
            pivot = guard.law.pivot
            if guard.law.kind == "impact":
                rough = guard.law.remaining is not None
                pivot = guard.law.remaining if rough else ex.constant(1.0)
            constraint = guard.law.constraint
            sizes = () if constraint is None else map(size_of_terms, (guard.gap, constraint))
            behind = (guard.law.drive, pivot, constraint, *sizes)
            held += [
                f"out[{(1 + block) * count + i}] = {code.value(value)}"
                for block, value in enumerate(behind)
                if value is not None
            ]
    code.lines += held  # after all code that reads the sides of hold guards
    return f"@kernel\ndef gaps(t, y, p, h, out):\n{indented(code.lines)}\n"


def evaluation_order(system: System) -> list[int]:
    """Guards ordered so that a gap comes after the guards on whose sides it depends; without hold
    guards, which depend on one another in circles.
    """
    order: list[int] = []

    def visit(i: int) -> None:
        law = system.guards[i].law
        if i in order or (law and law.kind == "hold"):
            return
        for node in ex.walk(system.guards[i].gap):
            if node.op == "select":
                for guard in bits_of(node.payload):
                    visit(guard)
        order.append(i)

    for i in range(len(system.guards)):
        visit(i)
    return order


def bits_of(condition: ex.Condition) -> set[int]:
    """Guards that a condition needs."""
    match condition:
        case ex.Bit(guard):
            return {guard}
        case ex.Relation():
            return set()
        case ex.And(left, right) | ex.Or(left, right):
            return bits_of(left) | bits_of(right)
        case ex.Not(inner):
            return bits_of(inner)
    raise TypeError(condition)


class _Guards:
    """Rows and snap data of the guards, filled while the jets are written."""

    def __init__(self) -> None:
        self.row: list[int] = []
        self.sign: list[float] = []
        self.snap_state: list[int] = []
        self.snap_const: list[int] = []


def _state_boundary(form: Linear, system: System) -> tuple[str, float, Expr] | None:
    """(state, sign, boundary) if the gap is ``sign * (state - boundary)`` with a boundary of
    parameters only.
    """
    if len(form.terms) != 1 or ex.depends_on(form.offset, MOVING):
        return None
    ((series, coefficient),) = form.terms.items()
    if (
        series.kind != "state"
        or series.payload not in system.states
        or not (is_constant(coefficient, 1.0) or is_constant(coefficient, -1.0))
    ):
        return None
    sign = coefficient.payload
    return str(series.payload), sign, ex.neg(form.offset) if sign > 0 else form.offset


def _gap_form(
    builder: SeriesBuilder, system: System, number: int, guard: Guard, gap: Expr
) -> Linear:
    """The series of a gap. While the contact is held its gap is zero: a difference of states and
    times would leave rounding in its place, whose series allows no step. The margin to release of a
    contact that isn't held is zero too, as it may have poles.
    """
    form = builder.form(gap)
    if guard.law is None or guard.law.partner < 0:
        return form
    if is_hold(guard):
        poles = any(node.op == "div" and ex.varies(node.args[1]) for node in ex.walk(gap))
        return builder.form(ex.select(ex.Bit(number), gap, 0.0)) if poles else form
    if _state_boundary(form, system) is not None:
        return form
    return builder.form(ex.select(ex.Bit(guard.law.partner), 0.0, gap))


def taylor_head(system: System, order: int, lanes: int) -> Head:
    """The head that kernels/taylor expects above it."""
    clocks = Clocks(system)
    aside = set_aside(system.field, system.guards)
    sums = long_sums(aside.field, aside.gaps, system.states) if not system.tangent_of else None
    builder, constants = SeriesBuilder(clocks), Constants(sums.count if sums else 0)
    column, moved = first_column(system), count_moved(system)
    code = (
        _series(system, aside.field, builder, constants, order)
        if sums is None
        else _looped_series(sums, builder, constants, order)
    )
    aside_gaps = sums.gaps if sums else aside.gaps
    gaps = [
        _gap_form(builder, system, number, guard, gap)
        for number, (guard, gap) in enumerate(zip(system.guards, aside_gaps, strict=True))
    ]
    sizes = [
        form if is_hold(guard) else builder.form(gap)
        for form, guard, gap in zip(gaps, system.guards, aside_gaps, strict=True)
    ]
    first_row = (sums.count if sums else len(system.states)) * (order + 1)
    guards, rows = _write_guards(system, code, gaps, sizes, constants, order, first_row)
    gap_row, scale_row, calm_row = rows, rows + len(system.guards), rows + 2 * len(system.guards)
    if isinstance(code, LoopCode) and sums and aside.guards:
        code.values()
    for j in range(len(aside.guards)):
        if isinstance(code, LoopCode) and sums:
            parts = list(all_assuming(sums.parts, [aside.first + j], True))
            code.without(parts, calm_row + j * moved, moved)
            continue
        for i, entry in enumerate(aside.without(j, moved)):
            code.write(calm_row + j * moved + i, code.linear(builder.form(entry), 0))
    handed_row = calm_row + moved * len(aside.guards)
    probed = builder.may_hide()
    rates = (
        []
        if not (probed or aside.guards)
        else _rates(system, aside.field, builder, constants, code.harmonics)
        if sums is None
        else _looped_rates(sums, builder, constants, code.harmonics)
    )
    series = sorted(set(guards.row))
    constants_of_head: dict[str, Constant] = dict(
        LANES=lanes, NSTATES=len(system.states), NGUARDS=len(system.guards), ORDER=order,
        NCONST=len(constants),
        NTURNS=len(code.harmonics), CLOCK_ROW=FIRST_TURN + len(code.harmonics), GAP_ROW=gap_row,
        SCALE_ROW=scale_row, CALM_ROW=calm_row,
        ROWS=handed_row + len(code.lines.handed), NMOVED=moved, NSINGULAR=len(aside.guards),
        NCOLUMNS=len(column),
        NEWTON_DEGREE_1=min(5, order), NEWTON_DEGREE_2=min(11, order), NSERIES=len(series),
        PROBED=probed, TANGENT=system.tangent_of is not None,
        LAWS=any(guard.law for guard in system.guards),
        LEVELS=bool(levels_of(system)),
        **tables(
            SERIES_ROW=series, GUARD_ROW=guards.row,
            GUARD_SERIES=[series.index(row) for row in guards.row],
            GUARD_SIGN=guards.sign, SNAP_STATE=guards.snap_state, SNAP_CONST=guards.snap_const,
            SINGULAR_GUARD=list(aside.guards),
            **tables_of_laws(system),
        ),
        **clocks.constants(),
    )  # fmt: skip
    functions = [
        _constants_function(system, constants),
        clocks.function(),
        gaps_function(system, clocks),
        jump_function(system, clocks, dated=True),
        reset_function(system, clocks, dated=True),
        levels_function(system, clocks),
        settle_function(system, clocks),
        _turns_function(system, code),
        *([loops_of(sums)] if sums else []),
        _jets_functions(code, len(column), handed_row, order + 1),
        f"@inner\ndef rates(y, side, c, clock, work):\n{indented(rates)}\n",
    ]
    return Head(constants_of_head, "\n".join(functions))


def _series(
    system: System,
    field: Sequence[Expr],
    builder: SeriesBuilder,
    constants: Constants,
    order: int,
) -> JetCode:
    """Code for the series of all states, one statement for each operation."""
    own, column = (system.tangent_of or system).states, first_column(system)
    written = (*range(len(own)), *column)
    fields = tuple(builder.form(field[i]) for i in written)
    code = JetCode(
        {system.states[i]: i for i in written}, fields, builder, constants, shared=len(own)
    )
    for i, row in enumerate(written):
        for k in range(order + 1):
            code.write(row * (order + 1) + k, code.state(i, k), of_column=row in column)
    return code


def _looped_series(
    sums: LongSums, builder: SeriesBuilder, constants: Constants, order: int
) -> LoopCode:
    """Code for the series of all states, with loops over long sums."""
    code = LoopCode(sums, builder, constants, order + 1)
    code.series()
    code.sizes()
    return code


def _looped_rates(
    sums: LongSums,
    builder: SeriesBuilder,
    constants: Constants,
    harmonics: dict[tuple[Expr, Expr], int],
) -> list[str]:
    """As :func:`_rates`, with loops over long sums."""
    code = LoopCode(sums, builder, constants)
    code.harmonics = harmonics
    code.right_hand_side()
    return list(code.lines.shared())


def count_moved(system: System) -> int:
    """Number of states that move by the system's equation: those before a tangent and before
    remembered states.
    """
    own = (system.tangent_of or system).states
    return len([name for name in own if not is_remembered(name)])


def tables_of_laws(system: System) -> dict[str, list[float]]:
    """Tables of the laws of contact, for each guard: its kind, its hold guard (of a hold guard: its
    owner), the guard of the contact that supports it, its side.
    """
    laws = [guard.law for guard in system.guards]
    return dict(
        LAW=[LAW_KINDS[law.kind] if law else NO_LAW for law in laws],
        PARTNER=[law.partner if law else -1 for law in laws],
        SUPPORT=[law.support if law else -1 for law in laws],
        LAW_SIDE=[float(law.side) if law else 0.0 for law in laws],
    )


def _rates(
    system: System,
    field: Sequence[Expr],
    builder: SeriesBuilder,
    constants: Constants,
    harmonics: dict[tuple[Expr, Expr], int],
) -> list[str]:
    """Code for the right-hand side alone, and for the size of its terms."""
    forms = tuple(builder.form(entry) for entry in field)
    code = JetCode({name: i for i, name in enumerate(system.states)}, forms, builder, constants)
    code.harmonics = harmonics
    for i, form in enumerate(forms):
        code.write(i, code.linear(form, 0))
        code.write(2 * len(forms) + i, code.rounding(form))
    return list(code.lines.shared())


def _constants_function(system: System, constants: Constants) -> str:
    """Code of ``constants(p, c, lane)``: values that depend on parameters only."""
    code = ScalarCode(parameter_leaf(system))
    for node, i in constants.rows.items():
        value = code.value(node)
        code.lines.append(f"c[{i}, lane] = {value}")
    return f"@kernel\ndef constants(p, c, lane):\n{indented(code.lines)}\n"


def _jets_functions(code: JetCode, columns: int, handed_row: int, terms: int) -> str:
    """Code of ``jets(y, side, c, clock, work)``; for a tangent it calls a function of one column
    for each column.
    """
    lines, texts = list(code.lines.shared(handed_row)), []
    if columns:
        texts.append(
            f"@inner\ndef jets_of_column(y, c, clock, shared, "
            f"work):\n{indented(code.lines.column)}\n\n"
        )
        lines += [
            f"jets_of_column(y[{j}:], c, clock, work[{handed_row}:], work[{j * terms}:])"
            for j in range(columns)
        ]
    return "".join(texts) + f"@inner\ndef jets(y, side, c, clock, work):\n{indented(lines)}\n"


def tables(**rows: Sequence[float]) -> dict[str, Constant]:
    """Tables as in a head: never empty."""
    return {name: tuple(entries) or (0,) for name, entries in rows.items()}


def _write_guards(
    system: System,
    code: JetCode,
    forms: list[Linear],
    sizes: list[Linear],
    constants: Constants,
    order: int,
    first_row: int,
) -> tuple[_Guards, int]:
    """Write every gap, and the size of its terms, to the work rows, held or not; guards of one
    state share that state's rows.
    """
    guards = _Guards()
    boundaries = [
        None if guard.law and guard.law.kind == "hold" else _state_boundary(form, system)
        for guard, form in zip(system.guards, forms, strict=True)
    ]
    own_rows = first_row
    for form, boundary in zip(forms, boundaries, strict=True):
        if boundary:
            state, sign, place = boundary
            index = system.states.index(state)
            guards.row.append(index * (order + 1))
            guards.sign.append(sign)
            guards.snap_state.append(index)
            guards.snap_const.append(constants.index(place))
            continue
        guards.row.append(own_rows)
        guards.sign.append(1.0)
        guards.snap_state.append(-1)
        guards.snap_const.append(-1)
        for k in range(order + 1):
            code.write(own_rows + k, code.linear(form, k))
        own_rows += order + 1
    for i, (form, size, boundary) in enumerate(zip(forms, sizes, boundaries, strict=True)):
        if boundary:
            x, c = code.named(boundary[0], 0), f"load(c, {guards.snap_const[i]}, LANES)"
            value: str | None = f"{x} - {c}" if boundary[1] > 0 else f"{c} - {x}"
        else:
            value = code.linear(form, 0)
        code.write(own_rows + i, value)
        code.write(own_rows + len(forms) + i, code.size(size))
    return guards, own_rows


def _turns_function(system: System, code: JetCode) -> str:
    """Code of ``turns(p, origin, period, count, lane, clock)``: phase of every harmonic at the
    start of a period; true if one of them drifts.
    """
    scalar = ScalarCode(parameter_leaf(system))
    drifting = []
    for (rate, offset), i in code.harmonics.items():
        w, b = scalar.value(rate), scalar.value(offset)
        scalar.lines.append(
            f"clock[{FIRST_TURN + i}, lane] = {b} + turned({w}, period, count) + "
            f"turned({w}, origin, 1)"
        )
        drifting.append(f"turned({w}, period, 1) != 0.0")
    scalar.lines.append(f"return {' or '.join(drifting) or 'False'}")
    return f"@kernel\ndef turns(p, origin, period, count, lane, clock):\n{indented(scalar.lines)}\n"
