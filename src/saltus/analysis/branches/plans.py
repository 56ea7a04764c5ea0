"""Plans by which the branches of a system are followed: over one period, or from contact to
contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from saltus.analysis.branches.leg_branches import leg_branches
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.tracing import Plan, both_ways
from saltus.analysis.branches.watch import Watch
from saltus.flow.methods import Method
from saltus.system import System
from saltus.system.leg import has_legs
from saltus.system.symmetry import is_symmetric

#: Doubled branches are followed to orbits of this number of periods.
LONGEST_DOUBLED = 2
#: Most work on all branches together where a branch has at most POINTS points, see :class:`Watch`:
#: 6000 points of 80 states, which take some five minutes, 600 of 256 states, 100 000 of 20.
MOST_WORK = 4e7
#: Most points of a branch in each direction.
POINTS = 1000
#: Events at which the branches that leave are followed.
SWITCHES = ("period_doubling", "branch_point", "hopf")


def plan_of(
    system: System,
    name: str,
    limits: tuple[float, float],
    method: Method,
    threads: int | None,
    points: int,
    longest: int,
    switch: Iterable[str],
    *,
    stable: bool = False,
    twins: bool = False,
    most: float = math.inf,
) -> Plan:
    """The plan of the branches of a system over a parameter ``name``; the rest is as in
    :class:`Plan`. ``twins``: mirror images are followed too; ``most``: see :class:`Watch`.

    Where states jump at contacts, branches are followed from contact to contact: the map over a
    period jumps when a contact crosses the whole period, and has a square root at a graze.
    """
    jumps = any(guard.law is not None and guard.law.reset for guard in system.guards)
    symmetric = not twins and is_symmetric(system, {name: limits})
    by_legs = jumps and has_legs(system)
    return Plan(
        lambda n, scale: PeriodicOrbits(system, (name,), n, scale, method, threads, symmetric),
        limits,
        points,
        longest,
        frozenset(switch),
        leg_branches if by_legs else both_ways,
        abreast=not by_legs,
        stable=stable,
        watch=Watch(most),
    )
