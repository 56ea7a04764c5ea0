"""Tell whether a system is linear between its contacts, and else why not."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from saltus.contact.guards import Law, is_hold
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system.courses import reason_against
from saltus.system.linear import SAME, Drive, LinearSystem, are_affine, drive_name
from saltus.system.linear_friction import gaps_of, levels_of, limit_side, sticking_of
from saltus.system.periodic import rate_of
from saltus.system.quantity import is_remembered, remembered
from saltus.system.system import System


@functools.lru_cache(maxsize=256)
def linear_pieces(system: System) -> LinearSystem | str:
    """The system as one that is linear between its contacts, or the reason why it isn't."""
    size = len(system.states) - len(remembered(system))
    missing = _missing(system, size)
    if missing is not None:
        return missing
    stops = [guard.law for guard in system.guards if guard.law and guard.law.kind == "impact"]
    laws = tuple(
        one
        for law in stops
        for one in (law.constraint, *law.settled[:size], *law.reset[:size])
        if one is not None
    )
    sticking = sticking_of(system)
    gaps = gaps_of(system, sticking)
    drives, courses = dict[Expr, Drive](), dict[Expr, None]()
    for node in _driving(*system.field[:size], *gaps, *laws):
        rate = rate_of(node.args[0]) if node.op in ("sin", "cos") else None
        if rate is not None:
            phase = ex.substituted(node.args[0], {ex.TIME: ex.constant(0.0)})
            if ex.depends_on(phase, ("state",)):
                return "the phase of a sine in it depends on the state"
            drives[node] = Drive(rate, phase, -math.pi / 2 if node.op == "sin" else 0.0)
        elif node.bits or ex.depends_on(node, ("state",)):
            return "a sine in it isn't one of the time alone"
        elif reason := reason_against(node, system.values):
            return reason
        else:
            courses[node] = None
    plain = [i for i, guard in enumerate(system.guards) if not is_hold(guard)]
    moving = courses.keys() & set(_driving(*(gaps[i] for i in plain), *laws))
    if any(node.op != "table" for node in moving):
        return "a boundary of it moves by a drive that may jump"
    names = {node: ex.parameter(drive_name(i)) for i, node in enumerate((*drives, *courses))}
    field, gaps, laws = (
        ex.all_substituted(given, names) for given in (system.field[:size], gaps, laws)
    )
    if any(ex.depends_on(one, ("select",)) for one in (*(gaps[i] for i in plain), *laws)):
        return "a boundary of it moves when another is crossed"
    if not are_affine((*field, *gaps, *laws), [drive_name(i) for i in range(len(names))]):
        return "it isn't linear between its contacts"
    found = tuple(drives.values()), tuple(courses), sticking, levels_of(system) or ()
    linear = LinearSystem(system, *found, field, gaps, names)
    return _misfit(linear, stops) or linear


def _misfit(linear: LinearSystem, stops: Sequence[Law]) -> str | None:
    """The reason why the laws of a system aren't carried, by their numbers; None if they are."""
    if not all(_only_reverses(linear, law) for law in stops):
        return "an impact of it changes more than velocities"
    values = linear.system.values
    rows = linear.gaps(values).matrix[[one.guard for one in linear.sticking]]
    if len(rows) and np.linalg.matrix_rank(rows) < len(rows):
        return "frictions of it that may stick at once depend on one another"
    closing = linear.pieces_of(
        [law.constraint for law in stops if law.constraint is not None], values
    ).matrix
    stopped = np.linalg.matrix_rank(closing) if len(closing) else 0
    if stopped and np.linalg.matrix_rank([*closing, *rows]) < stopped + len(rows):
        return "a friction of it acts along the direction of its rigid stops"
    if stopped and any(
        np.linalg.matrix_rank([*closing, row]) == stopped for row in _inputs(linear, values)
    ):
        return "a memory of it follows the direction of its rigid stops"
    return None


def _inputs(linear: LinearSystem, values: Mapping[str, float]) -> np.ndarray:
    """The rates that the inputs of memories have by the states, float64[limits, N]: those of the
    memories where all of them are within their limits.
    """
    sides = [limit_side(guard) for guard in linear.system.guards]
    within = sum(1 << g for g, side in enumerate(sides) if side < 0)
    gaps = linear.gaps(values).matrix[[g for g, side in enumerate(sides) if side]]
    found: np.ndarray = gaps @ linear.piece(values, within).matrix
    return found


def _driving(*roots: Expr) -> Iterator[Expr]:
    """The drives in some expressions: functions of the time alone, but for sums of them and factors
    without time.
    """
    waiting, seen = list(roots), set[Expr]()
    while waiting:
        node = waiting.pop()
        if node in seen or not ex.depends_on(node, ("time",)):
            continue
        seen.add(node)
        timed = [one for one in node.args if ex.depends_on(one, ("time",))]
        apart = node.op in ("add", "sub", "neg", "mul", "div") and (
            len(timed) == 1 or node.op in ("add", "sub")
        )
        alone = not ex.depends_on(node, ("state",)) and not node.bits
        if node.op in ("sin", "cos") or (alone and not apart):
            yield node
        else:
            waiting += reversed(node.args)


def _only_reverses(linear: LinearSystem, law: Law) -> bool:
    """True if an impact changes the state as a loss of its closing velocity does, times 1 + e."""
    values, size = linear.system.values, len(linear.states)
    given = ex.constant(0.0) if law.restitution is None else law.restitution
    (restitution,) = evaluate([given], values=values)
    changes = []
    for after in (law.reset[:size], law.settled[:size]):
        piece = linear.pieces_of(after, values)
        matrix = piece.matrix - np.eye(size)
        changes.append(np.column_stack([matrix, piece.constant, piece.driven]))
    apart = np.abs(changes[0] - (1 + restitution) * changes[1])
    return bool((apart <= SAME * np.abs(changes).max()).all())


def _missing(system: System, size: int) -> str | None:
    """The reason why a system isn't served, whose first states are moved: by what it carries, or by
    its laws of contact; None if there is none.
    """
    if system.tangent_of is not None:
        return "it carries its own derivatives"
    if any(map(is_remembered, system.states[:size])):
        return "states of it that hold past values aren't the last"
    for law in [guard.law for guard in system.guards if guard.law]:
        if law.kind == "jump":
            return "a contact of it makes its state jump"
        if law.friction is not None:
            return "a rigid stop of it has friction"
        if law.restitution is not None and ex.varies(law.restitution):
            return "a restitution of it isn't a number"
    if levels_of(system) is None:
        return "a friction of it may become negative on the way"
    return None
