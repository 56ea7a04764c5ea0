"""Three published systems, a row of bodies and the rig, written by hand for heyoka: an independent
solver for models that have no closed form.

heyoka's events go wrong in known ways: a start at rest on a boundary hangs it; its cool-down after
an event swallows shallow grazes; a field that switches by itself is silently wrong; an event
function that is exactly zero at the start of a step loses its next root (7.13.2: x'' = 1 - x, x =
0, v = -0.1: the return to x = 0 at t = 0.19934 isn't reported); ``x**3`` is NaN at x = 0. So here
every mode has an integrator of its own, with a smooth field and terminal events for its exits only,
each in the one direction that leaves the mode, without cool-down. Contacts are snapped to the
boundary and the next arc starts one floating-point number inside its mode. The gaps' signs are
checked after each step, steps are bounded.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import heyoka as hy
import numpy as np

MAX_STEPS = 200_000


@dataclass(frozen=True)
class Clearance:
    """A symmetric or one-sided clearance: boundaries low < high of one relative displacement."""

    displacement: Callable  # states -> relative displacement
    low: Callable  # parameters -> boundary
    high: Callable
    moved: int  # the state that is set when the displacement is snapped to a boundary
    base: int | None = None  # the state that the displacement is measured from, if any


@dataclass(frozen=True)
class Equations:
    """States, parameter names, clearances, and field(t, states, parameters, stretch): ``stretch``
    of each contact spring, 0 when apart.
    """

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    clearances: tuple[Clearance, ...]
    field: Callable


@dataclass(frozen=True)
class Run:
    """What :func:`simulate` found.

    Attributes
    ----------
    times : float array (contacts,)
        Contact times [s].
    clearances : int array (contacts,)
        Index of the clearance, in the order of the model's equations (chain: 0 ground, 1 coupling).
    sides : int array (contacts,)
        -1 = its low boundary, +1 = its high boundary.
    directions : int array (contacts,)
        Sign of the relative velocity at the contact.
    states : float array (contacts, states)
        State at the contact, SI.
    end : float array (states,)
        State at the end.
    margin : float
        Smallest gap to a boundary of the mode at which a relative motion turned [m or rad]: how
        close another sequence of contacts is.
    """

    times: np.ndarray
    clearances: np.ndarray
    sides: np.ndarray
    directions: np.ndarray
    states: np.ndarray
    end: np.ndarray
    margin: float


def _chain(t, y, p, stretch):
    x1, x2, v1, v2 = y
    to_ground = (
        p["ground_stiffness"] * x1
        + p["ground_damping"] * v1
        + p["ground_contact_stiffness"] * stretch[0]
    )
    between = (
        p["coupling_stiffness"] * (x2 - x1)
        + p["coupling_damping"] * (v2 - v1)
        + p["coupling_contact_stiffness"] * stretch[1]
    )
    force = p["force"] * hy.cos(2 * np.pi * p["frequency"] * t)
    return v1, v2, (force + between - to_ground) / p["first_mass"], -between / p["second_mass"]


def _gear_pair(t, y, p, stretch):
    wave = hy.cos(2 * np.pi * p["mesh_frequency"] * t)
    tooth = p["mesh_stiffness"] * (1 + p["stiffness_variation"] * wave) * stretch[0]
    dashpot = 2 * p["damping_ratio"] * hy.sqrt(p["mesh_stiffness"] * p["mesh_mass"]) * y[1]
    return y[1], (p["mean_force"] + p["alternating_force"] * wave - dashpot - tooth) / p[
        "mesh_mass"
    ]


def _aeroelastic(t, y, p, stretch):
    plunge, pitch, plunge_rate, pitch_rate = y
    b, a, speed = p["half_chord"], p["elastic_axis"], p["airspeed"]
    angle = pitch + (plunge_rate + (0.5 - a) * b * pitch_rate) / speed
    lift = p["air_density"] * speed * speed * b * p["lift_slope"] * angle
    right = (
        -lift - p["plunge_damping"] * plunge_rate - p["plunge_stiffness"] * plunge,
        lift * b * (0.5 + a) - p["pitch_damping"] * pitch_rate - p["pitch_stiffness"] * stretch[0],
    )
    m, s, i = p["mass"], p["mass"] * p["imbalance"] * b, p["inertia"]
    return (
        plunge_rate,
        pitch_rate,
        (i * right[0] - s * right[1]) / (m * i - s * s),
        (m * right[1] - s * right[0]) / (m * i - s * s),
    )


def _rig(t, y, p, stretch):
    wn, w = 2 * np.pi * p["natural_frequency"], 2 * np.pi * p["frequency"]
    force = (
        p["force"] * (1 - 18 / (w * w)) * hy.cos(w * t)
        - p["contact_stiffness"] * stretch[0]
        - p["cubic"] * y[0] * y[0] * y[0]
    )
    return y[1], force / p["mass"] - 2 * p["damping_ratio"] * wn * y[1] - wn * wn * y[0]


def _row(t, y, p, stretch):
    """Bodies in a row between springs and dashpots from a wall on, the last one driven; the second
    and the last between stops to ground.
    """
    n = len(y) // 2
    links = []
    for i in range(n):
        apart, rate = (y[i], y[n + i]) if i == 0 else (y[i] - y[i - 1], y[n + i] - y[n + i - 1])
        links.append(p["stiffness"] * (1 + 0.1 * i) * apart + p["damping"] * rate)
    forces = [links[i + 1] - links[i] for i in range(n - 1)] + [-links[-1]]
    forces[1] -= p["contact_stiffness"] * stretch[0]
    forces[-1] += p["force"] * hy.cos(2 * np.pi * p["frequency"] * t)
    forces[-1] -= p["contact_stiffness"] * stretch[1]
    return *y[n:], *(force / (p["mass"] * (1 + 0.2 * i)) for i, force in enumerate(forces))


def _symmetric(displacement, gap, moved, base=None):
    return Clearance(displacement, lambda p: -p[gap], lambda p: p[gap], moved, base)


def _names(text):
    return tuple(text.split())


SYSTEMS = {
    "chain": Equations(
        ("x1", "x2", "v1", "v2"),
        _names(
            "first_mass second_mass ground_stiffness coupling_stiffness ground_damping "
            "coupling_damping ground_contact_stiffness "
            "ground_gap coupling_contact_stiffness coupling_gap force frequency"
        ),
        (
            _symmetric(lambda y: y[0], "ground_gap", 0),
            _symmetric(lambda y: y[1] - y[0], "coupling_gap", 1, 0),
        ),
        _chain,
    ),
    "gear_pair": Equations(
        ("x", "v"),
        _names(
            "mesh_mass damping_ratio mesh_stiffness stiffness_variation gap mean_force "
            "alternating_force mesh_frequency"
        ),
        (_symmetric(lambda y: y[0], "gap", 0),),
        _gear_pair,
    ),
    "aeroelastic": Equations(
        ("plunge", "pitch", "plunge_rate", "pitch_rate"),
        _names(
            "airspeed mass inertia imbalance half_chord elastic_axis plunge_stiffness "
            "pitch_stiffness pitch_gap plunge_damping "
            "pitch_damping air_density lift_slope"
        ),
        (_symmetric(lambda y: y[1], "pitch_gap", 1),),
        _aeroelastic,
    ),
    "row": Equations(
        _names("x1 x2 x3 x4 x5 x6 v1 v2 v3 v4 v5 v6"),
        _names("mass stiffness damping contact_stiffness gap force frequency"),
        (_symmetric(lambda y: y[1], "gap", 1), _symmetric(lambda y: y[5], "gap", 5)),
        _row,
    ),
    "delangre": Equations(
        ("x", "v"),
        _names(
            "mass damping_ratio natural_frequency cubic contact_stiffness lower_gap upper_gap "
            "force frequency"
        ),
        (Clearance(lambda y: y[0], lambda p: -p["lower_gap"], lambda p: p["upper_gap"], 0),),
        _rig,
    ),
}


class _Arc:
    """heyoka's integrator for one mode: a side (-1, 0, +1) for each clearance.

    ``exits`` holds (clearance, side of the boundary, sign of its displacement minus boundary inside
    the mode, expression of that).
    """

    def __init__(self, name: str, sides: tuple[int, ...], tolerance: float):
        equations = SYSTEMS[name]
        states = hy.make_vars(*equations.states)
        values = {key: hy.par[i] for i, key in enumerate(equations.parameters)}
        moves = [clearance.displacement(states) for clearance in equations.clearances]
        self.equations, self.parameters, self.turning = equations, {}, []
        stretch, self.exits = [], []
        for number, (clearance, side, move) in enumerate(
            zip(equations.clearances, sides, moves, strict=True)
        ):
            bounds = {-1: clearance.low(values), 1: clearance.high(values)}
            stretch.append(move - bounds[side] if side else 0.0)
            self.exits += [
                (number, at, side or -at, move - bounds[at])
                for at in ((side,) if side else (-1, 1))
            ]
        rates = equations.field(hy.time, states, values, stretch)
        falling = [
            hy.event_direction.negative if sign > 0 else hy.event_direction.positive
            for *_, sign, _ in self.exits
        ]
        self.integrator = hy.taylor_adaptive(
            list(zip(states, rates, strict=True)),
            [0.0] * len(states),
            pars=[1.0] * len(equations.parameters),
            tol=tolerance,
            t_events=[
                hy.t_event(e[3], direction=d, cooldown=0.0)
                for e, d in zip(self.exits, falling, strict=True)
            ],
            nt_events=[self._turn(e, rates) for e in self.exits],
        )

    def _turn(self, exit_, rates):
        """Event that notes the gap wherever it turns."""
        rate = self.equations.clearances[exit_[0]].displacement(rates)

        def note(integrator, time, _):
            integrator.update_d_output(time)
            self.turning.append(self.gap(exit_, integrator.d_output))

        return hy.nt_event(rate, note)

    def begin(self, parameters, state, time, crossed):
        """Set the start of an arc; ``crossed`` is the (clearance, side) of the boundary it starts
        on, or None.
        """
        self.parameters, integrator = parameters, self.integrator
        integrator.pars[:] = [parameters[key] for key in self.equations.parameters]
        integrator.state[:], integrator.time = state, time
        integrator.reset_cooldowns()  # those of the last visit to this mode
        self.turning.clear()
        for exit_ in self.exits:
            moved = self.equations.clearances[exit_[0]].moved
            while exit_[:2] == crossed and self.gap(exit_, integrator.state) <= 0.0:
                integrator.state[moved] = np.nextafter(integrator.state[moved], exit_[2] * np.inf)

    def gap(self, exit_, state):
        """Gap of an exit, positive inside the mode."""
        number, at, sign, _ = exit_
        clearance = self.equations.clearances[number]
        bound = clearance.low(self.parameters) if at < 0 else clearance.high(self.parameters)
        return sign * (clearance.displacement(state) - bound)


@cache
def _arc(name, sides, tolerance):
    return _Arc(name, sides, tolerance)


def _start_side(displacement, rate, low, high):
    """Side of a clearance at the start; on a boundary the velocity decides."""
    if displacement > high or (displacement == high and rate > 0):
        return 1
    if displacement < low or (displacement == low and rate < 0):
        return -1
    if displacement in (low, high) and rate == 0:
        raise ValueError("a start at rest on a boundary is not supported")
    return 0


def _start_sides(equations, state, parameters):
    """Mode of the start."""
    half = len(state) // 2
    rates = np.r_[state[half:], np.zeros(half)]
    return tuple(
        _start_side(
            c.displacement(state), c.displacement(rates), c.low(parameters), c.high(parameters)
        )
        for c in equations.clearances
    )


def _advance(arc: _Arc, t_end: float, budget):
    """Step to the first exit of the mode or to t_end; returns the exit or None."""
    integrator = arc.integrator
    while integrator.time < t_end:
        next(budget)
        outcome, _ = integrator.step(t_end - integrator.time)
        code = -int(outcome) - 1
        if 0 <= code < len(arc.exits):
            return arc.exits[code]
        if outcome not in (hy.taylor_outcome.success, hy.taylor_outcome.time_limit):
            raise ArithmeticError(f"heyoka stopped: {outcome}")
        if min(arc.gap(exit_, integrator.state) for exit_ in arc.exits) < -1e-15:
            raise ArithmeticError(
                f"heyoka passed a boundary without an event before "
                f"{integrator.time} s: {integrator.state}"
            )
    return None


def simulate(name: str, parameters: dict, start, t_end: float, *, tolerance: float = 1e-16) -> Run:
    """Integrate one system from t = 0, contacts located.

    Parameters
    ----------
    name : str
        ``chain``, ``gear_pair``, ``aeroelastic``, ``row`` or ``delangre``.
    parameters : dict of str to float
        All parameters of the model of that name, SI, frequencies in Hz.
    start : sequence of float (states,)
        Displacements first, then their rates; not at rest on a boundary.
    t_end : float
        End time [s].
    tolerance : float
        heyoka's.

    Raises
    ------
    ArithmeticError
        If heyoka fails, passes a boundary unseen or needs more than 200 000 steps.
    """
    equations = SYSTEMS[name]
    state, time = np.array(start, float), 0.0
    sides = _start_sides(equations, state, parameters)
    budget = itertools.chain(range(MAX_STEPS), _exhausted())
    found, margins, crossed = [], [], None
    while True:
        arc = _arc(name, sides, tolerance)
        arc.begin(parameters, state, time, crossed)
        left = _advance(arc, t_end, budget)
        margins += arc.turning
        state, time = arc.integrator.state.copy(), arc.integrator.time
        if left is None:
            break
        number, at, sign, _ = left
        clearance, crossed = equations.clearances[number], (number, at)
        boundary = clearance.low(parameters) if at < 0 else clearance.high(parameters)
        state[clearance.moved] = boundary + (
            0.0 if clearance.base is None else state[clearance.base]
        )
        sides = tuple(
            (0 if sides[i] else at) if i == number else side for i, side in enumerate(sides)
        )
        found.append((time, number, at, -sign, state.copy()))
    columns = list(zip(*found, strict=True)) or [[], [], [], [], np.empty((0, state.size))]
    return Run(
        times=np.array(columns[0], float),
        clearances=np.array(columns[1], int),
        sides=np.array(columns[2], int),
        directions=np.array(columns[3], int),
        states=np.array(columns[4]),
        end=state,
        margin=min(margins, default=np.inf),
    )


def _exhausted():
    raise ArithmeticError(f"more than {MAX_STEPS} steps")
    yield
