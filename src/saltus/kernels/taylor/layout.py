"""Template of the Taylor flow: layout of its work arrays. codegen puts a generated head
before the templates.

One step of all lanes reads: jets -> step length (step.py) -> locate contacts
(crossings.py) -> advance and land (step.py), then attend to the lanes where more
happened: a contact to be recorded or hard to settle (contacts.py), the end of a period, a
sample, the end (trajectories.py). Steps are arithmetic on lanes without branches on their contents,
or with branches that only skip work; so a trajectory's digits don't depend on its neighbours.

Symbols
-------
N = ORDER; y_k Taylor coefficient k of state y; g gap; s = +1/-1 the side of a guard that the mode
says; P(d) = s*g along the step, d the time since its start; h step length; T forcing period; tau
phase in [0, T); c parameter-only constants of each lane. A guard is *fresh* while its lane stands
exactly on the boundary: P(0) = 0, and that known root is divided out; `fresh` counts the known
zeros, of P and its derivatives.

The head supplies the sizes LANES, NSTATES, NGUARDS, ORDER, NCONST, NTURNS, ROWS, NSERIES, the rows
SERIES_ROW, GUARD_ROW, GUARD_SERIES, GUARD_SIGN, GAP_ROW, SCALE_ROW, SNAP_STATE, SNAP_CONST, the
laws LAW, PARTNER, SUPPORT, LAW_SIDE of the guards (LAWS: whether there is one), the
degrees NEWTON_DEGREE_1 and _2, and the functions constants(p, c, lane), gaps(t, y, p, h, out),
turns(p, origin, period, count, lane, clock) -> whether they change from period to period, jets(y,
side, c, clock, work) and rates(y, side, c, clock, work), the right-hand side alone; PROBED says
whether a step must be probed with it.
"""

from collections import namedtuple

import numpy as np

from saltus.kernels.clocks_layout import HELD, NUMBERS
from saltus.kernels.isolation import DEEPEST, MOST_TOUCHES

# Rows of `clock`: phase, time at phase zero, then one phase offset for each harmonic of the
# forcing; then, from CLOCK_ROW on, what the clocks hold.
TAU, BASE, TURN = 0, 1, 2
CLOCK_ROWS = CLOCK_ROW + HELD * NCLOCKS
# Rows of `run`: the phase at which the current stretch ends, the next sample's phase, steps taken,
# smallest gap margin, active (0/1), the step length, the phase at its start, time of the last
# landing, contacts in a row without time passing, whether the mode at the start is still being
# settled (0/1); contacts so far, those too shallow to be sure of, the slowest; the guards that
# changed sides at the last landing's instant (bits; bit NGUARDS: one of them changed back and was
# counted again); the number of steps at which its pace is looked at next, and the periods behind it
# when that was done last; the phase of the next break of a clock, and from which on it counts as
# reached; log2 of the tolerance, and the contacts that the trajectory may make; the guard whose
# boundary the state came to at the last landing's instant (-1: none); how far a lane at the end of
# its run looks beyond it (0: it isn't there); whether there was an impact at that instant (0/1),
# and by how much earlier it came, for each column of a tangent.
(
    END,
    DUE,
    TAKEN,
    LEAST,
    ACTIVE,
    STEP,
    START,
    LANDED,
    BOUNCES,
    STARTING,
    MET,
    SHALLOW,
    SLOWEST,
    FLIPPED,
    LIMIT,
    MARK,
    BREAK,
    WATCH,
) = range(18)
TOLERANCE, MOST_MET, CAUSE, AHEAD, DATED, DATES = range(18, 24)
RUN_ROWS = DATES + NCOLUMNS
# Rows of `bounds`, for each series that a gap reads (see bound_series).
LINEAR, QUADRATIC, CUBIC, CHANGE, SLOPE_AT_END, REST, BOUNDS = range(7)
# Rows of `found`: time to the event or end of step, rate of the gap there, guard (-1: none),
# smallest depth at which a gap turned and when. Of that guard: +1/-1 by which its series becomes P,
# P(0), whether it is fresh (0/1), the row of its series, the share of the step within which it
# crosses just once (0: it crosses twice); terms 0 to 3 of P on [0, 1], or of P/x if it is fresh.
# From RIVALS on, of each guard: -1 if it needn't be asked whether the one chosen crosses before it;
# else its rounding error, or infinity if it may cross twice.
DELTA, RATE, WHICH, NEAREST, TURNED, SIGN, DEPTH, ONBOARD, SERIES, UNTIL, P0, P1, P2, P3, RIVALS = (
    range(15)
)
# Columns of `memo`: trajectory, periods, whether the slow path has decided this step, guards that
# it found to cross (bits), guards on which the state rests (bits), whether a harmonic of time has
# another phase in every period, whether this step isn't made of numbers, the status with which a
# law of contact ends the motion (0: none does), whether a friction may become negative, guards
# whose boundaries the state has ridden since its start (bits).
WHO, COUNT, DECIDED, HITS, RESTS, DRIFTS, BROKEN, FAULT, MAY_PUSH, ALWAYS = range(10)
MEMO = 10
# Columns of `options`: log2 of the tolerance; steps after which a trajectory's pace is looked at;
# contacts that it may make; periods that it must have gained by then, infinite if the steps are all
# that it may take.
LOG2_TOLERANCE, MOST_STEPS, MOST_CONTACTS, PACE = range(4)
# Rows of `prior`, for each guard: the size of the terms of its gap up to the step before, and up to
# this one, each step counting half of the one after it; their rounding is inherited.
OLD, NEW, PRIOR_ROWS = range(3)
# Columns of `carry`, what a paused lane needs besides its state: LANDED, BOUNCES, STARTING,
# FLIPPED, LIMIT, MARK, CAUSE, ALWAYS, DATED, then NEW for each guard; where contacts have laws,
# `fresh` of each; DATES.
CARRIED = 9
DATES_CARRIED = CARRIED + (2 if LAWS else 1) * NGUARDS
CARRY = DATES_CARRIED + NCOLUMNS
#: Records that one step may write at most: contacts and touches of all lanes, in the step and at
#: the end of the run.
STEP_RECORDS = 2 * LANES * ((2 if LAWS else 1) * NGUARDS + MOST_TOUCHES)
#: First of the rows of `side` that hold the lanes in which each guard is watched (0/1).
WATCHED = NGUARDS + NSINGULAR
#: Excess of the needed force over a friction force where slip begins, as a part of it, below
#: which it is rounding.
SLOW_START = 1.0e-9
#: Part of the first closing velocity at which successive impacts of one instant have ended for
#: good; landings at one instant after which the rest is taken at once.
CLOSED, MOST_STRIKES = 1.0e-16, 50
#: Part of the largest change at which the tangent has settled on the constraints of all stops at
#: rest; rounds at most.
SETTLED, MOST_SETTLED = 1.0e-13, 1000
#: Duration of a flight that the clock can't resolve, over the time.
SHORTEST_FLIGHT = 2.0e-16
#: Places of `slow.out` where a jump finds DATED and DATES (codegen/saltation.py).
OUT_DATED, OUT_DATES = 2, 3
#: Rows of `slow.state` after the state, if there are laws (see impacts.py).
TRIED, AT_FIRST, BY_GUARDS, WAY = (NSTATES * row for row in range(1, 5))
#: Times in each step at which a force of friction is tested; halvings that find where it becomes
#: negative.
LOOKS, HALVINGS = 4, 60
#: Share of a step that ends at a contact within which a force of friction is tested.
JUST_BEFORE = 1.0 - 2.0**-20
#: Share of a contact's effect left by friction, at which a contact is given up rather than
#: released.
PARADOX = 1.0e-9
#: Remainder of a chatter when it is completed, as a part of the time scale of the acceleration.
CHATTER = 1.0e-8
#: Times within this many ulp are one event (EVENTS.md, rule 6).
COINCIDENT = 10.0 * 2.220446049250313e-16
#: Part of the size of a gap's terms by which rounding may carry the state off a boundary that it
#: keeps to, in all steps together.
KEPT = 2.0**-30
#: Value of `fresh` for a ridden boundary, if contacts have laws: one zero is known, and a motion
#: that leaves it does so at once.
RIDDEN = 1.25
#: Value of `fresh` where a motion begins with a gap in rounding: a rate that isn't rounding tells
#: that the gap isn't zero either, and its sign is the side.
DOUBTFUL = 1.125
#: Said of the margin of a surface that begins to be held where it was at rest: nothing jumps.
AT_REST = -1.0
#: Block of `gaps` that holds the sizes of the gaps, if none of their terms cancelled.
SIZES = 4
#: Share of a state by which it is changed to see what that does to a gap.
ALTERED = 2.0**-12
#: Side of a guard on whose boundary the state is known to be, as `gaps` gets it.
KNOWN = 2.0
#: Rounds of flips at one instant before the contact is given up as sliding (EVENTS.md, rule 6).
MOST_BOUNCES = 100
HUGE = 1.0e300
#: Largest number whose square is a number: larger ones are taken for it where contacts are asked
#: whether they are shallow.
LARGE = 1.0e150
#: Highest term of a series that is summed by Horner's rule (even, and at most ORDER - 3).
HORNER = min(8, ORDER - 4 - ORDER % 2)
#: A probed step is at most this share of a period, or of an unforced span (MATLAB's default too).
LONGEST_SHARE = 0.1
#: Largest defect of a sound step, in units of the tolerance and of the rounding of the right-hand
#: side's terms: the derivative of the last terms is about N times their size.
DEFECT = 1024.0
#: Most halvings of a step by its probes.
MOST_HALVINGS = 40

# -- steps that prove nothing are shortened (settle_sooner), shares of the longest step --
#: Length of such a step over the predicted first crossing: the margin is about the error of the
#: prediction.
BEHIND = 1.1
#: Latest crossing aimed at, as a share of the step: a step hardly shorter proves hardly more.
WORTH_AIMING = 0.9
#: The share tried otherwise. A number of two bits keeps motions with round numbers exact.
SHORTENED = 0.75
#: Predicted crossings nearer to each other than this may be one event.
TOGETHER = 2.0**-10
#: Newton steps that find the turning point of a gap, from that of its quadratic part.
NEWTON_STEPS = 4
#: Length of the last of these steps, as a share of the step, at which it has converged.
TURN_FOUND = 2.0**-20
#: Least step, as a share of the stretch.
LEAST_SHARE = 2.0**-40

# -- laws without a series on a boundary (singular.py) --
#: Relative effect on a state below which terms without a series are left out of a step.
NEGLIGIBLE = 2.0**-50
#: Longest other step, as a share of the way to the boundary.
REACH = 0.9
#: Factor on all steps beyond such a boundary, as for a tolerance of 2**-13 of itself: near the edge
#: of its disc a series converges so slowly that its last terms are a small part of those after them
#: (with 2**-8 a Hertz contact loses 1e-15 of the energy each time).
FINER = 2.0 ** (-13.0 / ORDER)
#: A gap wider than this many rounding errors can be told from zero.
TOLD = 64.0
#: Way to the boundary [s] below which coefficients of the last order could overflow.
SHORTEST = 2.0 ** (-950.0 / ORDER)
#: Exponent of time with which the search for a negligible step begins: force d**1.5, and one more
#: for its integral.
USUAL_POWER = 2.5
#: Steps tried in this search.
MOST_TRIALS = 12

Lanes = namedtuple(
    "Lanes",
    "y side fresh clock c work bounds prior poly run found probe_y probe_clock probe_rate memo",
)
Slow = namedtuple("Slow", "q b bounds rates out gaps state touches held numbers")


# -- memory ----------------------------------------------------------------------------------------
def rows_of_lanes(count):
    """Zeros float64[count, LANES] that begin at a cache line: a row in two cache lines costs
    twice.
    """
    room = np.zeros(count * LANES + 8)
    first = -room.ctypes.data // 8 % 8
    return room[first : first + count * LANES].reshape(count, LANES)


def workspace():
    """The work arrays of one call of `propagate`; one set for each thread."""
    guards = max(NGUARDS, 1)
    rows = dict(
        y=NSTATES, side=2 * guards + NSINGULAR, fresh=guards, clock=CLOCK_ROWS, c=NCONST, work=ROWS,
        bounds=BOUNDS * max(NSERIES, 1),
        prior=PRIOR_ROWS * guards, poly=ORDER + 1, run=RUN_ROWS, found=RIVALS + guards,
        probe_y=NSTATES,
        probe_clock=CLOCK_ROWS, probe_rate=(6 if NSINGULAR > 0 else 3) * NSTATES,
    )  # fmt: skip
    lanes = Lanes(
        memo=np.zeros((LANES, MEMO), np.int64),
        **{name: rows_of_lanes(count) for name, count in rows.items()},
    )
    slow = Slow(
        q=np.zeros(ORDER + 1), b=np.zeros((DEEPEST + 2, ORDER + 1)),
        bounds=np.zeros((DEEPEST + 2, 2)), rates=np.zeros(ORDER + 1),
        out=np.zeros(OUT_DATES + NCOLUMNS), gaps=np.zeros(6 * guards),
        state=np.zeros((5 if LAWS else 1) * NSTATES),
        touches=np.zeros((MOST_TOUCHES, 2)),
        held=np.zeros(HELD * NCLOCKS), numbers=np.zeros((NUMBERS + 1) * NCLOCKS),
    )  # fmt: skip
    return (*lanes, *slow)
