"""Template of the Taylor flow: forces without a Taylor series on a boundary, such as d**1.5
where a contact begins or ends.

Off the boundary such a force is analytic; its series converges as far as the boundary is away. So
steps grow, and shrink, in proportion to that way (`away_from_boundaries`). The first step off a
boundary and the last step onto it can't be taken like that: there the terms without a series are
*set aside*. The step sees the rest of the equations, is so short that the terms left out change no
state by more than rounding, and their integral is added at its end (`add_what_was_left_out`). Its
polynomials are those of smooth equations: that no crossing is missed is proven as always.
docs/decisions/0013.

The head supplies NSINGULAR and SINGULAR_GUARD, the boundaries concerned; rows NGUARDS + j of `side`
are +1 where the terms of boundary j are set aside, else -1; rows CALM_ROW + j*NMOVED of `work` hold
the rates without them, of the NMOVED states that aren't a tangent. Whether a lane's terms are set
aside is a function of its state and of the boundaries that it stands on, never of what came before.
"""

import math

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.lanes import (
    any_lane,
    coarse_exp2,
    coarse_log2,
    fma,
    larger,
    libm_log,
    load,
    magnitude,
    root,
    select,
    smaller,
    splat,
    store,
)
from saltus.kernels.status import SURFACE_LAW


@inner
def coefficients(lanes):
    """Taylor coefficients of all lanes, computed again while lanes are found so near a boundary
    that its terms are set aside.
    """
    if NSINGULAR == 0:
        jets(lanes.y, lanes.side, lanes.c, lanes.clock, lanes.work)
    else:
        for j in range(NSINGULAR):
            stands = load(lanes.fresh, SINGULAR_GUARD[j], LANES) > 0.5
            store(lanes.side, NGUARDS + j, select(stands, splat(1.0, LANES), -1.0))
        again = True
        while again:
            jets(lanes.y, lanes.side, lanes.c, lanes.clock, lanes.work)
            again = set_aside(lanes)


@inner
def way(lanes, g):
    """Time in which the quadratic part of a gap changes by the gap itself: the distance of the
    boundary in time.
    """
    gap = larger(load(lanes.side, g, LANES) * load(lanes.work, GAP_ROW + g, LANES), 0.0)
    rate, bend = (
        magnitude(load(lanes.work, GUARD_ROW[g] + 1, LANES)),
        magnitude(load(lanes.work, GUARD_ROW[g] + 2, LANES)),
    )
    return select(gap > 0.0, 2.0 * gap / (rate + root(rate * rate + 4.0 * bend * gap)), 0.0)


@inner
def acts(lanes, j):
    """Lanes in which the terms of a boundary change a rate, or aren't numbers."""
    different = splat(0.0, LANES) > 1.0
    for i in range(NMOVED):
        rate, calm = (
            load(lanes.work, i * (ORDER + 1) + 1, LANES),
            load(lanes.work, CALM_ROW + j * NMOVED + i, LANES),
        )
        different = different | (~(magnitude(rate - calm) <= 0.0))
    return different & (load(lanes.run, ACTIVE, LANES) > 0.5)


@inner
def told(lanes, g):
    """Least gap that can be told from zero."""
    return TOLD * ROUNDING * load(lanes.work, SCALE_ROW + g, LANES)


@inner
def set_aside(lanes):
    """Set aside the terms that change no state by more than rounding from here to their boundary;
    True if there are any.
    """
    found = splat(0.0, LANES) > 1.0
    for j in range(NSINGULAR):
        g = SINGULAR_GUARD[j]
        before = load(lanes.side, NGUARDS + j, LANES)
        d = way(lanes, g)
        weak = splat(1.0, LANES) > 0.0
        for i in range(NMOVED):
            rate, calm = (
                load(lanes.work, i * (ORDER + 1) + 1, LANES),
                load(lanes.work, CALM_ROW + j * NMOVED + i, LANES),
            )
            size = magnitude(load(lanes.work, i * (ORDER + 1), LANES)) + d * magnitude(calm)
            weak = weak & (d * magnitude(rate - calm) <= 0.25 * NEGLIGIBLE * size)
        gap = load(lanes.side, g, LANES) * load(lanes.work, GAP_ROW + g, LANES)
        near = (
            (weak | (d <= SHORTEST) | (~(gap > told(lanes, g)))) & acts(lanes, j) & (before < 0.0)
        )
        store(lanes.side, NGUARDS + j, select(near, splat(1.0, LANES), before))
        found = found | near
    return any_lane(found)


@inner
def away_from_boundaries(lanes, h, room):
    """Shorten h to a share of the way to a boundary whose terms act, or, if they are set aside,
    until leaving them out is negligible.

    At most the room, which is no reason to shorten: a share of what is left would never reach the
    end.
    """
    for j in range(NSINGULAR):
        aside = load(lanes.side, NGUARDS + j, LANES) > 0.0
        h = select(
            acts(lanes, j) & (~aside), smaller(REACH * way(lanes, SINGULAR_GUARD[j]), FINER * h), h
        )
        aside = aside & (load(lanes.run, ACTIVE, LANES) > 0.5)
        if any_lane(aside):
            h = select(aside, negligible_step(lanes, smaller(h, room), j, aside), h)
    return smaller(h, room)


@inner
def rounding_of_gaps(lanes, i):
    """Rounding error of rate i by that of the gaps: near its boundary a gap has few digits."""
    total = splat(0.0, LANES)
    if i < NMOVED:
        for j in range(NSINGULAR):
            gap = magnitude(load(lanes.work, GAP_ROW + SINGULAR_GUARD[j], LANES))
            force = magnitude(
                load(lanes.work, i * (ORDER + 1) + 1, LANES)
                - load(lanes.work, CALM_ROW + j * NMOVED + i, LANES)
            )
            part = force * ROUNDING * load(lanes.work, SCALE_ROW + SINGULAR_GUARD[j], LANES) / gap
            total = total + select(part < HUGE, part, 0.0)
    return total


@inner
def negligible_step(lanes, h, j, wanted):
    """Approximate longest step up to h over which the terms of boundary j may be left out.

    Not shorter than the gap needs to be told from zero, by that of its terms which takes it there
    first, nor than SHORTEST. By the secant rule on the logarithms, in a bracket.
    """
    g = SINGULAR_GUARD[j]
    goal, rate, bend = (
        told(lanes, g),
        magnitude(load(lanes.work, GUARD_ROW[g] + 1, LANES)),
        magnitude(load(lanes.work, GUARD_ROW[g] + 2, LANES)),
    )
    longest, speed = h, rate + root(rate * rate + 4.0 * bend * goal)
    leaves = select(speed > 0.0, 2.0 * goal / speed, 0.0)
    for k in range(3, ORDER + 1):
        term = magnitude(load(lanes.work, GUARD_ROW[g] + k, LANES))
        alone = coarse_exp2((coarse_log2(goal) - coarse_log2(term)) * (1.0 / k))
        leaves = select(term > 0.0, smaller(leaves, alone), leaves)
    floor = smaller(larger(leaves, SHORTEST), longest)
    power, before, log_before = splat(USUAL_POWER, LANES), splat(2000.0, LANES), splat(0.0, LANES)
    # logs of a step short enough, and of one too long
    low, high = coarse_log2(floor), coarse_log2(longest)
    tries = 0
    while tries < MOST_TRIALS and any_lane(wanted):
        effect, log_h = coarse_log2(left_out(lanes, h, j)), coarse_log2(h)
        fits, useful = effect <= 0.0, magnitude(effect) < 900.0
        low, high = select(fits & wanted, log_h, low), select(fits | (~wanted), high, log_h)
        wanted = wanted & (high - low > 1.0) & ((~fits) | ((effect < -4.0) & (h < longest)))
        measured = (effect - before) / (log_h - log_before)
        power = select(useful & (before < 900.0), larger(smaller(measured, 8.0), 1.0), power)
        guess = log_h - (effect + 1.0) / power
        guess = select(useful & (guess > low) & (guess < high), guess, 0.5 * (low + high))
        before, log_before = select(useful, effect, 2000.0), log_h
        h = select(wanted, coarse_exp2(guess), select(fits, h, coarse_exp2(low)))
        tries += 1
    return h


@inner
def left_out(lanes, h, j):
    """Change of the states by the terms of boundary j over h, in units of the negligible change;
    estimated where its gap is widest.
    """
    g = SINGULAR_GUARD[j]
    s = load(lanes.side, g, LANES) * GUARD_SIGN[g]
    rate, bend = (
        s * load(lanes.work, GUARD_ROW[g] + 1, LANES),
        s * load(lanes.work, GUARD_ROW[g] + 2, LANES),
    )
    turn = smaller(-0.5 * rate / bend, h)
    rising = rate + 2.0 * bend * h >= 0.0
    widest = select(rising, select(fma(bend, h, rate) > 0.0, h, 0.0), select(rate > 0.0, turn, 0.0))
    # from rest a gap may begin with its third power
    widest = select(gap_at(lanes, g, h) > gap_at(lanes, g, widest), h, widest)
    look_with(lanes, widest, j)
    worst = splat(0.0, LANES)
    for i in range(NMOVED):
        rate, slope = load(lanes.probe_rate, i, LANES), load(lanes.probe_rate, NSTATES + i, LANES)
        defect = magnitude(rate - slope) - ROUNDING * load(lanes.probe_rate, 2 * NSTATES + i, LANES)
        # where a stop lets go the rate of a velocity is the rounding of its terms
        size = magnitude(load(lanes.work, i * (ORDER + 1) + 2, LANES))
        for k in range(1, -1, -1):
            size = fma(size, h, magnitude(load(lanes.work, i * (ORDER + 1) + k, LANES)))
        share = select(
            defect > 0.0,
            defect * h / (NEGLIGIBLE * size),
            select(defect <= 0.0, splat(0.0, LANES), math.inf),
        )
        worst = larger(share, worst)
    return worst


@kernel
def look_with(lanes, d, j):
    """Apply :func:`look_ahead` with the terms of boundary j restored."""
    kept = load(lanes.side, NGUARDS + j, LANES)
    store(lanes.side, NGUARDS + j, splat(-1.0, LANES))
    look_ahead(lanes, d)
    store(lanes.side, NGUARDS + j, kept)


@inner
def gap_at(lanes, g, d):
    """A gap at d, from its series, positive on its side."""
    value = splat(0.0, LANES)
    for k in range(ORDER, 0, -1):
        value = fma(value, d, load(lanes.work, GUARD_ROW[g] + k, LANES))
    value = fma(value * d, GUARD_SIGN[g], load(lanes.work, GAP_ROW + g, LANES))
    return load(lanes.side, g, LANES) * value


@inner
def sets_aside(lanes, lane):
    """True if terms of a lane are set aside in this step."""
    aside = False
    for j in range(NSINGULAR):
        aside = aside or lanes.side[NGUARDS + j, lane] > 0.0
    return aside


@inner
def hold_ridden(lanes, side):
    """Set the hold guards of the surfaces that this step rides: what was left out holds them, and
    leads off neither side.
    """
    for lane in range(LANES):
        rides = lanes.memo[lane, RESTS] if lanes.memo[lane, DECIDED] == 1 else 0
        for g in range(NGUARDS):
            if LAW[g] == SURFACE_LAW and (rides >> g) & 1 == 1:
                lanes.side[PARTNER[g], lane] = side


@inner
def add_what_was_left_out(lanes, d):
    """Add to the states at d the integral of the terms that were set aside."""
    if LAWS:
        hold_ridden(lanes, 1.0)
    for j in range(NSINGULAR):
        aside = (
            (load(lanes.side, NGUARDS + j, LANES) > 0.0)
            & (load(lanes.run, ACTIVE, LANES) > 0.5)
            & (d > 0.0)
        )
        if any_lane(aside):
            g = SINGULAR_GUARD[j]
            for third in range(3):  # at the start, in the middle, at the end
                look_with(lanes, (0.5 * third) * d, j)
                for i in range(NSTATES):
                    defect = load(lanes.probe_rate, i, LANES) - load(
                        lanes.probe_rate, NSTATES + i, LANES
                    )
                    store(lanes.probe_rate, (3 + third) * NSTATES + i, defect)
            small = 0.001 * gap_at(lanes, g, 0.5 * d)
            starts, ends = gap_at(lanes, g, 0.0 * d) <= small, gap_at(lanes, g, d) <= small
            for i in range(NSTATES):
                gained = integral(lanes, i, d, starts, ends)
                value = load(lanes.y, i, LANES)
                store(lanes.y, i, select(aside & (magnitude(gained) < HUGE), value + gained, value))
    if LAWS:
        hold_ridden(lanes, -1.0)


@inner
def integral(lanes, i, d, starts, ends):
    """Integral over d of the part left out of rate i: as a power of the time since, or until, the
    boundary; else by Simpson's rule.
    """
    first, middle = (
        load(lanes.probe_rate, 3 * NSTATES + i, LANES),
        load(lanes.probe_rate, 4 * NSTATES + i, LANES),
    )
    last = load(lanes.probe_rate, 5 * NSTATES + i, LANES)
    outer = select(starts, last, first)
    ratio = outer / middle
    power = larger(smaller(libm_log(ratio) * (1.0 / math.log(2.0)), 40.0), -0.9)
    by_power = select((ratio > 0.0) & (ratio < HUGE), outer * d / (power + 1.0), 0.0)
    first, last = (
        select(magnitude(first) < HUGE, first, 0.0),
        select(magnitude(last) < HUGE, last, 0.0),
    )
    by_simpson = (first + 4.0 * middle + last) * d * (1.0 / 6.0)
    return select((starts | ends) & (~(starts & ends)), by_power, by_simpson)
