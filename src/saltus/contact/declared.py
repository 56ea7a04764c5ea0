"""Laws that an equation returns after its rates: impacts and jumps of the state.

They are plain values: a law that isn't returned does nothing, and the trace says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import Any, ClassVar, TypeVar

from saltus.arguments import written
from saltus.errors import TraceError, shown
from saltus.language.dimensions import DimensionCheck
from saltus.language.expression import (
    Condition,
    Expr,
    Operand,
    Relation,
    as_expr,
    select,
    state,
    walk,
)

#: Names of the parts of an impact with friction: its coefficient, the sliding velocity, and the
#: sign of that velocity.
FRICTION, SLIP, FACING = "friction", "slip_velocity", "the sign of slip_velocity"

Made = TypeVar("Made")

_MADE: ContextVar[list[Declared] | None] = ContextVar("made", default=None)


class Declared:
    """A law of a contact as it was written: its comparison, and expressions by name."""

    name: ClassVar[str] = ""

    def __init__(self, condition: Relation, parts: Mapping[str, Expr]) -> None:
        self.condition, self.parts = condition, dict(parts)
        made = _MADE.get()
        if made is not None:
            made.append(self)

    def roots(self) -> list[Expr]:
        """The comparison as a piece, then the parts."""
        return [select(self.condition, 1.0, 0.0), *self.parts.values()]

    def misused(self, *_: Any) -> Any:
        """Refuse arithmetic. Raises TraceError."""
        raise TraceError(
            f"{self.name}(...) is a law of the contact, not a force: it stands in no sum. Return "
            f"it after the rates: return v, force/mass, {self.name}(...)."
        )

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = misused
    __truediv__ = __rtruediv__ = __pow__ = __rpow__ = __neg__ = __pos__ = __abs__ = misused
    __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __float__ = __iter__ = __getitem__ = misused
    __array_ufunc__ = None

    def __repr__(self) -> str:
        gap = self.condition.gap
        left, right = gap.args if gap.op == "sub" else (gap, 0)
        return f"{self.name}({left!r} > {right!r})"


class Impact(Declared):
    """The result of :func:`impact`."""

    name = "sl.impact"

    def __init__(
        self,
        allowed: Relation,
        velocity: Expr,
        restitution: Expr,
        inertia: Mapping[str, Expr],
        rubbing: Mapping[str, Expr],
    ) -> None:
        weights = {weight(name): value for name, value in inertia.items()}
        super().__init__(
            allowed, {"velocity": velocity, "restitution": restitution, **weights, **rubbing}
        )
        self.moved = tuple(name for name in _states_in(velocity) if name in inertia)
        slipping = [rubbing[SLIP]] if rubbing else []
        self.rubbed = tuple(name for name in _states_in(*slipping) if name in inertia)

    @property
    def rubs(self) -> bool:
        """True if friction acts in the contact while it rests."""
        return SLIP in self.parts


class Jump(Declared):
    """The result of :func:`jump`."""

    name = "sl.jump"


def check_law(law: Declared, dimensions: DimensionCheck) -> None:
    """Raise a UnitError where known units don't fit: the velocity of an impact has the unit of its
    gap per second, its restitution none, and each new value of a jump the unit of its state.
    """
    for name, part in law.parts.items():
        what = f"{law!r}: {name}"
        if isinstance(law, Jump):
            dimensions.check_alike(part, state(name), what)
        elif name in ("restitution", FRICTION):
            dimensions.check_plain(part, what)
        elif name == "velocity":
            dimensions.check_rate_of(part, law.condition.gap, what)


@contextmanager
def gathered(made: ContextVar[list[Made] | None]) -> Iterator[list[Made]]:
    """Collect the items that are added to the list of a context variable inside."""
    found: list[Made] = []
    token = made.set(found)
    try:
        yield found
    finally:
        made.reset(token)


def declarations() -> AbstractContextManager[list[Declared]]:
    """Collect the laws that are made inside."""
    return gathered(_MADE)


@written("impact(x < gap, v, restitution=0.8), after the rates")
def impact(
    allowed: Condition,
    velocity: Operand,
    *,
    restitution: Operand,
    inertia: Sequence[Operand] | Mapping[str, Operand] | None = None,
    friction: Operand | None = None,
    slip_velocity: Operand | None = None,
) -> Impact:
    """A rigid stop: the state never leaves the allowed side, and at the stop its velocity jumps by
    Newton's law, ``velocity`` to ``-restitution*velocity``.

    An equation returns it after its rates. Rest and release come with it: where the rebounds
    become smaller and smaller the contact comes to rest, and it is left when the stop would have
    to pull. With ``friction`` a stop without rebound is rough: while the contact rests it slides
    or sticks by Coulomb's law, under the force with which it is pressed. The blow of an impact
    itself has no friction.

    Parameters
    ----------
    allowed : comparison
        What always holds: ``x < gap``, ``x1 < x2``, ``x < height(t)``.
    velocity : Expr
        Velocity at which the contact closes [unit of the gap per second]: minus the rate of what is
        positive on the allowed side. Of ``x < gap`` it is ``v``, of ``x > 0`` it is ``-v``, of ``x1
        < x2`` it is ``v1 - v2``, of a moving stop it is relative to it. It is linear in velocities.
    restitution : Expr or float
        Coefficient of restitution [1], between 0 (no rebound) and 1 (no loss). It may depend on
        the state.
    inertia : sequence or mapping of str to Expr or float, optional
        Masses or moments of inertia [kg, kg*m**2] of the states whose velocities are in
        ``velocity`` (and then of those that stand in ``slip_velocity`` alone), in the order in
        which they stand there, or by the state's name. Needed where there are several; then
        momentum is kept.
    friction : Expr or float, optional
        Coefficient of friction [1], at least 0: the friction is at most this times the force with
        which the contact is pressed, and that much while it slides. It needs ``restitution=0``. A
        motion on which it becomes negative ends with status ``invalid_friction``.
    slip_velocity : Expr, optional
        Velocity at which the contact slides [as ``velocity``], linear in velocities. It comes with
        ``friction``.

    Returns
    -------
    Impact
        To be returned after the rates.

    Raises
    ------
    TraceError
        If ``allowed`` isn't one comparison, a restitution is outside [0, 1], friction is negative,
        comes without its velocity or with a rebound, or the inertias don't fit the velocities.

    Notes
    -----
    Newton's law of impact; Brogliato, Nonsmooth Mechanics (2016), section 4.1. Where friction takes
    away more of the closing acceleration than the force that causes it adds (Painleve's paradox)
    there is no motion, or there are several: status ``painleve``. Genot & Brogliato, New results on
    Painleve paradoxes, Eur. J. Mech. A/Solids 18 (1999) 653-677.

    Examples
    --------
    A ball that falls from 10 m comes to rest after 3 times the time of its first impact.

    >>> import saltus as sl
    >>> @sl.system(states="x v")
    ... def ball(t, x, v, *, gravity=9.81, restitution=0.5):
    ...     return v, -gravity, sl.impact(x > 0, -v, restitution=restitution)
    >>> fall = sl.simulate(ball, (10.0, 0.0), t_end=5.0)
    >>> round(float(fall["contact_time"][-1] / fall["contact_time"][0]), 12), float(fall["end_v"])
    (3.0, 0.0)

    A block thrown along a rough floor at 1 m/s comes to a stop after v/(friction*gravity).

    >>> @sl.system(states="x y u v")
    ... def block(t, x, y, u, v, *, gravity=10.0, friction=0.5):
    ...     floor = sl.impact(y > 0, -v, restitution=0, friction=friction, slip_velocity=u,
    ...                       inertia={"u": 1.0, "v": 1.0})
    ...     return u, v, 0.0, -gravity, floor
    >>> run = sl.simulate(block, (0.0, 0.0, 1.0, 0.0), t_end=1.0)
    >>> round(float(run["contact_time"][-1]), 12), round(float(run["end_x"]), 12)
    (0.2, 0.1)
    """
    condition, closing = _one_comparison("impact", allowed), as_expr(velocity)
    bounce = as_expr(restitution)
    if bounce.op == "const" and not 0 <= bounce.payload <= 1:
        raise TraceError(outside(bounce.payload))
    rubbing = _rubbing(friction, slip_velocity)
    if rubbing and not (bounce.op == "const" and bounce.payload == 0):
        raise TraceError(
            "sl.impact: friction= is for a stop without rebound, restitution=0: how a blow rubs "
            "doesn't follow from a coefficient of friction. Leave friction= and slip_velocity= "
            "out, or set restitution=0."
        )
    return Impact(condition, closing, bounce, _inertias(closing, rubbing, inertia), rubbing)


def weight(name: str) -> str:
    """Name of an impact's part that holds the inertia of a state."""
    return f"inertia of {name}"


def _rubbing(friction: Operand | None, slip_velocity: Operand | None) -> dict[str, Expr]:
    """The parts of an impact with friction; empty without friction."""
    if friction is None and slip_velocity is None:
        return {}
    if friction is None or slip_velocity is None:
        raise TraceError(
            "sl.impact: friction= and slip_velocity= come together: the coefficient, and the "
            "velocity at which the contact slides."
        )
    coefficient, slip = as_expr(friction), as_expr(slip_velocity)
    if coefficient.op == "const" and not coefficient.payload >= 0:
        raise TraceError(pushes_on(coefficient.payload))
    if not _states_in(slip):
        raise TraceError(
            f"sl.impact: slip_velocity= is the velocity at which the contact slides, which holds "
            f"a state, not {shown(slip_velocity)}."
        )
    facing = select(slip > 0, 1.0, -1.0)
    return {FRICTION: coefficient, SLIP: slip, FACING: facing}


def pushes_on(friction: float) -> str:
    """The message about a negative coefficient of friction."""
    return f"the coefficient of friction {friction:g} is negative: friction never pushes on."


def _states_in(*expressions: Expr) -> list[str]:
    """Names of the states in expressions, in the order of their first appearance."""
    nodes = (node for one in expressions for node in walk(one, conditions=False))
    return list(dict.fromkeys(node.payload for node in nodes if node.op == "state"))


def outside(restitution: float) -> str:
    """The message about a coefficient of restitution outside [0, 1]."""
    return (
        f"the restitution {restitution:g} is outside [0, 1]: 0 is an impact without a rebound, 1 "
        f"one without a loss."
    )


def _inertias(velocity: Expr, rubbing: Mapping[str, Expr], inertia: Any) -> dict[str, Expr]:
    """Inertia of each state that an impact, or its friction, changes; by name."""
    states = _states_in(velocity)
    if not states:
        raise TraceError(
            f"sl.impact needs the velocity at which the contact closes, such as v of x < gap, not "
            f"{shown(velocity)}."
        )
    states = _states_in(velocity, *([rubbing[SLIP]] if rubbing else []))
    held = (
        f"the velocities {velocity!r} and {rubbing[SLIP]!r} hold"
        if rubbing
        else f"the velocity {velocity!r} holds"
    )
    if inertia is None and len(states) > 1:
        raise TraceError(
            f"sl.impact: {held} the states {', '.join(states)}, and how "
            f"they share the impulse depends on their inertia. Add inertia=("
            f"{', '.join(f'mass of {name}' for name in states)}), or by name "
            f"inertia={{{states[0]!r}: ...}} for those that jump."
        )
    if inertia is None:
        return {states[0]: as_expr(1.0)}
    if not isinstance(inertia, Mapping):
        given = (
            list(inertia)
            if isinstance(inertia, Sequence) and not isinstance(inertia, str)
            else [inertia]
        )
        if len(given) != len(states):
            raise TraceError(
                f"sl.impact got {len(given)} inertias, but {held} "
                f"{len(states)} states: {', '.join(states)}. Give one for each, or by name "
                f"inertia={{{states[0]!r}: ...}} for those that jump."
            )
        inertia = dict(zip(states, given, strict=True))
    for name, value in inertia.items():
        if name not in states:
            raise TraceError(
                f"sl.impact: inertia= names {shown(name)}, but {held} {', '.join(states)}."
            )
        if as_expr(value).op == "const" and not as_expr(value).payload > 0:
            raise TraceError(f"sl.impact: the inertia of {name} must be positive.")
    for moving, what in ((velocity, "could jump"), (rubbing.get(SLIP), "friction could act on")):
        if moving is not None and not any(name in inertia for name in _states_in(moving)):
            names = ", ".join(map(shown, inertia)) or "{}"
            raise TraceError(f"sl.impact: inertia={names} names no state that {what}.")
    return {name: as_expr(value) for name, value in inertia.items()}


def jump(condition: Condition, /, **states: Operand) -> Jump:
    """A jump of the state: where the comparison becomes true, the named states get new values.

    An equation returns it after its rates. Nothing happens where the comparison becomes false.

    Parameters
    ----------
    condition : comparison
        ``x > gap``: the jump happens when it becomes true.
    **states : Expr or float
        New value of each state that jumps, a function of the time, the states before the jump and
        parameters: ``v=-0.8*v, count=count + 1``.

    Returns
    -------
    Jump
        To be returned after the rates.

    Raises
    ------
    TraceError
        If the condition isn't one comparison, or no state is named.

    Examples
    --------
    >>> import saltus as sl
    >>> @sl.system(states="x v")
    ... def kicked(t, x, v, *, level=1.0, kick=0.5):
    ...     return v, -x, sl.jump(x > level, v=v + kick)
    >>> run = sl.simulate(kicked, (0.0, 2.0), t_end=1.0)
    >>> round(float(run["end_x"] ** 2 + run["end_v"] ** 2), 12), round((3**0.5 + 0.5) ** 2 + 1, 12)
    (5.982050807569, 5.982050807569)
    """
    if not states:
        raise TraceError(
            "sl.jump needs the states that jump, with their new values: sl.jump(x > gap, v=-0.8*v)."
        )
    return Jump(
        _one_comparison("jump", condition), {name: as_expr(new) for name, new in states.items()}
    )


def _one_comparison(name: str, condition: Any) -> Relation:
    if isinstance(condition, Relation):
        return condition
    given = (
        "several joined by & or |"
        if isinstance(condition, Condition)
        else "a plain truth value"
        if isinstance(condition, bool)
        else shown(condition)
    )
    raise TraceError(f"sl.{name} takes one comparison of traced values, x < gap, not {given}.")
