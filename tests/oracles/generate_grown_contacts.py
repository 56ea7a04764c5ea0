"""Write tests/reference/grown_contacts.csv, contacts to 22 digits: ``python -m
tests.oracles.generate_grown_contacts``.

Five systems in which roundings grow most, of 120 random two-mass systems with clearances and 300
random circuits that were compared with an 80-bit integrator. Values are doubles, in the order of
the systems of tests/conformance/systems.py. Six minutes, one core.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import NamedTuple

from mpmath import mp, mpf

from . import piecewise_series as oracle

PERIODS, SPAN = 12, 30
NAMES = {"two_masses": "k1 k2 c1 c2 ka ga kb gb kd gd ke ge A f mu", "circuit": "al be m0 m1 b e h"}


class Case(NamedTuple):
    """One trajectory: values in the order of NAMES, and the start."""

    id: str
    system: str
    values: str
    start: str


# fmt: off
CASES = (
    Case(
        "masses_87", "two_masses",
        "1.2023369808256896 26.874767107912277 0.012598496763600111 0.1962444057163876 "
        "784.6302387902296 "
        "0.05019855423277736 2.3983609859381736 0.0812131458142126 25349.077861740592 "
        "0.06499338891323239 "
        "38.70554390781975 0.0761198427937724 11.750792064765447 0.7478923966944452 "
        "3.120614787498629",
        "0.06185249759655745 0.07066490837063988 0.2842273895833469 0.48617060277252566",
    ),
    Case(
        "masses_34", "two_masses",
        "7.24264809225685 12.8361201105173 0.13509000767303633 0.048754189050814654 "
        "15320.795303886624 "
        "0.06666752064284245 6277.990659584144 0.043021341437042185 28145.95866299432 "
        "0.03286478190502479 "
        "14585.650339772268 0.043659343546093146 0.2655473043978056 0.2763276017515169 "
        "8.27331475215858",
        "-0.040671246416779536 -0.03135740239879557 0.959378623911568 -0.4877147404279507",
    ),
    Case(
        "masses_31", "two_masses",
        "3.5833545839588163 4.309965315618795 0.016852395460874598 0.42194899421715387 "
        "38087.47712010293 "
        "0.11490769220641574 53.04809504610601 0.134297692905901 871221.7222143633 "
        "0.05874781671310521 "
        "65023.64348642291 0.06471043928138939 0.17783701703387023 2.808601244905522 "
        "2.915690435212857",
        "0.009620364602836634 0.13322703049544402 0.8931496486549586 0.5875114467917841",
    ),
    Case(
        "masses_28", "two_masses",
        "54.28340776656684 14.323874114535782 0.1368155331489396 0.02862735333352075 "
        "488.06133135386517 "
        "0.0834081126341087 11510.731955325484 0.06503022024720669 42717.13267038979 "
        "0.09529177988838362 "
        "3.8647319973350944 0.05982887107121178 18.69982622075018 0.44594282714517264 "
        "6.594134003228533",
        "-0.017332977245223452 0.08073664053204727 -0.9337256042193665 -0.1619288549482638",
    ),
    Case(
        "circuit_199", "circuit",
        "10.129903708475132 17.567105597606133 -1.1644775733959811 -0.7511297836547957 "
        "1.0878563162044506 "
        "0.025344672814471055 -1.6043283041854166",
        "1.4336395772714416 0.09890459434607407 1.0564577030181557",
    ),
)
# fmt: on


def solve(case: Case) -> list[tuple]:
    """Contacts of the first 12 forcing periods, or 30 s."""
    p = dict(zip(NAMES[case.system].split(), map(float, case.values.split()), strict=True))
    start = [float(value) for value in case.start.split()]
    if case.system == "two_masses":
        return oracle.simulate(
            oracle.two_masses_series, oracle.two_masses_gaps, p, start, PERIODS / mpf(p["f"])
        )
    return oracle.simulate(oracle.circuit_series, oracle.circuit_gaps, p, start, SPAN)


def write(rows: list[tuple[Case, list[tuple]]], path: Path) -> None:
    """Write the file."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*Case._fields, "guards", "contact_times_s"])
        for case, contacts in rows:
            with mp.workdps(50):
                writer.writerow(
                    [
                        *case,
                        " ".join(str(guard) for _, guard in contacts),
                        " ".join(mp.nstr(t, 22) for t, _ in contacts),
                    ]
                )


if __name__ == "__main__":
    wanted = [case for case in CASES if case.id in sys.argv[1:] or not sys.argv[1:]]
    write(
        [(case, solve(case)) for case in wanted],
        Path(__file__).parents[1] / "reference" / "grown_contacts.csv",
    )
