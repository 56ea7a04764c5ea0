"""Cost and correctness of maps of basins with impacts and sticking: two oscillators, 400 x 400
starts each. 2000 of these are followed alone over 1500 periods, to the attractor that is nearest
then.

    python benchmarks/laws_basins.py              400 x 400 cells
    python benchmarks/laws_basins.py --cells 100  fewer
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import xarray as xr

import saltus as sl

#: Starts that are checked, and forcing periods over which they are followed.
CHECKED, PERIODS = 2000, 1500
#: Distance from all attractors above which a motion has reached none of them.
FAR = 1e-3


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def struck(t, x, v, *, gap=0.0, restitution=0.6, damping=0.02, w=0.62):
    """An oscillator with a stop that is struck three or four times a period; on the way there
    motions chatter and rest.
    """
    return v, sl.cos(w * t) - damping * v - x, sl.impact(x < gap, v, restitution=restitution)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stick_slip(t, x, v, *, speed=0.5, slip=0.4, stick=0.6, force=0.6, w=1.2):
    """A block with a hardening spring on a belt."""
    spring = 0.7 * x + 0.3 * x**3
    rub = sl.friction(v - speed, slip=slip, stick=stick)
    return v, force * sl.cos(w * t) - spring - 0.02 * v - rub


AXES = {struck: {"x": (-3, -0.001), "v": (-3, 3)}, stick_slip: {"x": (-3, 3), "v": (-3, 3)}}


def nearest(found: xr.Dataset, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest attractor to each point, and its distance."""
    apart = [
        np.nanmin(np.hypot(x[:, None] - one_x.ravel(), v[:, None] - one_v.ravel()), axis=1)
        for one_x, one_v in zip(
            found["attractor_x"].values, found["attractor_v"].values, strict=True
        )
    ]
    return np.argmin(apart, axis=0), np.min(apart, axis=0)


def main() -> None:
    """Print a line for each system."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, default=400)
    cells = parser.parse_args().cells
    for system, axes in AXES.items():
        grid = {name: (*ends, cells) for name, ends in axes.items()}
        begin = time.perf_counter()
        found = sl.basins(system, **grid, progress=False)
        seconds = time.perf_counter() - begin
        i, j = np.random.default_rng(3).integers(0, cells, (2, CHECKED))
        start = {"x": found["x"].values[i], "v": found["v"].values[j]}
        end = sl.stroboscope(system, start, PERIODS, keep=1, progress=False)
        label, apart = nearest(found, end["x"].values[:, -1], end["v"].values[:, -1])
        other = label != found["basin"].transpose("x", "v").values[i, j]
        print(
            f"{system.name}: {cells} x {cells} starts in {seconds:.1f} s, "
            f"{found.sizes['attractor']} attractors; of {CHECKED} followed alone "
            f"{np.count_nonzero(other)} differ, {np.count_nonzero(apart > FAR)} come to none"
        )


if __name__ == "__main__":
    main()
