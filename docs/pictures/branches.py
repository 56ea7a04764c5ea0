"""Draws docs/pictures/branches.png: the responses of the rig, case c at 5 Hz, over the stiffness of
its stops, stable and unstable. Takes ten seconds.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import saltus as sl

BOX = {"x": ("-5 mm", "5 mm"), "v": ("-0.5 m/s", "0.5 m/s")}


def main(file: Path) -> None:
    """Compute, draw, write."""
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    stiffness = {"contact_stiffness": ("5 kN/m", "30 kN/m", 26)}
    diagram = sl.bifurcation_diagram(rig, stiffness, "random 24", box=BOX, unstable=True)
    with sl.plot.style():
        axes = sl.plot.frequency_response(diagram, quantity="peak")
        axes.figure.savefig(file, dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
