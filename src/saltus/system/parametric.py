"""The parametric system: a system whose parameters are states that don't change, so that its
tangent flow holds the derivatives with respect to them.

Where the period varies too - the forcing frequency is followed, or the system has no forcing - the
time is counted in periods: the rates are multiplied by the period T, which is a state, and
``frequency*t`` is the time itself. The map over one period then has no end that moves, and its
derivative with respect to T no term of its own. Seydel, Practical Bifurcation and Stability
Analysis (2010), section 7.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

from saltus.contact.guards import Guard, Law
from saltus.errors import ParameterError
from saltus.language import expression as ex
from saltus.language.derivatives import gradient
from saltus.language.expression import And, Condition, Expr, Not, Or, Relation
from saltus.system.system import System

#: Name of the state that holds the period [s].
PERIOD = "period"


@dataclass(frozen=True, eq=False)
class Parametric:
    """A system with some of its parameters as states.

    Attributes
    ----------
    system : System
        States, then the period if it varies, then the other parameters that are followed, in the
        order in which they were named.
    timed : bool
        Whether the time is counted in periods [1] and the first new state is the period [s].
    names : tuple of str
        The parameters that were asked for. The forcing frequency is one over the period.
    """

    system: System
    timed: bool
    names: tuple[str, ...]


@functools.lru_cache(maxsize=256)
def parametric(system: System, names: tuple[str, ...], unforced_timed: bool = True) -> Parametric:
    """The system with these parameters as states: the same one each time. The time is counted in
    periods where the forcing frequency is one of them and, unless ``unforced_timed`` is False, in a
    system without forcing.

    Raises
    ------
    ParameterError
        If the instants of a switch, a remainder or a table of time would depend on a parameter.
    """
    if system.origin is not system:
        known = parametric(system.origin, names, unforced_timed)
        kept = {name: system.values[name] for name in known.system.values}
        return replace(known, system=known.system.with_values(**kept))
    timed = unforced_timed if system.forced_at is None else system.forced_at in names
    new = tuple(name for name in names if name != system.forced_at)
    rewriting = _Rewriting(system, new, timed)
    states = (*system.states, *((_free(PERIOD, system),) if timed else ()), *new)
    rates = tuple(rewriting.rate(entry) for entry in system.field)
    zero = (ex.constant(0.0),) * (len(states) - len(rates))
    guards = tuple(rewriting.guard(guard, states) for guard in system.guards)
    values = {name: value for name, value in system.values.items() if name not in names}
    if timed and system.forced_at is not None:
        values.pop(system.forced_at, None)
    units = {**dict.fromkeys(states, ""), **system.units}
    made = System(
        name=f"{system.name} over {', '.join(names) or PERIOD}",
        states=states,
        field=(*rates, *zero),
        guards=guards,
        values=values,
        units={name: units[name] for name in (*states, *values)},
        forced_at=None if timed else system.forced_at,
    )
    return Parametric(made, timed, names)


def _free(name: str, system: System) -> str:
    """A name that no state or parameter has."""
    while name in system.states or name in system.values:
        name += "_"
    return name


class _Rewriting:
    """Rewrites expressions with states in place of parameters, and with the time in periods."""

    def __init__(self, system: System, names: tuple[str, ...], timed: bool) -> None:
        self._system, self._timed = system, timed
        self._period = ex.state(_free(PERIOD, system))
        self._memo: dict[Expr, Expr] = {}
        turns = 2 * math.pi if system.units.get(system.forced_at or "") == "rad/s" else 1.0
        self._leaves: dict[Expr, Expr] = {ex.parameter(name): ex.state(name) for name in names}
        if timed:
            self._leaves[ex.TIME] = ex.mul(ex.TIME, self._period)
            if system.forced_at is not None:
                self._frequency, self._turns = ex.parameter(system.forced_at), turns
                self._leaves[self._frequency] = ex.div(turns, self._period)

    def rate(self, entry: Expr) -> Expr:
        """A rate; per period if the time is counted in periods."""
        new = self.expression(entry)
        return ex.mul(new, self._period) if self._timed else new

    def guard(self, guard: Guard, states: tuple[str, ...]) -> Guard:
        """A boundary and its law."""
        law = None if guard.law is None else self._law(guard.law, states)
        return Guard(guard.name, self.expression(guard.gap), law=law)

    def _law(self, law: Law, states: tuple[str, ...]) -> Law:
        more = tuple(ex.state(name) for name in states[len(self._system.states) :])
        none = (ex.constant(0.0),) * len(more)
        each = self.expression
        constraint = None if law.constraint is None else each(law.constraint)
        return replace(
            law,
            reset=law.reset and (*map(each, law.reset), *more),
            settled=law.settled and (*map(each, law.settled), *more),
            constraint=constraint,
            normal=() if constraint is None else gradient(constraint, states),
            direction=law.direction and (*map(self.rate, law.direction), *none),
            drive=None if law.drive is None else self.rate(law.drive),
            pivot=None if law.pivot is None else self.rate(law.pivot),
            limit=None if law.limit is None else each(law.limit),
            restitution=None if law.restitution is None else each(law.restitution),
            friction=None if law.friction is None else each(law.friction),
            levels=tuple(each(level) for level in law.levels if ex.varies(level)),
            remaining=None if law.remaining is None else self.rate(law.remaining),
        )

    def expression(self, root: Expr) -> Expr:
        """The expression in the new states."""
        memo = self._memo
        for node in ex.walk(root):
            if node in memo:
                continue
            cycles = self._cycles(node) if self._timed else None
            if node in self._leaves:
                memo[node] = self._leaves[node]
            elif cycles is not None:
                memo[node] = cycles
            else:
                payload = node.payload
                if node.op == "select":
                    payload = self._condition(payload)
                memo[node] = ex.rebuild(node, tuple(memo[child] for child in node.args), payload)
                if node.op in ("mod", "table"):
                    self._check_clock(memo[node])
        return memo[root]

    def _cycles(self, node: Expr) -> Expr | None:
        """A product of the frequency, the time and anything else, in which the period cancels."""
        if node.op != "mul" or self._system.forced_at is None:
            return None
        factors = _factors(node)
        cancel = (ex.TIME, self._frequency)
        if any(sum(one is leaf for one in factors) != 1 for leaf in cancel):
            return None
        product = ex.constant(self._turns)
        for one in factors:
            if one is not ex.TIME and one is not self._frequency:
                product = ex.mul(product, self.expression(one))
        return ex.mul(product, ex.TIME)

    def _condition(self, condition: Condition) -> Condition:
        match condition:
            case Relation(gap):
                new = self.expression(gap)
                self._check_clock(new)
                return Relation(new)
            case Not(inner):
                return Not(self._condition(inner))
            case And(left, right) | Or(left, right):
                return type(condition)(self._condition(left), self._condition(right))
        return condition

    def _check_clock(self, node: Expr) -> None:
        """Raise a ParameterError if the instants of a clock depend on a followed parameter."""
        if ex.depends_on(node, ("state",)):
            raise ParameterError(
                f"{self._system.name} switches at times that depend on a parameter that is "
                "followed. Write them in phases of the forcing, such as ",
                lambda say: f"{say.sl}mod(frequency*t, 1).",
            )


def _factors(node: Expr) -> list[Expr]:
    """The factors of a product, however it is bracketed."""
    if node.op != "mul":
        return [node]
    return _factors(node.args[0]) + _factors(node.args[1])
