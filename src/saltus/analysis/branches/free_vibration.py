"""The equations of free vibrations without damping: a system whose forcing and damping are zero,
and the families of its periodic orbits.

Such orbits come in families, of which the amplitude is a parameter, and one of the equations that
close them follows from the others, since energy is conserved. A damping ``-d v`` of all velocities
makes the equations independent; d vanishes on the family. Munoz-Almaraz et al., Physica D 181
(2003) 1; Kerschen et al., Mech. Syst. Signal Process. 23 (2009) 170 (nonlinear normal modes).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.closed.field_zeros import autonomous, field_of, jacobian_of
from saltus.analysis.solve.newton import newton
from saltus.contact.guards import Guard
from saltus.errors import ParameterError
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.language import expression as ex
from saltus.language.expression import Expr
from saltus.sentences import Word
from saltus.system import System

#: Samples among which a first return is looked for.
SAMPLES = 1024
#: Periods of small vibrations within which a motion returns: where it rests on a contact, small
#: vibrations to its other side are slower.
LONGEST = 12.0
#: A mode vibrates if its decay is smaller than this share of its frequency.
UNDAMPED = 1e-6


def free_system(system: System) -> tuple[System, str]:
    """The system without those parameters that are zero, and with a damping d of all velocities;
    the name of that parameter.

    Raises
    ------
    ParameterError
        If its equations still depend on time, or no state is the velocity of another.
    """
    zeros = {ex.parameter(n): ex.constant(0.0) for n, value in system.values.items() if value == 0}
    field = [ex.substituted(entry, zeros) for entry in system.field]
    speeds = {entry.payload for entry in system.field if entry.op == "state"}
    if not speeds:
        raise ParameterError(
            lambda say: (
                f"{system.name} has no state that is the velocity of another: "
                f"{say.verb('backbone')} needs displacements x and velocities v with dx/dt = v."
            )
        )
    name = "fictitious_damping"
    drag = ex.parameter(name)
    for i, state in enumerate(system.states):
        if state in speeds:
            field[i] = ex.sub(field[i], ex.mul(drag, ex.state(state)))
    made = replace(
        system,
        field=tuple(field),
        guards=tuple(_guard(guard, zeros) for guard in system.guards),
        forced_at=None,
        values={**system.values, name: 0.0},
        units={**system.units, name: "1/s"},
        outputs=system.outputs.substituted(zeros),
    )
    if not autonomous(made):
        raise ParameterError(
            lambda say: (
                f"{system.name} is forced: its equations depend on time. Set the parameters of "
                f"its forcing, and of what damps, to zero by {say.key(values={Word('name'): 0})} - "
                f"it has {', '.join(system.values)} - or take {say.key(phase='quadrature')}."
            )
        )
    return made, name


def _guard(guard: Guard, new: Mapping[Expr, Expr]) -> Guard:
    """A boundary and its law with other nodes in the places of some."""

    def each(value: Any) -> Any:
        if isinstance(value, Expr):
            return ex.substituted(value, new)
        return tuple(map(each, value)) if isinstance(value, tuple) else value

    law = guard.law and replace(
        guard.law, **{one.name: each(getattr(guard.law, one.name)) for one in fields(guard.law)}
    )
    return replace(guard, gap=each(guard.gap), boundary=each(guard.boundary), law=law)


class FreeOrbits(PeriodicOrbits):
    """Periodic orbits that begin where a state passes its place of rest.

    Parameters
    ----------
    system, name
        From :func:`free_system`.
    scale : float64[1, z]
        Units of the points, the period and the damping.
    rest : float64[D]
        The place of rest.
    column : int
        The state.
    """

    def __init__(
        self,
        system: System,
        name: str,
        scale: np.ndarray,
        method: Method,
        rest: np.ndarray,
        column: int,
        threads: int | None = None,
    ) -> None:
        super().__init__(system, (name,), 1, scale, method, threads)
        self.phase[:, 0], self.phase[:, 1] = rest, np.eye(self.size)[column]
        self.rest, self.column = rest, column

    def first_return(self, start: np.ndarray, longest: float) -> tuple[float, np.ndarray]:
        """Time after which a motion from float64[D] first passes the place of rest again in the
        same direction, to a sample [s], NaN if it doesn't; and the largest magnitudes float64[D]
        on the way.
        """
        seen = self.sampled(start, longest)
        above = seen[:, self.column] > self.rest[self.column]
        back = np.flatnonzero(above[1:] & ~above[:-1] & (np.arange(SAMPLES - 1) > 0))
        if not len(back):
            return np.nan, np.full(self.size, np.nan)
        return float((back[0] + 1) / SAMPLES * longest), np.abs(seen[: back[0] + 1]).max(axis=0)

    def sampled(self, start: np.ndarray, time: float) -> np.ndarray:
        """A motion from float64[D] in equal steps over a time [s], float64[SAMPLES, D]."""
        begin = np.array([[*start, time, 0.0]])
        run = self.map.run(begin, 1, Schedule.even(1, SAMPLES))
        return np.asarray(run.samples[0][:, : self.size])

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """The condition on the phase stays."""


def equilibrium_near_zero(system: System) -> np.ndarray:
    """Locate an equilibrium, where the field vanishes, by Newton's method from zero."""
    values = {name: np.array([value]) for name, value in system.values.items()}
    zero, units = np.zeros((1, len(system.states))), np.ones((1, len(system.states)))
    size = np.abs(jacobian_of(system, zero, values)).max(axis=2)
    size = np.where(size > 0, size, 1.0)

    def equations(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return field_of(system, x, values) / size, jacobian_of(system, x, values) / size[..., None]

    found = newton(equations, zero, units, enough=0.0, longest_step=np.inf, least_squares=True)
    if not found.found[0]:
        raise ParameterError(
            f"no equilibrium of {system.name} was found from zero: a backbone begins with small "
            "vibrations about one."
        )
    return np.asarray(found.z[0])


def linear_mode(system: System, rest: np.ndarray, mode: int) -> tuple[float, np.ndarray, int]:
    """Period of a mode of small vibrations [s], its complex amplitudes complex128[D] in units of
    the largest displacement, which passes its rest at phase zero, and which state that is.
    """
    values = {name: np.array([value]) for name, value in system.values.items()}
    roots, shapes = np.linalg.eig(jacobian_of(system, rest[None], values)[0])
    fit = (roots.imag > 0) & (np.abs(roots.real) <= UNDAMPED * np.abs(roots.imag))
    order = np.flatnonzero(fit)[np.argsort(roots.imag[fit])]
    if not 1 <= mode <= len(order):
        raise ParameterError(
            lambda say: (
                f"{system.name} has {len(order)} undamped modes of small vibrations, and "
                f"{say.key(mode=mode)} was asked for. Set what damps to zero by "
                f"{say.key('values')}."
            )
        )
    root, shape = roots[order[mode - 1]], shapes[:, order[mode - 1]]
    places = [i for i, entry in enumerate(system.field) if entry.op == "state"]
    column = max(places, key=lambda i: abs(shape[i]))
    shape = shape / shape[column] * -1j
    return 2 * np.pi / float(root.imag), shape, column
