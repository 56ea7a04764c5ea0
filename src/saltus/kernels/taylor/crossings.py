"""Template of the Taylor flow: crossings of gaps within a step, in all lanes at once.

`locate` bounds the series, classifies each gap and chooses the first crossing. What is proven to
cross is refined by Newton's method. What stays open is tried on a shorter step (`settle_sooner`),
then left to the slow path (contacts.py). docs/decisions/0004, 0023.
"""

import math

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.lanes import (
    any_lane,
    bits,
    fma,
    larger,
    load,
    magnitude,
    root,
    select,
    smaller,
    splat,
    store,
)


@inner
def bound_series(lanes, h):
    """Bound every series that a gap reads: its first three terms at h, its change over h, its slope
    there, a bound of the terms after its cubic.

    Fills `bounds`: for x in [0, 1], gap(x h) = gap(0) + t1 x + t2 x^2 + t3 x^3 + rest(x), |rest| <=
    x^4 W/12, |rest'| <= W/3, |rest''| <= W with W = sum of k(k-1)|t_k| for k >= 4 (k(k-1) >= 3k >=
    12 there); so it is for rest/x, with x^3.
    """
    work, bounds = lanes.work, lanes.bounds
    for j in range(NSERIES):
        row = SERIES_ROW[j]
        rest, change, turn = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
        for k in range(ORDER, 3, -1):
            term = load(work, row + k, LANES)
            rest = fma(rest, h, magnitude(term) * (k * (k - 1.0)))
            turn = fma(turn, h, change)
            change = fma(change, h, term)
        h2 = h * h
        # of sum t_k h^(k-4), k >= 4: the derivative of h^4 times it, over h^3
        turn = fma(turn, h, 4.0 * change)
        t1, t2, t3 = (
            load(work, row + 1, LANES) * h,
            load(work, row + 2, LANES) * h2,
            load(work, row + 3, LANES) * h2 * h,
        )
        store(bounds, BOUNDS * j + LINEAR, t1)
        store(bounds, BOUNDS * j + QUADRATIC, t2)
        store(bounds, BOUNDS * j + CUBIC, t3)
        store(bounds, BOUNDS * j + CHANGE, fma(change * h2, h2, t3) + t2 + t1)
        store(bounds, BOUNDS * j + SLOPE_AT_END, fma(turn * h2, h2, 3.0 * t3) + 2.0 * t2 + t1)
        store(bounds, BOUNDS * j + REST, rest * h2 * h2)


@inner
def terms_of_gap(lanes, g):
    """Terms 0 to 3 of a gap over the step that `bounds` belong to, positive on its side, and the
    gap at its end.
    """
    j, side = BOUNDS * GUARD_SERIES[g], load(lanes.side, g, LANES)
    s, a0 = side * GUARD_SIGN[g], side * load(lanes.work, GAP_ROW + g, LANES)
    a1, a2, a3 = (
        load(lanes.bounds, j + LINEAR, LANES),
        load(lanes.bounds, j + QUADRATIC, LANES),
        load(lanes.bounds, j + CUBIC, LANES),
    )
    end = select(load(lanes.fresh, g, LANES) > 0.5, 0.0, a0) + s * load(
        lanes.bounds, j + CHANGE, LANES
    )
    return a0, s * a1, s * a2, s * a3, end


@inner
def without_known_root(on_boundary, a0, a1, a2, a3):
    """The terms of P, divided by x where the root at 0 is known."""
    return (
        select(on_boundary, a1, a0),
        select(on_boundary, a2, a1),
        select(on_boundary, a3, a2),
        select(on_boundary, 0.0, a3),
    )


@inner
def locate(lanes, h):
    """Find the lanes whose gaps may close within h. Fills NEAREST and TURNED; for lanes with a
    proven first crossing also WHICH and the entries of `found` for that gap. Returns the undecided
    lanes.
    """
    bound_series(lanes, h)
    store(lanes.found, NEAREST, splat(math.inf, LANES))
    store(lanes.found, TURNED, splat(0.0, LANES))
    store(lanes.found, WHICH, splat(-1.0, LANES))
    store(lanes.found, SERIES, splat(-1.0, LANES))
    undecided = splat(0.0, LANES) > 1.0
    for g in range(NGUARDS):
        undecided = undecided | classify(lanes, g, h)
    undecided = undecided & (load(lanes.run, ACTIVE, LANES) > 0.5)
    store(lanes.found, WHICH, select(undecided, -1.0, load(lanes.found, WHICH, LANES)))
    return undecided


@inner
def one_way(p1, p2, p3, rest):
    """Masks of lanes in which a gap p0 + p1 x + p2 x^2 + p3 x^3 + rest falls, rises, is concave, is
    convex on all of [0, 1]; see `bound_series`.
    """
    bend = 2.0 * p2
    falls = p1 + larger(bend + larger(3.0 * p3, 0.0), 0.0) + (1.0 / 3.0) * rest < 0.0
    rises = p1 + smaller(bend + smaller(3.0 * p3, 0.0), 0.0) - (1.0 / 3.0) * rest > 0.0
    concave = larger(bend, bend + 6.0 * p3) + rest < 0.0
    convex = smaller(bend, bend + 6.0 * p3) - rest > 0.0
    return falls, rises, concave, convex


@inner
def classify(lanes, g, h):
    """Classify a gap in all lanes: clear over the step, or crossing (`choose` then). Returns the
    lanes in which neither is proven.

    A gap P (P/x where the root at 0 is known) is p0 + p1 x + p2 x^2 + p3 x^3 + rest on [0, 1]. If
    it is monotone or concave its end decides; if it is convex it crosses once where it ends below
    zero, and twice where its vertex is proven to be; else its quadratic part less the bounds of
    what follows decides. What that leaves open `with_more_terms` settles. Where all gaps read one
    series it is a step in ten thousand (the rig's): the part of the step up to the crossing that is
    predicted is tried (`crosses_sooner`), then the slow path. What lies within the rounding error
    of the gap is never proven. How near clear gaps come, and when, goes to NEAREST, TURNED.
    """
    j, on_boundary = BOUNDS * GUARD_SERIES[g], load(lanes.fresh, g, LANES) > 0.5
    a0, a1, a2, a3, end = terms_of_gap(lanes, g)
    p0, p1, p2, p3 = without_known_root(on_boundary, a0, a1, a2, a3)
    rest = load(lanes.bounds, j + REST, LANES)
    size = (
        load(lanes.work, SCALE_ROW + g, LANES)
        + magnitude(a1)
        + magnitude(a2)
        + magnitude(a3)
        + rest
    )
    inherited = load(lanes.prior, PRIOR_ROWS * g + NEW, LANES)
    store(lanes.prior, PRIOR_ROWS * g + OLD, inherited)
    noise = ROUNDING * (size + inherited)
    turns = (p1 < 0.0) & (p1 + 2.0 * p2 > 0.0)
    flat_at = -p1 / (2.0 * p2)  # the vertex of the quadratic part
    vertex = p0 + 0.5 * p1 * flat_at
    least = select(turns, vertex, smaller(p0, p0 + p1 + p2)) + smaller(p3, 0.0) - (1.0 / 6.0) * rest
    falls, rises, concave, convex = one_way(p1, p2, p3, rest)
    dips = convex & turns & (6.0 * (vertex + larger(p3, 0.0) + noise) + rest < 0.0)
    inside, asked = p0 > 0.0, load(lanes.run, ACTIVE, LANES) > 0.5
    if LAWS:  # ridden boundaries, and those with more known zeros than one, go to the slow path
        asked = asked & (load(lanes.side, WATCHED + g, LANES) > 0.5)
        inside = inside & (load(lanes.fresh, g, LANES) < RIDDEN)
    clear = inside & (((falls | rises | concave) & (end > noise)) | (least > noise))
    once = inside & (end < -noise) & (falls | concave | convex)
    closes = asked & inside & (~clear)
    undecided = ~inside
    if SNAP_STATE[g] < 0:  # where it begins, its first terms may be rounding: the slow path tells
        undecided = undecided | (on_boundary & (load(lanes.run, STARTING, LANES) > 0.5))
    if LAWS:
        beside = on_boundary & (magnitude(a0) > KEPT * (size + inherited))
        undecided = (undecided | beside) & asked
    if NSERIES > 1:
        store(lanes.found, RIVALS + g, splat(-1.0, LANES))
    if any_lane(closes):
        until, doubtful = select(once, splat(1.0, LANES), 0.0), closes & (~once) & (~dips)
        if any_lane(doubtful):
            if NSERIES > 1:
                passes, leaves, returns, closest = with_more_terms(
                    lanes, g, h, p0, p1, p2, p3, flat_at, end, noise
                )
                clear, dips, least = (
                    clear | (doubtful & passes),
                    dips | (doubtful & returns),
                    select(doubtful, closest, least),
                )
                until = select(doubtful & leaves, splat(1.0, LANES), until)
            else:
                until = select(
                    doubtful, crosses_sooner(on_boundary, p0, p1, p2, p3, rest, noise), until
                )
        crosses = closes & (dips | (until > 0.0))
        undecided = undecided | (closes & (~(clear | crosses)))
        if any_lane(crosses):
            undecided = undecided | choose(lanes, g, crosses, until, p0, p1, p2, p3, noise)
    slope_at_end = (
        load(lanes.side, g, LANES) * GUARD_SIGN[g] * load(lanes.bounds, j + SLOPE_AT_END, LANES)
    )
    rises_again = slope_at_end > 0.0
    near = (
        clear
        & (~on_boundary)
        & (a1 < 0.0)
        & (turns | rises_again)
        & (least < load(lanes.run, LEAST, LANES))
    )
    if LAWS:
        near = near & asked
    if any_lane(near):
        note_turn(lanes, g, near, rises_again, h * larger(smaller(flat_at, 1.0), 0.0), h)
    return undecided


@kernel
def with_more_terms(lanes, g, h, p0, p1, p2, p3, place, end, noise):
    """Masks of lanes in which a gap is clear over the step, crosses once, crosses twice, by its
    terms to the seventh; and a lower bound of it.

    A polynomial lies between its coefficients in Bernstein's form. Those of the second derivative,
    summed up, are those of the rate, and of the gap. A convex gap lies above its tangents: above
    that near `place`, where it turns about. What follows the seventh term adds W/56 at most, to its
    rate W/7, to its second derivative W, with W as in `bound_series` for k >= 8 (k(k-1) >= 7k >= 56
    there).
    """
    work, row, on_boundary = lanes.work, GUARD_ROW[g], load(lanes.fresh, g, LANES) > 0.5
    rest, h2 = splat(0.0, LANES), h * h
    for k in range(ORDER, 7, -1):
        rest = fma(rest, h, magnitude(load(work, row + k, LANES)) * (k * (k - 1.0)))
    rest = rest * (h2 * h2) * (h2 * h2)
    s4 = load(lanes.side, g, LANES) * GUARD_SIGN[g] * (h2 * h2)
    t4, t5, t6 = (
        s4 * load(work, row + 4, LANES),
        s4 * h * load(work, row + 5, LANES),
        s4 * h2 * load(work, row + 6, LANES),
    )
    t7 = splat(0.0, LANES)
    if ORDER > 6:
        t7 = s4 * h2 * h * load(work, row + 7, LANES)
    p3, p4, p5 = (
        select(on_boundary, t4, p3),
        select(on_boundary, t5, t4),
        select(on_boundary, t6, t5),
    )
    p6, p7 = select(on_boundary, t7, t6), select(on_boundary, 0.0, t7)
    b0, b1, b2, b3, b4, b5 = second_derivative(p2, p3, p4, p5, p6, p7)
    convex = smaller(smaller(smaller(b0, b1), smaller(b2, b3)), smaller(b4, b5)) - rest > 0.0
    concave = larger(larger(larger(b0, b1), larger(b2, b3)), larger(b4, b5)) + rest < 0.0
    rate, slowest, fastest, value, least = p1, p1, p1, p0, p0
    for bend in (b0, b1, b2, b3, b4, b5):
        value = fma(1.0 / 7.0, rate, value)
        rate = fma(1.0 / 6.0, bend, rate)
        least, slowest, fastest = (
            smaller(value, least),
            smaller(rate, slowest),
            larger(rate, fastest),
        )
    least = smaller(fma(1.0 / 7.0, rate, value), least)
    falls, rises = fastest + (1.0 / 7.0) * rest < 0.0, slowest - (1.0 / 7.0) * rest > 0.0
    x = larger(smaller(place, 1.0), 0.0)
    bend = fma(
        fma(fma(fma(fma(42.0 * p7, x, 30.0 * p6), x, 20.0 * p5), x, 12.0 * p4), x, 6.0 * p3),
        x,
        2.0 * p2,
    )
    x = larger(smaller(x - rate_to_seventh(x, p1, p2, p3, p4, p5, p6, p7) / bend, 1.0), 0.0)
    rate = rate_to_seventh(x, p1, p2, p3, p4, p5, p6, p7)
    value = fma(fma(fma(fma(fma(fma(fma(p7, x, p6), x, p5), x, p4), x, p3), x, p2), x, p1), x, p0)
    doubt = fma(1.0 / 56.0, rest, 4.0 * noise)  # for sums of this length
    least = select(convex, larger(value - larger(rate * x, rate * (x - 1.0)), least), least) - doubt
    clear = ((falls | rises | concave) & (end > noise)) | (least > 0.0)
    once = (end < -noise) & (falls | concave | convex)
    twice = convex & (end > noise) & (value + doubt < 0.0)
    return clear, once, twice, least


@inner
def second_derivative(p2, p3, p4, p5, p6, p7):
    """Coefficients of 2 p2 + 6 p3 x + ... + 42 p7 x^5 on [0, 1] in Bernstein's form."""
    b0, b1, b2, b3, b4, b5 = 2.0 * p2, 1.2 * p3, 1.2 * p4, 2.0 * p5, 6.0 * p6, 42.0 * p7
    b5, b4, b3, b2, b1 = b5 + b4, b4 + b3, b3 + b2, b2 + b1, b1 + b0
    b5, b4, b3, b2 = b5 + b4, b4 + b3, b3 + b2, b2 + b1
    b5, b4, b3 = b5 + b4, b4 + b3, b3 + b2
    b5, b4 = b5 + b4, b4 + b3
    return b0, b1, b2, b3, b4, b5 + b4


@inner
def rate_to_seventh(x, p1, p2, p3, p4, p5, p6, p7):
    """Derivative of p1 x + ... + p7 x^7."""
    return fma(
        fma(
            fma(fma(fma(fma(7.0 * p7, x, 6.0 * p6), x, 5.0 * p5), x, 4.0 * p4), x, 3.0 * p3),
            x,
            2.0 * p2,
        ),
        x,
        p1,
    )


@kernel
def note_turn(lanes, g, near, rises_again, d, h):
    """Write the nearest approach and the time of gaps that turn near d, if nearer than before, to
    NEAREST and TURNED.

    One that rises at the end of the step turns for certain; of others Newton's method tells.
    """
    work, row, s = lanes.work, GUARD_ROW[g], load(lanes.side, g, LANES) * GUARD_SIGN[g]
    bend, change = splat(0.0, LANES), h
    for _ in range(NEWTON_STEPS):
        rate, bend = ORDER * load(work, row + ORDER, LANES), splat(0.0, LANES)
        for k in range(ORDER - 1, 0, -1):
            bend = fma(bend, d, rate)
            rate = fma(rate, d, k * load(work, row + k, LANES))
        closer = d - rate / bend
        change = select((closer >= 0.0) & (closer <= h), closer - d, h)
        d = select(change < h, d + change, d)
    depth = load(work, row + ORDER, LANES)
    for k in range(ORDER - 1, 0, -1):
        depth = fma(depth, d, load(work, row + k, LANES))
    depth = s * depth * d + load(lanes.side, g, LANES) * load(work, GAP_ROW + g, LANES)
    turns = rises_again | ((s * bend > 0.0) & (magnitude(change) <= TURN_FOUND * h))
    nearer = near & turns & (depth < load(lanes.found, NEAREST, LANES))
    keep(lanes.found, TURNED, nearer, d)
    keep(lanes.found, NEAREST, nearer, depth)


@inner
def crosses_sooner(on_boundary, p0, p1, p2, p3, rest, noise):
    """Share of the step, just beyond the crossing that the quadratic part predicts, within which a
    gap is proven to cross once; or 0.
    """
    share = smaller(BEHIND * first_root(p0, p1, p2), 1.0)
    square = share * share
    p1, p2, p3 = p1 * share, p2 * square, p3 * square * share
    rest = rest * square * share * select(on_boundary, 1.0, share)
    falls, _, concave, convex = one_way(p1, p2, p3, rest)
    ends_below = 12.0 * (p0 + p1 + p2 + p3 + noise) + rest < 0.0
    return select(ends_below & (falls | concave | convex), share, 0.0)


@inner
def first_root(p0, p1, p2):
    """First zero of p0 + p1 x + p2 x^2, which is positive at 0; infinite if there is none."""
    discriminant = p1 * p1 - 4.0 * p0 * p2
    x = 2.0 * p0 / (root(larger(discriminant, 0.0)) - p1)
    return select((discriminant >= 0.0) & (x > 0.0), x, math.inf)


@inner
def predicted(p0, p1, p2, p3):
    """Approximate first zero of a gap: that of its quadratic part, then one step of Newton's method
    on its cubic part.
    """
    x = 2.0 * p0 / (root(larger(p1 * p1 - 4.0 * p0 * p2, 0.0)) - p1)
    return x - fma(fma(fma(p3, x, p2), x, p1), x, p0) / fma(fma(3.0 * p3, x, 2.0 * p2), x, p1)


@inner
def choose(lanes, g, crosses, until, p0, p1, p2, p3, noise):
    """Let a lane cross guard g, if it is the first or is predicted to be; returns the lanes that
    stay undecided.

    Gaps of one state, on the same side of it, differ by a constant: the nearer closes first. Of
    others `refine_crossings` proves which is the first, if each of its rivals crosses once.
    """
    found, row = lanes.found, GUARD_ROW[g]
    s, fresh = load(lanes.side, g, LANES) * GUARD_SIGN[g], load(lanes.fresh, g, LANES)
    a0, nearest = (
        load(lanes.side, g, LANES) * load(lanes.work, GAP_ROW + g, LANES),
        load(found, DEPTH, LANES),
    )
    taken = load(found, WHICH, LANES) >= 0.0
    same_series = magnitude(load(found, SERIES, LANES) - row) < 0.5
    parallel = (
        same_series
        & (s * load(found, SIGN, LANES) > 0.0)
        & (magnitude(a0 - nearest) > 0.0)
        & (~(fresh > 0.5))
    )
    first = crosses & ((~taken) | (parallel & (a0 < nearest)))
    unknown = crosses & taken & (~parallel)
    if NSERIES > 1:
        store(
            lanes.found,
            RIVALS + g,
            select(crosses & (~(taken & parallel)), select(until > 0.0, noise, math.inf), -1.0),
        )
        if any_lane(unknown):
            theirs = predicted(
                load(found, P0, LANES),
                load(found, P1, LANES),
                load(found, P2, LANES),
                load(found, P3, LANES),
            )
            first = first | (unknown & (predicted(p0, p1, p2, p3) < theirs))
        unknown = splat(0.0, LANES) > 1.0
        keep(found, P0, first, p0)
        keep(found, P1, first, p1)
        keep(found, P2, first, p2)
        keep(found, P3, first, p3)
    keep(found, WHICH, first, splat(float(g), LANES))
    keep(found, SERIES, first, splat(float(row), LANES))
    keep(found, DEPTH, first, a0)
    keep(found, SIGN, first, s)
    keep(found, ONBOARD, first, fresh)
    keep(found, UNTIL, first, until)
    return unknown


@inner
def keep(rows, row, wanted, value):
    """Write a value to a row in the wanted lanes."""
    store(rows, row, select(wanted, value, load(rows, row, LANES)))


@inner
def gather_series(lanes):
    """Write the series of the gap that each lane crosses to `poly`; the first term isn't needed."""
    series = load(lanes.found, SERIES, LANES)
    for j in range(NSERIES):
        wanted = magnitude(series - SERIES_ROW[j]) < 0.5
        if any_lane(wanted):
            for k in range(1, ORDER + 1):
                store(
                    lanes.poly,
                    k,
                    select(
                        wanted,
                        load(lanes.work, SERIES_ROW[j] + k, LANES),
                        load(lanes.poly, k, LANES),
                    ),
                )


@inner
def newton(terms, base, found, h, wanted):
    """The root of P, or of P(d)/d if the root at 0 is known, in (0, h) in the wanted lanes; its
    derivative there; and the lanes in which it is found.

    P = P(0) + s (X(d) - X(0)) with the series X at `base`: guards of one series share its terms.
    Started from the root of the quadratic part; the first two steps use only the leading terms. A
    step is the last if the square of its length times a bound of P''/2 on [0, h] (its first four
    terms; the rest is smaller) says that what is left is below 1e-17 h. A lane that needs more than
    three steps gets them without touching the others.
    """
    s, depth, fresh = (
        load(found, SIGN, LANES),
        load(found, DEPTH, LANES),
        load(found, ONBOARD, LANES) > 0.5,
    )
    until = load(found, UNTIL, LANES)
    h = select(until > 0.0, until * h, h)
    x1, x2, x3 = (
        load(terms, base + 1, LANES),
        load(terms, base + 2, LANES),
        load(terms, base + 3, LANES),
    )
    a, b, c = select(fresh, s * x1, depth), s * select(fresh, x2, x1), s * select(fresh, x3, x2)
    x = 2.0 * a / (root(larger(b * b - 4.0 * a * c, 0.0)) - b)
    x = larger(smaller(x, h), 0.0)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, NEWTON_DEGREE_1)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, NEWTON_DEGREE_2)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, ORDER)
    x4, x5, x6 = (
        load(terms, base + 4, LANES),
        load(terms, base + 5, LANES),
        load(terms, base + 6, LANES),
    )
    third, fourth, fifth = (
        magnitude(select(fresh, x4, x3)),
        magnitude(select(fresh, x5, x4)),
        magnitude(select(fresh, x6, x5)),
    )
    bend = fma(fma(fma(10.0 * fifth, h, 6.0 * fourth), h, 3.0 * third), h, magnitude(c))
    allowed = 1.0e-17 * h
    converged = change * change * bend <= allowed * magnitude(slope)
    more = 0
    while more < 3 and any_lane(wanted & (~converged)):
        closer, steeper, change = newton_step(terms, base, x, s, depth, fresh, ORDER)
        x, slope = select(converged, x, closer), select(converged, slope, steeper)
        converged = converged | (change * change * bend <= allowed * magnitude(slope))
        more += 1
    return x, slope, converged & (x > 0.0) & (x <= h) & (slope < 0.0)


@inner
def newton_step(terms, base, x, s, depth, fresh, degree):
    """One Newton step with the terms of X up to `degree` (at least 5): even and odd terms apart,
    for half the latency of Horner's rule.
    """
    u, top_even, top_odd = x * x, degree - degree % 2, degree - 1 + degree % 2
    # of Q = (X(d) - X(0))/d: odd/even + d * even/odd
    even, odd = load(terms, base + top_even, LANES), load(terms, base + top_odd, LANES)
    even_rate, odd_rate = even, odd
    even, odd = (
        fma(even, u, load(terms, base + top_even - 2, LANES)),
        fma(odd, u, load(terms, base + top_odd - 2, LANES)),
    )
    for k in range(top_even - 4, 0, -2):
        even_rate = fma(even_rate, u, even)
        even = fma(even, u, load(terms, base + k, LANES))
    for k in range(top_odd - 4, 0, -2):
        odd_rate = fma(odd_rate, u, odd)
        odd = fma(odd, u, load(terms, base + k, LANES))
    quotient = s * fma(even, x, odd)
    quotient_rate = s * fma(2.0 * x, fma(x, even_rate, odd_rate), even)
    slope = select(fresh, quotient_rate, fma(x, quotient_rate, quotient))
    change = select(fresh, quotient, fma(x, quotient, depth)) / slope
    return x - change, slope, change


@inner
def refine_crossings(lanes, h, undecided):
    """Apply Newton's method in the lanes whose first crossing is proven or predicted. Lanes without
    a root, or with an earlier one, join the undecided.

    A rival crosses once. Where it is still above zero a thousandth of the step behind the crossing,
    it crosses later, and is no one event with it.
    """
    which = load(lanes.found, WHICH, LANES)
    crosses = which >= 0.0
    store(lanes.found, DELTA, h)
    if any_lane(crosses):
        if NSERIES > 1:
            gather_series(lanes)
            x, slope, found = newton(lanes.poly, 0, lanes.found, h, crosses)
            for g in range(NGUARDS):
                noise = load(lanes.found, RIVALS + g, LANES)
                rival = crosses & (noise >= 0.0) & (magnitude(which - g) > 0.5)
                if any_lane(rival):
                    found = found & (
                        (~rival) | (gap_at(lanes, g, smaller(x + TOGETHER * h, h)) > noise)
                    )
        else:
            x, slope, found = newton(lanes.work, SERIES_ROW[0], lanes.found, h, crosses)
        undecided = undecided | (crosses & (~found))
        crosses = crosses & found
        on_boundary = load(lanes.found, ONBOARD, LANES) > 0.5
        store(lanes.found, DELTA, select(crosses, x, h))
        store(lanes.found, RATE, select(on_boundary, slope * x, slope))
        store(lanes.found, WHICH, select(crosses, which, -1.0))
    return undecided


@inner
def gap_at(lanes, g, d):
    """A gap at time d into the step, positive on its side."""
    row, side = GUARD_ROW[g], load(lanes.side, g, LANES)
    value = load(lanes.work, row + ORDER, LANES)
    for k in range(ORDER - 1, 0, -1):
        value = fma(value, d, load(lanes.work, row + k, LANES))
    begin = select(load(lanes.fresh, g, LANES) > 0.5, 0.0, load(lanes.work, GAP_ROW + g, LANES))
    return side * fma(GUARD_SIGN[g] * value, d, begin)


@kernel
def settle_sooner(lanes, undecided):
    """Try one shorter step in lanes with undecided gaps; lanes that it doesn't settle keep their
    length. Refines, and returns the open lanes.

    A step that meets several contacts ends at the first; what its series say of the rest is thrown
    away. docs/decisions/0023.
    """
    longest = load(lanes.run, STEP, LANES)
    h = select(undecided, longest * share_to_first_crossing(lanes, longest), longest)
    tried = h < longest
    if any_lane(tried):
        undecided = locate_again(lanes, h)
        in_vain = tried & undecided
        if any_lane(in_vain):
            h = select(in_vain, longest, h)
            undecided = locate_again(lanes, h)
        store(lanes.run, STEP, h)
    return bits(refine_crossings(lanes, h, undecided))


@kernel
def locate_again(lanes, h):
    """:func:`locate`, not inlined."""
    return locate(lanes, h)


@inner
def share_to_first_crossing(lanes, h):
    """Share of the step that ends just after the predicted first crossing, and before the second.

    1 where a shorter step would prove nothing, or could tell less: a gap that turns about at zero
    before that (a graze is judged on the longest step), two crossings that may be one event, a gap
    that doesn't begin on its side or ends at zero, terms set aside, a step so short that time would
    hardly pass.
    """
    first, second, turned = splat(math.inf, LANES), splat(math.inf, LANES), splat(math.inf, LANES)
    for g in range(NGUARDS):
        a0, a1, a2, a3, end = terms_of_gap(lanes, g)
        p0, p1, p2, p3 = without_known_root(load(lanes.fresh, g, LANES) > 0.5, a0, a1, a2, a3)
        inside, discriminant = p0 > 0.0, p1 * p1 - 4.0 * p0 * p2
        if LAWS:
            inside = inside & (load(lanes.side, WATCHED + g, LANES) > 0.5)
            inside = inside & (load(lanes.fresh, g, LANES) < RIDDEN)
        x = 2.0 * p0 / (root(larger(discriminant, 0.0)) - p1)
        x = select(inside & (discriminant >= 0.0) & (x > 0.0), x, math.inf)
        second, first = smaller(second, larger(first, x)), smaller(first, x)
        doubt = load(lanes.bounds, BOUNDS * GUARD_SERIES[g] + REST, LANES) + 6.0 * (
            magnitude(p3) + TOGETHER * p0
        )
        # the vertex is -discriminant / (4 p2)
        touches = (p1 < 0.0) & (p2 > 0.0) & (6.0 * magnitude(discriminant) <= 4.0 * p2 * doubt)
        if LAWS:
            touches = touches & inside
        ends_on_boundary = magnitude(end) <= TOGETHER * TOGETHER * (
            magnitude(a0) + magnitude(a1) + magnitude(a2) + magnitude(a3)
        )
        turned = select(inside & (~ends_on_boundary), turned, 0.0)
        if any_lane(touches):
            turned = smaller(select(touches, -0.5 * p1 / p2, math.inf), turned)
    share = smaller(BEHIND * first, 0.5 * (first + second))
    share = select(share < WORTH_AIMING, share, SHORTENED)
    useful = (
        (turned >= share)
        & (~(second - first <= TOGETHER))
        & (share * h > LEAST_SHARE * load(lanes.run, END, LANES))
    )
    for j in range(NSINGULAR):
        useful = useful & (load(lanes.side, NGUARDS + j, LANES) < 0.0)
    return select(useful, share, 1.0)
