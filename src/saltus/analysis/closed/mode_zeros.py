"""The smooth equations of one mode of a system without forcing, and where they vanish: by Newton's
method from many starts, with deflation.

Of a held contact the constraint vanishes too, so there are more equations than unknowns, and where
the field leaves a state free (a block that is stuck) a continuum of zeros: steps are least-squares
steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.analysis.solve.newton import newton
from saltus.analysis.solve.tolerances import RANK
from saltus.contact.guards import Guard, Law, is_hold
from saltus.language import assuming
from saltus.language import expression as ex
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, depends_on
from saltus.system import System

#: Rounds of deflation.
ROUNDS = 8
#: Starts of each round but the first.
DEFLATED_STARTS = 64
#: Zeros of one mode from which deflation finds more at its own pace only: a field may have no end
#: of them.
MANY = 32
#: Deflated rounds begin beside what was found too, so far away in units of the scale.
ASIDE = 0.1
#: Longest step of Newton's method, in units of the scale.
LONGEST_STEP = 1e8
#: Distance of equal zeros, relative to the states and to the scale.
SAME = 1e-7
#: Size of a residual that vanishes, relative to the terms of its linear part.
RESIDUAL = 1e-9
#: States below this share of the scale may be zeros but for rounding.
ROUNDED = 1e-12


class ModeEquations:
    """The smooth equations of one mode, and their zeros.

    Attributes
    ----------
    entries : tuple of Expr
        What vanishes at an equilibrium: the field, and the constraints of held contacts.
    constraints : int
        How many of them are constraints.
    """

    def __init__(self, system: System, mode: tuple[bool, ...], scale: np.ndarray) -> None:
        self.system, self.mode, self.scale = system, mode, scale
        self.held = [
            guard.law.partner
            for number, guard in enumerate(system.guards)
            if mode[number] and guard.law is not None and is_hold(guard)
        ]
        constraints: list[Expr] = []
        for owner in self.held:
            law = self.law(owner)
            constraints += [law.constraint] if law.constraint is not None else []
            constraints += [system.guards[owner].gap] if law.kind == "impact" else []
        self.constraints = len(constraints)
        self.entries = tuple(self.here(one) for one in (*system.field, *constraints))
        self.slopes = tuple(gradient(one, system.states) for one in self.entries)

    def law(self, owner: int) -> Law:
        """The law of a guard that has one."""
        law = self.system.guards[owner].law
        if law is None:
            raise ValueError(f"guard {owner} has no law")
        return law

    def here(self, entry: Expr) -> Expr:
        """An expression as it is in this mode."""
        for number, side in enumerate(self.mode):
            entry = assuming(entry, number, side)
        return entry

    # -- zeros -------------------------------------------------------------------------------------
    def zeros(self, starts: np.ndarray) -> list[np.ndarray]:
        """States at which the field of this mode vanishes, whether the mode holds there or not;
        some of a continuum, that without a contact force first.
        """
        linear = not any(depends_on(one, ("state",)) for row in self.slopes for one in row)
        found: list[np.ndarray] = []
        for number in range(1 if linear else ROUNDS):
            begin = starts[: 1 if linear else DEFLATED_STARTS if number else None]
            beside = [one + far * self.scale for one in found for far in (ASIDE, -ASIDE)]
            begin = np.concatenate([begin, np.reshape(beside, (-1, len(self.scale)))])
            before = len(found)
            solved = self._solve(self.entries, self.slopes, begin, found)
            if any(len(self.along(state)) for state in solved):
                others = self._solve(self.entries, self.slopes, starts[:DEFLATED_STARTS])
                return [*(self._closest(one, self._drives(), one) for one in solved[:1]), *others]
            for state in solved:
                if not any(near(state, one, self.scale) for one in found):
                    found.append(state)
            if len(found) == before or len(found) > MANY:
                break
        return found

    def _solve(
        self,
        entries: Sequence[Expr],
        slopes: Sequence[Sequence[Expr]],
        start: np.ndarray,
        known: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Zeros float64[m, D] of expressions by Newton's method from float64[k, D], those that are
        known deflated.
        """

        def equations(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return self._equilibrated(entries, slopes, x)

        zeros = newton(
            equations,
            start,
            np.broadcast_to(self.scale, start.shape),
            longest_step=LONGEST_STEP,
            least_squares=True,
            known=np.array(known) if len(known) else None,
        )
        x = zeros.z[zeros.found]
        residual, derivative = self._equilibrated(entries, slopes, x)
        with np.errstate(invalid="ignore", over="ignore"):
            reach = 1.0 + np.abs(x / self.scale)
            terms = np.einsum("kij,kj->ki", np.abs(derivative), reach)
            good = (np.abs(residual) <= RESIDUAL * np.maximum(terms, 1.0)).all(axis=1)
        return np.asarray(x[good & np.isfinite(derivative).all(axis=(1, 2))])

    def _equilibrated(
        self, entries: Sequence[Expr], slopes: Sequence[Sequence[Expr]], x: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Expressions and their derivatives with respect to x/scale, each row divided by its
        largest derivative.
        """
        derivative = self.at([one for row in slopes for one in row], x)
        derivative = derivative.reshape(len(x), len(entries), len(self.scale)) * self.scale
        with np.errstate(all="ignore"):
            largest = np.abs(derivative).max(axis=2, initial=0.0)
            largest = np.where(largest > 0, largest, 1.0)
            return self.at(entries, x) / largest, derivative / largest[:, :, None]

    def at(self, entries: Sequence[Expr], x: np.ndarray) -> np.ndarray:
        """Expressions at states float64[k, D], float64[k, len(entries)]."""
        states = dict(zip(self.system.states, x.T, strict=True))
        columns = evaluate(entries, states=states, values=self.system.values, bits=self.mode)
        return np.stack([np.broadcast_to(one, len(x)) for one in columns], axis=1).astype(float)

    def one(self, entry: Expr, state: np.ndarray) -> float:
        """An expression at a state."""
        return float(self.at([entry], state[None])[0, 0])

    def vanishes(self, state: np.ndarray) -> bool:
        """True where a state is a zero."""
        return self._residual(state) <= RESIDUAL * (1.0 + float(np.abs(state / self.scale).max()))

    def _residual(self, state: np.ndarray) -> float:
        return float(np.abs(self._equilibrated(self.entries, self.slopes, state[None])[0]).max())

    def cleaned(self, state: np.ndarray) -> np.ndarray:
        """The state with zeros in place of rounding, where these fit as well."""
        zeroed = np.where(np.abs(state) <= ROUNDED * self.scale, 0.0, state)
        return zeroed if self._residual(zeroed) <= self._residual(state) else state

    # -- continua ----------------------------------------------------------------------------------
    def along(self, state: np.ndarray) -> np.ndarray:
        """Directions float64[dimension, D], in units of the scale, in which all stays zero to first
        order.
        """
        _, derivative = self._equilibrated(self.entries, self.slopes, state[None])
        _, singular, right = np.linalg.svd(derivative[0])
        return np.asarray(right[np.count_nonzero(singular > RANK * singular.max()) :])

    def _drives(self) -> list[Expr]:
        laws = [self.law(owner) for owner in self.held]
        return [
            self.here(one.drive) for one in laws if one.drive is not None and one.kind == "surface"
        ]

    def _closest(
        self, state: np.ndarray, more: Sequence[Expr], otherwise: np.ndarray
    ) -> np.ndarray:
        """The equilibrium near a state at which more expressions vanish, if there is one."""
        slopes = [gradient(one, self.system.states) for one in more]
        found = self._solve((*self.entries, *more), (*self.slopes, *slopes), state[None])
        return np.asarray(found[0] if len(found) else otherwise)

    def ends(self, state: np.ndarray) -> np.ndarray:
        """The ends float64[2, D] of the interval of equilibria about a state: where a contact is
        released, or another boundary is met.
        """
        ends = np.full((2, len(state)), np.nan)
        along = self.along(state)
        if len(along) != 1:
            return ends
        limits: list[Expr] = [self.here(guard.gap) for number, guard in self.free()]
        for owner in self.held:
            law = self.law(owner)
            assert law.drive is not None
            force = ex.constant(0.0)
            if law.limit is not None and law.pivot is not None:
                force = ex.mul(law.limit, law.pivot)
            limits += [self.here(ex.sub(law.drive, force)), self.here(ex.add(law.drive, force))]
        nearest = np.array([-np.inf, np.inf])
        for limit in limits:
            end = self._closest(state, [limit], np.full(len(state), np.nan))
            far = float(along[0] @ ((end - state) / self.scale))
            if nearest[0] < far < 0:
                nearest[0], ends[0] = far, end
            elif 0 < far < nearest[1]:
                nearest[1], ends[1] = far, end
        return ends if along[0][np.argmax(np.abs(along[0]))] > 0 else ends[::-1]

    def free(self) -> list[tuple[int, Guard]]:
        """The boundaries on one side of which this mode is."""
        return [
            (number, guard)
            for number, guard in enumerate(self.system.guards)
            if not is_hold(guard) and number not in self.held
        ]


def near(a: np.ndarray, b: np.ndarray, scale: np.ndarray) -> bool:
    """True where two states are equal but for the errors of Newton's method."""
    return bool((np.abs(a - b) <= SAME * np.maximum(scale, np.abs(a))).all())
