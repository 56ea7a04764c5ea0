"""The picture of the README: five ways in which one rig can vibrate, all at 15 Hz and 4 N. Run:
python docs/pictures/responses.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

import saltus as sl

#: Starts (x [m], v [m/s]) that settle to the five responses, in the order of their periods.
STARTS = {"x": [4e-3, 1e-3, 1.9e-3, 0.2e-3, 0.4e-3], "v": [0.3, 0.0, 0.0, 0.0, 0.0]}


def main(file: Path) -> None:
    """Simulate, find the periods, draw, write."""
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    run = sl.simulate(rig, start=STARTS, periods=2000, keep=96)
    periods = sl.settled(run).response_period.values
    with sl.plot.style():
        figure, axes = plt.subplot_mosaic(
            [["history"] * 5, list("01234")],
            figsize=(11, 5),
            height_ratios=(1, 1.25),
            layout="constrained",
        )
        sl.plot.history(
            run, len(periods) - 1, periods=24, ax=axes["history"], time="T", legend=True
        )
        axes["history"].set_title(
            f"{_times(periods[-1])}: 24 forcing periods, every contact marked"
        )
        for i, n in enumerate(periods):
            sl.plot.phase(run, i, ax=axes[str(i)], legend=False, units={"v": "mm/s"})
            axes[str(i)].set_title(_times(n), pad=24)
            if i:
                axes[str(i)].set_ylabel("")
        handles, _ = axes["4"].get_legend_handles_labels()
        figure.legend(handles[-1:], ["once a forcing period"], loc="outside lower right")
        figure.savefig(file, dpi=150)
        plt.close(figure)


def _times(n: float) -> str:
    return "period T" if n == 1 else f"period {int(n)}T"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
