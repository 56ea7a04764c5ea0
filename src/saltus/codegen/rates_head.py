"""The generated head of the methods that run one trajectory after the other: the right-hand side in
the user's own order of operations, split by dependence.

Parameter-only parts are worked out once a trajectory (``prepare``), time-only parts once a stage
time (``drive``): the same operations on the same numbers, so not a digit changes, but the cosine of
two stages at one time is computed once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from saltus.codegen.clocks import Clocks
from saltus.codegen.head import Constant, Head
from saltus.codegen.saltation import jump_function, levels_function, levels_of, reset_function
from saltus.codegen.scalar import ScalarCode, indented, parameter_leaf
from saltus.codegen.taylor_head import (
    bits_of,
    count_moved,
    evaluation_order,
    tables,
    tables_of_laws,
)
from saltus.contact.guards import Guard, is_hold
from saltus.errors import ParameterError
from saltus.language import all_assuming
from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.expression import Expr
from saltus.system import System


class _Slots:
    """Values that a later stage reads from an array: each gets an index."""

    def __init__(self, array: str) -> None:
        self.array = array
        self.nodes: dict[Expr, int] = {}

    def code(self, node: Expr) -> str:
        return f"{self.array}[{self.nodes.setdefault(node, len(self.nodes))}]"


def _level(node: Expr) -> int:
    """0: parameters only, 1: time too, 2: state or mode."""
    if ex.depends_on(node, ("state", "select")):
        return 2
    return 1 if ex.depends_on(node, ("time",)) else 0


class _Stages:
    """Leaves of the state-dependent code: everything that doesn't depend on the state is read from
    ``c`` or ``q``.
    """

    def __init__(self, system: System) -> None:
        self.constants, self.drives, self.clocks = _Slots("c"), _Slots("q"), Clocks(system)
        self._system = system

    def state_leaf(self, node: Expr) -> str | None:
        if node.op == "state":
            return f"y[{self._system.states.index(node.payload)}]"
        level = _level(node)
        if level == 2 or node.op == "const":
            return None
        return (
            "t" if node.op == "time" else (self.constants if level == 0 else self.drives).code(node)
        )

    def drive_leaf(self, node: Expr) -> str | None:
        if node.op == "time":
            return "t"
        if (clocked := self.clocks.value(node)) is not None:
            return clocked
        return self.constants.code(node) if _level(node) == 0 and node.op != "const" else None


def _with_sides(
    system: System, stages: _Stages, roots: Iterable[Expr], *, of_mode: bool = False
) -> ScalarCode:
    """Code that first determines the sides that the roots need from the state; with ``of_mode``
    from the bits of the mode, unless that is negative.
    """
    roots = list(roots)
    asked = {g for root in roots for g in _asked_by(root)}
    code = ScalarCode(stages.state_leaf, side=lambda i: f"b{i}", switch=stages.clocks.side)
    waiting = list(asked)
    while waiting:  # gaps need sides too, to any depth
        more = _asked_by(system.guards[waiting.pop()].gap) - asked
        asked |= more
        waiting += more
    for i in evaluation_order(system):
        if i in asked:
            value = code.value(system.guards[i].gap)
            side = f"{value} > 0.0"
            bit = f"(mode < 0 and {side}) or (mode >= 0 and ((mode >> {i}) & 1) == 1)"
            code.lines.append(f"b{i} = {bit if of_mode else side}")
    return code


def _asked_by(root: Expr) -> set[int]:
    """Guards whose sides an expression needs."""
    return {g for node in ex.walk(root) if node.op == "select" for g in bits_of(node.payload)}


def _outputs(code: ScalarCode, roots: Iterable[Expr]) -> str:
    values = code.values(roots)
    code.lines += [f"out[{i}] = {value}" for i, value in enumerate(values)]
    return indented(code.lines)


def _gap_rates(system: System, stages: _Stages) -> str:
    """d gap/dt = gradient . dy/dt + partial derivative by time."""
    gaps = [guard.gap for guard in system.guards]
    rows = [
        [differentiate(gap, ex.state(s)) for s in system.states] + [differentiate(gap, ex.TIME)]
        for gap in gaps
    ]
    code = _with_sides(system, stages, [entry for row in rows for entry in row])
    for i, row in enumerate(rows):
        terms = []
        for j, entry in enumerate(row):
            if entry.op == "const" and entry.payload == 0:
                continue
            value = code.value(entry)
            terms.append(f"{value} * dy[{j}]" if j < len(system.states) else value)
        code.lines.append(f"out[{i}] = {' + '.join(terms) or '0.0'}")
    return indented(code.lines)


def never_held(system: System) -> System:
    """The system without reduced equations: no contact is held, no hold guard is crossed.

    Raises
    ------
    ParameterError
        If a contact is held by more than its force while it moves: the right-hand side alone
        doesn't say so.
    """
    for guard in system.guards:
        limit = guard.law.limit if guard.law else None
        if limit is not None and not (limit.op == "const" and limit.payload == 1.0):
            raise ParameterError(
                f"{system.name} has static friction above kinetic friction at {guard.name!r}, "
                f"which only sl.Taylor() follows. Leave method= out."
            )
    guards, holds = list(system.guards), [n for n, one in enumerate(system.guards) if is_hold(one)]
    if not holds:
        return system
    for number in holds:
        guards[number] = Guard(guards[number].name, ex.constant(-1.0))
    field = all_assuming(system.field, holds, False)
    return replace(system, field=field, guards=tuple(guards))


def rates_head(system: System, numbers: Mapping[str, Constant], jacobian: bool = False) -> Head:
    """The head that kernels/stepping/trajectory.py and the templates of a method expect;
    ``numbers`` are those of the method (codegen/tableaux.py).
    """
    system = never_held(system)
    laws = tables_of_laws(system)
    stages = _Stages(system)
    gaps = [guard.gap for guard in system.guards]
    field = _outputs(_with_sides(system, stages, system.field, of_mode=True), system.field)
    gap_values = _outputs(_with_sides(system, stages, gaps), gaps)
    gap_rates = _gap_rates(system, stages)
    slopes = [entry for row in system.jacobian for entry in row] if jacobian else []
    matrix = _outputs(_with_sides(system, stages, slopes), slopes)
    drive = ScalarCode(stages.drive_leaf)
    for node, i in stages.drives.nodes.items():
        value = drive.value(node)
        drive.lines.append(f"q[{i}] = {value}")
    prepare = ScalarCode(parameter_leaf(system))
    for node, i in stages.constants.nodes.items():
        value = prepare.value(node)
        prepare.lines.append(f"c[{i}] = {value}")
    sizes: dict[str, Constant] = dict(
        NSTATES=len(system.states),
        NMOVED=count_moved(system),
        NGUARDS=len(gaps),
        NCONST=len(stages.constants.nodes),
        NDRIVE=len(stages.drives.nodes),
        TANGENT=system.tangent_of is not None,
        GAPS_IN_TIME=any(ex.depends_on(gap, ("time",)) for gap in gaps),
        LAWS=any(guard.law and guard.law.reset for guard in system.guards),
        LEVELS=bool(levels_of(system)),
        **tables(LAW=laws["LAW"], LAW_SIDE=laws["LAW_SIDE"]),
        **stages.clocks.constants(),
        **numbers,
    )
    functions = [
        f"@kernel\ndef prepare(p, c):\n{indented(prepare.lines)}\n",
        stages.clocks.function(),
        f"@kernel\ndef drive(t, c, h, q):\n{indented(drive.lines)}\n",
        f"@kernel\ndef field(t, y, c, q, h, mode, out):\n{field}\n",
        f"@kernel\ndef gaps(t, y, c, q, h, out):\n{gap_values}\n",
        jump_function(system, stages.clocks),
        reset_function(system, stages.clocks),
        levels_function(system, stages.clocks),
        f"@kernel\ndef gap_rates(t, y, dy, c, q, h, out):\n{gap_rates}\n",
    ]
    if jacobian:
        functions.append(f"@kernel\ndef jacobian(t, y, c, q, h, out):\n{matrix}\n")
    return Head(sizes, "\n".join(functions))
