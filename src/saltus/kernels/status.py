"""Status codes of a trajectory and kinds of contact: numbers in kernels, words in results, a
sentence each for users.
"""

from __future__ import annotations

# Status of a trajectory. 0 is not used: a fill value must never read as success.
RUNNING = 1
OK = 2
GRAZE_UNRESOLVED = 3
RESTING = 4
SLIDING = 5
BUDGET_STEPS = 6
BUDGET_EVENTS = 7
NONFINITE = 8
INVALID = 9
NOT_COMPUTED = 10
INTERRUPTED = 11
LONG_TRANSIENT = 12
TURNED = 13
AMBIGUOUS_IMPACT = 14
NONUNIQUE = 15
INVALID_RESTITUTION = 16
PAINLEVE = 17
INVALID_FRICTION = 18
MODE_VIOLATION = 19

#: Name and meaning of every status code.
STATUS = {
    RUNNING: ("running", "not finished yet"),
    OK: ("ok", "reached the end"),
    GRAZE_UNRESOLVED: (
        "graze_unresolved",
        "reached the end, but a graze on the way was shallower than the local error: either "
        "outcome is possible",
    ),
    RESTING: (
        "resting",
        "the gap and its first three derivatives are zero: resting on a boundary, "
        "which this version doesn't follow",
    ),
    SLIDING: (
        "sliding",
        "all sides push onto a boundary, or onto several that meet, and nothing was found that "
        "leads on",
    ),
    BUDGET_STEPS: ("budget_steps", "the step budget was used up"),
    BUDGET_EVENTS: ("budget_events", "the event budget was used up: contacts accumulate"),
    NONFINITE: ("nonfinite", "the state or its derivatives overflowed or became NaN"),
    INVALID: (
        "invalid",
        "the start or a parameter isn't a finite number, or the start lies beyond a stop",
    ),
    NOT_COMPUTED: ("not_computed", "stopped before this trajectory was begun"),
    LONG_TRANSIENT: (
        "long_transient",
        "still on its way to an attractor after all periods that were allowed",
    ),
    INTERRUPTED: ("interrupted", "stopped on its way"),
    TURNED: (
        "turned",
        "a gap turned about in the step that crossed its boundary (a graze), which steps in the "
        "gap and inverse interpolation can't follow",
    ),
    AMBIGUOUS_IMPACT: (
        "ambiguous_impact",
        "several impacts at one instant, and what follows depends on which is taken first: the "
        "equations don't say",
    ),
    NONUNIQUE: (
        "nonunique",
        "the start lies on a boundary from which both sides lead away: more than one motion "
        "begins there",
    ),
    INVALID_RESTITUTION: (
        "invalid_restitution",
        "the coefficient of restitution is outside [0, 1] at an impact",
    ),
    INVALID_FRICTION: (
        "invalid_friction",
        "the force of friction, or its coefficient in a contact that rests, is negative",
    ),
    MODE_VIOLATION: (
        "mode_violation",
        "the state was found on the other side of a boundary than the equations that moved it are "
        "for: this motion is wrong from there on",
    ),
    PAINLEVE: (
        "painleve",
        "friction takes away more of what presses a contact than the contact's force adds "
        "(Painleve's paradox): there is no motion with a rigid contact, or there are several",
    ),
}

# Kinds of contact record.
CROSSING = 0
GRAZE = 1
GRAZE_SHALLOW = 2
IMPACT = 3
HOLD = 4
RELEASE = 5

#: Name of every kind of contact record.
CONTACT_KIND = {
    CROSSING: "crossing", GRAZE: "graze", GRAZE_SHALLOW: "graze_unresolved", IMPACT: "impact",
    HOLD: "hold", RELEASE: "release",
}  # fmt: skip

# Laws of contact of a guard: none, a two-valued force that may hold the contact, an impact, a jump
# of the state; a hold guard says that another one's contact is held.
NO_LAW, SURFACE_LAW, IMPACT_LAW, JUMP_LAW, HOLD_LAW = range(5)
#: Number of each kind of law.
LAW_KINDS = {"surface": SURFACE_LAW, "impact": IMPACT_LAW, "jump": JUMP_LAW, "hold": HOLD_LAW}

# Columns of the integer counters kept for each trajectory.
STEPS, REJECTED, EVENTS, GRAZES, UNRESOLVED, VIOLATIONS = range(6)
#: Names of the integer counters, by column.
COUNTERS = ("steps", "rejected_steps", "events", "grazes", "grazes_unresolved", "mode_violations")

# Columns of the running minima kept for each trajectory.
CONTACT_SPEED, GAP_MARGIN = range(2)
#: Names of the running minima, by column.
MINIMA = ("smallest_contact_speed", "smallest_gap_margin")

# Columns of a contact record: integers, then floats (the state, then the absolute time, follow the
# floats). REC_STEPS counts the accepted steps from the start of the trajectory to the contact.
(
    REC_TRAJECTORY,
    REC_PERIOD,
    REC_GUARD,
    REC_DIRECTION,
    REC_KIND,
    REC_MODE_BEFORE,
    REC_MODE_AFTER,
    REC_STEPS,
) = range(8)
REC_PHASE, REC_VELOCITY, REC_TIME_ERROR = range(3)
RECORD_INTEGERS, RECORD_FLOATS = 8, 3

# Return values of a kernel call.
FINISHED, PAUSED = 0, 1
