"""Draws docs/pictures/basins.png: the basins of the rig's five responses at 15 Hz, a start a pixel.
Takes ten seconds.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import saltus as sl


def main(file: Path, count: int = 400) -> None:
    """Compute, draw, write."""
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    map_ = sl.basins(rig, x=("-5 mm", "5 mm", count), v=("-1 m/s", "1 m/s", count))
    with sl.plot.style():
        axes = sl.plot.basins(map_)
        axes.set_title(f"case b, 4 N at 15 Hz: {count} x {count} starts", loc="left")
        axes.figure.savefig(file, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
