"""Quantities that are added to a system: a surface to cross, a power to integrate.

The flow needs nothing new for it: a surface is one more guard, an integral one more state, and both
come with the flow's own precision.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from saltus.contact.boundaries import kinds_of, number_of, surface_guard
from saltus.contact.guards import Guard, Law, bits_in, expressions_of, is_hold
from saltus.errors import ParameterError, among, shown, unknown
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.expression import (
    Bit,
    Expr,
    Relation,
    add,
    constant,
    depends_on,
    div,
    mul,
    neg,
    parameter,
    select,
    state,
    sub,
    substituted,
)
from saltus.language.known_sides import assuming
from saltus.language.names import why_no_name
from saltus.language.sums import total
from saltus.system.checks import MOST_GUARDS
from saltus.system.read_off import Quantity, quantity
from saltus.system.system import System
from saltus.units import check_declared, to_si

#: Most contacts that switch an output whose turning points are looked for.
MOST_SIDES = 3
#: Suffix of a remembered state's name, which no user can write.
_REMEMBERED = " before a jump"


# -- surfaces --------------------------------------------------------------------------------------
def with_surface(system: System, surface: Quantity | str, name: str = "surface") -> System:
    """The system with one more guard, on which no equation depends: the flow locates its crossings
    as it locates contacts.

    Parameters
    ----------
    system : System
        The equations and values.
    surface : callable or str
        The motion is on the surface where this function of (t, states, parameters) is zero (see
        :func:`quantity`); or the name of a state or an output, for the surface on which it is zero.
    name : str
        Name of the guard; it gets primes if the system has one of that name.

    Returns
    -------
    System
        The new guard is the last: ``len(guards) - 1``. Its gap is the function as it stands, so
        direction +1 is where the function rises. Guards that the function needs for its own
        conditions stand before it.

    Raises
    ------
    TraceError
        If the function can't be traced, depends on no state, or doesn't repeat with the forcing.
    ParameterError
        If there is no such state.
    """
    if isinstance(surface, str):
        return _with_guard(system, *formula_of(system, surface), name)
    gap, guards = quantity(system, surface, "the surface")
    return _with_guard(system, gap, guards, name)


def with_level(system: System, name: str, level: float | str) -> System:
    """The system with a surface at a level of a state or an output. The level is a new parameter,
    so another one recompiles nothing.

    Parameters
    ----------
    system : System
        The equations and values.
    name : str
        A state or an output.
    level : float or str
        Its value on the surface: a number in SI, or text with a unit. It becomes the parameter
        ``surface_level``.

    Returns
    -------
    System
        The last guard is the surface: ``gap = state - surface_level``.

    Raises
    ------
    ParameterError, UnitError
        If there is no such state, or the level isn't a finite number in its unit.
    """
    formula, guards = formula_of(system, name)
    unit, key = unit_of(system, name), _free("surface_level", system)
    value = to_si(level, unit, f"the level of {name}")
    extended = replace(
        system, values={**system.values, key: value}, units={**system.units, key: unit}
    )
    return _with_guard(extended, sub(formula, parameter(key)), guards, key)


def turning_surfaces(
    system: System, name: str
) -> tuple[System, dict[int, tuple[tuple[int, int], ...]]]:
    """The system with the surfaces on which a state or an output turns: its rate is zero, from + to
    - (direction -1) at a maximum.

    One that contacts switch, such as the force of a stop, has a surface for each of their sides:
    its rate jumps where they do, and is zero all the time while the stop is open.

    Parameters
    ----------
    system : System
        The equations and values.
    name : str
        A state or an output.

    Returns
    -------
    System
        The surfaces are its last guards; their gaps are the rates.
    dict of int to tuple of (int, int)
        By the number of each surface the contact states to which it belongs, as (mask, bits): those
        whose mode has these bits within the mask.

    Raises
    ------
    ParameterError
        If there is no such state or output.
    TraceError
        If the rate depends on no state, so that it turns at given times.
    """
    formula, guards = formula_of(system, name)
    bits, title = sorted(bits_in([formula])), f"{name} turns"
    rates = _rates_by_sides(system, formula, bits) if len(bits) <= MOST_SIDES else {}
    moving = [rate for rate in rates if "state" in kinds_of(rate)]
    if not moving or any(depends_on(rate, ("time",)) for rate in rates.keys() - set(moving)):
        found = _with_guard(system, rate_of(system, formula), guards, title)
        return found, {len(guards): ((0, 0),)}
    found, of = replace(system, guards=guards), {}
    mask = sum(1 << bit for bit in bits)
    for rate in moving:
        of[len(found.guards)] = tuple(
            (mask, sum(1 << bit for bit, up in zip(bits, sides, strict=True) if up))
            for sides in rates[rate]
        )
        found = _with_guard(found, rate, found.guards, title)
    return found, of


def _rates_by_sides(
    system: System, formula: Expr, bits: Sequence[int]
) -> dict[Expr, list[tuple[bool, ...]]]:
    """The rates that a formula has on the sides of some guards, each with the sides on which it is
    that.
    """
    rates: dict[Expr, list[tuple[bool, ...]]] = {}
    for sides in itertools.product((False, True), repeat=len(bits)):
        rate = rate_of(system, _on_sides(formula, bits, sides))
        rates.setdefault(_on_sides(rate, bits, sides), []).append(sides)
    return rates


def with_turning_surfaces(
    system: System, names: Iterable[str], admits: Callable[[System], bool]
) -> tuple[System, dict[int, str], list[str]]:
    """The system with surfaces on which states and outputs turn, as many as it has room for.

    One that contacts switch, such as the force of a stop, has a surface for each of their sides: it
    jumps where they do, and a surface that jumps would have no side between.

    Parameters
    ----------
    system : System
        The equations and values.
    names : iterable of str
        States and outputs.
    admits : callable
        True for a system that is wanted; a surface that makes another one is left out.

    Returns
    -------
    System
    dict of int to str
        The state or output of each new guard by its number. The gap of a guard is the rate.
    list of str
        The names that turn on these surfaces and at contacts only, or never. The others turn at
        times of their own, on surfaces that were left out, or are switched by more than
        :data:`MOST_SIDES` contacts or by boundaries of their own.
    """
    found, of, complete = system, {}, []
    holds = {number for number, guard in enumerate(system.guards) if is_hold(guard)}
    for name in names:
        formula, guards = formula_of(system, name)
        bits = sorted(bits_in([formula]))
        if len(guards) > len(system.guards) or len(bits) > MOST_SIDES:
            continue
        left_out = False
        more_bits = sorted({*bits, *(bits_in([rate_of(system, formula)]) & holds)})
        if len(more_bits) <= MOST_SIDES:  # a rate of what is held would be ridden
            bits = more_bits
        for gap in _rates_by_sides(system, formula, bits):
            if "state" not in kinds_of(gap):
                left_out |= depends_on(gap, ("time",))
                continue
            if not bits_in([gap]) and number_of(Relation(gap), system.guards) is not None:
                continue  # it turns at contacts: a second guard there would be ridden as they hold
            more = _with_guard(found, gap, found.guards, f"{name} turns")
            if len(found.guards) >= MOST_GUARDS or not admits(more):
                left_out = True
                continue
            of[len(found.guards)] = name
            found = more
        if not left_out:
            complete.append(name)
    return found, of, complete


def _on_sides(formula: Expr, bits: Iterable[int], sides: Iterable[bool]) -> Expr:
    for bit, side in zip(bits, sides, strict=True):
        formula = assuming(formula, bit, side)
    return formula


def formula_of(system: System, name: str) -> tuple[Expr, tuple[Guard, ...]]:
    """A state or an output of a system, and the guards that its bits number: those of the system,
    and where it needs more, those of the outputs. Raises ParameterError for any other name.
    """
    if not among(name, system.outputs.names):
        unit_of(system, name)
        return state(name), system.guards
    formulas, guards = system.outputs.behind(system.guards)
    formula = formulas[system.outputs.names.index(name)]
    more = bits_in([formula]) - set(range(len(system.guards)))
    return formula, guards if more else system.guards


def rate_of(system: System, formula: Expr) -> Expr:
    """The time derivative of a function of the states and the time, in a frozen mode."""
    slopes = gradient(formula, system.states)
    moved = [mul(slope, rate) for slope, rate in zip(slopes, system.field, strict=True)]
    return total([one for one in (*moved, time_derivative(formula)) if one is not constant(0.0)])


def unit_of(system: System, name: str) -> str:
    """Unit of a state or an output; ``""`` if it isn't known. Raises ParameterError for any other
    name.
    """
    units = {one: system.units[one] for one in system.states}
    units |= dict(zip(system.outputs.names, system.outputs.units, strict=True))
    if not among(name, units):
        what = "state or output" if len(system.outputs) else "state"
        raise unknown(f"{system.name} has no {what}", name, units)
    return units[name]


def acting_guards(system: System) -> tuple[int, ...]:
    """Numbers of the guards on which the equations depend: all but added surfaces."""
    waiting = bits_in(system.field) | {n for n, guard in enumerate(system.guards) if guard.law}
    acting: set[int] = set()
    while waiting:  # hold guards refer to one another in circles
        acting |= waiting
        waiting = bits_in(expressions_of([system.guards[number] for number in waiting])) - acting
    return tuple(sorted(acting))


def _with_guard(system: System, gap: Expr, guards: tuple[Guard, ...], name: str) -> System:
    taken = {guard.name for guard in guards}
    while name in taken:
        name += "'"
    return replace(system, guards=(*guards, surface_guard(gap, name)))


# -- integrals -------------------------------------------------------------------------------------
def with_integrals(
    system: System, integrands: Mapping[str, Quantity | str], units: Mapping[str, str] | None = None
) -> System:
    """The system with more states, each the integral of a function along the motion; their starts
    are given, as a rule zero.

    Parameters
    ----------
    system : System
        The equations and values.
    integrands : mapping of str to callable or str
        Integrands by the name of the new state: functions of (t, states, parameters), see
        :func:`quantity`, or names of states or outputs. They can't use the other integrals.
    units : mapping of str to str, optional
        Coherent SI unit of each integral.

    Returns
    -------
    System
        The new states are the last, in this order. Guards that the functions need for conditions of
        their own are appended.

    Raises
    ------
    TraceError
        If a function can't be traced, or doesn't repeat with the forcing.
    ParameterError, UnitError
        If a name is taken or can't be a name, or a unit isn't coherent.
    """
    rates: list[Expr] = []
    new_units = {name: check_declared(unit, name) for name, unit in (units or {}).items()}
    extended = system
    for name, function in integrands.items():
        if why_no_name(name) is not None or name in system.units:
            raise ParameterError(
                f"an integral of {system.name} can't be called {shown(name)}: use letters, digits "
                f"and _, and no name it has."
            )
        if isinstance(function, str):
            rate, guards = formula_of(extended, function)
        else:
            rate, guards = quantity(extended, function, f"the integrand {shown(name)}")
        extended = replace(extended, guards=guards)
        rates.append(rate)
    return with_states(extended, dict(zip(integrands, rates, strict=True)), new_units)


def with_states(
    system: System, rates: Mapping[str, Expr], units: Mapping[str, str] | None = None
) -> System:
    """The system with more states, the last, which its laws of contact don't touch.

    Parameters
    ----------
    system : System
        The equations and values.
    rates : mapping of str to Expr
        Rate of each new state by its name, which isn't taken.
    units : mapping of str to str, optional
        Coherent SI unit of each new state.
    """
    new = tuple(map(state, rates))
    return replace(
        system,
        guards=tuple(
            replace(guard, law=guard.law.extended(new)) if guard.law else guard
            for guard in system.guards
        ),
        states=(*system.states, *rates),
        field=(*system.field, *rates.values()),
        units={**system.units, **{name: (units or {}).get(name, "") for name in rates}},
    )


# -- jumps of the state ----------------------------------------------------------------------------
def jumping_states(system: System) -> tuple[str, ...]:
    """The states that impacts and jumps change, in the order of the system."""
    resets = [guard.law.reset for guard in system.guards if guard.law and guard.law.reset]
    return tuple(
        name
        for i, name in enumerate(system.states)
        if any(reset[i] is not state(name) for reset in resets)
    )


def is_remembered(name: str) -> bool:
    """True if a state is one that :func:`remembering` has added: it holds a past value, and the
    motion doesn't depend on it.
    """
    return name.endswith(_REMEMBERED)


def remembered(system: System) -> tuple[int, ...]:
    """Numbers of the states whose past values the states that :func:`remembering` has added
    hold.
    """
    return tuple(
        system.states.index(name.removesuffix(_REMEMBERED))
        for name in system.states
        if is_remembered(name)
    )


@functools.lru_cache(maxsize=64)
def remembering(system: System) -> System:
    """The system extended by its :func:`jumping_states` as they were before the last impact or
    jump. Without jumps it is the system itself. The result is cached; copies with other values give
    copies.
    """
    names, size = jumping_states(system), len(system.states)
    if not names:
        return system
    if system.origin is not system:
        return remembering(system.origin).with_values(**system.values)
    new = {f"{name}{_REMEMBERED}": name for name in names}
    extended = with_states(
        system,
        dict.fromkeys(new, constant(0.0)),
        {one: system.units.get(name, "") for one, name in new.items()},
    )
    was = tuple(map(state, names))

    def told(guard: Guard) -> Guard:
        law = guard.law
        if law is None or not law.reset:
            return guard
        return replace(guard, law=replace(law, reset=(*law.reset[:size], *was)))

    return replace(extended, guards=tuple(map(told, extended.guards)))


def with_losses(system: System, stored: Expr, name: str, unit: str) -> System:
    """The system with one more state, the last: the sum of the losses of a stored quantity at
    impacts and jumps.

    Parameters
    ----------
    system : System
        The equations and values.
    stored : Expr
        The quantity, as :func:`quantity` returns it; its pieces are those from which the state
        jumps.
    name, unit : str
        Of the new state.

    Returns
    -------
    System
        Where nothing jumps the new state stays as it starts.
    """
    extended = with_integrals(system, {name: lambda: 0.0}, {name: unit})
    sum_, states = state(name), [state(one) for one in system.states]

    def taken(after: Sequence[Expr]) -> tuple[Expr, ...]:
        left = substituted(stored, dict(zip(states, after[:-1], strict=True)))
        return (*after[:-1], add(sum_, sub(stored, left)))

    def lossy(guard: Guard) -> Guard:
        law = guard.law
        if law is None or law.kind not in ("impact", "jump"):
            return guard
        settled = law.settled and taken(law.settled)
        return replace(guard, law=replace(law, reset=taken(law.reset), settled=settled))

    return replace(extended, guards=tuple(map(lossy, extended.guards)))


def with_impulses(system: System, names: Mapping[int, str]) -> System:
    """The system with more states, the last: the impulse of each stop so far, from its impacts and
    from the force at rest. Where impacts accumulate, the force that would hold the contact replaces
    the impacts that aren't followed: their impulse is the same.

    Parameters
    ----------
    system : System
        The equations and values.
    names : mapping of int to str
        Names of the new states by the number of the guard, all of which have the law of an impact.

    Returns
    -------
    System
        An impulse is relative to the mass where the law has no inertias.
    """
    rates: list[Expr] = []
    for number in names:
        law = system.guards[number].law
        assert law is not None
        assert law.drive is not None
        assert law.pivot is not None
        rates.append(select(Bit(law.partner), neg(div(law.drive, law.pivot)), 0.0))
    extended = with_integrals(system, dict.fromkeys(names.values(), lambda: 0.0))
    guards = list(extended.guards)
    for number, name in names.items():
        guards[number] = replace(guards[number], law=_summed(guards[number].law, name, extended))
    field = (*system.field, *rates)
    return replace(extended, field=field, guards=tuple(guards))


def _summed(law: Law | None, name: str, system: System) -> Law:
    """The law of an impact that adds its impulse to a state."""
    assert law is not None
    assert law.constraint is not None
    assert law.restitution is not None
    assert law.mass is not None
    place, own = system.states.index(name), state(name)
    turned = mul(law.mass, mul(add(1.0, law.restitution), law.constraint))
    return replace(
        law,
        reset=_with(law.reset, place, add(own, turned)),
        settled=_with(law.settled, place, add(own, mul(law.mass, law.constraint))),
    )


def _with(entries: tuple[Expr, ...], place: int, entry: Expr) -> tuple[Expr, ...]:
    return (*entries[:place], entry, *entries[place + 1 :])


def _free(name: str, system: System) -> str:
    """The name, with a number behind it if the system uses it already."""
    number, free = 1, name
    while free in system.units:
        number += 1
        free = f"{name}_{number}"
    return free
