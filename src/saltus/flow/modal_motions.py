"""Motions of the modal flow, leg by leg, as sums of waves (flow/waves.py)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.contact.guards import Guard
from saltus.flow.maps import Stroboscope
from saltus.flow.modal import Modal, modal_flow
from saltus.flow.modal_tables import Tables
from saltus.flow.request import Outcome
from saltus.flow.waves import Legs
from saltus.language.expression import Expr


def wave_motions(
    map_: Stroboscope,
    start: np.ndarray,
    periods: int,
    quantities: Sequence[Expr],
    guards: Sequence[Guard],
) -> tuple[list[list[Legs]], Outcome] | None:
    """The motions from float64[k, D] over ``periods``, row i by row i of the map, as legs of waves.

    Parameters
    ----------
    map_, start, periods, quantities, guards
        As for :func:`saltus.flow.pieces.pieces`.

    Returns
    -------
    list of list of Legs, Outcome
        The legs of each motion, none of one that didn't reach the end; their quantities are the
        states, then those asked for, then the gaps. None if another method moves this system, or a
        quantity isn't linear.
    """
    system = map_.system
    method = map_.method.serving(system.origin)
    if not isinstance(method, Modal) or system.tangent_of is not None:
        return None
    if len(guards) != len(system.guards):
        return None
    tables = modal_flow(system.origin).tables
    asked = tables.linear.of(tuple(quantities))
    if asked is None:
        return None
    outcome = map_.run(start, periods, record=0)
    begins = outcome.contacts.begins(len(start))
    motions = [
        _legs(map_, tables, asked, start[i], periods, outcome, i, slice(begins[i], begins[i + 1]))
        for i in range(len(start))
    ]
    return motions, outcome


def _legs(
    map_: Stroboscope,
    tables: Tables,
    asked: tuple[Expr, ...],
    start: np.ndarray,
    periods: int,
    outcome: Outcome,
    i: int,
    mine: slice,
) -> list[Legs]:
    """The legs of one motion, by contact state."""
    if not np.isfinite(outcome.state[i]).all() or outcome.time[i] < periods * map_.period[i]:
        return []
    contacts, period = outcome.contacts.rows(mine), float(map_.period[i])
    first = int(contacts.mode_before[0]) if len(contacts) else int(outcome.mode[i])
    modes = np.append(first, contacts.mode_after)
    states = np.vstack([start, contacts.state])
    counts, phases = np.append(0, contacts.period), np.append(0.0, contacts.phase)
    length = np.diff(counts, append=periods) * period + np.diff(phases, append=0.0)
    parts = []
    for mode in np.unique(modes).tolist():
        own = np.flatnonzero((modes == mode) & (length > 0.0))
        waves = tables.waves(map_.parameters[i if len(map_) > 1 else 0], mode, asked)
        amplitudes = waves.amplitudes(states[own], counts[own], period, phases[own])
        begin = counts[own] * period + phases[own]
        parts.append(Legs(waves.rates, waves.rows, amplitudes, begin, length[own]))
    return parts
