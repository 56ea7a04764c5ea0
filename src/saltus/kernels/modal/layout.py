"""Layout of the modal flow: what its tables and its work arrays hold.

One trajectory after the other; the lanes of a step hold its modes. A contact state is linear: z' =
A z + b + drives. Its modes y = L (z - z_p(t)), z_p the steady answer to the drives, go their own
ways: y_j(t) = y_j e^{lambda_j t}. Of a pair of complex modes one is kept, and z = z_p + Re(V y).
A gap is a row of amplitudes: g(t) = c + Re(sum_j w_j y_j(t)) + drives. The derivative of the state
with respect to the state at the start, if it is carried, is moved from contact to contact at once.

Symbols
-------
N states; G groups of LANES modes, ascending by |lambda|; S groups of LANES states; R rows of gaps,
of which guards are plus or minus one, and an offset; H drives Re(e^{i (rate t + phase)}). Modes
that don't go their own ways go together in a block: see blocks.py. Drives that are
polynomials between breaks are courses: see records.py.
"""

from collections import namedtuple

#: Terms of a gap's series beyond the first, and what the last one's successor is divided by.
ORDER = 15
FACTORIAL = 20922789888000.0
#: Terms of a gap where a step begins that tell a polynomial with as many where it ends: what it
#: leaves out is smaller by (x (1 - x))^HALF, of which CLOSER times is 1 at most. Its slope leaves
#: out STEEPER times as much: it meets that of the gap HALF - 1 times at both ends, and once between
#: them.
HALF = (ORDER + 1) // 2
CLOSER, STEEPER = 65536.0, 64.0
#: A mode is followed between both ends of a step while |lambda| h is at most SPANNED, a block from
#: its beginning while that is at most FOLLOWED: what is left out is at most an amplitude.
SPANNED, FOLLOWED = 12.0, 6.0
#: Largest part of a gap, or of its rate where that decides, that a step leaves to modes that it
#: doesn't follow.
LEFT = 0.15
# Columns of `sizes`; ROWS are the rows of amplitudes: those of the modes, real parts then imaginary
# ones, then those of a block; TANGENTS are the columns of the derivative of the state that is
# carried: one for each state at the start, then one for each parameter; 0: none. REMEMBERED are the
# states behind the others that hold others of before the last impact, whose numbers are in
# `remembers`; TERMS are the coefficients of the pieces of courses, 4 or 16.
STATES, MODE_GROUPS, STATE_GROUPS, GAP_ROWS, GUARDS, DRIVES, ROWS, COURSES = range(8)
TANGENTS, REMEMBERED, TERMS = range(8, 11)
# Columns of `record`: the time of a course at the beginning of the period, the times of the period
# at which its piece begins and ends [s], the row of that piece, its value and derivatives.
BASE, SINCE, UNTIL, PIECE, VALUE = range(5)
# Columns of `links`: first row of the modes' table, first row of the drives' table, guards where
# the rates don't jump (bits), first row of the derivatives by parameters; then for each guard the
# contact state behind its boundary, -1 where it hasn't been made yet.
MODES, STEADY, SMOOTH, SLOPES, BEHIND = range(5)
# Columns of `carry`: the contact state (-1: to be looked up), whether its amplitudes must be made
# of the state, the next step [s], the time of the last landing, landings there since, guards that
# the state has ridden from its start on (bits), the set of parameter values, the generation of the
# tables in which these numbers stand; with tangents the time for which they haven't been moved [s]
# and the boundaries just crossed (bits); gaps whose rate is known to be zero too, and those whose
# acceleration is (bits), whether no time has passed since the start, the contact that was struck
# (one more than its number; 0: none), whether it is known how the instant of a landing moves, the
# frictions whose sliding has been reversed at this instant (bits); then the
# amplitudes, and with tangents the rates of the states and the gaps before these boundaries,
# how that instant moves with each column, and with parameters the amplitudes when the derivative
# was moved last.
AT, ENTERS, NEXT_STEP, LANDED_AT, LANDINGS, RIDES, SET, TABLES, WAITED, CROSSED = range(10)
TWICE, THRICE, STARTS, ASKS, DATED, REVERSED, AMPLITUDES = range(10, 17)
# Columns of `laws`, for each guard: the kind of its law (status.py), its hold guard (of a hold
# guard: its contact's), the state that its gap is a level of; the guard whose bit says that the
# contact is held; of a friction, and of what holds it, the number of the second margin; -1 where
# there is none; the side to which the input leads on at the limit of a memory, 0 at other
# boundaries. Second margins are guards behind
# those of the system, whose bits are never set: their gaps are minus the margins.
KIND, PARTNER, LEVEL, HOLDER, SECOND, LIMITS, LAW_COLUMNS = range(7)
# Rows of `acts`, where a guard has a law: guards, set by set. Columns: the gap and the closing
# velocity as functions of the state - N slopes, a constant, slopes for the cosines of the H drives
# and for the C courses -, the change of the state by a unit of closing velocity, N numbers, the
# restitution; of a friction 1 if nothing jumps at its release, else 0. Rows of `presses`: guards,
# contact state by contact state. Columns: the acceleration with which the contact closes without
# its own force, as such a function.
# Rows of `struck`: the state before impacts and the one behind them in the order of the guards, the
# way that each state has gone in them.
AT_FIRST, BY_GUARDS, WAY = range(3)
# Columns of `options`.
MOST_STEPS, MOST_CONTACTS = range(2)
# What is known of a guard in a step.
CLEAR, CROSSES, OPEN = range(3)
# Columns of `found`, for each guard: the place of its crossing as a part of the step, whether that
# is final, whether it is ridden, touches of the step (first row), the part of the step that is
# decided, the end of the bracket of the crossing, whether a stop is pressed at the start, the
# beginning of that bracket, the least margin by its turns, groups of modes whose factors at the
# end of the step are known (first row).
PLACE, FINAL, RIDDEN, TOUCHED, DECIDED, BRACKET, PRESSED, BEGINS, TURNED, FACTORS = range(10)
# Columns of `stood`, for each row of gaps where the amplitudes stand: value and rate, the size of
# its terms, what its fifth derivative is at most.
HERE, SLOPE, SIZE, FIFTH = range(4)
# Rows of `waves`, for each row of gaps: of each group of modes its real and imaginary part, its
# rate, its size, the sizes of all terms from it on, and those of their rates; then these two once
# more, 0. The last two are lanes whose numbers add up to them. In place of the first four of the
# last rows stand the Bernstein coefficients over a step.
REAL, IMAGINARY, GOING, BOUND, BEYOND, FASTER, WAVES = range(7)
# Rows of `column`: the amplitudes of a column of the derivative, as ROWS; then of several columns
# side by side, two lanes for each number: the states, then the real and the imaginary part of the
# amplitude of each mode.
#: Samples that wait for one product with the modes of their contact state. Rows of `queue`, for
#: each: its amplitudes, the rates of these, the steady answer.
QUEUE = 8
# Columns of `spans`, for each row of gaps over a step: bounds of the gap without what its series
# leaves out; whether the series is known; its first and its last Bernstein coefficient, the least
# and the largest difference of two, those that rise and that fall (bits), coefficients below and
# above the first one.
LEAST, MOST, KNOWN, FIRST, LAST, DROP, RISE, RISES, FALLS, BELOW, ABOVE = range(11)
# Rows of `bernstein`, tables of four numbers in a row: Bernstein coefficients by the terms at both
# ends, their differences and the powers of x, for each term; coefficients of the left and of the
# right half of a part of the step, for each of its own; the places of coefficients; what makes
# those of a gap over x of their differences from the first; 1 over k!.
TABLE = (ORDER + 1) * (ORDER + 1) // 4
POWERS, LEFT_HALF, RIGHT_HALF, PLACES = 2 * TABLE, 3 * TABLE, 4 * TABLE, 5 * TABLE
OVER_X, SHARES = PLACES + (ORDER + 1) // 4, PLACES + (ORDER + 1) // 2
#: Shortest part of a step by which a gap is decided.
SHORTEST_PIECE = 0.125
#: A step as short as this [s] decides nothing because the gaps are no numbers.
LEAST_STEP = 1.0e-290
#: Landings at one instant before they count as sliding.
MOST_LANDINGS = 100
#: Landings at one instant after which impacts that cause each other are completed at once, least
#: part of the first closing velocity then; the most impacts of it.
MOST_STRIKES, CLOSED, MOST_IMPACTS = 50, 1.0e-16, 50_000
#: Part of the largest change at which the derivative has settled on the constraints of all contacts
#: at rest; rounds at most.
SETTLED, MOST_SETTLED = 1.0e-13, 1000
#: Least effect of an impact on another contact, and where a comparison of orders ends, as parts of
#: its closing velocity; rounding of a restitution.
FELT, ENDED, PART = 1.0e-9, 1.0e-12, 1.0e-12
#: Remainder of a chatter when it is completed, as a part of the time scale of the acceleration.
CHATTER = 1.0e-8
#: Times within this many ulp are one event.
COINCIDENT = 10.0 * 2.220446049250313e-16
#: Rounding of a gap, in units of the sizes of its terms.
ROUNDED = 16.0 * 2.220446049250313e-16
#: A third term this many times the rounding of a gap isn't rounding itself: SPANNED^3 / 3! times
#: that of amplitudes is less.
CERTAIN = 100.0
#: Times its rounding by which a gap may lie behind its boundary: it was landed on, and other
#: landings have made the state and its amplitudes of each other since, which rounds each time.
MISSED = 4.0
#: Rounding of the time at the end of a run, as a part of it.
CLOCK = 2.0 * 2.220446049250313e-16
HUGE = 1.0e300

Modal = namedtuple(
    "Modal",
    "sizes row_of sign_of offset rate lag modes steady links course pieces laws acts presses "
    "remembers varied shifts y moved size sums q errors p bern bounds slopes out touches state "
    "answer angle found chain record factor column columns struck bernstein stood waves spans near "
    "queue queued rates",
)
