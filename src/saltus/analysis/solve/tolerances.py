"""The tolerances of the search for attractors and of the engine of orbits, each with its reason.

Distances are in units of the range of each state.
"""

from __future__ import annotations

from saltus.results.dataset import kinds

# -- periods ---------------------------------------------------------------------------------------
#: Longest period looked for [iterates].
LONGEST = kinds.LONGEST
#: Iterates between two tests for recurrence: two of the longest periods.
ROUND = 2 * LONGEST
#: Recurrence that is worth a try by Newton's method: a wrong try costs time only where the orbit
#: found must capture the trajectory.
NEAR = 1e-3
#: Recurrence at which a trajectory has settled where nothing captures it. It leaves the slowest
#: transient of the rig in a few rounds, and takes no neighbour for the orbit. What hasn't come so
#: near in time is let in from NEAR.
SETTLED = 1e-5
#: An orbit belongs to a trajectory that lies within this multiple of its recurrence: the ratio of
#: the two is 1/(1 - multiplier).
BESIDE = 30.0
#: Recurrence below which distances are rounding.
ROUNDING = 1e-9
#: Largest distance between equal orbits: Newton's method leaves 1e-12, amplified by 1/(1 -
#: multiplier).
SAME = 1e-6
#: A state whose range is so small a part of its size rests.
RESTS = 1e-9

# -- Newton's method -------------------------------------------------------------------------------
#: Steps: quadratic convergence needs a handful, linear convergence at a fold thirty.
MAX_NEWTON_STEPS = 30
#: A step so short is the last one: the next is rounding.
CONVERGED = 1e-12
#: Steps of stiff orbits stall where rounding is amplified: up to this length they count as
#: converged.
AMPLIFIED = 1e-9
#: A step longer than this many of the one before is slow: at a fold they halve.
SLOW = 0.75
#: A step that quadratic convergence foresees to be shorter than this isn't waited for.
FORESEEN = 1e-16
#: Most damped steps, shortened ones included.
MAX_DAMPED_STEPS = 60
#: Longest damped step, in units of the scale.
LONGEST_DAMPED = 0.3
#: A damped step isn't shortened below this share of it.
SHORTEST_SHARE = 1.0 / 64
#: Condition number of a linear system from which its solution has no digit.
SINGULAR = 1e15
#: Singular values below this share of the largest are zero, where equations may depend on each
#: other.
RANK = 1e-9
#: Distance of a multiplier from the unit circle that rounding can't make.
MARGINAL = 1e-7

# -- maps with errors of their own, such as ode45's ------------------------------------------------
#: Iterates after which a trajectory has settled.
SETTLING_ITERATES = 400
#: Returns whose mean is taken then.
AVERAGED_RETURNS = 8
#: Scatter of the returns to a point, in units of the map's noise, that its errors may make.
JITTER = 2.0
#: Least distance of two points of an orbit, in units of the scatter.
APART = 5.0
#: Scatter below which period doubling isn't looked for.
SHOWING = 1e-6
#: Least range of a state that goes on decaying: the square of less is no number.
DECAYED = 1e-150
