"""The deLangre rig to 40 digits: Taylor series in mpmath, contacts isolated by proof.

One arc is expanded to order :data:`ORDER` about its start. On the step s in [0, h] the gap
polynomial g satisfies |g''| <= B with B = sum k (k - 1) |g_k| h^(k - 2), so no root lies before the
first root of g + g' s - B s^2 / 2: the search marches by that root and then polishes with Newton's
method. The step is cut at the contact, the displacement set to the boundary exactly, the series
begun anew. Nothing here is shared with the package or with :mod:`piecewise_linear`.
"""

from __future__ import annotations

from dataclasses import dataclass

from mpmath import mp, mpf

ORDER = 48
GUARD_DIGITS = 10
FREE, LOWER, UPPER = 0, 1, 2


@dataclass(frozen=True)
class Trajectory:
    """One trajectory; numbers are mpf in SI.

    Attributes
    ----------
    times, velocities : lists of mpf
        Contacts in (0, t_end]: time [s] and dx/dt [m/s].
    guards : list of int
        1 = lower, 2 = upper boundary.
    x, v : mpf
        State at the end [m], [m/s].
    margin : mpf
        Smallest distance to another sequence of contacts [m]: gap left when the motion turned back
        before a watched boundary, or depth reached beyond one.
    """

    times: list
    guards: list
    velocities: list
    x: mpf
    v: mpf
    margin: mpf


def drive(force, frequency):
    """Amplitude of the rig's cosine force [N]: force (1 - 18 / w^2), w in rad/s."""
    return mpf(force) * (1 - 18 / (2 * mp.pi * mpf(frequency)) ** 2)


def _series(rig, mode, t, x, v, order):
    """Taylor coefficients of x about time t in a frozen mode."""
    kc, origin = (rig["stiffness"], rig["boundary"][mode]) if mode else (mpf(0), mpf(0))
    w, decay = rig["w"], rig["decay"]
    linear, constant = rig["wn2"] + kc, kc * origin
    turn, wt = mpf(1), w * t
    cos, sin = mp.cos(wt), mp.sin(wt)
    wave = (cos, -sin, -cos, sin)
    xs, squares, v_n = [x], [], v
    for n in range(order):
        squares.append(mp.fdot(xs, reversed(xs)))
        cube = mp.fdot(squares, reversed(xs)) if rig["cubic"] else 0
        rate = (
            rig["drive"] * turn * wave[n % 4] - decay * v_n - linear * xs[n] - rig["cubic"] * cube
        )
        if n == 0:
            rate += constant
        xs.append(v_n / (n + 1))
        v_n = rate / (n + 1)
        turn = turn * w / (n + 1)
    return xs


def _step_size(xs, tolerance):
    """Step over which the last terms stay below the tolerance, relative to the largest displacement
    term.
    """
    order = len(xs) - 1
    scale = max(abs(xs[0]), abs(xs[1]) / 100, mpf(10) ** -8)
    sizes = [(tolerance * scale / abs(xs[k])) ** (mpf(1) / k) for k in (order - 1, order) if xs[k]]
    return min(sizes)


def _value(poly, s):
    """Polynomial and its slope at s."""
    value = slope = mpf(0)
    for c in reversed(poly):
        slope = slope * s + value
        value = value * s + c
    return value, slope


def _turn(poly, s, after):
    """Gap at the turning point between two times of opposite slope."""
    sign = _value(poly, s)[1] < 0
    for _ in range(50):
        middle = (s + after) / 2
        gap, slope = _value(poly, middle)
        s, after = (middle, after) if (slope < 0) == sign else (s, middle)
    return gap


class _Watch:
    """One boundary of a mode: its gap polynomial on the present step, and what was seen of it since
    the mode was entered.
    """

    def __init__(self, which, sign, boundary, entered):
        self.which, self.sign, self.boundary, self.entered = which, sign, boundary, entered
        self.depth, self.margin, self.slope = mpf(0), mp.inf, None

    def load(self, xs, h, inside):
        self.poly = [self.sign * c for c in xs]
        self.poly[0] -= self.sign * self.boundary
        self.bound = sum(
            k * (k - 1) * abs(c) * h ** (k - 2) for k, c in enumerate(self.poly) if k > 1
        )
        self.inside = inside  # False on the step that starts on this boundary

    def look(self, s, last):
        """Gap at s; turning points between the last point and this one are noted."""
        gap, slope = _value(self.poly, s)
        if self.slope is not None and (slope < 0) != (self.slope < 0):
            turned = _turn(self.poly, last, s)
            if slope > 0:
                self.margin = min(self.margin, turned)
            else:
                self.depth = max(self.depth, turned)
        self.slope = slope
        self.depth = max(self.depth, gap)
        return gap, slope

    def leave(self, h):
        """Time until which the boundary that the step starts on can't be met again: g >= s^k (g_k -
        s sum of the later |g_j| h^(j-k-1)).
        """
        k = next(k for k, c in enumerate(self.poly) if c)
        if self.poly[k] < 0:
            raise ArithmeticError("the motion leaves the mode at its start")
        return self.poly[k] / (
            2 * sum(abs(c) * h ** (j - k - 1) for j, c in enumerate(self.poly) if j > k)
        )

    def reach(self, gap, slope):
        """Time until which this boundary can't be reached."""
        root = mp.sqrt(slope * slope + 2 * self.bound * gap)
        return (slope + root) / self.bound if slope > 0 else 2 * gap / (root - slope)


def _first_contact(watches, h, tiny):
    """First root of any watched gap polynomial in (0, h]: (s, watch), or (h, None)."""
    s = last = mpf(0)
    while True:
        steps = []
        for watch in watches:
            gap, slope = watch.look(s, last)
            if s == 0 and not watch.inside:
                steps.append(watch.leave(h))
                continue
            if gap < tiny:
                if slope * slope < 1000 * tiny * watch.bound:
                    raise ArithmeticError(f"tangency closer than {mp.nstr(tiny, 3)} m")
                for _ in range(3):
                    gap, slope = _value(watch.poly, s)
                    s -= gap / slope
                return (s, watch) if s <= h else (h, None)
            steps.append(watch.reach(gap, slope))
        if s >= h:
            return h, None
        last, s = s, min(s + min(steps), h)


def _watches(mode, rig, entered):
    if mode:
        return [_Watch(mode, 1 if mode == UPPER else -1, rig["boundary"][mode], entered == mode)]
    return [
        _Watch(k, 1 if k == LOWER else -1, rig["boundary"][k], entered == k) for k in (LOWER, UPPER)
    ]


def _start_mode(rig, t, x, v):
    """Mode at the start and the boundary stood on; there the first non-zero derivative decides (the
    same in both modes up to the third).
    """
    lower, upper = rig["boundary"][LOWER], rig["boundary"][UPPER]
    if x not in (lower, upper):
        return (UPPER if x > upper else LOWER if x < lower else FREE), FREE
    rising = next((c > 0 for c in _series(rig, FREE, t, x, v, 3)[1:] if c), None)
    if rising is None:
        raise ArithmeticError("resting on a boundary")
    if x == upper:
        return (UPPER if rising else FREE), UPPER
    return (FREE if rising else LOWER), LOWER


def _rig(parameters):
    """Parameters per unit of mass, in mpf."""
    p = {name: mpf(value) for name, value in parameters.items()}
    wn = 2 * mp.pi * p["natural_frequency"]
    amplitude = p["drive"] if "drive" in p else drive(p["force"], p["frequency"])
    return {
        "wn2": wn**2,
        "decay": 2 * p["damping_ratio"] * wn,
        "w": 2 * mp.pi * p["frequency"],
        "drive": amplitude / p["mass"],
        "cubic": p.get("cubic", mpf(0)) / p["mass"],
        "stiffness": p["contact_stiffness"] / p["mass"],
        "boundary": {LOWER: -p["lower_gap"], UPPER: p["upper_gap"]},
    }


def simulate(parameters, x, v, periods, *, digits=40, order=ORDER) -> Trajectory:
    """One trajectory of the rig from t = 0 over a number of forcing periods.

    Parameters
    ----------
    parameters : dict of str to float or str
        mass [kg], damping_ratio, natural_frequency [Hz], cubic [N/m^3] (0 if absent),
        contact_stiffness [N/m], lower_gap, upper_gap [m], frequency [Hz] and either force [N] (see
        :func:`drive`) or drive [N], the amplitude itself. A string is read to full precision.
    x, v : float or str
        Start [m], [m/s].
    periods : int
        Whole periods.
    digits, order : int
        Digits wanted and order of the series; two orders that agree are a check.

    Raises
    ------
    ArithmeticError
        A tangency that the digits can't decide, or a start resting on a boundary.
    """
    with mp.workdps(digits + GUARD_DIGITS):
        rig = _rig(parameters)
        x, v, t = mpf(x), mpf(v), mpf(0)
        t_end = periods / mpf(parameters["frequency"])
        tolerance, tiny = mpf(10) ** -(digits + 4), mpf(10) ** -(digits + 2)
        mode, entered = _start_mode(rig, t, x, v)
        times, guards, velocities, margin = [], [], [], mp.inf
        watches = _watches(mode, rig, entered)
        on = entered
        while t < t_end:
            xs = _series(rig, mode, t, x, v, order)
            h = min(_step_size(xs, tolerance), t_end - t)
            for watch in watches:
                watch.load(xs, h, on != watch.which)
            s, hit = _first_contact(watches, h, tiny)
            x, v = _value(xs, s)
            t, on = (t_end if hit is None and s == t_end - t else t + s), FREE
            margin = min([margin] + [watch.margin for watch in watches])
            if hit is None:
                continue
            if hit.entered:
                margin = min(margin, hit.depth)
            x, on = hit.boundary, hit.which
            times.append(t)
            guards.append(on)
            velocities.append(v)
            mode = on if mode == FREE else FREE
            watches = _watches(mode, rig, on)
        return Trajectory(times, guards, velocities, x, v, margin)
