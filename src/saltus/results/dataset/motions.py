"""Tables of the results that look at a motion more closely: sections, spectra, impact statistics, energy balances.

As in :mod:`saltus.results.dataset.schema` the dims are those of one trajectory. Crossings and contacts are one table for all trajectories.
"""

from __future__ import annotations

from saltus.results.dataset.variable import COUNTERS, FORCING_PERIOD, GUARDS, STATUS, TRAJECTORY_NUMBER, Variable

_WORK = {name: COUNTERS[name] for name in ("steps", "rejected_steps", "mode_violations", "grazes_unresolved")}
_ENDS = {"status": STATUS, **_WORK, "end_time": Variable((), "s", "time at the end")}
_EACH = {"forcing_period": FORCING_PERIOD, "trajectory": TRAJECTORY_NUMBER}

#: Variables of what ``poincare`` returns, beside the states at the crossings.
SECTION_VARIABLES = {
    "crossing_time": Variable(("crossing",), "s", "time of the crossing"),
    "crossing_time_error": Variable(("crossing",), "s", "error of that time by the step that holds the crossing"),
    "crossing_period": Variable(("crossing",), "1", "whole forcing periods from the start to the crossing", "i8"),
    "crossing_phase": Variable(("crossing",), "1", "phase of the forcing at the crossing, t/T mod 1"),
    "crossing_direction": Variable(("crossing",), "1", "+1 where the surface's function rises, -1 where it falls", "i1"),
    "crossing_rate": Variable(("crossing",), "", "rate of the surface's function at the crossing"),
    "crossing_kind": Variable(("crossing",), "", "kind of crossing", "str"),
    "crossing_trajectory": Variable(("crossing",), "1", "trajectory that the crossing belongs to", "i8"),
    "crossings": Variable((), "1", "crossings that were kept", "i8"),
    "tangencies": Variable((), "1", "touches of the surface without a crossing", "i8"),
    "contacts": Variable((), "1", "contacts of the system itself meanwhile", "i8"),
    **_ENDS,
    **GUARDS,
    **_EACH,
}

#: Variables of what ``spectrum`` returns, beside ``<state>_amplitude`` and ``<state>_phase``.
SPECTRUM_VARIABLES = {
    "frequency": Variable(("frequency",), "Hz", "frequency"),
    "order": Variable(("frequency",), "1", "frequency in units of the forcing frequency"),
    "window": Variable((), "", "window", "str"),
    "noise_bandwidth": Variable((), "1", "equivalent noise bandwidth of the window, in lines"),
    "response_period": Variable((), "1", "period of the response in forcing periods, 0 if none was found", "i8"),
    "status": STATUS,
    **_EACH,
}

#: Variables of what ``impact_statistics`` returns.
IMPACTS_VARIABLES = {
    "contact_time": Variable(("contact",), "s", "time at which the contact begins"),
    "contact_guard": Variable(("contact",), "", "guard that was met", "str"),
    "contact_speed": Variable(("contact",), "<gap rate>", "speed at which the contact begins"),
    "contact_exit_speed": Variable(("contact",), "<gap rate>", "speed at which it ends"),
    "contact_duration": Variable(("contact",), "s", "time from the beginning of the contact to its end"),
    "contact_impulse": Variable(("contact",), "N*s", "impulse of the contact force"),
    "contact_trajectory": Variable(("contact",), "1", "trajectory that the contact belongs to", "i8"),
    "contact_side": Variable(("guard",), "1", "sign of the gap in contact", "i1"),
    "contacts": Variable(("guard",), "1", "contacts that begin", "i8"),
    "contacts_per_second": Variable(("guard",), "1/s", "contacts per second"),
    "contacts_per_second_error": Variable(("guard",), "1/s", "standard error of the contacts per second"),
    "contacts_per_period": Variable(("guard",), "1", "contacts per forcing period"),
    "contacts_per_period_error": Variable(("guard",), "1", "standard error of the contacts per forcing period"),
    "speed_mean": Variable(("guard",), "<gap rate>", "mean speed at contact"),
    "speed_mean_error": Variable(("guard",), "<gap rate>", "standard error of the mean speed at contact"),
    "speed_rms": Variable(("guard",), "<gap rate>", "root mean square of the speed at contact"),
    "speed_max": Variable(("guard",), "<gap rate>", "largest speed at contact"),
    "speed_histogram": Variable(("guard", "speed_bin"), "1", "contacts in each bin of speed", "i8"),
    "speed_low": Variable(("speed_bin",), "<gap rate>", "lower edge of the bin"),
    "speed_high": Variable(("speed_bin",), "<gap rate>", "upper edge of the bin"),
    "duration_mean": Variable(("guard",), "s", "mean duration of contact"),
    "duration_mean_error": Variable(("guard",), "s", "standard error of the mean duration of contact"),
    "duration_min": Variable(("guard",), "s", "shortest contact"),
    "duration_max": Variable(("guard",), "s", "longest contact"),
    "share_in_contact": Variable(("guard",), "1", "share of the time in contact"),
    "share_in_contact_error": Variable(("guard",), "1", "standard error of the share of the time in contact"),
    "impulse_mean": Variable(("guard",), "N*s", "mean impulse of a contact"),
    "impulse_mean_error": Variable(("guard",), "N*s", "standard error of the mean impulse of a contact"),
    "impulse_max": Variable(("guard",), "N*s", "largest magnitude of the impulse of a contact"),
    **_ENDS,
    **GUARDS,
    **_EACH,
}

#: Variables of what ``energy_balance`` returns. Of an unforced system they lie along ``time`` in place of ``period``.
ENERGY_VARIABLES = {
    "period": Variable(("period",), "1", "whole forcing periods from the start to the end of the interval", "i8"),
    "time": Variable(("time",), "s", "time at the end of the interval"),
    "energy": Variable(("period",), "J", "stored energy at the end of the interval"),
    "change": Variable(("period",), "J", "change of the stored energy in the interval"),
    "supplied": Variable(("period",), "J", "work supplied in the interval"),
    "dissipated": Variable(("period",), "J", "energy dissipated in the interval"),
    "residual": Variable(("period",), "J", "supplied - dissipated - change"),
    "imbalance": Variable((), "1", "largest |residual| relative to the energy that is stored or turned over in an interval"),
    **_ENDS,
    **_EACH,
}
