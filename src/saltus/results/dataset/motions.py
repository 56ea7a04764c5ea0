"""Tables of the results of one motion: sections, spectra, impact statistics, energy balances,
responses.
"""

from __future__ import annotations

from saltus.results.dataset.variable import (
    COUNTERS,
    END_STATES,
    END_TIME,
    GUARDS,
    SHARED,
    STATUS,
    TRAJECTORY_NUMBER,
    Variable,
)

_WORK = {
    name: COUNTERS[name]
    for name in ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")
}
_ENDS = {"status": STATUS, **_WORK, **END_TIME, **END_STATES}

#: Variables of what ``poincare`` returns. Crossings are one table for all trajectories.
SECTION_VARIABLES = {
    "<state>": Variable(("crossing",), "<state>", "<state> at the crossing"),
    "crossing_time": Variable(("crossing",), "s", "time of the crossing"),
    "crossing_time_error": Variable(
        ("crossing",), "s", "error of that time by the step that holds the crossing"
    ),
    "crossing_period": Variable(
        ("crossing",), "1", "whole forcing periods from the start to the crossing", "i8"
    ),
    "crossing_phase": Variable(
        ("crossing",), "1", "phase of the forcing at the crossing, t/T mod 1"
    ),
    "crossing_direction": Variable(
        ("crossing",), "1", "+1 where the surface's function rises, -1 where it falls", "i1"
    ),
    "crossing_rate": Variable(
        ("crossing",), "<surface rate>", "rate of the surface's function at the crossing"
    ),
    "crossing_kind": Variable(("crossing",), "", "kind of crossing", "str"),
    "crossing_trajectory": Variable(
        ("crossing",), "1", "trajectory that the crossing belongs to", "i8"
    ),
    "crossings": Variable(("trajectory",), "1", "crossings that were kept", "i8"),
    "tangencies": Variable(("trajectory",), "1", "touches of the surface without a crossing", "i8"),
    "contacts": Variable(("trajectory",), "1", "contacts of the system itself meanwhile", "i8"),
    **_ENDS,
    **GUARDS,
    **SHARED,
}

#: Variables of what ``spectrum`` returns. Of trajectories with forcing periods of their own they
#: lie along ``order`` in place of ``frequency``.
SPECTRUM_VARIABLES = {
    "frequency": Variable(("trajectory?", "frequency"), "Hz", "frequency", coord=True),
    "order": Variable(
        ("frequency",), "1", "frequency in units of the forcing frequency", coord=True
    ),
    "<state>_amplitude": Variable(("trajectory", "frequency"), "<state>", "amplitude of <state>"),
    "<state>_phase": Variable(("trajectory", "frequency"), "rad", "phase of <state>"),
    "window": Variable(("trajectory",), "", "window", "str"),
    "noise_bandwidth": Variable(
        ("trajectory",), "1", "equivalent noise bandwidth of the window, in lines"
    ),
    "response_period": Variable(
        ("trajectory",), "1", "period of the response in forcing periods, 0 if none was found", "i8"
    ),
    "status": STATUS,
    **SHARED,
}

#: Variables of what ``settled`` returns. The last three are those of a run with samples between
#: whole periods.
SETTLED_VARIABLES = {
    "mismatch": Variable(
        ("trajectory",), "1", "relative difference of states one response period apart"
    ),
    "response_period": SPECTRUM_VARIABLES["response_period"],
    "contacts_per_response": Variable(
        ("trajectory",), "1", "contacts in one period of the response"
    ),
    "<state>_peak": Variable(("trajectory",), "<state>", "largest |<state>|"),
    "<state>_rms": Variable(("trajectory",), "<state>", "root mean square of <state>"),
    **TRAJECTORY_NUMBER,
}

#: Variables of what ``impact_statistics`` returns.
IMPACTS_VARIABLES = {
    "contact_time": Variable(("contact",), "s", "time at which the contact begins"),
    "contact_guard": Variable(("contact",), "", "guard that was met", "str"),
    "contact_speed": Variable(("contact",), "<gap rate>", "speed at which the contact begins"),
    "contact_exit_speed": Variable(("contact",), "<gap rate>", "speed at which it ends"),
    "contact_duration": Variable(
        ("contact",), "s", "time from the beginning of the contact to its end"
    ),
    "contact_impacts": Variable(
        ("contact",), "1", "impacts that were met in the contact, one by one", "i8"
    ),
    "contact_impulse_of_impacts": Variable(
        ("contact",), "<impulse>", "impulse of the impacts of the contact, without that at rest"
    ),
    "contact_impulse": Variable(("contact",), "<impulse>", "impulse of the contact force"),
    "contact_trajectory": Variable(
        ("contact",), "1", "trajectory that the contact belongs to", "i8"
    ),
    "contact_side": Variable(("guard",), "1", "sign of the gap in contact", "i1"),
    "contacts": Variable(("trajectory", "guard"), "1", "contacts that begin", "i8"),
    "contacts_per_second": Variable(("trajectory", "guard"), "1/s", "contacts per second"),
    "contacts_per_second_error": Variable(
        ("trajectory", "guard"), "1/s", "standard error of the contacts per second"
    ),
    "contacts_per_period": Variable(("trajectory", "guard"), "1", "contacts per forcing period"),
    "contacts_per_period_error": Variable(
        ("trajectory", "guard"), "1", "standard error of the contacts per forcing period"
    ),
    "speed_mean": Variable(("trajectory", "guard"), "<gap rate>", "mean speed at contact"),
    "speed_mean_error": Variable(
        ("trajectory", "guard"), "<gap rate>", "standard error of the mean speed at contact"
    ),
    "speed_rms": Variable(
        ("trajectory", "guard"), "<gap rate>", "root mean square of the speed at contact"
    ),
    "speed_max": Variable(("trajectory", "guard"), "<gap rate>", "largest speed at contact"),
    "speed_histogram": Variable(
        ("trajectory", "guard", "speed_bin"), "1", "contacts in each bin of speed", "i8"
    ),
    "speed_low": Variable(("speed_bin",), "<gap rate>", "lower edge of the bin", coord=True),
    "speed_high": Variable(("speed_bin",), "<gap rate>", "upper edge of the bin", coord=True),
    "duration_mean": Variable(("trajectory", "guard"), "s", "mean duration of contact"),
    "duration_mean_error": Variable(
        ("trajectory", "guard"), "s", "standard error of the mean duration of contact"
    ),
    "duration_min": Variable(("trajectory", "guard"), "s", "shortest contact"),
    "duration_max": Variable(("trajectory", "guard"), "s", "longest contact"),
    "share_in_contact": Variable(("trajectory", "guard"), "1", "share of the time in contact"),
    "share_in_contact_error": Variable(
        ("trajectory", "guard"), "1", "standard error of the share of the time in contact"
    ),
    "impulse_mean": Variable(("trajectory", "guard"), "<impulse>", "mean impulse of a contact"),
    "impulse_mean_error": Variable(
        ("trajectory", "guard"), "<impulse>", "standard error of the mean impulse of a contact"
    ),
    "impulse_max": Variable(
        ("trajectory", "guard"), "<impulse>", "largest magnitude of the impulse of a contact"
    ),
    **_ENDS,
    **GUARDS,
    **SHARED,
}

#: Variables of what ``energy_balance`` returns. Of an unforced system they lie along ``time`` in
#: place of ``period``.
ENERGY_VARIABLES = {
    "period": Variable(
        ("period",),
        "1",
        "whole forcing periods from the start to the end of the interval",
        "i8",
        coord=True,
    ),
    "time": Variable(("time",), "s", "time at the end of the interval", coord=True),
    "energy": Variable(("trajectory", "period"), "J", "stored energy at the end of the interval"),
    "change": Variable(
        ("trajectory", "period"), "J", "change of the stored energy in the interval"
    ),
    "supplied": Variable(("trajectory", "period"), "J", "work supplied in the interval"),
    "dissipated": Variable(("trajectory", "period"), "J", "energy dissipated in the interval"),
    "friction": Variable(("trajectory", "period"), "J", "work taken by friction in the interval"),
    "impacts": Variable(
        ("trajectory", "period"), "J", "energy taken by impacts and jumps in the interval"
    ),
    "residual": Variable(
        ("trajectory", "period"), "J", "supplied - dissipated - friction - impacts - change"
    ),
    "imbalance": Variable(
        ("trajectory",),
        "1",
        "largest |residual| relative to the energy that is stored or turned over in an interval",
    ),
    **_ENDS,
    **SHARED,
}
