"""Piecewise smooth systems of any size to 40 digits: Taylor series in mpmath, contacts isolated by
proof as in :mod:`high_precision`.

A system is two functions: the Taylor coefficients of its states in a frozen mode, and those of its
gaps. Nothing here is shared with the package.
"""

from __future__ import annotations

from collections.abc import Callable

from mpmath import mp, mpf

from .high_precision import ORDER, _first_contact, _value, _Watch

DIGITS = 40
#: Coefficients of the states, a list for each: (parameters, sides, time, states, order).
Series = Callable[[dict, list[bool], mpf, list, int], list[list]]
#: Coefficients of the gaps, a list for each: (parameters, coefficients of the states).
Gaps = Callable[[dict, list[list]], list[list]]


def simulate(series: Series, gaps: Gaps, parameters: dict, start: list, t_end) -> list[tuple]:
    """The contacts of one trajectory from t = 0: (time [s], number of the gap).

    Raises
    ------
    ArithmeticError
        A tangency that the digits can't decide.
    """
    with mp.workdps(DIGITS + 10):
        p = {name: mpf(value) for name, value in parameters.items()}
        y, t, t_end = [mpf(value) for value in start], mpf(0), mpf(t_end)
        sides = [gap[0] > 0 for gap in gaps(p, [[value] for value in y])]
        found, on = [], None
        while t < t_end:
            terms = series(p, sides, t, y, ORDER)
            h = min(_step(terms), t_end - t)
            watches = [_Watch(i, 1 if side else -1, mpf(0), False) for i, side in enumerate(sides)]
            for watch, gap in zip(watches, gaps(p, terms), strict=True):
                if on == watch.which:
                    gap[0] = mpf(0)  # the state stands on this boundary
                watch.load(gap, h, on != watch.which)
            s, hit = _first_contact(watches, h, mpf(10) ** -(DIGITS + 2))
            y, t, on = [_value(row, s)[0] for row in terms], t + s, None
            if hit is not None:
                on = hit.which
                sides[on] = not sides[on]
                found.append((t, on))
        return found


def _step(terms: list[list]) -> mpf:
    """Step over which the last terms of every state stay below the digits wanted, relative to its
    leading ones.
    """
    steps = []
    for row in terms:
        scale = max(abs(row[0]), abs(row[1]) / 100, mpf(10) ** -12)
        steps += [
            (mpf(10) ** -(DIGITS + 4) * scale / abs(row[k])) ** (mpf(1) / k)
            for k in (ORDER - 1, ORDER)
            if row[k]
        ]
    return min(steps)


# -- the systems -----------------------------------------------------------------------------------
def two_masses_series(p: dict, sides: list[bool], t, y: list, order: int) -> list[list]:
    """x, y, v, w of two masses with clearances of both signs at the first and between the two
    (conformance/systems.py: two_masses).
    """
    x, z, v, w = ([value] for value in y)
    phase, rate, factor = 2 * mp.pi * p["f"] * t, 2 * mp.pi * p["f"], p["A"]
    wave = (mp.cos(phase), -mp.sin(phase), -mp.cos(phase), mp.sin(phase))
    stop, place = (
        (p["ka"], p["ga"]) if sides[0] else (mpf(0), mpf(0)) if sides[1] else (p["kb"], -p["gb"])
    )
    between, gap = (
        (p["kd"], p["gd"]) if sides[2] else (mpf(0), mpf(0)) if sides[3] else (p["ke"], -p["ge"])
    )
    for n in range(order):
        apart = z[n] - x[n]
        one = 1 if n == 0 else 0
        inner = p["k2"] * apart + p["c2"] * (w[n] - v[n]) + between * (apart - one * gap)
        a = (
            factor * wave[n % 4]
            - p["k1"] * x[n]
            - p["c1"] * v[n]
            - stop * (x[n] - one * place)
            + inner
        )
        for row, derivative in ((x, v[n]), (z, w[n]), (v, a), (w, -p["mu"] * inner)):
            row.append(derivative / (n + 1))
        factor *= rate / (n + 1)
    return [x, z, v, w]


def two_masses_gaps(p: dict, terms: list[list]) -> list[list]:
    """x - ga, x + gb, y - x - gd, y - x + ge."""
    x = terms[0]
    apart = [b - a for a, b in zip(terms[0], terms[1], strict=True)]
    rows = ((x, -p["ga"]), (x, p["gb"]), (apart, -p["gd"]), (apart, p["ge"]))
    return [[row[0] + offset, *row[1:]] for row, offset in rows]


def circuit_series(p: dict, sides: list[bool], t, y: list, order: int) -> list[list]:
    """x, y, z of Chua's circuit with a third kink abs(x - h) and a cubic term
    (conformance/systems.py: circuit).
    """
    x, u, z = ([value] for value in y)
    squares: list = []
    slope, offset = (
        (p["m1"], (p["m0"] - p["m1"]) * p["b"])
        if sides[0]
        else (p["m0"], mpf(0))
        if sides[1]
        else (p["m1"], (p["m1"] - p["m0"]) * p["b"])
    )
    side = 1 if sides[2] else -1
    for n in range(order):
        one = 1 if n == 0 else 0
        squares.append(mp.fdot(u, reversed(u)))
        cube = mp.fdot(squares, reversed(u))
        rates = (
            p["al"] * (u[n] - x[n] - slope * x[n] - one * offset),
            x[n] - u[n] + z[n] - p["e"] * cube,
            -p["be"] * u[n] - mpf("0.05") * side * (x[n] - one * p["h"]),
        )
        for row, rate in zip((x, u, z), rates, strict=True):
            row.append(rate / (n + 1))
    return [x, u, z]


def circuit_gaps(p: dict, terms: list[list]) -> list[list]:
    """x - b, x + b, x - h."""
    x = terms[0]
    return [[x[0] + offset, *x[1:]] for offset in (-p["b"], p["b"], -p["h"])]
