"""Template: forces along a motion, integrated by Gauss's rule between the instants at which it
meets boundaries.
"""

from __future__ import annotations

import math

#: Nodes of Gauss's rule on an interval beyond half its turns and some of their cube root, and
#: further ones for each bend of the angle.
BEYOND, FOR_BEND = 5, 15
#: Most nodes of a rule, and the step from one rule to the next; longer intervals are divided.
MOST_NODES, RULE_STEP = 96, 4
#: Distance from an instant within which depths are rounding [rad].
BESIDE = 1e-12


@kernel
def nodes_for(turns, bent):
    """Nodes that integrate a series over some turns to rounding."""
    return math.ceil(turns + 4.5 * turns ** (1.0 / 3.0)) + BEYOND + FOR_BEND * bent


@kernel
def add_node(angle, weight, aside, mode, pace, states, p, here, y, out, integrals):
    """Add the forces at an angle, and their slopes, times a weight and the basis."""
    write_basis(angle, (len(here) - 1) // 2, here)
    write_states(states, here, y)
    forces(angle * pace, y, p, mode, out)
    for r in range(len(out)):
        if aside and not math.isfinite(out[r]):
            continue  # a power of a depth isn't defined where rounding makes that negative
        share = weight * out[r]
        for k in range(len(here)):
            integrals[r, k] += share * here[k]


@kernel
def integrate(
    begin, length, mode, count, whole, degree, bent, pace, states, p, place, weigh, here, y, out,
    integrals,
):  # fmt: skip
    """Integrals over the circle of forces and slopes times the basis, over pi, f8[r, 4H + 1].

    Between instants by Gauss's rules; the ``whole`` circle by equidistant angles. ``bent``: a sine
    takes the angle to the ends of an interval with no slope, so many times (pieces.py).
    """
    integrals[:] = 0.0
    if whole:
        for i in range(degree + 1):
            angle = 2.0 * math.pi * i / (degree + 1)
            add_node(
                angle, 2.0 / (degree + 1), bent > 0 and i == 0, mode[0], pace, states, p, here, y,
                out, integrals,
            )  # fmt: skip
        return
    for i in range(count):
        turns, parts = 0.25 * degree * length[i] * (0.5 * math.pi) ** bent, 1
        while nodes_for(turns / parts, bent) > MOST_NODES:
            parts += 1
        rule = (nodes_for(turns / parts, bent) + RULE_STEP - 1) // RULE_STEP
        first = RULE_STEP * rule * (rule - 1) // 2
        for part in range(parts):
            for node in range(first, first + RULE_STEP * rule):
                share, weight = (part + place[node]) / parts, weigh[node] / parts
                for _ in range(bent):
                    turned = math.pi * (share - 0.5)
                    weight *= 0.5 * math.pi * math.cos(turned)
                    share = 0.5 + 0.5 * math.sin(turned)
                angle, end = begin[i] + length[i] * share, begin[i] + length[i]
                aside = bent > 0 and min(angle - begin[i], end - angle) < BESIDE
                add_node(
                    angle, length[i] * weight / math.pi, aside, mode[i], pace, states, p, here, y,
                    out, integrals,
                )  # fmt: skip
