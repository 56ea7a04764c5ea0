"""Motions as polynomials between the samples and contacts of a compiled flow.

The flow hands over its states some times a period and at every contact, and the mode in between.
From each of these nodes the motion is the Taylor series of the equations in that mode:
:mod:`saltus.codegen` writes it, NumPy evaluates it for thousands of nodes at once. Any function of
the motion has its series too, so turning points are roots of polynomials and means are exact sums;
nothing is compiled. A method that locates no contacts has cubics between its samples instead,
through their values and rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from saltus.contact.guards import Guard
from saltus.flow import polynomials
from saltus.flow.maps import Stroboscope
from saltus.flow.motion_series import MotionSeries, Nodes, Pieces
from saltus.flow.request import Outcome, Schedule
from saltus.language.expression import Expr
from saltus.system import System

#: Nodes of a period besides the contacts.
NODES = 8
#: Nodes of a period for a method whose errors are more than rounding.
NODES_INEXACT = 64
#: Samples of a period for cubics.
SAMPLES = 1000
#: Nodes whose series are computed at a time: some tens of megabytes.
WIDTH = 2048
#: A sample within this time after a contact is the contact [forcing periods].
SAME = 1e-9


def pieces(
    map_: Stroboscope,
    start: np.ndarray,
    periods: int,
    quantities: Sequence[Expr],
    guards: Sequence[Guard],
) -> tuple[Pieces, Outcome]:
    """The motions from float64[k, D] over ``periods``, row i by row i of the map.

    Parameters
    ----------
    map_ : Stroboscope
        The flow.
    start : float64[k, D]
        States at a whole period.
    periods : int
        Length of the motions.
    quantities : sequence of Expr
        Functions of time, states and parameters, whose conditions hold bits.
    guards : sequence of Guard
        Guards that the bits stand for: those of the system, then those of the quantities alone.

    Returns
    -------
    Pieces, Outcome
        The quantities are the states, then those asked for, then the gaps of the system. A motion
        that didn't reach the end has no pieces.
    """
    watched = watched_system(map_.system.origin, tuple(guards), tuple(quantities))
    found, outcome = _pieces(
        map_, start, periods, watched, len(guards), not map_.method.records_contacts
    )
    if map_.method.records_contacts:
        without = np.setdiff1d(
            np.arange(len(start)), found.motion[np.isfinite(found.terms).all(axis=(0, 1))]
        )
        bad = np.union1d(without, found.motion[~np.isfinite(found.terms).all(axis=(0, 1))])
        bad = bad[np.isfinite(outcome.state[bad]).all(axis=1)]
        if len(bad):  # a pole, or a law whose series isn't known where it begins
            cubics = _pieces(map_.rows(bad), start[bad], periods, watched, len(guards), True)[0]
            good = found.rows(~np.isin(found.motion, bad))
            found = _joined([[good, replace(cubics, motion=bad[cubics.motion])]])
    return found, outcome


@lru_cache(maxsize=256)
def watched_system(
    system: System, guards: tuple[Guard, ...], quantities: tuple[Expr, ...]
) -> System:
    """The system with the quantities as its last guards; cached, since its series are costly."""
    asked = tuple(Guard(f"quantity {i}", quantity) for i, quantity in enumerate(quantities))
    return replace(system, guards=(*guards, *asked))


def nodes_of(map_: Stroboscope, cubic: bool = False) -> int:
    """Nodes of a period."""
    if cubic or not map_.method.records_contacts:
        return SAMPLES
    return NODES if map_.exact else NODES_INEXACT


def _pieces(
    map_: Stroboscope, start: np.ndarray, periods: int, watched: System, guards: int, cubic: bool
) -> tuple[Pieces, Outcome]:
    """The pieces by Taylor series or by cubics, and the outcome of the flow."""
    count = nodes_of(map_, cubic)
    schedule = Schedule.even(periods, count, beyond=int(cubic))
    outcome = map_.run(start, periods, schedule, record=0)
    nodes, series = (
        _nodes(map_, outcome, periods, schedule, cubic),
        MotionSeries(map_, watched, guards),
    )
    parts = [
        series.of(nodes.rows(slice(first, first + WIDTH)), cubic)
        for first in range(0, len(nodes.motion), WIDTH)
    ]
    whole = _joined(parts or [[series.none()]])
    return (_between(whole) if cubic else whole), outcome


# -- nodes -----------------------------------------------------------------------------------------
def _nodes(
    map_: Stroboscope, outcome: Outcome, periods: int, schedule: Schedule, cubic: bool
) -> Nodes:
    """Samples and contacts in one list, one of them for each instant."""
    k, m, size = outcome.samples.shape
    contacts = outcome.contacts
    complete = np.isfinite(outcome.samples).all(axis=(1, 2)) & (m > 0)
    nodes = Nodes(
        np.concatenate([np.repeat(np.arange(k), m), contacts.trajectory]),
        np.concatenate([np.tile(schedule.count, k), contacts.period]),
        np.concatenate([(map_.period[:, None] * schedule.fraction).ravel(), contacts.phase]),
        np.repeat([0.0, 1.0], [k * m, len(contacts)]),  # for now: whether it is a contact
        np.concatenate([outcome.samples.reshape(-1, size), contacts.state]),
        np.concatenate([outcome.sample_mode.ravel(), contacts.mode_after]),
    )
    period = map_.period[nodes.motion]
    # a sample before a contact at one instant
    order = np.lexsort((nodes.length, nodes.period * period + nodes.phase, nodes.motion))
    nodes, period = nodes.rows(order), period[order]
    behind = np.zeros(len(order), bool)
    follows = (np.diff(nodes.motion) == 0) & (
        np.diff(nodes.period * period + nodes.phase) < SAME * period[1:]
    )
    behind[1:] = follows & (nodes.length[1:] == 0.0) & (nodes.length[:-1] == 1.0)
    keep = complete[nodes.motion] & ~behind
    nodes, period = nodes.rows(keep), period[keep]
    last = np.append(np.diff(nodes.motion) != 0, True)[: len(period)]
    until_period = np.where(last, periods, np.roll(nodes.period, -1))
    until_phase = np.where(last, 0.0, np.roll(nodes.phase, -1))
    nodes = replace(
        nodes, length=(until_period - nodes.period) * period + (until_phase - nodes.phase)
    )
    if cubic:  # the last node ends the last piece
        return replace(nodes, length=np.where(last, period / SAMPLES, nodes.length)).rows(
            (nodes.length > 0.0) | last
        )
    return nodes.rows(nodes.length > 0.0)


def _joined(parts: list[list[Pieces]]) -> Pieces:
    """All pieces in the order of motion and time. Cubics are padded with zero terms to the length
    of the others.
    """
    flat = [piece for part in parts for piece in part]
    longest = max(len(piece.terms) for piece in flat)
    flat = [
        replace(piece, terms=np.pad(piece.terms, ((0, longest - len(piece.terms)), (0, 0), (0, 0))))
        for piece in flat
    ]
    joined = Pieces(
        *(
            np.concatenate([getattr(piece, name) for piece in flat], axis=-1)
            for name in Pieces.__dataclass_fields__
        )
    )
    return joined.rows(np.lexsort((joined.phase, joined.period, joined.motion)))


def _between(nodes: Pieces) -> Pieces:
    """Cubics from each node to the next, through values and rates at both. The node at the end of a
    motion only closes its last piece.
    """
    first = np.flatnonzero(np.diff(nodes.motion) == 0)
    length = nodes.length[first]
    rate = nodes.terms[1] / nodes.length
    (a, b), (da, db) = ((of[:, first], of[:, first + 1]) for of in (nodes.terms[0], rate))
    terms = polynomials.hermite(a, b, da * length, db * length)
    return Pieces(
        nodes.motion[first],
        nodes.period[first],
        nodes.phase[first],
        length,
        terms,
        nodes.noise[:, first],
    )
