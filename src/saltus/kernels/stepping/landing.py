"""Template: landing of a step of fixed length on a boundary that it has crossed, by one of three
rules. All start again from the start of the step, in its mode.

HENON     the gap g takes the place of time: dy/dg = (dy/dt)/(dg/dt) and dt/dg = 1/(dg/dt) over
          [g at the start, 0] in one step of the method. M. Henon, Physica D 5 (1982) 412-414
INVERSE   the cubic t(g) with the values and rates of g at both ends of the step says where g = 0;
          a step goes there, and once more with its end in place of the step's
BISECT    the length of the step is halved and halved again, to the side on which the boundary lies

The first two can't reach a boundary where dg/dt changes sign in the step: status TURNED; nor, where
the state jumps, one where it has just done so. Where
several gaps have crossed, the step lands on the first. Where the law beyond pushes back onto the
boundary, status SLIDING.

Symbols
-------
g a gap, by its number; direction its sign beyond the boundary; t, h start and length of the step;
hit a time from the start of the step [s], NaN if the boundary can't be reached.
"""

import math

from saltus.kernels.status import REJECTED, RUNNING, SLIDING, TURNED

# Rules, the column LOCATE of `options`; 0 locates nothing.
HENON, INVERSE, BISECT = range(1, 4)
#: Least rate of a gap at the start of a step, as a part of that at its end, where the state jumps.
#: Below it a step in the gap errs by half a per cent or more, and impacts that accumulate gain
#: speed.
SLOWEST_START = 0.5


@kernel
def find_contact(i, t, t_new, t_leg, h, batch, work):
    """The first contact of a step, whose state NEXT becomes: (its time, end and length of the step
    that it ends, True if there is one, RUNNING or the status if it can't be reached).
    """
    gaps_at(t_new, NEXT, Q_STAGE, AT_NEXT, work)
    crossed = sides(AT_NEXT, work) ^ batch.mode[i]
    if crossed == 0:
        return t_new, t_new, h, False, RUNNING
    drive_at(t, Q, work)
    gap_rates_at(t, NODE, K1, Q, LEFT, work)
    gap_rates_at(t_new, NEXT, K_END, Q_STAGE, RIGHT, work)
    first, last, hit = -1, -1, math.inf
    for g in range(NGUARDS):
        if crossed >> g & 1:
            one, last = reach(i, g, t, h, batch, work), g
            if not one >= hit:
                first, hit = g, one
            if one != one:
                return t_new, t_new, h, False, TURNED
    if first != last:
        hit = reach(i, first, t, h, batch, work)
    closing(first, crossed, t + hit, batch.mode[i], work)
    if not (LAWS and strikes(work, first)) and comes_back(first, t + hit, batch.mode[i], work):
        return t_new, t_new, h, False, SLIDING
    return t + hit, t + hit, hit, True, RUNNING


@kernel
def reach(i, g, t, h, batch, work):
    """Step from NODE to the boundary g; return the time it takes, NaN if it isn't reached."""
    direction, rule = (-1.0 if batch.mode[i] >> g & 1 else 1.0), batch.options[i, LOCATE]
    if rule == BISECT:
        return bisect(i, g, t, h, direction, batch, work)
    least = SLOWEST_START * abs(work[RIGHT + g]) if LAWS and waits(g, batch.mode[i]) else 0.0
    if not (work[LEFT + g] * direction > least and work[RIGHT + g] * direction > 0.0):
        return math.nan
    if rule == INVERSE:
        return invert(g, t, h, direction, batch.mode[i], work)
    return henon(g, t, direction, batch.mode[i], work)


@kernel
def closing(first, crossed, t_hit, mode, work):
    """Give LEFT and RIGHT different signs for the gap that is reached, and for those already on
    their new sides at NEXT.
    """
    drive_at(t_hit, Q, work)
    gaps_at(t_hit, NEXT, Q, TRY, work)
    there = sides(TRY, work) ^ mode
    for g in range(NGUARDS):
        closes = g == first or (crossed & there) >> g & 1
        direction = -1.0 if mode >> g & 1 else 1.0
        work[LEFT + g], work[RIGHT + g] = (-direction, direction) if closes else (0.0, 0.0)


@kernel
def comes_back(g, t_hit, mode, work):
    """True if the law beyond boundary g pushes back onto it. Needs q at t_hit in Q."""
    rate_at(t_hit, NEXT, Q, mode ^ (1 << g), POINT, work)
    gap_rates_at(t_hit, NEXT, POINT, Q, TRY, work)
    return work[TRY + g] * (-1.0 if mode >> g & 1 else 1.0) < 0.0


@kernel
def henon(g, t, direction, mode, work):
    """Take the step in g, to NEXT. The times of its stages replace those of the step's."""
    total = -work[AT_NODE + g]
    for stage in range(STAGES - 1):
        elapsed = 0.0
        for j in range(stage):
            elapsed += WEIGHT[stage * STAGES + j] * work[S + j]
        time, row = t + total * elapsed, K1 + NSTATES * stage
        drive_at(time, Q_STAGE, work)
        if stage > 0:
            toward(stage, total, POINT, work)
            rate_at(time, POINT, Q_STAGE, mode, row, work)
        gap_rates_at(time, POINT if stage > 0 else NODE, row, Q_STAGE, TRY, work)
        rate = work[TRY + g]
        if not rate * direction > 0.0:
            return math.nan
        work[S + stage] = 1.0 / rate
        for j in range(NSTATES):
            work[row + j] /= rate
    toward(STAGES - 1, total, NEXT, work)
    hit = 0.0
    for j in range(STAGES - 1):
        hit += WEIGHT[(STAGES - 1) * STAGES + j] * work[S + j]
    hit *= total
    drive_at(t, Q, work)
    rate_at(t, NODE, Q, mode, K1, work)
    drive_at(t + hit, Q_STAGE, work)
    rate_at(t + hit, NEXT, Q_STAGE, mode, K_END, work)
    stand_in(hit, work)
    return hit


@inner
def stand_in(h, work):
    """Replace the stages between the first and the last so that the interpolant has the ends of a
    step in g.
    """
    weight = WEIGHT[(STAGES - 1) * STAGES]
    for j in range(NSTATES):
        slope = (work[NEXT + j] - work[NODE + j]) / h if h != 0.0 else work[K1 + j]
        for stage in range(1, STAGES - 1):
            work[K1 + NSTATES * stage + j] = (slope - weight * work[K1 + j]) / (1.0 - weight)


@kernel
def invert(g, t, h, direction, mode, work):
    """Step to the zero of the inverse cubic, twice."""
    hit, value, rate = h, work[AT_NEXT + g], work[RIGHT + g]
    for _ in range(2):
        if not rate * direction > 0.0:
            return math.nan
        hit = inverse_cubic(hit, work[AT_NODE + g], value, work[LEFT + g], rate)
        if not 0.0 <= hit <= REACHES * h:
            return math.nan
        stages(t, hit, t + hit, mode, work)
        gaps_at(t + hit, NEXT, Q_STAGE, TRY, work)
        value = work[TRY + g]
        gap_rates_at(t + hit, NEXT, K_END, Q_STAGE, TRY, work)
        rate = work[TRY + g]
    return hit


@inner
def inverse_cubic(h, start, end, start_rate, end_rate):
    """The time where g = 0 on the cubic t(g) from (start, 0) to (end, h), with the slopes 1/rate
    there.
    """
    width = end - start
    if width == 0.0:
        return h
    u = -start / width
    rest = 1.0 - u
    slopes = u * rest * (rest / start_rate - u / end_rate)
    return u * u * (3.0 - 2.0 * u) * h + width * slopes


@kernel
def bisect(i, g, t, h, direction, batch, work):
    """Step to just beyond the boundary, by halving."""
    before, beyond = 0.0, h
    while beyond - before > batch.options[i, CLOSENESS] * h:
        middle = 0.5 * (before + beyond)
        if middle <= before or middle >= beyond or t + middle == t + before:
            break
        stages(t, middle, t + middle, batch.mode[i], work)
        gaps_at(t + middle, NEXT, Q_STAGE, TRY, work)
        batch.counters[i, REJECTED] += 1
        if (work[TRY + g] > 0.0) == (direction > 0.0):
            beyond = middle
        else:
            before = middle
    stages(t, beyond, t + beyond, batch.mode[i], work)
    return beyond
