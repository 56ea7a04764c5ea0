"""All equilibria of a piecewise smooth system: in each region, on boundaries, and held by contacts.

In each mode - a side of every boundary, and which contacts are held - the field is smooth, and
Newton's method looks for its zeros from many starts, known ones deflated. A zero counts where the
mode holds: those on the other side are virtual. Where contacts are held the zeros are those of the
reduced field on the boundary (pseudo-equilibria), isolated or an interval of them (a block that is
stuck); its ends are where a contact is released. di Bernardo, Budd, Champneys & Kowalczyk,
Piecewise-smooth Dynamical Systems (2008), section 2.2; deflation: Farrell, Birkisson & Funke, SIAM
J. Sci. Comput. 37 (2015) A2026-A2045.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.analysis.closed.mode_zeros import ModeEquations, near
from saltus.analysis.solve.tolerances import RANK
from saltus.contact.guards import Guard, Law, is_hold
from saltus.errors import ParameterError
from saltus.language.derivatives import gradient
from saltus.language.expression import Expr
from saltus.system import System, margin_gaps

#: Modes that are looked at; each boundary doubles them.
MOST_MODES = 1024
#: Share of its terms below which a gap is zero.
ON = 1e-10
#: Share of the terms that the scale would make, likewise.
ON_SCALE = 1e-13
#: Parts of eigenvalues below this share of the largest eigenvalue are zero.
NEUTRAL = 1e-12


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium, or a continuum of them.

    Attributes
    ----------
    state : float64[D]
        Where it is; of a continuum one of them, that without a contact force if there is one.
    mode : tuple of bool
        Side of each guard.
    place : str
        ``region``; ``boundary`` where a gap vanishes too; ``pseudo`` where contacts are held.
    kind : str
        ``node``, ``focus``, ``saddle``, ``saddle_focus``, ``center``, ``degenerate``;
        ``continuum``; ``undecided`` on a boundary, where linear parts decide nothing.
    stable : bool
        Whether it attracts; of a continuum whether all of it does.
    contacts : tuple of int
        Guards whose contacts are held, or whose gap vanishes.
    dimension : int
        Of the continuum; 0 of an isolated equilibrium.
    eigenvalues : complex128[D]
        Of the linear part on the boundaries that hold it [1/s], the largest real part first; NaN
        across them.
    ends : float64[2, D]
        First and last state of an interval of equilibria; of an isolated one itself twice; NaN
        where it doesn't end.
    margin : float
        Distance to the nearest other boundary [unit of the gap]; inf without one.
    """

    state: np.ndarray
    mode: tuple[bool, ...]
    place: str
    kind: str
    stable: bool
    contacts: tuple[int, ...]
    dimension: int
    eigenvalues: np.ndarray
    ends: np.ndarray
    margin: float


def all_equilibria(system: System, starts: np.ndarray, scale: np.ndarray) -> list[Equilibrium]:
    """The equilibria of a system without forcing.

    Parameters
    ----------
    system : System
        Equations and values.
    starts : float64[k, D]
        Where Newton's method begins, in every mode.
    scale : float64[D]
        Size of each state.
    """
    found: list[Equilibrium] = []
    continua: list[ModeEquations] = []
    for mode in _modes(system.guards):
        piece = ModeEquations(system, mode, scale)
        equilibria: list[Equilibrium] = []
        for state in piece.zeros(starts):
            equilibrium = _equilibrium(piece, state)
            if equilibrium is None:
                continue
            if equilibrium.dimension and equilibrium.place != "boundary":
                continua.append(piece)
                equilibria = [equilibrium]  # one of a continuum says all
                break
            if not (equilibrium.dimension and equilibria):
                equilibria.append(equilibrium)
        found += [one for one in equilibria if not any(_same(one, other, scale) for other in found)]
    edges = [  # where a continuum ends it is found from beyond too
        any(piece.vanishes(one.state) for piece in continua) and one.place == "boundary"
        for one in found
    ]
    kept = [one for one, edge in zip(found, edges, strict=True) if not edge]
    return sorted(kept, key=lambda one: tuple(np.round(one.state / scale, 9)))


def _modes(guards: Sequence[Guard]) -> list[tuple[bool, ...]]:
    """Every mode that a motion can be in: sides of the boundaries, and contacts that are held."""
    options: list[tuple[tuple[bool, bool], ...]] = []
    for guard in guards:
        law = guard.law
        if is_hold(guard):
            continue
        free: tuple[tuple[bool, bool], ...] = ((False, False), (True, False))
        if law is not None and law.kind == "impact":
            free = ((law.side > 0, False),)
        options.append((*free, (False, True)) if law is not None and law.partner >= 0 else free)
    if np.prod([float(len(one)) for one in options]) > MOST_MODES:
        raise ParameterError(
            lambda say: (
                f"{len(options)} boundaries make more than {MOST_MODES} modes, too many to "
                f"look for equilibria in each. Ask {say.verb('attractors')} for those that attract."
            )
        )
    owners = [number for number, guard in enumerate(guards) if not is_hold(guard)]
    modes = []
    for choice in itertools.product(*options):
        bits = [False] * len(guards)
        for owner, (side, held) in zip(owners, choice, strict=True):
            law = guards[owner].law
            bits[owner] = side
            if held and law is not None:
                bits[law.partner] = True
        modes.append(tuple(bits))
    return modes


def _equilibrium(piece: ModeEquations, state: np.ndarray) -> Equilibrium | None:
    """The equilibrium at a zero of the field; None where the mode doesn't hold."""
    state = piece.cleaned(state)
    touched, margin = [], np.inf
    counted, _ = margin_gaps(piece.system)
    for number, guard in piece.free():
        gap, noise = _gap(piece, guard.gap, state)
        if abs(gap) <= noise:
            touched.append(number)
        elif (gap > 0) != piece.mode[number]:
            return None
        if number in counted:
            margin = min(margin, abs(gap))
    releases, attracts = [], True
    for owner in piece.held:
        law = piece.law(owner)
        holds, firm = _holds(piece, law, state)
        if not holds:
            return None
        if not firm:
            releases.append(owner)
        attracts &= _attracts(piece, law, state)
    dimension = len(piece.along(state))
    eigenvalues = _eigenvalues(piece, state)
    kind, stable = _named(eigenvalues, dimension)
    if touched or releases:
        kind, stable = "undecided", False
    place = "boundary" if touched or releases else "pseudo" if piece.held else "region"
    ends = piece.ends(state) if dimension else np.stack([state, state])
    missing = np.full(len(state) - len(eigenvalues), np.nan + 0j)
    return Equilibrium(
        state + 0.0,
        piece.mode,
        place,
        kind,
        stable and attracts,
        (*piece.held, *touched),
        dimension,
        np.append(eigenvalues, missing),
        ends,
        margin,
    )


def _gap(piece: ModeEquations, gap: Expr, state: np.ndarray) -> tuple[float, float]:
    """A gap, and what rounding and Newton's method leave of it."""
    slopes = np.array([piece.one(one, state) for one in gradient(gap, piece.system.states)])
    noise = np.abs(slopes) @ (ON * np.abs(state) + ON_SCALE * piece.scale)
    return piece.one(gap, state), float(noise)


def _holds(piece: ModeEquations, law: Law, state: np.ndarray) -> tuple[bool, bool]:
    """True where a contact is held at the equilibrium, not just about to be released."""
    assert law.drive is not None
    assert law.pivot is not None
    drive, pivot = piece.one(law.drive, state), piece.one(law.pivot, state)
    _, noise = _gap(piece, law.drive, state)
    limit = 1.0 if law.limit is None else piece.one(law.limit, state)
    room = drive if law.kind == "impact" else abs(limit * pivot) - abs(drive)
    noise += 0.0 if law.kind == "impact" else ON * abs(limit * pivot)
    return room >= -noise, room > noise


def _attracts(piece: ModeEquations, law: Law, state: np.ndarray) -> bool:
    """True where motions near a held contact come to it."""
    if law.kind == "impact":
        return law.restitution is None or piece.one(law.restitution, state) < 1.0
    assert law.pivot is not None
    return piece.one(law.pivot, state) < 0


def _eigenvalues(piece: ModeEquations, state: np.ndarray) -> np.ndarray:
    """Of the linear part along the boundaries that hold the motion [1/s], the largest real part
    first.
    """
    size = len(state)
    matrix = piece.at([one for row in piece.slopes for one in row], state[None])
    matrix = matrix.reshape(-1, size) * piece.scale
    matrix[:size] /= piece.scale[:, None]
    normals, frame = matrix[size:], np.eye(size)
    if len(normals):
        _, singular, right = np.linalg.svd(normals)
        frame = right[np.count_nonzero(singular > RANK * singular.max()) :].T
    eigenvalues = np.linalg.eigvals(frame.T @ matrix[:size] @ frame) + 0j
    largest = np.abs(eigenvalues).max(initial=0.0)
    eigenvalues.real[np.abs(eigenvalues.real) <= NEUTRAL * largest] = 0.0
    eigenvalues.imag[np.abs(eigenvalues.imag) <= NEUTRAL * largest] = 0.0
    return np.asarray(eigenvalues[np.lexsort((-eigenvalues.imag, -eigenvalues.real))])


def _named(eigenvalues: np.ndarray, dimension: int) -> tuple[str, bool]:
    """The kind of an equilibrium, and whether its linear part is stable: by the eigenvalues, but
    for those along a continuum.
    """
    across = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")[dimension:]]
    stable = bool((across.real < 0).all())
    if dimension:
        return "continuum", stable
    grows, turns = across.real > 0, across.imag != 0
    if (across.real == 0).any():
        return "center" if (turns | (across.real != 0)).all() else "degenerate", False
    if grows.any() and not grows.all():
        return "saddle_focus" if turns.any() else "saddle", False
    return "focus" if turns.any() else "node", stable


def _same(a: Equilibrium, b: Equilibrium, scale: np.ndarray) -> bool:
    """True where two finds are one equilibrium: on a boundary it belongs to both sides."""
    return near(a.state, b.state, scale) and (
        a.mode == b.mode or ("boundary" in (a.place, b.place) and a.dimension == b.dimension)
    )
