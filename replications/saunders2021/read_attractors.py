"""Readings for what the attractors are, with and without event location: Figs. 9, 10, 12 and 14."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from saltus.replication.claims import Data
from saltus.results.dataset.schema import kind_text

from .draw_attractors import Trio, deviations, trios
from .looks import LOOKS, strobe
from .reading import ENDS, counted, listed, multipliers, names, parameter, place_of, three

#: By the end of a job's name, what claims call this way of integrating.
SHORT = {look.end: short for look, short in zip(LOOKS, ENDS, strict=True)}
STIFF = "18.4 MN per m"


def _range(data: Data, figure: str, setting: str, trio: Trio) -> np.ndarray:
    one = data[f"{figure}/{setting}, exact, motions"].isel(trajectory=trio.number["exact"])
    return np.array([np.ptp(one[name].values) for name in ("x", "v")])


def deviation(data: Data, figure: str, settings: Sequence[str]) -> dict[str, Any]:
    """For each exact attractor the largest deviation of ode45's at whole periods, in units of the
    motion's range.
    """
    rows, places = [], []
    for setting in settings:
        here: list[dict[str, Any]] = []
        for trio in trios(data, figure, setting):
            if trio.number["exact"] >= 0:
                clouds, size = (
                    deviations(data, figure, setting, trio),
                    _range(data, figure, setting, trio),
                )
                misses = {
                    SHORT[end]: float(np.abs(cloud / size).max()) for end, cloud in clouds.items()
                }
                here.append(
                    {
                        "place": place_of(setting),
                        "name": kind_text(trio.kind, trio.period),
                        **misses,
                    }
                )
        rows += [
            {**row, "worst": max(row["on"], row["off"])}
            for row in here
            if {"on", "off"} <= row.keys()
        ]
        told = {
            end: [f"{row['name']} {_text(row.get(end))}" for row in here] for end in ("on", "off")
        }
        places.append({"place": place_of(setting), **told})
    return {"attractors": rows, "places": places}


def _text(value: float | None) -> str:
    return "not found" if value is None else f"{value:.1e}"


def _largest(data: Data, of: str, end: str, by: str) -> np.ndarray:
    """Largest exponents [1/s] along the motions of one way of integrating, one for each attractor
    that it finds.
    """
    return np.asarray(data[f"{of}, {ENDS[end]}, {by}"]["lyapunov_exponent"].values[:, 0], float)


def _numbers(values: np.ndarray) -> str:
    return ", ".join(f"{round(float(value), 2) + 0.0:.2f}" for value in values) or "no attractor"


def small(values: np.ndarray, limit: float, exact: bool) -> bool | None:
    """Whether exponents by Wolf's algorithm are small. Large ones on ode45's motions decide
    nothing: the paper's settings aren't known.
    """
    if not values.size:
        return None
    return bool((np.abs(values) < limit).all()) or (False if exact else None)


def regular(data: Data, figure: str, settings: Sequence[str], a_period: float) -> dict[str, Any]:
    """Whether all attractors are periodic and stable, and exponents by Wolf's algorithm small:
    below a limit for a forcing period.
    """
    rows, ways = [], []
    for setting in settings:
        of, ds = f"{figure}/{setting}", data[f"{figure}/{setting}, exact"]
        size, limit = float(np.nanmax(multipliers(ds))), a_period * parameter(ds, "frequency")
        row: dict[str, Any] = {
            "place": place_of(setting),
            "multiplier": size,
            "periodic": bool((ds["attractor_type"] == "periodic").all()) and size < 1,
            "exponents": _numbers(_largest(data, of, "exact", "variational")),
        }
        for end, word in (("exact", "exact"), ("on", "located"), ("off", "not located")):
            wolf = _largest(data, of, end, "wolf")
            row[end] = _numbers(wolf)
            ways.append(
                {
                    "place": row["place"],
                    "way": word,
                    "limit": limit,
                    "wolf": row[end],
                    "small": small(wolf, limit, end == "exact"),
                }
            )
        rows.append(row)
    return {"settings": rows, "ways": ways}


def periods(data: Data, of: str) -> dict[str, Any]:
    """The different periods of the exact attractors."""
    maps = three(data, of)
    return {
        **counted(maps),
        "names": names(maps["exact"]),
        "different": sorted(set(names(maps["exact"]))),
    }


def doubled(data: Data, before: str, after: str, near: float) -> dict[str, Any]:
    """Period of the dominant attractor on both sides, and how far the later one passes from a graze
    [m].
    """
    sides = [three(data, of) for of in (before, after)]
    maps = [one["exact"] for one in sides]
    main = [int(np.argmax(ds["attractor_fraction"].values)) for ds in maps]
    first, second = (int(ds["attractor_period"][i]) for ds, i in zip(maps, main, strict=True))
    return {
        "own": "; ".join(listed(one["on"]) for one in sides), "exact": "; ".join(map(listed, maps)),
        "before": first, "after": second, "near": near,
        "margin": float(maps[1]["attractor_margin"][main[1]]),
        "limit": near * parameter(maps[1], "upper_gap"),
    }  # fmt: skip


# -- Fig. 14 ---------------------------------------------------------------------------------------
def _spread(data: Data, period: int) -> dict[str, Any]:
    """Scatter of states at whole periods about their own means, in units of the motion's range, of
    the first attractor of a period.
    """
    found: dict[str, Any] = dict.fromkeys(ENDS)
    trio = next(
        (
            one
            for one in trios(data, "fig13", STIFF)
            if one.period == period and one.number["exact"] >= 0
        ),
        None,
    )
    if trio is not None:
        size = _range(data, "fig13", STIFF, trio)
        for end, short in SHORT.items():
            if trio.number[end] >= 0:
                points = strobe(data[f"fig13/{STIFF}, {end}, motions"], trio.number[end])
                rows = points[: len(points) // period * period].reshape(-1, period, 2)
                found[short] = float((np.abs(rows - rows.mean(axis=0)) / size).max())
    return found | {f"{short}_told": _text(found[short]) for short in ENDS}


def smeared(data: Data, period: int) -> dict[str, Any]:
    """Scatter and stability of the attractors of a period."""
    ds = data[f"fig13/{STIFF}, exact"]
    here = ds["attractor_period"].values == period
    largest = float(multipliers(ds)[here].max()) if here.any() else np.nan
    return {
        **_spread(data, period),
        "name": kind_text("periodic", period),
        "count": here.sum(),
        "largest": largest,
        "stable": largest < 1,
    }


def chaotic(data: Data) -> dict[str, Any]:
    """How many motions are chaotic by their exponents, by each way of integrating, and how many
    attractors have five points.
    """
    found: dict[str, Any] = {}
    maps = three(data, f"fig13/{STIFF}")
    for end, ds in maps.items():
        kinds = data[f"fig13/{STIFF}, {ENDS[end]}, variational"]["kind"].values
        found |= {
            f"{end}_chaotic": int((kinds == "chaotic").sum()),
            f"{end}_five": int((ds["attractor_period"] == 5).sum()),
            f"{end}_rates": _numbers(_largest(data, f"fig13/{STIFF}", end, "variational")),
        }
    return {
        **counted(maps),
        **found,
        "only_own": bool(found["on_chaotic"]) and not found["exact_chaotic"],
        "starts": maps["exact"]["basin"].size,
        "seen": 100 * maps["exact"].attrs["smallest_basin_seen"],
    }


def coarse(data: Data, period: int) -> dict[str, Any]:
    """Which maps have an attractor of a period, and how it scatters."""
    maps = three(data, f"fig13/{STIFF}")
    own = [name for name in names(maps["on"]) if name in names(maps["off"])]
    scatter = {f"{end}_scatter": value for end, value in _spread(data, period).items()}
    return {**counted(maps), **scatter, "names": names(maps["exact"]), "own_names": own}


def exponents(data: Data) -> dict[str, Any]:
    """Exponents at stiff contact, by the variational equations and by Wolf's algorithm."""
    of, kinds = f"fig13/{STIFF}", names(data[f"fig13/{STIFF}, exact"])
    high = data[f"{of}, exact, variational"]["lyapunov_high"].values[:, 0]
    own = {end: float(np.nanmax(_largest(data, of, end, "variational"))) for end in ENDS}
    return {
        "attractors": [{"name": name, "high": float(value)} for name,
            value in zip(kinds, high, strict=True)], "names": kinds, **own,
        "rates": _numbers(_largest(data, of, "exact", "variational")),
        **{f"{end}_wolf": _numbers(_largest(data, of, end, "wolf")) for end in ENDS},
        "only_own": max(own["on"], own["off"]) > 0 > own["exact"],
    }  # fmt: skip
