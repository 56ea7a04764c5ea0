"""States and outputs of motions, with their derivatives with respect to parameters and starts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.derivatives.carried import CarriedDerivatives, Places
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.starts import Ensemble
from saltus.language.derivatives import differentiate, time_derivative
from saltus.language.expression import TIME, Expr, parameter, state
from saltus.system import System


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Readings of the motions of a flow that carries derivatives: K states and outputs.

    Attributes
    ----------
    system : System
        The equations with their outputs.
    flow : CarriedDerivatives
        Its columns are C: the starts, then the parameters.
    group : Ensemble
        The trajectories.
    """

    system: System
    flow: CarriedDerivatives
    group: Ensemble

    def values(self, at: Places, mode: np.ndarray | None = None) -> np.ndarray:
        """States and outputs, float64[m, K], in the mode there or in another one."""
        return outputs_of(self.system).values(
            at.time,
            at.states,
            self.flow.parameters(self.group, at.trajectory),
            at.mode if mode is None else mode,
        )

    def slopes(
        self, at: Places, moved: np.ndarray | None = None, mode: np.ndarray | None = None
    ) -> np.ndarray:
        """Their derivatives, float64[m, K, C]; along places whose times have the derivatives
        ``moved`` float64[m, C].
        """
        outputs, names = outputs_of(self.system), self.flow.names
        leaves = [*map(state, self.system.states), *map(parameter, names), TIME]
        known = self.flow.parameters(self.group, at.trajectory)
        rate = np.zeros((len(at.time), 0)) if moved is None else self.flow.rates(at, self.group)
        states = at.slopes if moved is None else at.slopes + rate[..., None] * moved[:, None]
        if not outputs.formulas:
            return states
        size, columns = at.states.shape[1], at.slopes.shape[2]
        parts = tuple(slope_of(one, leaf) for one in outputs.formulas for leaf in leaves)
        named = (*self.system.states, *map(str, range(len(parts))))
        gradients = (
            replace(outputs, names=named, formulas=parts)
            .values(at.time, at.states, known, at.mode if mode is None else mode)[:, size:]
            .reshape(len(at.time), len(outputs.formulas), len(leaves))
        )
        own = np.einsum("mki,mic->mkc", gradients[..., :size], states)
        own[..., columns - len(names) :] += gradients[..., size:-1]
        if moved is not None:
            own += gradients[..., -1:] * moved[:, None]
        return np.concatenate([states, own], axis=1)


def slope_of(formula: Expr, leaf: Expr) -> Expr:
    """Derivative of a formula with respect to a state, a parameter or the time."""
    return time_derivative(formula) if leaf is TIME else differentiate(formula, leaf)
