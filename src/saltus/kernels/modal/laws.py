"""Template of the modal flow: laws of contact - impacts, contacts at rest, their release.

A contact at rest has a guard of its own, the hold guard (docs/decisions/0040): its bit names the
contact state in which the contact is held, and its gap there is the acceleration with which the
contact would close. One law acts in a landing, and whether a contact that was struck comes to rest
is asked in the contact state behind it. What else happens at that instant is found by the next
step, of no length: boundaries that the state stands on are known to be zero, so the side to which
it leaves them is that of the first rate that isn't.
"""

import math

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.lanes import load, store
from saltus.kernels.status import (
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    HOLD,
    HOLD_LAW,
    IMPACT,
    IMPACT_LAW,
    INVALID_RESTITUTION,
    NO_LAW,
    RELEASE,
    RUNNING,
    SLIDING,
    SURFACE_LAW,
)


# -- which guards are watched, and what is known of them -------------------------------------------
@inner
def is_watched(g, mode, m):
    """True if a guard can act: a hold guard while its contact is held, others while it isn't."""
    holder = m.laws[g, HOLDER]
    held = holder >= 0 and (mode >> holder) & 1 == 1
    return held == (m.laws[g, KIND] == HOLD_LAW)


@inner
def known_zeros(i, g, batch):
    """Number of zeros that are known: of a gap, of its rate, of its acceleration."""
    twice, thrice = int(batch.carry[i, TWICE]), int(batch.carry[i, THRICE])
    return ((batch.fresh[i] >> g) & 1) + ((twice >> g) & 1) + ((thrice >> g) & 1)


@inner
def know_zeros(i, g, count, batch):
    """Note the number of zeros that are known of a gap."""
    rest = ~(1 << g)
    twice, thrice = int(batch.carry[i, TWICE]) & rest, int(batch.carry[i, THRICE]) & rest
    batch.fresh[i] = (batch.fresh[i] & rest) | ((1 if count > 0 else 0) << g)
    batch.carry[i, TWICE] = float(twice | ((1 if count > 1 else 0) << g))
    batch.carry[i, THRICE] = float(thrice | ((1 if count > 2 else 0) << g))


@inner
def know_alike(i, g, count, batch, m):
    """The same for a stop, and for boundaries without a law that are met with it: their gaps are
    one.
    """
    know_zeros(i, g, count, batch)
    for other in range(m.sizes[GUARDS]):
        alike = m.row_of[other] == m.row_of[g] and m.laws[other, KIND] == NO_LAW
        if alike and known_zeros(i, other, batch) > 0:
            know_zeros(i, other, count, batch)


@inner
def know_nothing(i, batch):
    """Time has passed: no gap is known to be zero, and the start is over."""
    batch.fresh[i] = 0
    batch.carry[i, TWICE], batch.carry[i, THRICE], batch.carry[i, STARTS] = 0.0, 0.0, 0.0
    batch.carry[i, DATED], batch.carry[i, REVERSED] = 0.0, 0.0


@inner
def end_start(i, d, hits, batch):
    """The start is over where time has passed, or a boundary is met that wasn't stood on."""
    if d > 0.0 or hits & ~batch.fresh[i] != 0:
        batch.carry[i, STARTS] = 0.0


@inner
def know_rides(i, batch, m):
    """Time has passed, and the state hasn't jumped: boundaries that were ridden go on to be."""
    fresh, twice, thrice = 0, int(batch.carry[i, TWICE]), int(batch.carry[i, THRICE])
    for g in range(m.sizes[GUARDS]):
        if m.found[g, RIDDEN] > 0.5:
            fresh |= 1 << g
    know_nothing(i, batch)
    batch.fresh[i] = fresh
    batch.carry[i, TWICE], batch.carry[i, THRICE] = float(twice & fresh), float(thrice & fresh)


# -- linear functions of the state -----------------------------------------------------------------
@inner
def width_of(m):
    """Number of coefficients of such a function."""
    return m.sizes[STATES] + 1 + m.sizes[DRIVES] + m.sizes[COURSES]


@inner
def value_of(table, row, first, m):
    """A linear function of the state in `state`, the drives in `angle` and the courses."""
    states = m.sizes[STATES]
    total = table[row, first + states]
    for j in range(states):
        total += table[row, first + j] * m.state[j // LANES, j % LANES]
    for d in range(m.sizes[DRIVES]):
        total += table[row, first + states + 1 + d] * m.angle[d, 1]
    for p in range(m.sizes[COURSES]):
        total += table[row, first + states + 1 + m.sizes[DRIVES] + p] * m.record[p, VALUE]
    return total


@inner
def size_of(table, row, first, m):
    """The size of the terms of such a function."""
    states = m.sizes[STATES]
    total = abs(table[row, first + states])
    for j in range(states):
        total += abs(table[row, first + j] * m.state[j // LANES, j % LANES])
    for d in range(m.sizes[DRIVES]):
        total += abs(table[row, first + states + 1 + d])  # the rounding of a cosine is absolute
    for p in range(m.sizes[COURSES]):
        total += abs(table[row, first + states + 1 + m.sizes[DRIVES] + p] * m.record[p, VALUE])
    return total


@inner
def law_row(i, g, batch, m):
    """Row of a guard in `acts`."""
    return int(batch.carry[i, SET]) * m.sizes[GUARDS] + g


@inner
def closing_of(i, g, batch, m):
    """Velocity at which a contact closes; zero, if it is the rounding of its terms."""
    row, first = law_row(i, g, batch, m), width_of(m)
    velocity = value_of(m.acts, row, first, m)
    return velocity if abs(velocity) > ROUNDED * size_of(m.acts, row, first, m) else 0.0


@inner
def pressing_of(i, g, batch, m):
    """Acceleration at which a contact would close without its force; zero, if it is the rounding of
    its terms.
    """
    row = int(batch.carry[i, AT]) * m.sizes[GUARDS] + g
    pressing = value_of(m.presses, row, 0, m)
    return pressing if abs(pressing) > ROUNDED * size_of(m.presses, row, 0, m) else 0.0


@inner
def restitution_of(i, g, batch, m):
    """Coefficient of restitution of a contact."""
    return m.acts[law_row(i, g, batch, m), 2 * width_of(m) + m.sizes[STATES]]


@inner
def push(i, g, change, batch, m):
    """Change the velocity at which a contact closes by an impulse."""
    states, row = m.sizes[STATES], law_row(i, g, batch, m)
    first = 2 * width_of(m)
    for j in range(states):
        m.state[j // LANES, j % LANES] += change * m.acts[row, first + j]


@inner
def snap(i, g, batch, m):
    """Put the state on the boundary of a guard, if that is a level of a state."""
    j = m.laws[g, LEVEL]
    if j >= 0:
        level = m.offset[int(batch.carry[i, SET]), m.sizes[GUARDS] + g]
        m.state[j // LANES, j % LANES] = level


# -- landing on a contact with a law ---------------------------------------------------------------
@kernel
def first_law(hits, m):
    """The guard whose law acts first, of those that are met: impacts before releases; -1: none."""
    first = -1
    for g in range(m.sizes[GUARDS]):
        if (hits >> g) & 1 and m.laws[g, KIND] == IMPACT_LAW:
            return g
        if (hits >> g) & 1 and m.laws[g, KIND] != NO_LAW and first < 0:
            first = g
    return first


@kernel
def act(i, g, tau, d, hits, modes, steady, batch, m):
    """Let the law of a guard act a time d after tau. Returns the status."""
    state_at(i, tau, d, modes, steady, batch, m)
    if d > 0.0 and (m.laws[g, SECOND] >= 0 or m.laws[g, KIND] == HOLD_LAW):
        know_rides(i, batch, m)
    elif d > 0.0:
        know_nothing(i, batch)
    elif m.laws[g, KIND] != HOLD_LAW:
        end_start(i, d, 1 << g, batch)
    for other in range(m.sizes[GUARDS]):
        jumps = d == 0.0 and m.laws[other, KIND] == HOLD_LAW  # what presses it isn't zero
        if (hits >> other) & 1 and not jumps:
            know_zeros(i, other, max(1, known_zeros(i, other, batch)), batch)
    before, at = batch.mode[i], int(batch.carry[i, AT])
    status, endless = RUNNING, 0
    if m.laws[g, SECOND] >= 0:
        rub(i, g, tau + d, d > 0.0, modes, steady, batch, m)
    elif m.laws[g, KIND] == HOLD_LAW:
        release(i, g, tau + d, 3 if d > 0.0 else 2, batch, m)
    else:
        status, endless = impacts(i, g, tau + d, hits, modes, steady, batch, m)
    leave(i, before, batch, m)
    if m.sizes[TANGENTS] != 0:
        batch.carry[i, WAITED] += d
        struck = int(batch.carry[i, CROSSED])
        leave_columns(i, struck, at, tau + d, batch, m)
        if endless != 0:
            repeat_impacts(i, endless, tau + d, batch, m)
        elif m.laws[g, SECOND] >= 0:
            date_rubbing(i, g, modes, tau + d, d > 0.0, batch, m)
        elif struck != 0:
            strike_columns(i, g, tau + d, batch, m)
    slides = count_landing(i, tau + d, batch)
    return slides if status == RUNNING else status


@inner
def has_just_landed(i, tau, batch):
    """True if the trajectory has landed, or begun, at this time: its state is known to the bit."""
    return time_of(i, tau, batch) == batch.carry[i, LANDED_AT]


@kernel
def state_at(i, tau, d, modes, steady, batch, m):
    """The state a time d after tau, to `state`, to the bit if it is known; its amplitudes to
    `moved`.
    """
    state_after(i, tau, d, modes, steady, batch, m)
    if d == 0.0 and has_just_landed(i, tau, batch):
        take_state(i, batch, m)


@kernel
def leave(i, before, batch, m):
    """Store the state in `state` and look up the contact state of the mode, which was another."""
    write_state(batch.state, i, 0, m)
    at, changed = int(batch.carry[i, AT]), before ^ batch.mode[i]
    for g in range(m.sizes[GUARDS]):
        if (changed >> g) & 1 and at >= 0:
            at = m.links[at, BEHIND + g]
    batch.carry[i, AT], batch.carry[i, ENTERS] = at, 1.0


@inner
def count_landing(i, now, batch):
    """Count the landings at one instant. Returns the status: sliding, if they are too many."""
    time = time_of(i, now, batch)
    again = time == batch.carry[i, LANDED_AT]
    batch.carry[i, LANDINGS] = batch.carry[i, LANDINGS] + 1.0 if again else 0.0
    batch.carry[i, LANDED_AT] = time
    return SLIDING if batch.carry[i, LANDINGS] >= MOST_LANDINGS else RUNNING


@kernel
def note(i, g, now, kind, direction, velocity, after, error, batch, m):
    """Count and record what a law did, and set the mode. At the start of a run it is an initial
    condition, and no event.
    """
    if batch.carry[i, STARTS] > 0.5:
        for k in range(max(batch.cursor[i], 0)):
            batch.sample_mode[i, k] = after
    else:
        batch.counters[i, EVENTS] += 1
        record(i, g, now, kind, direction, velocity, after, error, batch, m)
    batch.mode[i] = after


@inner
def clock_error(i, now, batch):
    """Rounding of a time."""
    return 2.0e-16 * (now + abs(batch.origin[i] + batch.count[i] * batch.period[i]))


# -- impacts ---------------------------------------------------------------------------------------
@kernel
def impacts(i, g, now, hits, modes, steady, batch, m):
    """Apply an impact, after the test that the order of several doesn't matter. Returns the status,
    and the stops (bits) whose impacts without end were completed; 0: none.
    """
    stops = 0
    for other in range(m.sizes[GUARDS]):
        held = (batch.mode[i] >> max(m.laws[other, PARTNER], 0)) & 1 == 1
        stands = m.laws[other, KIND] == IMPACT_LAW
        if stands and (held or known_zeros(i, other, batch) > 0):
            stops |= 1 << other
    if stops & (stops - 1) != 0 and known_zeros(i, g, batch) < 2:
        status = order_of_impacts(i, stops, batch, m)
        if status != RUNNING:
            return status, 0
        endless = has_just_landed(i, now, batch) and batch.carry[i, LANDINGS] >= MOST_STRIKES
        if endless and end_impacts(i, stops, now, batch, m):
            return RUNNING, stops
    return strike(i, g, now, modes, steady, batch, m), 0


@kernel
def strike(i, g, now, modes, steady, batch, m):
    """Apply the impact of a contact; whether it comes to rest is asked next. Returns the status."""
    which, mode, side = int(batch.carry[i, SET]), batch.mode[i], side_of(g, batch.mode[i])
    _, rate = gap_of_moved(m.row_of[g], modes, steady, which, m)
    rate *= m.sign_of[g]
    snap(i, g, batch, m)
    closing, restitution = closing_of(i, g, batch, m), restitution_of(i, g, batch, m)
    first, _, _, _ = terms_of_gap(m.row_of[g], modes, steady, which, m)
    if known_zeros(i, g, batch) > 1 or abs(closing) <= ROUNDED * first:
        push(i, g, -closing, batch, m)  # it is the rounding of the modes
        closing = 0.0
    if closing > 0.0:
        if not -PART <= restitution <= 1.0 + PART:
            return INVALID_RESTITUTION
        for k in range(m.sizes[REMEMBERED]):
            j = m.remembers[k]
            batch.state[i, m.sizes[STATES] + k] = m.state[j // LANES, j % LANES]
        push(i, g, -(1.0 + restitution) * closing, batch, m)
        batch.carry[i, CROSSED] = float(1 << g)
        starts = batch.carry[i, STARTS] > 0.5
        slowest = batch.minima[i, CONTACT_SPEED]
        batch.minima[i, CONTACT_SPEED] = slowest if starts else min(slowest, abs(rate))
        size = m.errors[m.row_of[g], 2] + abs(m.offset[which, g])
        error = ROUNDED * size / abs(rate) if rate != 0.0 else math.inf
        error += clock_error(i, now, batch)
        note(i, g, now, IMPACT, int(-side), rate, mode, error, batch, m)
        turn_over(i, g, now, batch, m)
        loosen(i, g, now, closing, batch, m)
    zeros = 3 if known_zeros(i, g, batch) > 1 else 2  # it closes, and only a force may close it
    know_alike(i, g, 1 if restitution * closing > 0.0 else zeros, batch, m)
    batch.carry[i, ASKS] = g + 1.0
    return RUNNING


@kernel
def rest_or_go(i, now, modes, steady, batch, m):
    """Hold the contact that was struck if its rebounds are too small to be followed, or to be told
    from the rounding of its modes.
    """
    g, before = int(batch.carry[i, ASKS]) - 1, batch.mode[i]
    batch.carry[i, ASKS] = 0.0
    take_state(i, batch, m)
    for row in range(m.sizes[ROWS]):
        store(m.moved, row, load(m.y, row, LANES))
    drive(i, now, batch, m)
    restitution, pressing = restitution_of(i, g, batch, m), pressing_of(i, g, batch, m)
    rebound = -closing_of(i, g, batch, m) if known_zeros(i, g, batch) < 2 else 0.0
    begins = known_zeros(i, g, batch) > 2 and pressing <= 0.0  # what presses it begins at zero
    if (pressing <= 0.0 and not begins) or rebound < 0.0:
        return
    later = 0.0
    if rebound > 0.0:
        later = math.inf
        if restitution < 1.0:
            later = 2.0 * rebound / (pressing * (1.0 - restitution))
    which = int(batch.carry[i, SET])
    first, second, third, fourth = terms_of_gap(m.row_of[g], modes, steady, which, m)
    shortest = too_short(i, now, restitution, second, third, fourth, batch)
    hidden = rebound <= ROUNDED * first or is_hidden(i, g, rebound, pressing, batch, m)
    if later <= shortest or hidden:
        hold(i, g, now, later, 1 if begins else 0, batch, m)
        leave(i, before, batch, m)
        if m.sizes[TANGENTS] != 0:
            settle_held(i, now, batch, m)


@inner
def too_short(i, now, restitution, second, third, fourth, batch):
    """Duration of a chatter [s] below which it is completed: the remainder changes the acceleration
    by less than 1e-8, so the time of its end is accurate to rounding. See taylor/laws.py.
    """
    scale = end_of(i, batch)
    if second < scale * third:
        scale = second / third
    if second < scale * scale * fourth:
        scale = math.sqrt(second / fourth)
    since = now + abs(batch.origin[i] + batch.count[i] * batch.period[i])
    return max(CHATTER * (1.0 - restitution) * scale, 4.0e-16 * since)


@kernel
def terms_of_gap(r, modes, steady, which, m):
    """The size of what makes the rate of a row of gaps, and sizes of its terms 2, 3 and 4, by the
    amplitudes in `moved` and the drives in `angle`.
    """
    groups, drives = m.sizes[MODE_GROUPS], m.sizes[DRIVES]
    row = modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS]) + 3 * groups * r
    rate, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    for j in range(groups * LANES):
        a, b = number(m.modes, row, j), number(m.modes, row + groups, j)
        x, y = number(m.moved, 0, j), number(m.moved, groups, j)
        real, imaginary = a * x - b * y, a * y + b * x
        a, b = number(m.modes, modes, j), number(m.modes, modes + groups, j)
        real, imaginary = a * real - b * imaginary, a * imaginary + b * real
        rate += abs(real) + abs(imaginary)
        real, imaginary = a * real - b * imaginary, a * imaginary + b * real
        second += real
        real, imaginary = a * real - b * imaginary, a * imaginary + b * real
        third += real
        fourth += a * real - b * imaginary
    size, block_second, block_third, block_fourth = block_terms(r, modes, m.moved, m)
    rate, second, third = rate + size, second + block_second, third + block_third
    fourth += block_fourth
    first, at = numbers_of_gap(r, steady, m)
    for d in range(drives):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        cosine, sine = m.angle[d, 1], m.angle[d, 2]
        real, imaginary = a * cosine - b * sine, a * sine + b * cosine
        w = m.rate[which, d]
        rate += abs(w) * (abs(real) + abs(imaginary))
        second += -w * w * real
        third += w * w * w * imaginary
        fourth += w * w * w * w * real
    for p in range(m.sizes[COURSES]):
        numbers = at + 1 + 2 * drives + m.sizes[TERMS] * p
        for k in range(3):
            rate += abs(number(m.steady, first, numbers + k) * m.record[p, VALUE + 1 + k])
        for k in range(2):
            second += number(m.steady, first, numbers + k) * m.record[p, VALUE + 2 + k]
        third += number(m.steady, first, numbers) * m.record[p, VALUE + 3]
    return rate, abs(second) / 2.0, abs(third) / 6.0, abs(fourth) / 24.0


@inner
def is_hidden(i, g, rebound, pressing, batch, m):
    """True if a flight stays within the rounding of its gap, which counts in two steps, where
    another boundary may put a node into the flight. See taylor/laws.py.
    """
    height = 0.5 * rebound * rebound / pressing
    size = 2.0 * size_of(m.acts, law_row(i, g, batch, m), 0, m)
    return m.sizes[GUARDS] > 2 and height <= ROUNDING * size


@kernel
def turn_over(i, struck, now, batch, m):
    """Change the sides of the guards over whose boundaries an impact has carried the state."""
    for g in range(m.sizes[GUARDS]):
        turns = m.laws[g, KIND] == NO_LAW or m.laws[g, KIND] == SURFACE_LAW
        asked = g != struck and turns and known_zeros(i, g, batch) == 0
        asked = asked and is_watched(g, batch.mode[i], m)
        gap = value_of(m.acts, law_row(i, g, batch, m), 0, m) if asked else 0.0
        if gap * side_of(g, batch.mode[i]) < 0.0:
            after = batch.mode[i] ^ (1 << g)
            error, side = clock_error(i, now, batch), 1 if (after >> g) & 1 == 1 else -1
            note(i, g, now, CROSSING, side, 0.0, after, error, batch, m)


@kernel
def loosen(i, struck, now, closing, batch, m):
    """Release the contacts at rest and the frictions that feel the impact of another. A free one
    whose gap and rate were known to be zero closes or opens now.
    """
    for g in range(m.sizes[GUARDS]):
        rubs, h = m.laws[g, KIND] == SURFACE_LAW, m.laws[g, PARTNER]
        asked = g != struck and (rubs or m.laws[g, KIND] == IMPACT_LAW)
        feels = asked and abs(closing_of(i, g, batch, m)) > FELT * closing
        held = feels and (batch.mode[i] >> h) & 1 == 1
        if held and rubs:
            throw(i, g, now, batch, m)
        elif held:
            release(i, h, now, 1, batch, m)
        elif feels and not rubs:
            know_zeros(i, g, min(1, known_zeros(i, g, batch)), batch)


# -- contacts at rest ------------------------------------------------------------------------------
@kernel
def hold(i, g, now, later, zeros, batch, m):
    """Begin to hold a contact, at most `later` [s] after now: the state goes onto its constraint.
    So many zeros of what presses it are known.
    """
    h = m.laws[g, PARTNER]
    row, first = law_row(i, g, batch, m), width_of(m)
    push(i, g, -value_of(m.acts, row, first, m), batch, m)
    know_zeros(i, g, 0, batch)
    know_zeros(i, h, zeros, batch)
    error = CHATTER * later + clock_error(i, now, batch)
    note(i, h, now + later, HOLD, 1, 0.0, batch.mode[i] | (1 << h), error, batch, m)


@kernel
def release(i, h, now, zeros, batch, m):
    """Release a contact. If its force vanishes continuously, gap, rate and acceleration are known
    to be zero; if it jumps, gap and rate; if it was struck, the gap.
    """
    know_alike(i, m.laws[h, PARTNER], zeros, batch, m)
    after = batch.mode[i] & ~(1 << h)
    note(i, h, now, RELEASE, -1, 0.0, after, clock_error(i, now, batch), batch, m)
