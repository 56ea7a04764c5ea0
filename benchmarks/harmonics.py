"""Harmonic balance: a beam of 2000 degrees of freedom with two stops, and the rig, beside a plain
alternating frequency-time method (AFT) of our own in the same run, and exact branches.

    OPENBLAS_NUM_THREADS=1 python benchmarks/harmonics.py

CPU time of one thread. The AFT samples the motion at 1024 places of a period, adds up the force
there, and takes its Fourier coefficients and their derivatives by products of matrices, as NLvib
does; it is written in NumPy, and has the same linear response and the same unknowns, so what
differs is how the force is integrated. Its error is the distance of its own solution from that of
the equations with exact contact instants.
"""

from __future__ import annotations

import functools
import sys
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "src"))

import saltus as sl
from saltus.analysis.branches.arclength import correct, tangents
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.language.evaluate import evaluate

SAMPLES = 1024


def cantilever(elements, length=1.0, width=0.02, height=0.005, modulus=2.1e11, density=7850.0):
    """Mass and stiffness of a clamped beam, sparse, two degrees of freedom a node."""
    area, inertia, le = width * height, width * height**3 / 12, length / elements
    bend = modulus * inertia / le**3 * np.array([
        [12, 6 * le, -12, 6 * le], [6 * le, 4 * le**2, -6 * le, 2 * le**2],
        [-12, -6 * le, 12, -6 * le], [6 * le, 2 * le**2, -6 * le, 4 * le**2]])  # fmt: skip
    weigh = density * area * le / 420 * np.array([
        [156, 22 * le, 54, -13 * le], [22 * le, 4 * le**2, 13 * le, -3 * le**2],
        [54, 13 * le, 156, -22 * le], [-13 * le, -3 * le**2, -22 * le, 4 * le**2]])  # fmt: skip
    rows, columns = np.meshgrid(range(4), range(4), indexing="ij")
    first = 2 * np.arange(elements)[:, None, None]
    place = (first + rows).ravel(), (first + columns).ravel()

    def whole(one):
        values = np.broadcast_to(one, (elements, 4, 4)).ravel()
        return sp.csc_matrix((values, place), shape=(2 * elements + 2,) * 2)[2:, 2:]

    return whole(weigh), whole(bend)


def beam(elements=1000, modes=8):
    """The beam with stops at its tip and its middle."""
    mass, stiffness = cantilever(elements)
    names = [f"{kind}{node}" for node in range(1, elements + 1) for kind in "wr"]
    tip, middle = f"w{elements}", f"w{elements // 2}"
    return sl.structure(
        mass, stiffness, 1e-5 * stiffness + 0.2 * mass, modes=modes, residual=True, names=names,
        frequency="4.5 Hz", name="beam", forces=[sl.Force(tip, "0.05 N")],
        sensors={"tip": tip, "middle": middle},
        contacts=[sl.Contact(tip, stiffness="2 kN/m", gap="1 mm", side="both"),
                  sl.Contact(middle, stiffness="2 kN/m", gap="0.5 mm", side="both")],
    )  # fmt: skip


class Sampled(HarmonicOrbits):
    """The equations as the AFT of the literature has them: forces at equidistant samples."""

    def _of(self, z):
        forces, harmonics, signals = self.forces, self.harmonics, self.signals(z)
        constants, slopes, rate, rate_by = self._constants(z)
        angle, here = samples(harmonics)
        states = forces.states(signals, rate)
        seen = here @ states.T
        numbers, gaps = forces._gaps(states, constants)
        bits = np.zeros((SAMPLES, len(forces.system.guards)), bool)
        bits[:, numbers] = here @ gaps.T > 0
        found = evaluate(
            forces._entries, **forces.motion(angle, seen, constants), bits=list(bits.T)
        )
        found = np.array([np.broadcast_to(one, SAMPLES) for one in found])
        back = here.T * (2.0 / SAMPLES)
        back[0] *= 0.5
        width, size = 2 * harmonics + 1, self.size
        whole = np.zeros((forces.count, width, 1 + size + len(constants)))
        whole[:, :, 0] = found[: forces.count] @ back.T
        for (i, j), slope in zip(forces._known, found[forces.count :], strict=True):
            if j >= len(forces.moving):
                whole[i, :, 1 + size + j - len(forces.moving)] += back @ slope
                continue
            first, times = 1 + forces._signal[j] * width, forces._times[j]
            derived = fourier.derivative(np.eye(width), times).T * rate**times
            whole[i, :, first : first + width] += (back * slope) @ (here @ derived)
            shift = back @ (slope * seen[:, j]) * times
            whole[i, :, 1 + size :] += np.outer(shift, rate_by)
        response, by_rate = (one[0] + 1j * one[1] for one in self.source.response(harmonics, rate))
        moved = responses(response, whole).reshape(size, -1) / constants[0]
        turned = responses(by_rate, whole[:, :, :1]).ravel() / constants[0]
        derivative = np.empty((size, self.width))
        derivative[:, :size] = np.diag(self._own) - moved[:, 1 : 1 + size]
        by = -moved[:, 1 + size :] - np.outer(turned, rate_by)
        by[:, 0] += moved[:, 0] / constants[0]
        derivative[:, size:] = by @ slopes
        return self._own * z[:size] - moved[:, 0], derivative


def responses(blocks, series):
    """Series float64[m, 2H + 1, n] whose amplitudes are multiplied by complex128[H + 1, c, m]."""
    amplitudes = fourier.to_complex(series.swapaxes(1, 2))  # m, n, H + 1
    found = np.einsum("kcm,mnk->cnk", blocks, amplitudes)
    return fourier.of_complex(found).swapaxes(1, 2)


@functools.lru_cache(maxsize=8)
def samples(harmonics):
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    return angle, fourier.basis(angle, harmonics)


def equations(system, harmonics, scale, kind=HarmonicOrbits):
    """Those of one motion over the frequency."""
    return kind(system, ("frequency",), harmonics, 1, scale[None])


def closed(orbits, z):
    """The motion that Newton's method leads to at its frequency, and the evaluations it took."""
    unit = orbits.scale[0]
    for count in range(1, 40):
        residual, derivative = orbits.evaluate(z[None], np.zeros(1, int))
        step = np.linalg.solve(derivative[0][:, :-1], -residual[0])
        z = z + np.append(step, 0.0) * unit
        if np.abs(step).max() < 1e-12:
            return z, count
    return z, -1


def cost(function, seconds=0.3):
    """CPU time of a call [ms]."""
    begin, count = time.process_time(), 0
    while time.process_time() - begin < seconds:
        function()
        count += 1
    return 1e3 * (time.process_time() - begin) / count


def of_beam():
    begin = time.process_time()
    system = beam()
    made = time.process_time() - begin
    options = {"at": 1, "by": sl.HarmonicBalance(7), "switch": (), "progress": False}
    print(
        "A clamped beam of 2000 degrees of freedom, 2 stops on both sides, 7 harmonics: "
        f"{len(system.states) // 2} coordinates, made in {made:.2f} s"
    )
    print("| points | CPU time, first point included [s] | folds [Hz] | those that touch |")
    print("|---|---|---|---|")
    for most in (20, 200):
        begin = time.process_time()
        found = sl.branches(system, {"frequency": ("4.3 Hz", "8 Hz")}, points=most, **options)
        took = time.process_time() - begin
        folds = found.event_frequency.values[found.event_kind.values == "fold"]
        off = found.point_error.values[found.point_contacts.values > 0]
        print(
            f"| {found.sizes['point']} | {took:.2f} | {', '.join(f'{f:.6f}' for f in folds)} | "
            f"{len(off)}, median error {np.nanmedian(off):.1e}, "
            f"{np.isnan(off).sum()} without an exact orbit |"
        )
    i = int(np.argmax(found.point_contacts.values))
    c = found.point_harmonic_real.values[i] + 1j * found.point_harmonic_imag.values[i]
    compare(system, 7, fourier.of_complex(c), float(found.point_frequency[i]))


def compare(system, harmonics, states, frequency):
    """One motion by exact instants and by samples."""
    one = equations(system, harmonics, np.ones(1))
    z = one.of_states(states[: len(system.states)], frequency)
    unit = np.append(np.full(one.size, np.abs(z[:-1]).max()), 1.0)
    exact, aft = (equations(system, harmonics, unit, kind) for kind in (HarmonicOrbits, Sampled))
    (z, _), (sampled, more) = closed(exact, z), closed(aft, z)
    off = np.abs(z - sampled)[:-1].max() / unit[0]
    print(
        f"one motion with {len(exact.intervals(z).begin)} intervals: exact instants "
        f"{cost(lambda: exact.evaluate(z[None], np.zeros(1, int))):.2f} ms an evaluation, "
        f"AFT of {SAMPLES} samples {cost(lambda: aft.evaluate(z[None], np.zeros(1, int))):.2f} ms, "
        f"off by {off:.1e} of the largest harmonic ({more} steps)\n"
    )


def of_point(system, found):
    """CPU time of an evaluation at the first motion of a result, and of a point that converges from
    a step along the tangent there [ms], as text.
    """
    c = found.point_harmonic_real.values[0] + 1j * found.point_harmonic_imag.values[0]
    one = equations(system, c.shape[1] - 1, np.ones(1))
    one.scale = np.append(np.full(one.size, 1e-2), 1.0)[None]
    z = one.of_states(fourier.of_complex(c), float(found.point_frequency[0]))[None]
    row = np.zeros(1, int)
    along = tangents(one.evaluate(z, row)[1], np.eye(one.width)[-1:])
    guess = z + 0.05 * along * one.scale
    times = (
        cost(lambda: one.evaluate(z, row)),
        cost(lambda: correct(one, guess, along, row, foresee=True)),
    )
    return "{:.3f} | {:.2f}".format(*times)


def of_rig():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    start, limits = {"x": "5 mm", "v": 0}, {"frequency": ("14 Hz", "18 Hz")}
    print("The rig, case b, 4 N, 14 to 18 Hz")
    print(
        "| | evaluation [ms] | converged point [ms] | points | CPU time a point of a branch [ms] | "
        "fold [Hz] | median error |"
    )
    print("|---|---|---|---|---|---|---|")
    for count in (None, 3, 5, 9, 15, 31, 63):
        options = {} if count is None else {"by": sl.HarmonicBalance(count)}
        sl.branches(
            rig, {"frequency": (15.0, 15.1)}, start, at=1, progress=False, points=2, **options
        )
        begin = time.process_time()
        found = sl.branches(rig, limits, start, at=1, switch=(), progress=False, **options)
        took = 1e3 * (time.process_time() - begin) / found.sizes["point"]
        folds = found.event_frequency.values[found.event_kind.values == "fold"]
        error = "" if count is None else f"{float(np.nanmedian(found.point_error)):.1e}"
        print(
            f"| {'exact' if count is None else f'H = {count}'} | "
            f"{' | ' if count is None else of_point(rig, found)} | {found.sizes['point']} | "
            f"{took:.1f} | "
            f"{', '.join(f'{f:.8f}' for f in folds)} | {error} |"
        )


def of_folds():
    """Folds and isolas of three models that truncated motions have, misplace and miss."""
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    box = {"x": ("-3 mm", "3 mm"), "v": ("-0.15 m/s", "0.15 m/s")}
    grid = {"contact_stiffness": ("13 kN/m", "29 kN/m", 5)}
    seeds = sl.bifurcation_diagram(rig, grid, "random 12", box=box, progress=False)
    stop, pair = sl.models.soft_stop(), sl.models.two_masses()
    for system, over, start, at in (
        (stop, {"frequency": (1.38, 2.8)}, (1.5, 0.0), 1),
        (pair, {"frequency": (0.6, 0.8)}, np.zeros(4), 4),
        (rig, {"contact_stiffness": (8e3, 30e3)}, seeds, 1),
    ):
        name = next(iter(over))
        print(f"\n{system.name} over {name}")
        print("| | branch | from | to | folds |\n|---|---|---|---|---|")
        for count in (None, 5, 9, 15):
            options = {} if count is None else {"by": sl.HarmonicBalance(count)}
            found = sl.branches(
                system, over, start, at=at, longest=1, switch=(), progress=False, **options
            )
            for number in range(found.sizes["branch"]):
                along = found[f"point_{name}"].values[found.point_branch.values == number]
                mine = (found.event_branch.values == number) & (found.event_kind.values == "fold")
                folds = np.sort(found[f"event_{name}"].values[mine])
                kind = "isola" if found.branch_closed.values[number] else "open"
                print(
                    f"| {'exact' if count is None else f'H = {count}'} | {kind} | "
                    f"{along.min():.6g} | {along.max():.6g} | "
                    f"{', '.join(f'{one:.8g}' for one in folds)} |"
                )


if __name__ == "__main__":
    of_beam()
    of_rig()
    of_folds()
