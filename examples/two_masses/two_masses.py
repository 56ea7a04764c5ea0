"""A system of one's own: two masses in a row, the second in front of an elastic stop. Used by the
study beside this file.
"""

import saltus as sl


@sl.system(
    states="x1 v1 x2 v2",
    forced_at="frequency",
    units={
        "x1": "m", "v1": "m/s", "x2": "m", "v2": "m/s", "first_mass": "kg", "second_mass": "kg",
        "ground_stiffness": "N/m",
        "coupling_stiffness": "N/m", "ground_damping": "N*s/m", "coupling_damping": "N*s/m",
        "stop_stiffness": "N/m", "stop_gap": "m",
        "force": "N", "frequency": "Hz",
    },
)  # fmt: skip
def rig(
    t, x1, v1, x2, v2, *, first_mass=2.0, second_mass=1.0, ground_stiffness=4e3,
    coupling_stiffness=2e3, ground_damping=8.0,
    coupling_damping=4.0, stop_stiffness=2e5, stop_gap=1e-3, force=2.0, frequency=6.0,
):  # fmt: skip
    """Two masses; the first is shaken, the second meets a stop. Without it the undamped natural
    frequencies are 5.033 and 10.066 Hz.
    """
    stop = sl.piecewise((stop_stiffness * (x2 - stop_gap), x2 > stop_gap), otherwise=0)
    ground = ground_stiffness * x1 + ground_damping * v1
    coupling = coupling_stiffness * (x2 - x1) + coupling_damping * (v2 - v1)
    drive = force * sl.cos(2 * sl.pi * frequency * t)
    return v1, (drive - ground + coupling) / first_mass, v2, (-coupling - stop) / second_mass
