"""The block of a contact state: modes that don't go their own ways, and the drives near them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from saltus.flow.modal_eigen import ROUNDING

#: Most that rounding may be multiplied by: 2^10 * 2.2e-16 = 2.3e-13 of the motion.
MOST_LOSS = 2.0**10
#: The same for each of two modes that coincide: their losses are multiplied.
MOST_LOSS_OF_TWO = 2.0**5
#: Least unit of a course's derivatives, in units of its steepest: the fifteenth has a number still.
LEAST_UNIT = 2.0**-40
#: Times that the slowest pair of modes may be slower than the fastest: its amplitudes hold speeds
#: over its rate, and its vectors rounding of the others.
MOST_SPREAD = 2.0**14


@dataclass(frozen=True)
class Block:
    """Modes that go together: v' = T v, z = R v, v = L z.

    Attributes
    ----------
    matrix : float64[K, K]
        T, with the drives among the amplitudes.
    right, left : float64[N, K], float64[K, N]
        R and L; zero for drives.
    drives : tuple of (int, int, float, float)
        Number of each drive in it (0: the constant 1; the harmonic ones; the courses), its first
        amplitude, its scale, and by what each derivative of a course is divided [1/s].
    limit : float
        alpha of kernels/modal/blocks.py [1/s].
    """

    matrix: np.ndarray
    right: np.ndarray
    left: np.ndarray
    drives: tuple[tuple[int, int, float, float], ...]
    limit: float


@dataclass(frozen=True)
class Subspace:
    """An invariant subspace: v' = T v."""

    matrix: np.ndarray
    right: np.ndarray
    left: np.ndarray


@dataclass(frozen=True)
class ModalLoads:
    """ModalLoads on the modes, and the gaps in which their answers matter.

    Attributes
    ----------
    rates : float64[1 + D]
        Of the constant, 0, and of the harmonic drives [rad/s].
    speeds : float64[C, K]
        Derivatives of the courses, in units of their values.
    loads : float64[N, 1 + D + C]
        Their factors in the equations.
    gaps, offsets : float64[G, N], float64[G]
        Rows and constants of the gaps.
    scale : float
        The fastest of rates and eigenvalues [rad/s].
    fastest : float
        The fastest eigenvalue of other contact states [rad/s].
    """

    rates: np.ndarray
    speeds: np.ndarray
    loads: np.ndarray
    gaps: np.ndarray
    offsets: np.ndarray
    scale: float
    fastest: float

    def of(self, states: np.ndarray) -> ModalLoads:
        """The same for some states."""
        return replace(self, loads=self.loads[states], gaps=self.gaps[:, states])


def loss_of(speeds: np.ndarray, sizes: np.ndarray, scale: float) -> np.ndarray:
    """The loss of modes in their answer to a course: slow ones don't follow its derivatives, and
    their motion is a small difference of large answers.
    """
    with np.errstate(all="ignore"):
        terms = (speeds[speeds > 0] / sizes[:, None] ** np.flatnonzero(speeds)).max(
            axis=1, initial=1.0
        )
        losses = terms * np.maximum(_speed(speeds) / sizes, 1.0) ** 2
    return np.array(np.where(sizes > ROUNDING * scale, losses, np.inf))


def block_of(
    spaces: list[Subspace], acts: ModalLoads, answers: np.ndarray
) -> tuple[Block, np.ndarray]:
    """The block of some subspaces and the drives near them; answers with those to the others."""
    first = np.cumsum([0, *(len(space.matrix) for space in spaces)])
    norm = max(np.abs(space.matrix).sum(axis=1).max() for space in spaces)
    size, harmonic = int(first[-1]), len(acts.rates)
    columns, drives = list[np.ndarray](), list[tuple[int, int, float, float]]()
    own = list[np.ndarray]()
    for d in range(acts.loads.shape[1]):
        column = np.zeros(first[-1])
        for space, at in zip(spaces, first, strict=False):
            load = space.left @ acts.loads[:, d]
            if load.any() and _is_near(d, np.linalg.eigvals(space.matrix), acts):
                column[at : at + len(load)] = load
            elif load.any():
                _answer(d, space, load, acts, answers)
        if column.any():
            speed = _unit_of(acts.speeds[d - harmonic], norm) if d >= harmonic else 1.0
            own.append(_generator(d, speed, acts))
            fastest = max(norm, np.abs(own[-1]).max())
            scale = np.abs(column).max() / fastest if fastest > 0 else 1.0
            drives.append((d, size, float(scale), speed))
            columns.append(column / scale)
            size += len(own[-1])
    matrix = np.zeros((size, size))
    for space, at in zip(spaces, first, strict=False):
        end = at + len(space.matrix)
        matrix[at:end, at:end] = space.matrix
    for column, generator, (_, at, _, _) in zip(columns, own, drives, strict=True):
        matrix[: len(column), at] = column
        matrix[at : at + len(generator), at : at + len(generator)] = generator
    states = len(answers)
    right, left = np.zeros((states, size)), np.zeros((size, states))
    right[:, : first[-1]] = np.hstack([space.right for space in spaces])
    left[: first[-1]] = np.vstack([space.left for space in spaces])
    return Block(matrix, right, left, tuple(drives), _limit(matrix)), answers


def _generator(drive: int, speed: float, acts: ModalLoads) -> np.ndarray:
    """Rates of a drive by itself: the constant; cosine and sine; a value and its derivatives."""
    if drive == 0:
        return np.zeros((1, 1))
    if drive < len(acts.rates):
        return np.array([[0.0, -1.0], [1.0, 0.0]]) * float(acts.rates[drive])
    return np.array(speed * np.eye(acts.speeds.shape[1], k=1))


def _speed(speeds: np.ndarray) -> float:
    """Rate of change of a course, that makes its derivatives as large as its values [1/s]."""
    return float(max(speeds[1], speeds[2] ** (1 / 2), speeds[3] ** (1 / 3)))


def _unit_of(speeds: np.ndarray, norm: float) -> float:
    """By what each derivative of a course is divided [1/s]: not more than the modes turn, for it
    limits the steps of slow pieces too. They end with the last derivative, so a piece that is far
    steeper needs no other unit.
    """
    fastest = _speed(speeds) or 1.0
    return min(fastest, max(norm, LEAST_UNIT * fastest))


def _is_near(drive: int, values: np.ndarray, acts: ModalLoads) -> bool:
    """True if a drive resonates with one of the modes of a subspace."""
    sizes, harmonic = np.abs(values), len(acts.rates)
    scale = max(acts.scale, acts.fastest)
    if drive >= harmonic:
        losses = loss_of(acts.speeds[drive - harmonic], sizes, scale)
        return bool((losses >= MOST_LOSS_OF_TWO).any())
    rate = float(acts.rates[drive])
    far = scale if drive == 0 else np.maximum(abs(rate), sizes)
    return bool((MOST_LOSS_OF_TWO * np.abs(1j * rate - values) <= far).any())


def _answer(
    drive: int, space: Subspace, load: np.ndarray, acts: ModalLoads, answers: np.ndarray
) -> None:
    """Add the steady answer of a subspace to a drive to `answers`."""
    harmonic = len(acts.rates)
    if drive < harmonic:
        away = 1j * acts.rates[drive] * np.eye(len(load)) - space.matrix
        answers[:, drive] += space.right @ np.linalg.solve(away, load)
        return
    terms = acts.speeds.shape[1]
    for k in range(terms):
        load = np.linalg.solve(space.matrix, load) * (-1.0 if k == 0 else 1.0)
        answers[:, harmonic + terms * (drive - harmonic) + k] += space.right @ load


def _limit(matrix: np.ndarray) -> float:
    """alpha with ||T^k|| <= alpha^k for all k > 11 [1/s]: 0 for motions that are polynomials."""
    if not np.linalg.matrix_power(matrix, 12).any():
        return 0.0
    fourth = np.linalg.matrix_power(matrix, 4)
    norms = [np.abs(one).sum(axis=1).max() for one in (fourth, fourth @ matrix)]
    return float(max(norms[0] ** 0.25, norms[1] ** 0.2))


def table_of(
    block: Block | None, coordinates: int, gaps: np.ndarray, lanes: int, state_groups: int
) -> Iterator[np.ndarray]:
    """The table of a block, as kernels/modal/blocks.py reads it; rows of gaps float64[R, N]."""
    if block is None:
        yield np.array([0.0, 0.0, 0.0, coordinates])
        return
    size, states = len(block.matrix), len(block.right)
    groups, count = -(-size // lanes), lanes * state_groups
    width = lanes * groups
    matrix, left = np.zeros((width, width)), np.zeros((width, count))
    right = np.zeros((count, width))
    matrix[:size, :size], left[:size, :states] = block.matrix, block.left
    right[:states, :size] = block.right
    rows = gaps @ right[:states]
    head = np.zeros((1 + len(block.drives), lanes))
    head[0, :3] = groups, block.limit, len(block.drives)
    head[1:, :4] = np.reshape(block.drives, (-1, 4))
    yield from (head[0], matrix.T, left.T, right.T, rows, rows @ matrix, head[1:])
