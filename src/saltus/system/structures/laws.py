"""Laws of a contact of a structure: its force, its friction, its impact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from saltus.contact.declared import Impact, impact, outside
from saltus.contact.dry_friction import friction
from saltus.contact.forces import freeplay, hertz
from saltus.errors import ParameterError, must_be
from saltus.language.expression import Expr, Relation, as_expr
from saltus.language.functions import piecewise
from saltus.system.structures.parts import Contact
from saltus.units import to_si


@dataclass(frozen=True)
class Moving:
    """Motion at a contact.

    Attributes
    ----------
    deflection, rate : Expr
        Of its degree of freedom.
    slip : Expr or None
        Rate of the degree of freedom along which it slides.
    """

    deflection: Expr
    rate: Expr
    slip: Expr | None = None


def entries(label: str, contact: Contact, units: tuple[str, ...]) -> list[tuple[str, Any, str]]:
    """Name, value and unit of each parameter of a contact; ``units`` are those of a deflection, a
    force, a stiffness and a damper.

    Raises
    ------
    ParameterError
        If the gap of both sides, a stiffness or a damping is negative, or a restitution is outside
        [0, 1].
    """
    length, force, spring, damper = units
    if contact.side == "both" and to_si(contact.gap, length, f"{label}_gap") < 0:
        raise ParameterError(
            f"{label}: both sides can't touch at once with one gap. Give two contacts, one of "
            f"side='upper' and one of side='lower'."
        )
    if contact.power is not None and contact.power != 1 and length:
        spring = f"{force}/{length}^{contact.power:g}"
    rebounds = contact.restitution if contact.friction is None else None
    for key, value, unit in (("stiffness", contact.stiffness, spring),
                             ("damping", contact.damping, damper)):  # fmt: skip
        if value is not None and to_si(value, unit, f"{label}_{key}") < 0:
            raise must_be(f"{label}: {key}", "0 or more", value)
    if rebounds is not None:
        bounce = to_si(rebounds, "1", f"{label}_restitution")
        if not 0 <= bounce <= 1:
            raise ParameterError(f"{label}: {outside(bounce)}")
    return [
        (f"{label}_gap", contact.gap, length),
        (f"{label}_stiffness", contact.stiffness, spring),
        (f"{label}_damping", contact.damping, damper),
        (f"{label}_restitution", rebounds, "1"),
        (f"{label}_preload", contact.preload, force),
        (f"{label}_friction", contact.friction, "1"),
    ]


def sides(contact: Contact) -> tuple[str, ...]:
    """The sides on which there is contact."""
    return ("upper", "lower") if contact.side == "both" else (contact.side,)


def boundaries(
    label: str, contact: Contact, at: Moving, values: Mapping[str, Any]
) -> dict[str, Relation]:
    """The boundaries of a contact by their names, each with the comparison that holds in contact,
    or while it slides forwards.
    """
    gap, found = values[f"{label}_gap"], {}
    for side in sides(contact):
        name = f"{label} {side}" if contact.side == "both" else label
        found[name] = at.deflection > gap if side == "upper" else at.deflection < -gap
    if at.slip is not None:
        found[f"{label} slides"] = at.slip > 0
    return found


def forces(label: str, contact: Contact, at: Moving, values: Mapping[str, Any]) -> tuple[Any, Any]:
    """The force of a contact against the deflection, without its preload; and the friction against
    the slip, None without friction.
    """
    if contact.restitution is not None:
        return None, None
    if contact.friction is None:
        return _pressed(label, contact, sides(contact), at, values), None
    pushed = [_pressed(label, contact, (side,), at, values) for side in sides(contact)]
    normal = [
        one if side == "upper" else -one for one, side in zip(pushed, sides(contact), strict=True)
    ]
    rubbed = friction(at.slip, slip=values[f"{label}_friction"] * sum(normal[1:], normal[0]))  # type: ignore[arg-type]
    return sum(pushed[1:], pushed[0]), rubbed


def _pressed(
    label: str, contact: Contact, touching: tuple[str, ...], at: Moving, values: Mapping[str, Any]
) -> Any:
    """The force of the spring and the damper on some sides, against the deflection."""
    gap, stiffness = values[f"{label}_gap"], values[f"{label}_stiffness"]
    damping = values[f"{label}_damping"] if contact.damping is not None else None
    rubs = contact.friction is not None
    if contact.power in (None, 1):
        return as_expr(
            freeplay(
                at.deflection,
                stiffness=stiffness,
                damping=0.0 if damping is None else damping,
                velocity=None if damping is None else at.rate,
                no_tension=rubs,
                **{f"{side}_gap": gap for side in touching},
            )
        )
    total: Any = 0.0
    for side in touching:
        depth = at.deflection - gap if side == "upper" else -at.deflection - gap
        closing = at.rate if side == "upper" else -at.rate
        force = hertz(depth, stiffness=stiffness, exponent=contact.power)
        if damping is not None:
            whole = stiffness * depth**contact.power + damping * closing
            touches = (depth > 0) & (whole > 0) if rubs else depth > 0
            force = piecewise((whole, touches), otherwise=0.0)
        total = total + force if side == "upper" else total - force
    return total


def impacts(
    label: str, contact: Contact, at: Moving, values: Mapping[str, Any], inertia: dict[str, float]
) -> list[Impact]:
    """The laws of a rigid stop, one each side; ``inertia`` is that of each rate that it may
    change.
    """
    gap, rubs = values[f"{label}_gap"], contact.friction is not None
    rebound = 0.0 if rubs else values[f"{label}_restitution"]
    rubbing = {"friction": values[f"{label}_friction"], "slip_velocity": at.slip} if rubs else {}
    found = []
    for side in sides(contact):
        upper = side == "upper"
        allowed = at.deflection < gap if upper else at.deflection > -gap
        closing = at.rate if upper else -at.rate
        found.append(impact(allowed, closing, restitution=rebound, inertia=inertia, **rubbing))
    return found
