"""A system whose force jumps at its contacts, so that the saltation matrix isn't the identity."""

import saltus as sl


@sl.system(states="x v", forced_at="frequency", units={"frequency": "Hz"})
def jumping(
    t, x, v, *, stiffness=3.0, preload=0.6, loss=0.8, gap=0.2, other=-0.3, force=1.3, frequency=0.2
):
    """Contact with a preload (the force jumps) and a damper (it jumps with the speed), and a wall
    that moves.
    """
    pushes = sl.piecewise(
        (
            stiffness * (x - gap) + preload + loss * v,
            x > gap + 0.05 * sl.sin(2 * sl.pi * frequency * t),
        ),
        otherwise=0,
    )
    pulls = sl.piecewise((2.0 * (x - other) - preload, x < other), otherwise=0)
    return v, force * sl.cos(2 * sl.pi * frequency * t) - pushes - pulls - 0.1 * v - x
