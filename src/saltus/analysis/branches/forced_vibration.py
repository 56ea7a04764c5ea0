"""The equations of forced vibrations in phase quadrature: the displacement lags the force by a
quarter of the forcing period, as a linear oscillator's does at its natural frequency whatever its
damping.

The force P that drives a velocity is proportional to a parameter A. Quadrature is that the mean of
``x dP/dA`` over a period vanishes; of a harmonic force that is the phase of the displacement's
first harmonic. The integral is one more state of the exact flow, and A one more unknown. Peeters,
Kerschen & Golinval, Mech. Syst. Signal Process. 25 (2011) 1227 (phase resonance).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from saltus.analysis.branches.free_vibration import (
    LONGEST,
    FreeOrbits,
    equilibrium_near_zero,
    free_system,
)
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.closed.field_zeros import jacobian_of
from saltus.errors import ParameterError, among, unknown
from saltus.flow.methods import Method
from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.quantity import with_states

#: Instants of a period at which a force is looked at.
SAMPLES = 256
#: Frequencies about that of a mode among which quadrature is looked for.
LOOKS = 401
#: Distance of the farthest of them, as a share of that frequency.
FAR = 0.5
#: Name of the state that is the integral.
INTEGRAL = "displacement_on_force"


@dataclass(frozen=True)
class Forcing:
    """A force in proportion to a parameter.

    Attributes
    ----------
    name : str
        The parameter.
    rates : dict of int to Expr
        Derivatives of the rates of the forced states with respect to it.
    displacement, velocity : int
        The displacement whose quadrature is asked for, and its velocity.
    row : int
        Which of the rates is the force.
    """

    name: str
    rates: dict[int, Expr]
    displacement: int
    velocity: int
    row: int

    @classmethod
    def of(cls, system: System, name: str, state: str) -> Forcing:
        """The force on the displacement ``state``, or on that whose velocity it is.

        Raises
        ------
        ParameterError
            If the system isn't forced in proportion to the parameter.
        """
        if system.forced_at is None:
            raise ParameterError(
                lambda say: (
                    f"{system.name} isn't forced, so nothing has a phase. Leave "
                    f"{say.key('phase')} out."
                )
            )
        if not among(name, system.values):
            raise unknown(
                f"{system.name} has no parameter",
                name,
                system.values,
                lambda say: f" {say.key('force')} names the amplitude of its forcing.",
            )
        amplitude = ex.parameter(name)
        rates = {
            i: differentiate(entry, amplitude)
            for i, entry in enumerate(system.field)
            if amplitude in set(ex.walk(entry))
        }
        if not rates or any(
            ex.depends_on(rate, ("state", "select"))
            or amplitude in set(ex.walk(rate))
            or not ex.depends_on(rate, ("time",))
            for rate in rates.values()
        ):
            raise ParameterError(
                lambda say: (
                    f"{name} isn't the amplitude of a force on {system.name}: it must multiply "
                    f"a function of time alone. Name another parameter by {say.key('force')}."
                )
            )
        velocity = {
            i: system.states.index(str(entry.payload))
            for i, entry in enumerate(system.field)
            if entry.op == "state"
        }
        place = system.states.index(state)
        back = {v: i for i, v in velocity.items()}
        place = place if place in velocity else back.get(place, place)
        if place not in velocity:
            raise ParameterError(
                lambda say: (
                    f"{state} is no displacement, and no velocity of one: choose another "
                    f"{say.key('state')}."
                )
            )
        row = velocity[place] if velocity[place] in rates else min(rates)
        return cls(name, rates, place, velocity[place], row)

    def harmonics(self, system: System, frequency: float) -> np.ndarray:
        """First harmonics of the rates over the parameter, complex128[D]."""
        assert system.forced_at is not None
        values = {**system.values, system.forced_at: frequency}
        share = np.arange(SAMPLES) / SAMPLES
        times = share * system.period({system.forced_at: frequency})
        found = np.zeros(len(system.states), complex)
        for i, rate in self.rates.items():
            (seen,) = evaluate([rate], t=times, values=values)
            found[i] = 2 * np.mean(seen * np.exp(-2j * np.pi * share))
        return found


class QuadratureOrbits(PeriodicOrbits):
    """Periodic orbits of one forcing period in quadrature, over the forcing frequency and the
    amplitude of the force.

    Parameters
    ----------
    system : System
        What is forced.
    force : Force
        By what.
    scale : float64[1, z]
        Units of the points, the frequency and the amplitude.
    unit : float
        Of the mean of the displacement times the force.
    rest : float64[D]
        The place of rest.
    """

    def __init__(
        self,
        system: System,
        force: Forcing,
        scale: np.ndarray,
        unit: float,
        rest: np.ndarray,
        method: Method,
        threads: int | None = None,
    ) -> None:
        assert system.forced_at is not None
        names = (system.forced_at, force.name)
        super().__init__(system, names, 1, scale, method, threads)
        x = ex.state(system.states[force.displacement])
        rate = ex.mul(x, force.rates[force.row])
        self.rest, self.force = rest, force
        self._extended = PeriodicOrbits(
            with_states(system, {INTEGRAL: rate}),
            names,
            1,
            np.insert(scale, self.size, unit, axis=1),
            method,
            threads,
        )

    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        whole = np.insert(z, self.size, 0.0, axis=1)
        residual, derivative = self._extended.evaluate(whole, rows)
        return residual, np.delete(derivative, self.size, axis=2)


def small_vibration(
    system: System, force: Forcing, mode: int, state: int, amplitude: float, method: Method
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The place of rest without the force, float64[D]; the linear vibration about it in quadrature
    in which a state has an amplitude: its complex amplitudes complex128[D]; and its unknowns
    float64[D + 2]: the state at a whole period, the forcing frequency and the force. Where the rest
    lies on a boundary they are nearly those of the vibration that meets it.

    Raises
    ------
    ParameterError
        If there is none.
    """
    assert system.forced_at is not None
    rest = equilibrium_near_zero(system.with_values(**{force.name: 0.0}))
    values = {name: np.array([value]) for name, value in system.values.items()}
    matrix = jacobian_of(system, rest[None], values)[0]
    roots = np.linalg.eigvals(matrix)
    natural = np.sort(np.abs(roots[roots.imag > 0]))
    if not 1 <= mode <= len(natural):
        raise ParameterError(
            lambda say: (
                f"{system.name} has {len(natural)} modes of small vibrations, not {mode}: "
                f"choose another {say.key('mode')}."
            )
        )
    turns = 2 * np.pi / system.period({system.forced_at: 1.0})  # rad over forcing frequency

    def response(frequency: float) -> tuple[np.ndarray, complex]:
        drive = force.harmonics(system, frequency)
        rigid = 1j * turns * frequency * np.eye(len(matrix)) - matrix
        return np.linalg.solve(rigid, drive), drive[force.row]

    def in_phase(frequency: float) -> float:
        shape, drive = response(frequency)
        return float((shape[force.displacement] * np.conj(drive)).real)

    about = natural[mode - 1] / turns
    looked = about * np.linspace(1 - FAR, 1 + FAR, LOOKS)
    signs = np.sign([in_phase(one) for one in looked])
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    first = changes[np.abs(looked[changes] - about).argmin()] if len(changes) else 0
    apart = np.abs(natural / turns - looked[first])
    # damping may keep a displacement from quadrature in a mode: the next change is another mode's
    if not len(changes) or apart[mode - 1] > apart.min() + about / LOOKS:
        raise ParameterError(
            f"no forcing frequency near mode {mode} of {system.name} brings "
            f"{system.states[force.displacement]} into quadrature with {force.name}. ",
            lambda say: f"Choose another {say.key('state')} or {say.key('mode')}.",
        )
    frequency = float(brentq(in_phase, looked[first], looked[first + 1], xtol=1e-14 * about))
    shape, drive = response(frequency)
    size = amplitude / np.abs(shape[state])
    begin, shape = rest + size * shape.real, size * shape
    if any(guard.law is None and _meets(guard.gap, system, rest) for guard in system.guards):
        begin, frequency = _on_boundary(system, force, rest, shape, state, drive, method)
    return rest, shape, np.array([*begin, frequency, size])


def _meets(gap: Expr, system: System, rest: np.ndarray) -> bool:
    """True if an equilibrium lies on a boundary."""
    named = dict(zip(system.states, rest, strict=True))
    (found,) = evaluate([gap], states=named, values=system.values)
    return bool(found == 0)


def _on_boundary(
    system: System,
    force: Forcing,
    rest: np.ndarray,
    shape: np.ndarray,
    state: int,
    drive: complex,
    method: Method,
) -> tuple[np.ndarray, float]:
    """The state at a whole period, and the frequency, of a small free vibration about a rest on a
    boundary, with the phase of quadrature.
    """
    place, amplitude = force.displacement, np.abs(shape[state])
    free, name = free_system(system.with_values(**{force.name: 0.0}))
    orbits = FreeOrbits(free, name, np.ones((1, len(rest) + 2)), method, rest, place)
    period = system.period({str(system.forced_at): 1.0})
    longest = LONGEST * 2 * np.pi * np.abs(shape[place] / shape[force.velocity])
    begin = rest + (shape * (np.abs(shape[place]) / shape[place]) * -1j).real
    for _ in range(2):  # to the amplitude, which is that of the first half
        time, swing = orbits.first_return(begin, longest)
        begin = rest + (begin - rest) * (amplitude / swing[state])
    seen = orbits.sampled(begin, time)
    share = np.arange(len(seen)) / len(seen)
    first = np.mean((seen[:, place] - rest[place]) * np.exp(-2j * np.pi * share))
    turn = (np.angle(drive) - np.pi / 2 - np.angle(first)) / (2 * np.pi) % 1.0
    return seen[int(turn * len(seen)) % len(seen)], float(period / time)
