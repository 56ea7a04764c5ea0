"""Modes of one contact state: those that go their own ways, and those that go together in a block.

Modes go together if taking them apart loses digits: eigenvectors that nearly coincide (critical
damping, a rigid body), or a drive near the eigenvalue of a mode. What is lost is a factor, by which
rounding is multiplied; a block keeps it below MOST_LOSS. Modes that grow go into it too: a step
never bounds a block, it follows it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from saltus.flow.modal_blocks import (
    MOST_LOSS,
    MOST_LOSS_OF_TWO,
    MOST_SPREAD,
    Block,
    ModalLoads,
    Subspace,
    block_of,
    loss_of,
)
from saltus.flow.modal_eigen import (
    ROUNDING,
    Eigen,
    both_of_each_pair,
    eigen_of,
    one_of_each_pair,
    slots_of,
)
from saltus.system.linear import LinearPiece
from saltus.system.linear_laws import Constrained

#: Rate of growth that is none, in units of the largest eigenvalue.
NO_GROWTH = 1e-12
#: By the fastest of rates and eigenvalues: the loads on the modes, and whether some of these don't
#: go their own ways whatever the rates.
Known = dict[float, tuple[np.ndarray, bool]]


@dataclass(frozen=True)
class StateModes:
    """Modes of one contact state, z = V y and y = L z, and its block.

    Attributes
    ----------
    values, vectors, inverse : complex128[M], complex128[N, M], complex128[M, N]
        Eigenvalues [1/s], V and L of the modes that go their own ways: of each pair the one that
        :func:`slots_of` keeps.
    block : Block or None
        Those that don't.
    answers : complex128[N, 1 + D + K * C]
        Steady answers to the constant, to each harmonic drive, and to each derivative of each
        course, as far as they aren't in the block.
    """

    values: np.ndarray
    vectors: np.ndarray
    inverse: np.ndarray
    block: Block | None
    answers: np.ndarray


def modes_of(
    piece: LinearPiece,
    gaps: LinearPiece,
    rates: np.ndarray,
    speeds: np.ndarray,
    most: int,
    eigen: Eigen,
    fastest: float = 0.0,
    known: Known | None = None,
) -> StateModes:
    """Modes of a contact state.

    Parameters
    ----------
    piece, gaps : LinearPiece
        Its equations; the gaps.
    rates : float64[D]
        Rates of the harmonic drives [rad/s].
    speeds : float64[C, K]
        Derivatives of the courses, in units of their values [1/s^k].
    most : int
        Modes that may go their own ways; of a pair one counts.
    eigen : tuple
        :func:`saltus.flow.modal_eigen.half_of` the matrix.
    fastest : float
        Size of the largest eigenvalue of other contact states [1/s]: they tell how slow a mode is.
    known : dict, optional
        What is the same for other rates, all else being equal: is filled, and read.
    """
    if not len(eigen[0]):  # contacts at rest hold all states
        return StateModes(*eigen, None, np.zeros((0, 1 + len(rates) + speeds.size), complex))
    every = np.concatenate([[0.0], rates])
    acts = ModalLoads(
        every,
        speeds,
        np.column_stack([piece.constant, piece.driven]),
        gaps.matrix,
        gaps.constant,
        float(max(np.abs(eigen[0]).max(), np.abs(every).max())),
        fastest,
    )
    known = {} if known is None else known
    if acts.scale not in known:
        whole = both_of_each_pair(eigen)
        parts = whole[2] @ acts.loads
        always = bool(_always_together(*whole, parts, acts).any())
        known[acts.scale] = parts[: len(eigen[0])], always or len(eigen[0]) > most
    parts, together = known[acts.scale]
    if not (together or _driven_together(eigen[0], parts, acts).any()):
        return StateModes(*eigen, None, _answers(*eigen[:2], parts, acts))
    spaces, whole = _parted(piece.matrix, acts, most)
    eigen = one_of_each_pair(whole)
    answers = _answers(*eigen[:2], eigen[2] @ acts.loads, acts)
    if not spaces:  # states that the equations keep apart aren't mixed any more
        return StateModes(*eigen, None, answers)
    return StateModes(*eigen, *block_of(spaces, acts, answers))


def spread_over(modes: StateModes, free: Constrained, drives: int) -> StateModes:
    """Modes of the states that contacts at rest allow as modes of all states; number of harmonic
    drives.
    """
    states, harmonic = len(free.spread), 1 + drives
    courses = free.base.shape[1] - harmonic
    inverse = np.zeros((len(modes.values), states), complex)
    inverse[:, free.kept] = modes.inverse
    answers = free.spread @ modes.answers
    answers[:, :harmonic] += free.base[:, :harmonic]
    if courses:
        terms = (answers.shape[1] - harmonic) // courses
        answers[:, harmonic::terms] += free.base[:, harmonic:]
    block = modes.block
    if block is not None:
        left = np.zeros((len(block.matrix), states))
        left[:, free.kept] = block.left
        block = replace(block, right=free.spread @ block.right, left=left)
    return StateModes(modes.values, free.spread @ modes.vectors, inverse, block, answers)


def _together(
    values: np.ndarray, vectors: np.ndarray, inverse: np.ndarray, acts: ModalLoads
) -> np.ndarray:
    """True for modes that don't go their own ways: bool[M]."""
    parts = inverse @ acts.loads
    always = _always_together(values, vectors, inverse, parts, acts)
    together: np.ndarray = always | _driven_together(values, parts, acts)
    return together


def _driven_together(values: np.ndarray, parts: np.ndarray, acts: ModalLoads) -> np.ndarray:
    """True for modes that a drive comes too near to, bool[M]; loads on them, complex128[M, ..]."""
    found, sizes = near_drives(values, parts, acts.rates), np.abs(values)
    for course, part in zip(acts.speeds, parts.T[len(acts.rates) :], strict=True):
        found |= (part != 0) & (loss_of(course, sizes, acts.scale) >= MOST_LOSS_OF_TWO)
    return found


def near_drives(values: np.ndarray, parts: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """True for modes that a harmonic drive comes too near to, bool[M]: rates of the constant and
    the drives.
    """
    found, sizes = np.zeros(len(values), bool), np.abs(values)
    for rate, part in zip(rates[1:], parts.T[1:], strict=False):
        far = np.minimum(np.abs(1j * rate - values), np.abs(1j * rate + values))
        found |= (part != 0) & (MOST_LOSS * far <= np.maximum(abs(rate), sizes))
    return found


def _always_together(
    values: np.ndarray,
    vectors: np.ndarray,
    inverse: np.ndarray,
    parts: np.ndarray,
    acts: ModalLoads,
) -> np.ndarray:
    """True for modes that don't go their own ways whatever the rates of the drives, bool[M]."""
    # sum_i |L_ji V_ij|: what rounding of the states is multiplied by, in any units of theirs
    found: np.ndarray = ~((np.abs(inverse.T) * np.abs(vectors)).sum(axis=0) <= MOST_LOSS)
    found |= values.real > NO_GROWTH * acts.scale
    sizes = np.abs(values)
    slow = MOST_SPREAD * sizes <= acts.scale
    found |= slow & (slow.sum() > 1)
    # a force that is constant moves a slow mode far before it is balanced
    with np.errstate(all="ignore"):
        static = np.abs(acts.gaps @ vectors * (parts[:, 0] / values))
    known = np.where(np.isfinite(static), static, 0.0)
    others = known @ (sizes[:, None] > 1.5 * sizes) + np.abs(acts.offsets)[:, None]
    zero = sizes <= ROUNDING * acts.scale
    far_off = (static > MOST_LOSS * others).any(axis=0) | zero
    slow = zero | (sizes < max(acts.scale / MOST_LOSS_OF_TWO, acts.fastest / MOST_LOSS))
    found |= (parts[:, 0] != 0) & far_off & slow
    return found


def _answers(
    values: np.ndarray, vectors: np.ndarray, parts: np.ndarray, acts: ModalLoads
) -> np.ndarray:
    """Steady answers of modes that go their own ways, one of each pair, by the loads on them
    complex128[M, ..]: complex128[N, 1 + D + K * C].
    """
    harmonic = len(acts.rates)
    weights = weights_of(values, np.tile(parts[:, :harmonic], 2), both_ways(acts.rates))
    answers = answers_of(vectors, weights)
    with np.errstate(all="ignore"):
        # -A^-(k+1) B of the k-th derivative
        powers = -((1 / values[:, None]) ** np.arange(1, acts.speeds.shape[1] + 1))
        powers[values.imag > 0] *= 2
        courses = [
            (vectors @ np.where(part[:, None] == 0, 0, part[:, None] * powers)).real
            for part in parts.T[harmonic:]
        ]
    return np.concatenate([answers, *courses], axis=1)


def both_ways(rates: np.ndarray) -> np.ndarray:
    """Rates of drives, then those of their conjugates, float64[2 D]."""
    return np.concatenate([rates, -rates])


def weights_of(values: np.ndarray, parts: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Amplitudes of the modes in their steady answers, parts / (i rate - value): complex128[M, R].

    The conjugates of modes answer a drive as the modes answer its conjugate, so that of each pair
    one is enough. Each number is made by itself, in the same operations wherever it stands: contact
    states may be made together or one by one.

    Parameters
    ----------
    values : complex128[M]
        Eigenvalues, one of each pair [1/s].
    parts : complex128[M, R]
        Loads on the modes.
    rates : float64[R]
        As of :func:`both_ways` [rad/s].
    """
    with np.errstate(all="ignore"):
        result = np.where(parts == 0, 0, parts / (1j * rates - values[:, None]))
    result[values.imag <= 0, len(rates) // 2 :] = 0
    return np.asarray(result)


def answers_of(vectors: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Answers of the states, complex128[N, R/2], by those of modes as of :func:`weights_of`."""
    both = vectors @ weights
    half = both.shape[1] // 2
    return np.asarray(both[:, :half] + both[:, half:].conj())


def answers_at(
    eigen: list[Eigen], loads: list[np.ndarray], rates: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Steady answers of k contact states at some rates of the constant and the drives, as
    :func:`modes_of` gives them to each by itself: complex128[k, N, 1 + D]. Before them, which of
    the states keep their modes apart there, bool[k].
    """
    ends = np.cumsum([len(values) for values, *_ in eigen])[:-1]
    values, parts = np.concatenate([values for values, *_ in eigen]), np.concatenate(loads)
    near = np.split(near_drives(values, parts, rates), ends)
    weights = np.split(weights_of(values, np.tile(parts, 2), both_ways(rates)), ends)
    answers = [answers_of(one[1], own) for one, own in zip(eigen, weights, strict=True)]
    return np.array([not one.any() for one in near]), np.array(answers)


# -- parting -----------------------------------------------------------------------------------
def _parted(matrix: np.ndarray, acts: ModalLoads, most: int) -> tuple[list[Subspace], Eigen]:
    """Subspaces whose modes go together, and the other modes. States that the equations keep apart
    stay apart: a rigid body isn't rounded by the stiffest mode.
    """
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(matrix != 0, directed=False)
    size, spaces, found = len(matrix), list[Subspace](), list[Eigen]()
    members = [np.flatnonzero(part == one) for one in range(count)]
    eigen = [eigen_of(matrix[np.ix_(one, one)]) for one in members]
    joined = [_together(*e, acts.of(one)) for e, one in zip(eigen, members, strict=True)]
    _make_room([e[0] for e in eigen], joined, most)
    for one, (values, *_), go in zip(members, eigen, joined, strict=True):
        space, modes = _split(matrix[np.ix_(one, one)], values, go, acts.of(one))
        if space is not None:
            right, left = np.zeros((size, len(space.matrix))), np.zeros((len(space.matrix), size))
            right[one], left[:, one] = space.right, space.left
            spaces.append(Subspace(space.matrix, right, left))
        vectors = np.zeros((size, len(modes[0])), complex)
        inverse = np.zeros((len(modes[0]), size), complex)
        vectors[one], inverse[:, one] = modes[1], modes[2]
        found.append((modes[0], vectors, inverse))
    return spaces, (
        np.concatenate([one[0] for one in found]),
        np.concatenate([one[1] for one in found], axis=1),
        np.concatenate([one[2] for one in found]),
    )


def _make_room(values: list[np.ndarray], joined: list[np.ndarray], most: int) -> None:
    """Let the slowest modes go together if there are more than the lanes hold."""
    left = sum(len(slots_of(v[~go])) for v, go in zip(values, joined, strict=True)) - most
    order = sorted(
        (abs(v[j]), c, j)
        for c, (v, go) in enumerate(zip(values, joined, strict=True))
        for j in slots_of(v)
        if not go[j]
    )
    for _, c, j in order[: max(left, 0)]:
        joined[c][j] = True


def _split(
    matrix: np.ndarray, values: np.ndarray, joined: np.ndarray, acts: ModalLoads
) -> tuple[Subspace | None, Eigen]:
    """A matrix as a subspace whose modes go together and the other modes."""
    while True:
        joined = _closed(values, joined)
        space, modes = _separated(matrix, values, joined)
        again = _together(*modes, acts)
        if not again.any():
            return space, modes
        for value in modes[0][again]:
            free = np.flatnonzero(~joined)
            joined[free[np.argmin(np.abs(values[free] - value))]] = True


def _closed(values: np.ndarray, joined: np.ndarray) -> np.ndarray:
    """With each mode its complex partner, and those whose eigenvalues nearly coincide with it."""
    sizes = np.maximum(np.abs(values)[:, None], np.abs(values))
    apart = np.abs(values[:, None] - values)
    near = MOST_LOSS * np.minimum(apart, np.abs(values[:, None] - values.conj())) <= sizes
    while True:
        grown: np.ndarray = joined | near[:, joined].any(axis=1)
        if (grown == joined).all():
            return grown
        joined = grown


def _separated(
    matrix: np.ndarray, values: np.ndarray, joined: np.ndarray
) -> tuple[Subspace | None, Eigen]:
    """The invariant subspace of some eigenvalues, and the modes of the others, by an ordered Schur
    form and a Sylvester equation (Bavely & Stewart, SIAM J. Numer. Anal. 16 (1979) 359).
    """
    from scipy import linalg

    size = len(matrix)
    none = (np.zeros(0, complex), np.zeros((size, 0), complex), np.zeros((0, size), complex))
    if not joined.any():
        return None, eigen_of(matrix)
    even, (scale, _) = linalg.matrix_balance(matrix, permute=False, separate=True)
    if joined.all():
        return Subspace(even, np.diag(scale), np.diag(1 / scale)), none

    def chosen(real: float, imaginary: float = 0.0) -> bool:
        return bool(joined[np.argmin(np.abs(values - (real + 1j * imaginary)))])

    try:
        schur, turn, k = linalg.schur(even, output="real", sort=chosen)
    except linalg.LinAlgError:  # rounding brought an eigenvalue to the other side
        return Subspace(even, np.diag(scale), np.diag(1 / scale)), none
    if not 0 < k < size:
        return Subspace(even, np.diag(scale), np.diag(1 / scale)), none
    mixed = linalg.solve_sylvester(schur[:k, :k], -schur[k:, k:], -schur[:k, k:])
    own, within, back = eigen_of(schur[k:, k:])
    right = scale[:, None] * turn[:, :k]
    left = (turn[:, :k].T - mixed @ turn[:, k:].T) / scale
    vectors = scale[:, None] * (turn[:, :k] @ mixed + turn[:, k:]) @ within
    inverse = back @ turn[:, k:].T / scale
    every, lefts = np.hstack([right, vectors]), np.vstack([left, inverse])
    lefts = lefts + lefts @ (np.eye(size) - every @ lefts)
    return Subspace(schur[:k, :k], right, lefts[:k].real), (own, vectors, lefts[k:])
