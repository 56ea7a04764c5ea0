"""Made-up sections, spectra, impact statistics and energy balances: what the tests of results and
pictures share.
"""

import numpy as np

import made_results
from saltus.results import Guards
from saltus.results.dataset import schema

GUARDS = Guards(["lower_gap", "upper_gap"], ["x", "x"], np.array([0.0, 4e-4]))
UNITS = {"x": "m", "v": "m/s", "force": "N"}
WORK = {
    "steps": 10,
    "rejected_steps": 0,
    "mode_violations": 0,
    "grazes_unresolved": 0,
    "end_time": 1.0,
}


def common(count, states=("x", "v")):
    return dict(
        states=states, units=UNITS, guards=GUARDS, status=["ok"] * count,
        end={name: np.zeros(count) for name in states},
        forcing_period=0.5, attrs={"system": "rig"}, batch=count > 1,
    )  # fmt: skip


def each(count, **more):
    return {name: np.repeat(value, count) for name, value in WORK.items()} | more


def section(count=1, rows=4):
    index = np.arange(rows)
    table = {
        "x": np.full(rows, 3e-4), "v": 0.1 * np.cos(index), "crossing_time": 0.3 * index,
        "crossing_time_error": np.full(rows, 1e-15),
        "crossing_period": index // 2, "crossing_phase": (0.6 * index) % 1,
        "crossing_direction": 1 - 2 * (index % 2),
        "crossing_rate": 0.1 * np.cos(index),
        "crossing_kind": np.where(index == 3, "graze_unresolved", "crossing"),
        "crossing_trajectory": index % count,
    }  # fmt: skip
    kept = each(
        count,
        crossings=np.full(count, rows // count),
        tangencies=np.zeros(count),
        contacts=np.full(count, 2),
    )
    ds = made_results.motion(
        schema.SECTION, **common(count), each=kept, table=table, words={"<surface rate>": "m/s"}
    )
    return ds.assign_attrs(surface="x = 0.3 mm", direction=0)


def impacts(count=1):
    zeros = np.zeros((count, 2))
    names = ("contacts_per_second", "speed_mean", "share_in_contact")
    table = {
        "contact_time": np.array([0.1]),
        "contact_speed": np.array([0.2]),
        "contact_guard": np.array(["lower_gap"]),
    }
    table |= {"contact_trajectory": np.array([0]), "contact_side": np.array([-1, 1])}
    kept = each(
        count,
        **dict.fromkeys(names, zeros + 0.5),
        contacts=zeros + 1,
        speed_histogram=np.ones((count, 2, 3)),
    )
    edges = {"speed_low": np.arange(3) * 0.1, "speed_high": np.arange(1, 4) * 0.1}
    return made_results.motion(schema.IMPACTS, **common(count), each=kept, table=table | edges)


def energy(count=1, along=None):
    parts = {
        name: np.full((count, 5), value)
        for name, value in zip(("energy", "change", "supplied"), (2e-3, 1e-3, 3e-3), strict=True)
    }
    parts |= {
        "dissipated": np.full((count, 5), 2e-3),
        "residual": np.zeros((count, 5)),
        "imbalance": np.full(count, 1e-15),
    }
    coords = {"time": np.arange(5) * 0.1} if along else {"period": np.arange(1, 6)}
    return made_results.motion(
        schema.ENERGY, **common(count), each=each(count, **parts), table=coords, along=along
    )


def spectrum(count=1, own=False, window="none"):
    order = np.arange(9) / 2
    amplitude = {name: np.tile(10.0 ** -np.arange(9), (count, 1)) for name in ("x", "v")}
    frequency = np.outer([2.0, 4.0], order) if own else order * 2.0
    return made_results.spectrum(
        states=("x", "v"), units=UNITS, frequency=frequency, order=order, amplitude=amplitude,
        phase=amplitude, batch=count > 1,
        each={"window": [window] * count, "noise_bandwidth": [1.0] * count,
            "response_period": [2 if window == "none" else 0] * count,
              "status": ["ok"] * count},
        forcing_period=np.array([0.5, 0.25]) if own else 0.5, attrs={"system": "rig"},
    )  # fmt: skip
