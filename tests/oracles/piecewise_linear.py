"""Closed form of piecewise-linear arcs: a forced oscillator with two one-sided springs and no cubic
term.

Between two contacts the displacement is, with u measured from the boundary in contact and from the
origin in free flight,

    u(s) = offset + a cos(w s) + b sin(w s) + exp(-sigma s) (c cos(wd s) + d sin(wd s)),

s being the time since the last contact.

**Why no contact is missed.** Differentiating an exponential term multiplies its complex amplitude
by ``-sigma + i wd``, whose modulus is the mode's natural frequency ``wm``. Hence for every later
time ``|u''| <= B(s) = w^2 hypot(a, b) + wm^2 hypot(c, d) exp(-sigma s)``, and B falls with s. A
watched gap g > 0 with slope g' can therefore not vanish before the first root of ``g + g' h - B h^2
/ 2``. The search marches by that root (:func:`_safe_step`), the rounding of the closed form
subtracted from g first. Every gap is positive on everything that was marched over, by proof and not
by sampling. On a transversal root the march converges quadratically, as Newton's method does from
the safe side. A root too close to a tangency for double precision ends the trajectory as
``undecided`` instead of guessing.

**How exact.** Rounding is followed along the trajectory as a 2 x 2 covariance, mapped from contact
to contact by the exact matrix exponential (the field is continuous at a soft contact, so the
tangent doesn't jump). From it come ``time_error`` and ``margin_in_errors``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from numba.extending import register_jitable

FREE, LOWER, UPPER = 0, 1, 2
OK, UNDECIDED, FULL = 0, 1, 2
PARAMETERS = (
    "mass",
    "damping_ratio",
    "natural_frequency",
    "contact_stiffness",
    "lower_gap",
    "upper_gap",
    "drive",
    "frequency",
)
_EPS = 2.0**-52
_CLEAR = 8.0  # how many units of rounding noise a decision must stand clear of


@dataclass(frozen=True)
class Contacts:
    """Contacts of a batch, in one flat table, and what became of each trajectory.

    Attributes
    ----------
    trajectory : int array (contacts,)
        Index of the trajectory; contacts of one trajectory follow each other in time.
    time, velocity : float arrays (contacts,)
        Time [s] and velocity dx/dt [m/s] at the contact; x is the boundary itself.
    guard, direction : int arrays (contacts,)
        1 = lower, 2 = upper boundary; direction is the sign of the velocity.
    time_error : float array (contacts,)
        One standard deviation of the oracle's own rounding in ``time`` [s].
    margin_so_far : float array (contacts,)
        Smallest margin (see below) on the way to this contact [m].
    count, status : int arrays (trajectories,)
        Number of contacts; 0 ok, 1 undecided (a tangency below rounding; what came before stands),
        2 full.
    margin, margin_in_errors : float arrays (trajectories,)
        Smallest distance to another sequence of contacts: the smallest gap at which the motion
        turned back before a watched boundary, and the smallest depth by which it went beyond one;
        in metres, and in standard deviations of the displacement there.
    end_x, end_v, end_x_error : float arrays (trajectories,)
        State at the end [m], [m/s] and one standard deviation of x.
    """

    trajectory: np.ndarray
    time: np.ndarray
    guard: np.ndarray
    direction: np.ndarray
    velocity: np.ndarray
    time_error: np.ndarray
    margin_so_far: np.ndarray
    count: np.ndarray
    status: np.ndarray
    margin: np.ndarray
    margin_in_errors: np.ndarray
    end_x: np.ndarray
    end_v: np.ndarray
    end_x_error: np.ndarray

    def of(self, trajectory: int) -> np.ndarray:
        """Rows of the table that belong to one trajectory."""
        return np.arange(*np.searchsorted(self.trajectory, (trajectory, trajectory + 1)))


@register_jitable
def _arc(mode, x, v, phase, p):
    """Coefficients of the closed form in one mode: (origin, wm2, sigma, wd, w, offset, a, b, c, d,
    noise).
    """
    mass, zeta, natural, stiffness, lower, upper, drive, frequency = (
        p[0],
        p[1],
        p[2],
        p[3],
        p[4],
        p[5],
        p[6],
        p[7],
    )
    wn, w = 2.0 * math.pi * natural, 2.0 * math.pi * frequency
    sigma = zeta * wn
    origin = 0.0
    wm2 = wn * wn
    if mode == UPPER:
        origin, wm2 = upper, wm2 + stiffness / mass
    elif mode == LOWER:
        origin, wm2 = -lower, wm2 + stiffness / mass
    offset = -wn * wn * origin / wm2
    wd = math.sqrt(wm2 - sigma * sigma)
    real, imag = wm2 - w * w, 2.0 * sigma * w
    size = drive / mass / (real * real + imag * imag)
    cos, sin = math.cos(phase), math.sin(phase)
    a = size * (cos * real + sin * imag)
    b = -size * (sin * real - cos * imag)
    c = x - origin - offset - a
    d = (v - b * w + sigma * c) / wd
    noise = 4.0 * _EPS * (abs(offset) + math.hypot(a, b) + math.hypot(c, d) + abs(origin))
    return origin, wm2, sigma, wd, w, offset, a, b, c, d, noise


@register_jitable
def _state(arc, s):
    """Displacement from the mode's origin and velocity, s seconds after the arc began."""
    _, _, sigma, wd, w, offset, a, b, c, d, _ = arc
    cw, sw = math.cos(w * s), math.sin(w * s)
    cd, sd = math.cos(wd * s), math.sin(wd * s)
    decay = math.exp(-sigma * s)
    free = decay * (c * cd + d * sd)
    return offset + a * cw + b * sw + free, w * (b * cw - a * sw) - sigma * free + decay * wd * (
        d * cd - c * sd
    )


@register_jitable
def _bound(arc, s):
    """Upper bound of |u''| from s on."""
    _, wm2, sigma, _, w, _, a, b, c, d, _ = arc
    return w * w * math.hypot(a, b) + wm2 * math.hypot(c, d) * math.exp(-sigma * s)


@register_jitable
def _gap(mode, which, u, v, p):
    """A watched gap and its slope; the gap is positive inside the mode. ``which`` is the boundary
    (LOWER, UPPER).
    """
    if mode == FREE:
        return (u + p[4], v) if which == LOWER else (p[5] - u, -v)
    return (-u, -v) if mode == LOWER else (u, v)


@register_jitable
def _safe_step(gap, slope, bound):
    """First positive root of gap + slope h - bound h^2 / 2, gap > 0."""
    root = math.sqrt(slope * slope + 2.0 * bound * gap)
    return (slope + root) / bound if slope > 0.0 else 2.0 * gap / (root - slope)


@register_jitable
def _turning_gap(arc, mode, which, left, right, p):
    """Gap at the extremum between two times whose slopes differ in sign (bisection to 1e-9 of the
    interval, then it is flat).
    """
    _, slope_left = _gap(mode, which, *_state(arc, left), p)
    for _ in range(30):
        middle = 0.5 * (left + right)
        gap, slope = _gap(mode, which, *_state(arc, middle), p)
        if (slope < 0.0) == (slope_left < 0.0):
            left = middle
        else:
            right = middle
    return gap


@register_jitable
def _polish(arc, mode, which, s, p):
    """Newton's method on a root that is known to be simple and next to s."""
    for _ in range(4):
        gap, slope = _gap(mode, which, *_state(arc, s), p)
        s -= gap / slope
    return s


@register_jitable
def _spread(arc, s, cxx, cxv, cvv):
    """Map a covariance of (x, v) along an arc by its matrix exponential."""
    _, wm2, sigma, wd, _, _, _, _, _, _, _ = arc
    decay, cd, sd = math.exp(-sigma * s), math.cos(wd * s), math.sin(wd * s) / wd
    xx, xv = decay * (cd + sigma * sd), decay * sd
    vx, vv = -decay * wm2 * sd, decay * (cd - sigma * sd)
    return (
        xx * xx * cxx + 2.0 * xx * xv * cxv + xv * xv * cvv,
        xx * vx * cxx + (xx * vv + xv * vx) * cxv + xv * vv * cvv,
        vx * vx * cxx + 2.0 * vx * vv * cxv + vv * vv * cvv,
    )


@register_jitable
def _turns(arc, mode, entered, s, after, margin, depth, p):
    """Margin and depth, with the turning point between two times (if any) taken in."""
    u, v = _state(arc, s)
    _, v_after = _state(arc, after)
    if (v < 0.0) != (v_after < 0.0):
        for which in range(LOWER, UPPER + 1):
            if mode in (FREE, which):
                _, slope = _gap(mode, which, u, v, p)
                turned = _turning_gap(arc, mode, which, s, after, p)
                if slope < 0.0:
                    margin = min(margin, turned)
                elif which == entered:
                    depth = max(depth, turned)
    return margin, depth


@register_jitable
def _first_safe_time(arc, mode, entered, speed, p):
    """Time to march from the boundary just crossed: its gap grows at least as speed h - B h^2 / 2.
    -1 if that drowns in rounding.
    """
    if entered == FREE:
        return 0.0
    bound, noise = _bound(arc, 0.0), arc[10]
    s = speed / bound
    if mode == FREE:  # the other boundary lies ahead
        s = min(s, _safe_step(p[4] + p[5] - noise, -speed, bound))
    return s if speed * s - 0.5 * bound * s * s > _CLEAR * noise else -1.0


@register_jitable
def _leave(arc, mode, entered, speed, s_end, p):
    """March along an arc to its first contact or to s_end.

    ``entered`` is the boundary just crossed (FREE at a start off the boundaries) and ``speed`` the
    speed of entry. Returns (status, s, which, margin): ``which`` is the boundary reached, FREE if
    none; margin the smallest turning gap or depth of the visit.
    """
    noise, margin, depth = arc[10], math.inf, 0.0
    s = _first_safe_time(arc, mode, entered, speed, p)
    if s < 0.0:
        return UNDECIDED, 0.0, entered, 0.0
    while s < s_end:
        u, v = _state(arc, s)
        bound, step = _bound(arc, s), math.inf
        for which in range(LOWER, UPPER + 1):
            if mode not in (FREE, which):
                continue
            gap, slope = _gap(mode, which, u, v, p)
            if which == entered:
                depth = max(depth, gap)
            if gap <= 2.0 * noise:
                if slope >= 0.0 or slope * slope < 2.0 * _CLEAR * noise * bound:
                    return UNDECIDED, s, which, min(abs(gap), margin)
                s = _polish(arc, mode, which, s, p)
                if s > s_end:
                    return OK, s_end, FREE, margin
                return OK, s, which, min(margin, depth) if which == entered else margin
            step = min(step, _safe_step(gap - noise, slope, bound))
        if s + step == s:
            return UNDECIDED, s, entered, margin
        margin, depth = _turns(arc, mode, entered, s, s + step, margin, depth, p)
        s += step
    return OK, s_end, FREE, margin


@register_jitable
def _start_mode(x, v, p):
    """Mode of a state; on a boundary the velocity decides. Returns (mode, boundary it stands on or
    FREE).
    """
    if x == p[5]:
        return (UPPER, UPPER) if v > 0.0 else (FREE, UPPER)
    if x == -p[4]:
        return (LOWER, LOWER) if v < 0.0 else (FREE, LOWER)
    if x > p[5]:
        return UPPER, FREE
    if x < -p[4]:
        return LOWER, FREE
    return FREE, FREE


def _trajectory(p, x, v, t_end, number, at, table, ends):
    """Fill the contact table from row ``at`` with one trajectory; returns the next free row."""
    w = 2.0 * math.pi * p[7]
    mode, entered = _start_mode(x, v, p)
    t, margin, in_errors, status = 0.0, math.inf, math.inf, OK
    cxx = cxv = cvv = 0.0
    while True:
        arc = _arc(mode, x, v, 2.0 * math.pi * (p[7] * t % 1.0), p)
        status, s, which, turned = _leave(arc, mode, entered, abs(v), t_end - t, p)
        u, v_new = _state(arc, s)
        speed_noise = arc[10] * math.sqrt(arc[1]) + 4.0 * _EPS * (
            w * math.hypot(arc[6], arc[7]) + abs(v_new)
        )
        clock = _EPS * t_end
        cxx, cxv, cvv = _spread(arc, s, cxx, cxv, cvv)
        cxx += arc[10] ** 2 + (clock * v_new) ** 2
        cvv += speed_noise**2 + (clock * _bound(arc, s)) ** 2
        deviation = math.sqrt(cxx)
        if turned < margin:
            margin = turned
        in_errors = min(in_errors, turned / deviation)
        t, v = t + s, v_new
        x = u + arc[0]
        if status != OK or which == FREE:
            break
        if at == table.shape[0]:
            status = FULL
            break
        x = p[5] if which == UPPER else -p[4]
        table[at, 0], table[at, 1], table[at, 2], table[at, 3] = number, t, which, v
        table[at, 4], table[at, 5] = math.hypot(deviation / v, clock), margin
        at += 1
        mode, entered = (which if mode == FREE else FREE), which
    ends[number, 0], ends[number, 1], ends[number, 2], ends[number, 3] = (
        x,
        v,
        math.sqrt(cxx),
        margin,
    )
    ends[number, 4], ends[number, 5] = in_errors, status
    return at


@cache
def _loop(compiled):
    """The loop over trajectories, compiled or plain."""
    one = njit(_trajectory) if compiled else _trajectory

    def loop(parameters, x0, v0, t_end, table, ends):
        at = 0
        for i in range(x0.size):
            at = one(parameters[i], x0[i], v0[i], t_end[i], i, at, table, ends)
        return at

    return njit(loop) if compiled else loop


def contacts(parameters, x0, v0, t_end, *, max_contacts=None, compiled=False) -> Contacts:
    """All contacts of a batch in (0, t_end].

    Parameters
    ----------
    parameters : dict of str to float or array (trajectories,)
        :data:`PARAMETERS` in SI: ``drive`` is the amplitude of the cosine force [N] itself,
        frequencies in Hz; lower_gap + upper_gap > 0; damping_ratio < 1; contact_stiffness >= 0.
    x0, v0, t_end : float or array (trajectories,)
        Start [m], [m/s] at t = 0 and end time [s]. A start on a boundary needs a velocity.
    max_contacts : int, optional
        Rows of the table; 2000 a trajectory by default.
    compiled : bool
        Compile with Numba (some seconds) for more than some 10^4 contacts.

    Raises
    ------
    ValueError
        If gaps add up to nothing, or an arc would be overdamped.
    """
    columns = np.broadcast_arrays(
        *(np.asarray(parameters[name], float) for name in PARAMETERS), x0, v0, t_end
    )
    flat = [np.array(np.ravel(column), float) for column in columns]
    values = np.ascontiguousarray(np.stack(flat[: len(PARAMETERS)], axis=1))
    if np.any(values[:, 4] + values[:, 5] <= 0) or np.any(values[:, 1] >= 1):
        raise ValueError("needs lower_gap + upper_gap > 0 and damping_ratio < 1")
    x, v, end = flat[len(PARAMETERS) :]
    table = np.empty((max_contacts or 2000 * x.size, 6))
    ends = np.empty((x.size, 6))
    rows = _loop(compiled)(values, x, v, end, table, ends)
    found = table[:rows]
    number = found[:, 0].astype(np.int64)
    return Contacts(
        trajectory=number,
        time=found[:, 1].copy(),
        guard=found[:, 2].astype(np.int64),
        direction=np.sign(found[:, 3]).astype(np.int64),
        velocity=found[:, 3].copy(),
        time_error=found[:, 4].copy(),
        margin_so_far=found[:, 5].copy(),
        count=np.bincount(number, minlength=x.size),
        status=ends[:, 5].astype(np.int64),
        margin=ends[:, 3],
        margin_in_errors=ends[:, 4],
        end_x=ends[:, 0],
        end_v=ends[:, 1],
        end_x_error=ends[:, 2],
    )


def random_cases(trajectories: int, seed: int) -> tuple[dict, np.ndarray, np.ndarray, np.ndarray]:
    """Random rigs without cubic term: (parameters, x0 [m], v0 [m/s], t_end [s]), about 100 contacts
    a trajectory in 10 periods.

    ``force`` and ``drive`` are both given: drive = force (1 - 18 / w^2), w in rad/s, as the
    deLangre rig has it. One gap in four is zero.
    """
    rng = np.random.default_rng(seed)

    def uniform(low, high):
        return rng.uniform(low, high, trajectories)

    frequency, force = uniform(3.0, 30.0), uniform(0.3, 10.0)
    lower, upper = uniform(0.0, 1e-3), uniform(2e-5, 1e-3)
    lower[rng.random(trajectories) < 0.25] = 0.0
    parameters = {
        "mass": np.full(trajectories, 3.0),
        "damping_ratio": 10.0 ** uniform(-3.0, -0.5),
        "natural_frequency": np.full(trajectories, 5.0),
        "contact_stiffness": 10.0 ** uniform(2.0, 7.0),
        "lower_gap": lower,
        "upper_gap": upper,
        "force": force,
        "drive": force * (1.0 - 18.0 / (2.0 * np.pi * frequency) ** 2),
        "frequency": frequency,
    }
    return parameters, uniform(-3e-3, 3e-3), uniform(-0.3, 0.3), 10.0 / frequency


__all__ = ["PARAMETERS", "Contacts", "contacts", "random_cases"]
