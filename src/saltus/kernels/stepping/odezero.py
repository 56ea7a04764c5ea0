"""Template: MATLAB's odezero, the root finder behind ode45's events. codegen puts it
behind a generated head.

A step from t to t_new has the values of all gaps at both ends. While a gap differs in sign between
the ends of the bracket [t_left, t_right], regula falsi proposes a place for each such gap, the
leftmost proposal is tried, and the half in which the first change of sign lies is kept; an end that
has stayed twice in a row has its values halved (the Illinois rule, Dowell & Jarratt 1971). The
rules are those of Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997), as
ode45 applies them to terminal events in either direction.

Symbols
-------
t_left, t_right the bracket; t_try the last place tried, after a move: the end that was given up;
LEFT, RIGHT, TRY in `work` (layout.py): the gaps at these three. Only the signs and ratios of
gaps matter, so halved values do no harm.
"""

# The end of the bracket that moved last.
NEITHER, MOVED_LEFT, MOVED_RIGHT = range(3)
#: Width of the last bracket [ulp of the time].
RESOLUTION = 128.0


@kernel
def odezero(t, t_new, t_leg, h, work):
    """The first contact of a step: (a time just before it, its time, True if it ends the leg),
    times in s.

    Needs the gaps at t and t_new at AT_NODE and AT_NEXT. Afterwards LEFT and RIGHT bracket the
    contact: the gaps that differ in sign there are those that close. A contact at the very start of
    a leg (t_leg) doesn't end it: it is the one that began it.
    """
    for g in range(NGUARDS):
        work[LEFT + g] = work[AT_NODE + g]
    t_left, t_right = narrow(t, t, t_new, h, work)
    if LAWS:
        while t_left == t_leg and t_right < t_new and not any_strikes(work):
            # MATLAB stops here: the state would fall through a stop
            for g in range(NGUARDS):
                work[LEFT + g] = work[RIGHT + g]
            if not any_sign_change(work, LEFT, AT_NEXT):
                break
            t_leg = t_right
            t_left, t_right = narrow(t, t_right, t_new, h, work)
    return t_left, t_right, t_left != t_leg


@inner
def narrow(t, t_left, t_new, h, work):
    """The bracket of the first contact between t_left, whose gaps are in LEFT, and the end of the
    step.
    """
    tol = min(RESOLUTION * max(ulp(t), ulp(t_new)), abs(t_new - t))
    t_right, t_try = t_new, t_new
    for g in range(NGUARDS):
        work[RIGHT + g], work[TRY + g] = work[AT_NEXT + g], work[AT_NEXT + g]
    moved = NEITHER
    while t_right - t_left > tol:
        place = propose(t, t_left, t_right, t_try, tol, work)
        try_place(place, t, h, work)
        if any_sign_change(work, LEFT, TRY):
            t_right, t_try = place, t_right
            give_up(work, RIGHT)
            if moved == MOVED_RIGHT:
                halve(work, LEFT)
            moved = MOVED_RIGHT
        else:
            t_left, t_try = place, t_left
            give_up(work, LEFT)
            if moved == MOVED_LEFT:
                halve(work, RIGHT)
            moved = MOVED_LEFT
    return t_left, t_right


@inner
def any_strikes(work):
    """True if the state jumps at one of the gaps that close."""
    found = False
    for g in range(NGUARDS):
        found |= strikes(work, g)
    return found


@inner
def propose(t, t_left, t_right, t_try, tol, work):
    """The next place to try, at least tol/2 inside the bracket."""
    width = t_right - t_left
    change = 1.0
    for g in range(NGUARDS):
        if changes_sign(work, LEFT, RIGHT, g):
            if work[LEFT + g] == 0.0 and t_left == t:
                return t_left + 0.5 * tol
            change = min(
                change,
                proposal(
                    t_left, t_right, t_try, width, work[LEFT + g], work[RIGHT + g], work[TRY + g]
                ),
            )
    change = max(0.5 * tol, min(change * width, width - 0.5 * tol))
    return t_left + change


@inner
def proposal(t_left, t_right, t_try, width, left, right, tried):
    """The next try for one gap, as a fraction of the bracket; a gap that is zero at an end is
    extrapolated from the end given up.
    """
    if left == 0.0:
        if not (t_try > t_right and tried != right):
            return 0.5
        maybe = 1.0 - right * (t_try - t_right) / ((tried - right) * width)
    elif right == 0.0:
        if not (t_try < t_left and tried != left):
            return 0.5
        maybe = left * (t_left - t_try) / ((tried - left) * width)
    else:
        return -left / (right - left)
    return maybe if 0.0 <= maybe <= 1.0 else 0.5


@inner
def give_up(work, row):
    """Make the place tried an end of the bracket; the end it replaces is remembered as tried."""
    for g in range(NGUARDS):
        work[row + g], work[TRY + g] = work[TRY + g], work[row + g]


@inner
def halve(work, row):
    """Apply the Illinois rule, unless it loses the sign."""
    for g in range(NGUARDS):
        if abs(0.5 * work[row + g]) >= SMALLEST:
            work[row + g] *= 0.5


@inner
def try_place(place, t, h, work):
    """Write the gaps at a time inside the step to TRY."""
    dense(place, t, h, work)
    if GAPS_IN_TIME:
        drive_at(place, Q, work)
    gaps_at(place, POINT, Q, TRY, work)
