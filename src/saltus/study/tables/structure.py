"""The table [system.structure] of a study file, made from :func:`saltus.structure` and what it is
given.
"""

from __future__ import annotations

from typing import Any

from saltus.study.tables.kinds import whole
from saltus.study.tables.parts import Quantity, one_or_many
from saltus.study.tables.signature import Generated, WrittenAs, table
from saltus.system.structures.parts import MOST_POWER

_PLACE = "system.structure"
_FILE = "File in the study's folder: {}"
_DRIVE = WrittenAs(
    Quantity,
    ("2 m/s^2",),
    "Amplitude of a harmonic one; or a formula of the time t, which calls tables by name, "
    "quake(t). One that holds frequency has the period of the forcing frequency.",
)
_DRIVES = {"amplitude": _DRIVE, "harmonic": whole(2, 0)}

#: A contact of a structure.
Contact: Any = table(
    f"{_PLACE}.contacts",
    ["Contact"],
    {
        "at": WrittenAs(examples=("w_12",)),
        "to": WrittenAs(examples=("w_7",)),
        "stiffness": WrittenAs(examples=("1 MN/m",)),
        "gap": WrittenAs(examples=("0.3 mm",)),
        "damping": WrittenAs(examples=("20 N*s/m",)),
        "name": WrittenAs(examples=("bumper",)),
        "restitution": WrittenAs(examples=(0.6,)),
        "power": WrittenAs(examples=(1.5,), limits={"ge": 1, "le": MOST_POWER}),
        "preload": WrittenAs(examples=("50 N",)),
        "friction": WrittenAs(examples=(0.2,)),
        "sliding": WrittenAs(str | list[str], ("u_12",)),
    },
    base=Generated,
)
#: A force on a structure.
Force: Any = table(
    f"{_PLACE}.forces",
    ["Force"],
    {
        "at": WrittenAs(examples=("w_3",)),
        "phase": WrittenAs(examples=("90 deg",)),
        "name": WrittenAs(examples=("shaker",)),
        **_DRIVES,
    },
    base=Generated,
)
#: A base that moves.
Base: Any = table(
    f"{_PLACE}.base",
    ["Base"],
    {
        "direction": WrittenAs(str | list[float] | dict[str, float], ("w",)),
        "phase": WrittenAs(Quantity, ("90 deg",)),
        "name": WrittenAs(str, ("floor",)),
        **_DRIVES,
    },
    base=Generated,
)
#: A structure.
Structure: Any = table(
    _PLACE,
    ["structure"],
    {
        "mass": WrittenAs(
            str, ("plate.npz",), _FILE.format("all matrices, .npz or .mat; or the mass, .mtx.")
        ),
        "stiffness": WrittenAs(str, ("K.mtx",), _FILE.format("the stiffness.")),
        "damping": WrittenAs(str, ("C.mtx",), _FILE.format("the damping.")),
        "contacts": WrittenAs(
            one_or_many(Contact),
            ([{"at": "w_12", "stiffness": "1 MN/m", "gap": "0.3 mm"}],),
            "Stops behind gaps, one table each.",
            [],
        ),
        "forces": WrittenAs(
            one_or_many(Force), ([{"at": "w_3", "amplitude": "2 N"}],), "One table each.", []
        ),
        "base": WrittenAs(
            one_or_many(Base),
            ([{"direction": "w", "amplitude": "quake(t)"}],),
            "Acceleration of the base, one table each.",
            [],
        ),
        "frequency": WrittenAs(examples=("15 Hz",)),
        "damping_ratio": WrittenAs(Quantity | list[Quantity], ("2 %",)),
        "modes": whole(8),
        "residual": WrittenAs(examples=(True,)),
        "names": WrittenAs(str | list[str], ("x1 x2",)),
        "sensors": WrittenAs(
            dict[str, str],
            ({"tip": "w_30", "tip acceleration": "acceleration(w_30)"},),
            "What every result holds and every picture shows, by name: a degree of freedom, the "
            "stretch between two, w_30 - w_12, velocity(...) or acceleration(...) of either, "
            "contact_force(stop).",
            {},
        ),
    },
    base=Generated,
    without=("name", "source"),
)
