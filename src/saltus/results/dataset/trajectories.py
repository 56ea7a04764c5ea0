"""Tables of what ``simulate`` and ``stroboscope`` return."""

from __future__ import annotations

from saltus.results.dataset.variable import (
    COUNTERS,
    END_STATES,
    END_TIME,
    GUARDS,
    MINIMA,
    SHARED,
    STATUS,
    Variable,
)

_CONTACT = ("contact",)

#: Variables of what ``simulate`` returns. Trajectories with forcing periods of their own share
#: phases, not times: their samples lie along ``period`` in place of ``time``. Contacts are one
#: table for all trajectories.
TRAJECTORY_VARIABLES = {
    "<state>": Variable(("trajectory", "time"), "<state>", "<state>"),
    "time": Variable(("trajectory?", "time"), "s", "time", coord=True),
    "period": Variable(("time",), "1", "time in forcing periods", coord=True),
    "mode": Variable(
        ("trajectory", "time"),
        "1",
        "sides of the guards: bit i is set where gap i is positive",
        "i8",
    ),
    "contact_time": Variable(_CONTACT, "s", "time of the contact"),
    "contact_time_error": Variable(_CONTACT, "s", "estimated error of the time of the contact"),
    "contact_guard": Variable(_CONTACT, "", "guard that was met", "str"),
    "contact_direction": Variable(
        _CONTACT, "1", "+1 where the gap becomes positive, -1 where it becomes negative", "i1"
    ),
    "contact_velocity": Variable(_CONTACT, "<gap rate>", "rate of the gap at the contact"),
    "contact_kind": Variable(_CONTACT, "", "kind of contact", "str"),
    "contact_mode_before": Variable(_CONTACT, "1", "mode before the contact", "i8"),
    "contact_mode_after": Variable(_CONTACT, "1", "mode after the contact", "i8"),
    "contact_steps": Variable(_CONTACT, "1", "accepted steps from the start to the contact", "i8"),
    "contact_trajectory": Variable(_CONTACT, "1", "trajectory that the contact belongs to", "i8"),
    "contact_<state>": Variable(
        _CONTACT, "<state>", "<state> at the contact; behind it where it jumps"
    ),
    "contact_<state>_before": Variable(_CONTACT, "<state>", "<state> before the contact"),
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **END_TIME,
    **END_STATES,
    **GUARDS,
    **SHARED,
}

#: Variables of what ``stroboscope`` returns.
STROBOSCOPE_VARIABLES = {
    "<state>": Variable(("trajectory", "period"), "<state>", "<state>"),
    "period": Variable(("period",), "1", "whole forcing periods since the start", "i8", coord=True),
    "status": STATUS,
    **COUNTERS,
    **MINIMA,
    **GUARDS,
    **SHARED,
}
