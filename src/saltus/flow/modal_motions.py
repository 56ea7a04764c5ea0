"""Motions of the modal flow, leg by leg, as sums of waves (flow/waves.py)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.contact.guards import Guard
from saltus.flow.maps import Stroboscope
from saltus.flow.modal import Modal, modal_flow
from saltus.flow.modal_tables import Tables
from saltus.flow.request import Outcome
from saltus.flow.waves import UNSEEN, WaveLegs, padded
from saltus.language.expression import Expr

#: Turns of a drive in a period that are whole to so much are whole [relative].
WHOLE = 1e-12


def wave_motions(
    map_: Stroboscope,
    start: np.ndarray,
    periods: int,
    quantities: Sequence[Expr],
    guards: Sequence[Guard],
) -> tuple[list[WaveLegs | None], Outcome] | None:
    """The motions from float64[k, D] over ``periods``, row i by row i of the map, as legs of waves.

    Parameters
    ----------
    map_, start, periods, quantities, guards
        As for :func:`saltus.flow.pieces.pieces`.

    Returns
    -------
    list of WaveLegs, Outcome
        The legs of each motion, None of one that didn't reach the end; their quantities are the
        states, then those asked for, then the gaps. None in place of both if another method moves
        this system, a quantity isn't linear, a drive is a record, a contact rubs or remembers, or
        modes go together in a block.
    """
    system = map_.system
    method = map_.method.serving(system.origin)
    if not isinstance(method, Modal) or system.tangent_of is not None:
        return None
    if len(guards) != len(system.guards):
        return None
    tables = modal_flow(system.origin).tables
    if tables.rubs.any() or (~tables.plain & ~tables.strikes & ~tables.holds).any():
        return None
    asked = tables.linear.of(tuple(quantities))
    if asked is None or tables.linear.courses:
        return None
    outcome = map_.run(start, periods, record=0)
    begins = outcome.contacts.begins(len(start))
    motions: list[WaveLegs | None] = []
    for i in range(len(start)):
        mine = slice(begins[i], begins[i + 1])
        if not np.isfinite(outcome.state[i]).all() or outcome.time[i] < periods * map_.period[i]:
            motions.append(None)
            continue
        legs = _legs(map_, tables, asked, start[i], periods, outcome, i, mine)
        if legs is None:
            return None
        motions.append(legs)
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
) -> WaveLegs | None:
    """The legs of one motion, by contact state; None if modes go together in a block."""
    contacts, period = outcome.contacts.rows(mine), float(map_.period[i])
    first = int(contacts.mode_before[0]) if len(contacts) else int(outcome.mode[i])
    modes = np.append(first, contacts.mode_after)
    states = np.vstack([start, contacts.state])
    counts, phases = np.append(0, contacts.period), np.append(0.0, contacts.phase)
    length = np.diff(counts, append=periods) * period + np.diff(phases, append=0.0)
    known, amplitudes, legs = list[_Waves](), list[np.ndarray](), list[np.ndarray]()
    for mode in np.unique(modes[length > 0.0]).tolist():
        own = np.flatnonzero((modes == mode) & (length > 0.0))
        waves = _waves_of(tables, map_.parameters[i if len(map_) > 1 else 0], mode, asked)
        if waves is None:
            return None
        known.append(waves)
        amplitudes.append(waves.amplitudes(states[own], counts[own], period, phases[own]))
        legs.append(own)
    order, widest = np.concatenate(legs), max(len(one.rates) for one in known)
    return WaveLegs(
        np.stack([padded(one.rates, widest, UNSEEN) for one in known]),
        np.stack([padded(one.rows, widest) for one in known]),
        np.zeros(len(known), np.int64),
        np.repeat(np.arange(len(legs)), [len(own) for own in legs]),
        np.concatenate([padded(one, widest) for one in amplitudes]),
        counts[order] * period + phases[order],
        length[order],
    )


def modal_rates(map_: Stroboscope, states: np.ndarray) -> np.ndarray | None:
    """The rates at states float64[k, D] at a whole period, row i by row i of the map,
    float64[k, D]; None if another method moves this system, or a contact has a law.
    """
    system = map_.system
    if not isinstance(map_.method.serving(system.origin), Modal):
        return None
    tables = modal_flow(system.origin).tables
    if not tables.plain.all() or len(tables.linear.states) != states.shape[1]:
        return None
    found = np.empty_like(states)
    with tables.lock:
        for i, state in enumerate(states):
            given = tables.sets[tables.set_of(map_.parameters[i if len(map_) > 1 else 0])]
            courses = [float(one.at(np.zeros(()))[0]) for one in given.courses]
            drives = np.concatenate([np.cos(given.lags), courses])
            gap = given.gaps.matrix @ state + given.gaps.constant + given.gaps.driven @ drives
            piece = tables.equations.piece_of(given, int((gap > 0) @ (1 << np.arange(len(gap)))))
            found[i] = piece.matrix @ state + piece.constant + piece.driven @ drives
    return found


def slowest_decays(map_: Stroboscope) -> np.ndarray | None:
    """The slowest decay of a free motion of each row of a map, in the contact state in which all
    states are zero, float64[k] [1/period]; 0 or less where one doesn't decay. None if another
    method moves this system.
    """
    system = map_.system
    if not isinstance(map_.method.serving(system.origin), Modal):
        return None
    tables = modal_flow(system.origin).tables
    with tables.lock:
        sets = [tables.sets[tables.set_of(row)] for row in map_.parameters]
    found: np.ndarray = np.array([tables.equations.slowest(given) for given in sets]) * map_.period
    return found


@dataclass(frozen=True)
class _Waves:
    """The waves of a contact state: its modes, a constant and the drives; see flow/waves.py.

    Attributes
    ----------
    rates : complex128[E]
        [1/s].
    rows : complex128[R, E]
        What each adds to each quantity.
    inverse : complex128[M, N]
        Amplitudes of modes by states.
    answers : complex128[N, 1 + D]
        Steady answers to the constant and the drives.
    drives, lags : float64[D]
        Rates [rad/s] and phases [rad] of the drives.
    """

    rates: np.ndarray
    rows: np.ndarray
    inverse: np.ndarray
    answers: np.ndarray
    drives: np.ndarray
    lags: np.ndarray

    def amplitudes(
        self, states: np.ndarray, count: np.ndarray, period: float, phase: np.ndarray
    ) -> np.ndarray:
        """Amplitudes complex128[p, E] in states float64[p, N], ``phase`` [s] after whole
        periods.
        """
        turns = self.drives * period / (2 * math.pi)
        whole = np.abs(turns - np.round(turns)) <= WHOLE * np.abs(turns)
        angle = self.lags + self.drives * phase[:, None]
        angle = angle + np.where(whole, 0.0, count[:, None] * self.drives * period)
        loads = np.column_stack([np.ones(len(states)), np.exp(1j * angle)])
        modes = (states - (loads @ self.answers.T).real) @ self.inverse.T
        return np.column_stack([modes, loads])


def _waves_of(
    tables: Tables, row: np.ndarray, mode: int, quantities: tuple[Expr, ...]
) -> _Waves | None:
    """The waves of a contact state, with the states, some quantities and the gaps; None if modes go
    together in a block.
    """
    with tables.lock:
        which = tables.set_of(row)
        given, (_, modes) = tables.sets[which], tables.made[tables.state_of(which, mode)]
    if modes.block is not None:
        return None
    asked = tables.linear.rows(quantities, given.values, mode)
    weight = np.where(modes.values.imag > 0, 2.0, 1.0)
    states = np.hstack([modes.vectors * weight, modes.answers])
    others = np.vstack([asked.matrix, given.gaps.matrix]) @ states
    behind = others[:, len(weight) :]
    behind[:, 0] += np.append(asked.constant, given.gaps.constant)
    behind[:, 1:] += np.vstack([asked.driven, given.gaps.driven])
    return _Waves(
        np.concatenate([modes.values, [0.0], 1j * given.rates]),
        np.vstack([states, others]),
        modes.inverse,
        modes.answers,
        given.rates,
        given.lags,
    )
