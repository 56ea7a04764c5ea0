"""Peaks of the forces and depths of contacts, from the Taylor series of the motion between the
instants at which the flow knows it.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.motion.touchdowns import Touchdowns
from saltus.analysis.motion.window import Stretch
from saltus.contact.guards import Guard
from saltus.errors import SaltusWarning
from saltus.flow import polynomials
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.motion_series import MotionSeries, Nodes, Pieces
from saltus.flow.pieces import watched_system
from saltus.flow.request import Outcome
from saltus.interrupt import check_stop
from saltus.language.derivatives import gradient
from saltus.language.expression import Expr, constant, div, mul, walk
from saltus.system import System, gap_units
from saltus.system.contact_forces import force_unit, forces_in_equations
from saltus.system.quantity import formula_of
from saltus.system.read_off import Quantity, quantity
from saltus.units import dimension

#: Contacts whose peaks are found unless more are asked for; fewer, where the contacts times the
#: operations of the equations would be more than so many: some seconds (2 us each were measured of
#: plates of 40 and 60 modes).
MOST_CONTACTS = 10_000
MOST_OPERATIONS = 2_000_000
#: Parts of contacts whose series are made at a time: some tens of megabytes.
WIDTH = 256
#: In place of a unit: there is no such impulse.
NONE = "none"
#: Share of a part of a contact that may be missing at its end: rounding.
MISSING = 1e-9


@dataclass(frozen=True)
class ContactForces:
    """Forces of contacts as functions of the motion.

    Attributes
    ----------
    formulas : mapping of int to Expr
        By the number of the guard; conditions hold bits.
    guards : tuple of Guard
        The guards of these bits: those of the system, then those that only the formulas need.
    found : frozenset of int
        Guards whose force was found in the equations.
    """

    formulas: Mapping[int, Expr]
    guards: tuple[Guard, ...]
    found: frozenset[int]


@dataclass(frozen=True)
class Peaks:
    """Peaks of contacts, one a row.

    Attributes
    ----------
    force : float64[k]
        Force of the largest magnitude, with its sign; NaN where it isn't known.
    depth : float64[k]
        Largest distance beyond the boundary [unit of the gap].
    impulse : float64[k]
        Integral of the force over the contact.
    """

    force: np.ndarray
    depth: np.ndarray
    impulse: np.ndarray


# -- forces ----------------------------------------------------------------------------------------
def forces_of(
    system: System, given: Mapping[int, Quantity | str], sides: np.ndarray
) -> ContactForces:
    """The forces of contacts that the user gave, and those in the equations."""
    found = forces_in_equations(system, sides)
    if given and force_unit(system, found) != "N":
        found = {}  # forces that are given are in newtons
    formulas, extended = dict(found), system
    for number, function in given.items():
        if isinstance(function, str):  # the name of an output
            formulas[number], guards = formula_of(extended, function)
        else:
            formulas[number], guards = quantity(extended, function, "the force")
        extended = replace(extended, guards=guards)
    return ContactForces(formulas, extended.guards, frozenset(found.keys() - given.keys()))


def impulse_units(system: System, forces: ContactForces, peaks: bool) -> tuple[str, str, str]:
    """Units of the forces, of their impulses, and of those of rigid stops; ``none`` where there are
    none.
    """
    known = {g: one for g, one in forces.formulas.items() if peaks or g not in forces.found}
    unit = "N"
    if forces.found & known.keys():
        unit = force_unit(system, {g: known[g] for g in forces.found})
    of_impulse = {"N": "N*s", "m/s^2": "m/s"}.get(unit, f"{unit}*s" if unit else "")
    stops = [g for g, guard in enumerate(system.guards) if g not in known and _is_stop(guard)]
    return (
        unit,
        of_impulse if known else NONE,
        _impulse_of_stops(system, stops) if stops else NONE,
    )


def with_found(
    system: System, found: Touchdowns, forces: ContactForces, tops: Peaks | None
) -> tuple[Touchdowns, dict[str, str]]:
    """The contacts with the impulses of forces in the equations, and the units of forces and
    impulses; impulses of stops in another unit than that of forces are left out.
    """
    unit, of_forces, of_stops = impulse_units(system, forces, tops is not None)
    words = {"<impulse>": of_stops if of_forces == NONE else of_forces, "<force>": unit}
    if tops is not None and forces.found:
        known = np.full(len(found.guard), np.nan) if found.impulse is None else found.impulse
        own = np.isin(found.guard, list(forces.found))
        found = replace(found, impulse=np.where(own, tops.impulse, known))
    if found.impulse is not None and NONE not in (of_forces, of_stops) and of_forces != of_stops:
        rigid = np.array([guard.law is not None for guard in system.guards])[found.guard]
        rigid &= ~np.isin(found.guard, list(forces.formulas))
        found = replace(
            found,
            impulse=np.where(rigid, np.nan, found.impulse),
            struck=np.where(rigid, np.nan, found.struck),
        )
    return found, words


def warn_of_stops(system: System, forces: ContactForces, peaks: bool) -> None:
    """Say that impulses of rigid stops are left out, at the line of the user's call."""
    _, of_forces, of_stops = impulse_units(system, forces, peaks)
    if NONE not in (of_forces, of_stops) and of_forces != of_stops:
        warnings.warn(
            f"{system.name}: impulses of rigid stops [{of_stops or 'unknown unit'}] have another "
            f"unit than those of forces [{of_forces or 'unknown unit'}], so those of the stops are "
            f"left out. Give sl.impact the masses by inertia=.",
            SaltusWarning,
            stacklevel=4,
        )


def _is_stop(guard: Guard) -> bool:
    return guard.law is not None and guard.law.mass is not None


def _impulse_of_stops(system: System, stops: Sequence[int]) -> str:
    """The unit that the impulses of rigid stops share: that of a velocity where no inertia is
    given, ``""`` if it isn't known.
    """
    written, found = gap_units(system), set()
    for number in stops:
        law = system.guards[number].law
        assert law is not None
        assert law.constraint is not None
        assert law.mass is not None
        states = [node.payload for node in walk(law.constraint) if node.op == "state"]
        own = system.units[states[0]]
        slope = gradient(law.constraint, states[:1])[0]
        alone = len(states) == 1 and law.mass is div(constant(1.0), mul(slope, slope))
        if alone and "kg" not in (dimension(own) if own else ()):
            found.add(own)
        else:  # of coordinates of modes, the mass is 1 without a unit
            found.add("N*m*s" if written[number] == "rad" else "N*s")
    return found.pop() if len(found) == 1 else ""


def most(system: System) -> int:
    """Contacts whose peaks are found within seconds."""
    operations = sum(1 for _ in walk(*system.field))
    return int(min(MOST_CONTACTS, MOST_OPERATIONS / max(operations, 1)))


def warn_of_many(system: System, contacts: int) -> None:
    """Say that peaks are left out, at the line of the user's call; rigid stops have none."""
    if contacts > most(system) and any(guard.law is None for guard in system.guards):
        warnings.warn(
            f"{system.name}: {contacts} contacts are more than the {most(system)} whose peak "
            f"forces, depths and impulses are found by default (of {len(system.states)} states), "
            f"so these are left out. For all of them give peaks=True, in a study file peaks = "
            f"true; it takes longer.",
            SaltusWarning,
            stacklevel=4,
        )


# -- peaks -----------------------------------------------------------------------------------------
def peaks(
    seen: Stretch,
    method: Method,
    sides: np.ndarray,
    forces: ContactForces,
    outcome: Outcome,
    found: Touchdowns,
) -> Peaks:
    """The peaks of all contacts of a stretch; those of rigid stops have none, nor has a contact
    part of which takes more than :data:`saltus.flow.motion_series.MOST_PIECES` steps of a series.

    A contact that doesn't end has the peaks so far, and no impulse.
    """
    system, numbers = seen.system, list(forces.formulas)
    soft = np.array([guard.law is None for guard in system.guards])
    wanted = np.flatnonzero(soft[found.guard])
    part, owner = _parts(outcome, found, wanted)
    row, place = np.unique(part, return_inverse=True)
    size = len(system.states), len(numbers), len(system.guards)
    largest, total = _of_parts(seen, method, forces, outcome, row, size)
    force, depth, impulse = (np.full(len(found.guard), np.nan) for _ in range(3))
    for guard in np.unique(found.guard[wanted]).tolist():
        mine = found.guard[owner] == guard
        at, who = place[mine], owner[mine]
        gap = size[1] + guard
        _most(depth, who, _along(largest, gap, float(sides[guard]))[at])
        if guard in forces.formulas:
            column = numbers.index(guard)
            _most(force, who, _widest(largest, column)[at])
            summed = np.zeros(len(force))
            np.add.at(summed, who, total[at, column])
            here = np.unique(who)
            impulse[here] = np.where(np.isfinite(found.end[here]), summed[here], np.nan)
    return Peaks(force, depth, impulse)


def _most(into: np.ndarray, who: np.ndarray, values: np.ndarray) -> None:
    """Put the value of the largest magnitude of each contact; NaN where that of a part is."""
    order = np.lexsort((np.where(np.isnan(values), np.inf, np.abs(values)), who))
    last = np.append(np.diff(who[order]) != 0, True)[: len(order)]
    into[who[order[last]]] = values[order[last]]


def _along(largest: np.ndarray, column: int, side: float) -> np.ndarray:
    """The largest value towards a side, float64[part]."""
    values: np.ndarray = np.maximum(side * largest[:, 0, column], side * largest[:, 1, column])
    return values


def _widest(largest: np.ndarray, column: int) -> np.ndarray:
    """The value of the larger magnitude of the least and the largest one, float64[part]."""
    low, high = largest[:, 0, column], largest[:, 1, column]
    values: np.ndarray = np.where(np.abs(low) > np.abs(high), low, high)
    return values


def _parts(
    outcome: Outcome, found: Touchdowns, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the table of contacts at which parts of contacts begin, and the contact of each:
    a part lasts until the next row.
    """
    ends = outcome.contacts.begins(len(outcome.status))
    first, final = found.first[wanted], found.final[wanted]
    last = np.where(final >= 0, final, ends[1:][found.trajectory[wanted]])
    count = last - first
    owner = np.repeat(wanted, count)
    begins = np.repeat(first - np.append(0, np.cumsum(count)[:-1]), count)
    return begins + np.arange(count.sum()), owner


def _of_parts(
    seen: Stretch,
    method: Method,
    forces: ContactForces,
    outcome: Outcome,
    row: np.ndarray,
    size: tuple[int, int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest value float64[part, 2, quantity] of forces and gaps in each part, and the
    integrals float64[part, quantity] of these.
    """
    states, quantities = size[0], size[1] + size[2]
    largest = np.full((len(row), 2, quantities), np.nan)
    total = np.full((len(row), quantities), np.nan)
    system = seen.system
    watched = watched_system(system.origin, forces.guards, tuple(forces.formulas.values()))
    nodes = _nodes(seen, outcome, row, states)
    by_length = np.argsort(nodes.length)  # the longest of those together sets their steps
    for begin in range(0, len(row), WIDTH):
        check_stop()
        some = by_length[begin : begin + WIDTH]
        here = nodes.rows(some)
        of = here.motion if len(seen.group.parameters) > 1 else np.zeros(len(here.motion), int)
        map_ = Stroboscope(
            system,
            method,
            seen.group.parameters[of],
            None if system.forced_at is not None else seen.length.period[here.motion],
        )
        series = MotionSeries(map_, watched, len(forces.guards))
        numbered = Nodes(
            np.arange(len(here.motion)), here.period, here.phase, here.length, here.state, here.mode
        )
        covered = np.zeros(len(here.motion))
        low = np.full((len(here.motion), quantities), np.inf)
        high, summed = -low, np.zeros_like(low)
        for pieces in series.of(numbered, False):
            least, most, integral = _extremes(pieces, states)
            covered[pieces.motion] += pieces.length
            low[pieces.motion] = np.minimum(low[pieces.motion], least)
            high[pieces.motion] = np.maximum(high[pieces.motion], most)
            summed[pieces.motion] += integral
        whole = (covered >= (1.0 - MISSING) * here.length)[:, None]
        largest[some, 0], largest[some, 1] = (
            np.where(whole, low, np.nan),
            np.where(whole, high, np.nan),
        )
        total[some] = np.where(whole, summed, np.nan)
    return largest, total


def _nodes(seen: Stretch, outcome: Outcome, row: np.ndarray, states: int) -> Nodes:
    """The contacts of these rows as nodes, at absolute times, each as long as its part."""
    table = outcome.contacts
    who, time = table.trajectory[row], table.time[row]
    following = np.minimum(row + 1, len(table) - 1)
    same = (following > row) & (table.trajectory[following] == who)
    until = np.where(same, table.time[following], outcome.time[who])
    period = seen.length.period[who]
    count = np.zeros(len(row))
    if seen.system.forced_at is not None:
        count = np.floor(time / period)
    return Nodes(
        who,
        count.astype(np.int64),
        time - count * period,
        np.maximum(until - time, 0.0),
        table.state[row][:, :states],
        table.mode_after[row],
    )


def _extremes(pieces: Pieces, states: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least and largest value of each quantity but the states in each piece, and its integral,
    float64[piece, quantity] each: values at both ends and at turning points.
    """
    terms = pieces.terms[:, states:]
    shape = terms.shape[1:]
    flat = terms.reshape(len(terms), -1)
    ends = np.stack([flat[0], flat.sum(axis=0)])
    least, most = ends.min(axis=0), ends.max(axis=0)
    finite = np.flatnonzero(np.isfinite(flat).all(axis=0))
    which, place = polynomials.sign_changes(polynomials.derivative(flat[:, finite]))
    turned = polynomials.value(flat[:, finite[which]], place)
    np.minimum.at(least, finite[which], turned)
    np.maximum.at(most, finite[which], turned)
    integral = (flat / np.arange(1, len(flat) + 1)[:, None]).sum(axis=0).reshape(shape)
    return least.reshape(shape).T, most.reshape(shape).T, (integral * pieces.length).T
