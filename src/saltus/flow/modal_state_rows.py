"""Rows of a contact state in the tables of the modal flow: its modes, and its steady answers."""

from __future__ import annotations

import numpy as np

from saltus.codegen.module import MODAL_LANES as LANES
from saltus.flow.modal_blocks import table_of
from saltus.flow.modal_eigen import shared_of
from saltus.flow.modal_modes import StateModes

#: Modes from which on L and V share the shapes: a chaotic motion comes to hundreds of contact
#: states, whose tables come from memory.
SHARED = 32


def modes_rows(
    matrix: np.ndarray, modes: StateModes, gaps: np.ndarray, groups: int, state_groups: int
) -> np.ndarray:
    """The table of some modes: lambda, its size, L, V, amplitudes of the gaps, their sizes, and
    those of the terms of which they are sums; where L and V aren't zero; the groups of modes in
    use; the block.

    Parameters
    ----------
    matrix : float64[N, N]
        Of the equations.
    modes : StateModes
        Its modes.
    gaps : float64[R, N]
        Gaps by states.
    groups, state_groups : int
        Registers of lanes that modes and states take.
    """
    values, states, slots = modes.values, len(modes.vectors), len(modes.values)
    width, count = LANES * groups, LANES * state_groups
    weight = np.where(values.imag > 0, 2.0, 1.0)
    lam, size = np.zeros(width, complex), np.zeros(width)
    lam[:slots], size[:slots] = values, np.abs(values)
    size[slots:] = size[:slots].max(initial=0.0)
    to_modes, to_states = np.zeros((width, count), complex), np.zeros((count, width), complex)
    to_modes[:slots, :states] = modes.inverse
    to_states[:states, :slots] = modes.vectors * weight
    # L: by groups of modes, real parts then imaginary ones, each for all states
    left = to_modes.reshape(groups, LANES, count).transpose(0, 2, 1)
    left = np.concatenate([left.real, left.imag])
    # V: by groups of states, for each mode the real part and minus the imaginary one
    right = to_states.reshape(state_groups, LANES, width).transpose(0, 2, 1)
    right = np.stack([right.real, -right.imag], axis=2)
    eigen = values, modes.vectors, modes.inverse
    shared = shared_of(matrix, eigen) if slots >= SHARED and modes.block is None else None
    if shared is not None:
        left = shapes_table(*shared, to_states, LANES, left.size)
        right = np.zeros(right.shape)
    rows = gaps @ to_states[:states]
    terms = np.abs(gaps) @ np.abs(to_states[:states])
    waves = np.stack([rows.real, rows.imag, np.abs(rows), terms], axis=1)
    block = table_of(modes.block, slots if shared else 0, gaps, LANES, state_groups)
    sides = (
        (to_modes, groups, state_groups),
        (to_states, state_groups, groups),
    )
    runs = [
        runs_of((side != 0).reshape(rows, LANES, columns, LANES).any(axis=(1, 3)))
        for side, rows, columns in sides
    ]
    used = np.array([-(-slots // LANES), 0.0, 0.0, 0.0])
    return np.concatenate(
        [one.ravel() for one in (lam.real, lam.imag, size, left, right, waves, *runs, used, *block)]
    )


def runs_of(filled: np.ndarray) -> np.ndarray:
    """Runs in which the rows of bool[rows, places] are true: the first place of one and that behind
    it, then those of a second run behind the widest gap, float64[rows, 4].
    """
    runs = np.zeros((len(filled), 4))
    for run, row in zip(runs, filled, strict=True):
        places = np.flatnonzero(row)
        if len(places):
            apart = np.diff(places)
            cut = int(np.argmax(apart)) + 1 if apart.max(initial=1) > 1 else len(places)
            for part, own in enumerate((places[:cut], places[cut:])):
                run[2 * part : 2 * part + 2] = (own[0], own[-1] + 1) if len(own) else 0
    return runs


def shapes_table(
    scale: np.ndarray, damping: np.ndarray, to_states: np.ndarray, lanes: int, size: int
) -> np.ndarray:
    """The table in place of L where the states are coordinates and their rates, float64[size]:
    see kernels/modal/series.py. Factors of the left vectors complex128[M], damping float64[M], V.
    """
    modes, width = len(scale), to_states.shape[1]
    count = -(-modes // lanes) * lanes
    shapes, factors, rates = (
        np.zeros((count, width), complex),
        np.zeros(width, complex),
        np.zeros(count),
    )
    shapes[:modes], factors[:modes], rates[:modes] = to_states[:modes], scale / 2, damping
    blocks = shapes.reshape(-1, lanes, width // lanes, lanes).transpose(0, 2, 1, 3)
    parts = np.stack([blocks.real, blocks.imag], axis=3)
    flat = np.concatenate([one.ravel() for one in (parts, factors.real, factors.imag, rates)])
    return np.concatenate([flat, np.zeros(size - len(flat))])


def steady_rows(
    answers: np.ndarray, gaps: np.ndarray, sizes: np.ndarray, harmonic: int, width: int
) -> np.ndarray:
    """Rows of the table of steady answers, contact state by contact state, float64[k, ..].

    Parameters
    ----------
    answers, gaps : complex128[k, N, ..], complex128[k, R, ..]
        Of the states, and of the gaps; the first ``harmonic`` of them have an imaginary part, but
        for that to the constant.
    sizes : float64[k, R, ..]
        Of the terms of which the answers of the gaps are sums.
    harmonic, width : int
        How many; numbers that the states take with those that fill the lanes.
    """
    states, columns = answers.shape[1:]
    terms = [(0, "real")]
    terms += [(d, part) for d in range(1, harmonic) for part in ("real", "imag")]
    terms += [(d, "real") for d in range(harmonic, columns)]
    each = len(terms) + 1 + columns - harmonic
    first, count = width * len(terms), each * gaps.shape[1]
    rows = np.zeros((len(answers), first + count + -count % LANES))
    for k, (d, part) in enumerate(terms):
        rows[:, width * k : width * k + states] = getattr(answers[:, :, d], part)
        rows[:, first + k : first + count : each] = getattr(gaps[:, :, d], part)
    rows[:, first + len(terms) : first + count : each] = sizes[:, :, :harmonic].sum(axis=2)
    for k in range(harmonic, columns):
        place = first + len(terms) + 1 + k - harmonic
        rows[:, place : first + count : each] = sizes[:, :, k]
    return rows
