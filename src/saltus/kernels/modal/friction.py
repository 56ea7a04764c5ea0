"""Template of the modal flow: friction that sticks and slides.

The boundary of a friction is the zero of a velocity w. Where the motion comes to it, w' is the
drive N without the force, which changes it by P at most: the motion sticks if both margins, P - N
and P + N, are positive, else w changes its sign. While it sticks the contact state has one mode
less, and each margin is a gap: at the end of the first one w becomes positive, of the second one
negative.
See system/linear_friction.py.
"""

import math

from saltus.kernels.status import CONTACT_SPEED, CROSSING, HOLD, HOLD_LAW, RELEASE


@inner
def margins_of(i, g, batch, m):
    """Both margins of a friction in the state in `state`. Needs `angle`."""
    first = int(batch.carry[i, AT]) * m.sizes[GUARDS]
    upper = value_of(m.presses, first + g, 0, m)
    return upper, -value_of(m.presses, first + m.laws[g, SECOND], 0, m)


@inner
def margin_noise(i, g, batch, m):
    """Rounding of these margins."""
    first = int(batch.carry[i, AT]) * m.sizes[GUARDS]
    return ROUNDED * size_of(m.presses, first + g, 0, m)


@kernel
def rub(i, g, now, moved, modes, steady, batch, m):
    """Let the law of a friction act: its boundary is met, or a margin ends; `moved` says whether
    time has passed before.
    """
    if m.laws[g, KIND] == HOLD_LAW:
        let_slide(i, g, now, moved, batch, m)
        return
    upper, lower = margins_of(i, g, batch, m)
    reversed_before = int(batch.carry[i, REVERSED])
    batch.carry[i, CROSSED] = float(1 << g)
    if upper > 0.0 and lower > 0.0:
        stick(i, g, now, 0, batch, m)
    elif (reversed_before >> g) & 1 == 1:  # both sides lead back: its force begins at zero
        stick(i, g, now, 1, batch, m)
    else:
        reverse(i, g, now, modes, steady, batch, m)
        batch.carry[i, REVERSED] = float(reversed_before | (1 << g))


@kernel
def stick(i, g, now, zeros, batch, m):
    """Hold the motion on the boundary of a friction; so many zeros of both margins are known."""
    row, h = law_row(i, g, batch, m), m.laws[g, HOLDER]
    push(i, g, -value_of(m.acts, row, width_of(m), m), batch, m)
    snap(i, g, batch, m)
    know_zeros(i, g, 0, batch)
    know_zeros(i, h, zeros, batch)
    know_zeros(i, m.laws[g, SECOND], zeros, batch)
    note(i, h, now, HOLD, 1, 0.0, batch.mode[i] | (1 << h), clock_error(i, now, batch), batch, m)


@kernel
def reverse(i, g, now, modes, steady, batch, m):
    """Let the velocity of a friction change its sign."""
    row = m.row_of[g]
    _, rate = gap_of_moved(row, modes, steady, int(batch.carry[i, SET]), m)
    rate *= m.sign_of[g]
    size = m.errors[row, 2] + abs(m.offset[int(batch.carry[i, SET]), g])
    error = ROUNDED * size / abs(rate) if rate != 0.0 else math.inf
    after = batch.mode[i] ^ (1 << g)
    if batch.carry[i, STARTS] < 0.5:
        batch.minima[i, CONTACT_SPEED] = min(batch.minima[i, CONTACT_SPEED], abs(rate))
    know_zeros(i, g, 1, batch)
    note(i, g, now, CROSSING, 1 if (after >> g) & 1 == 1 else -1, rate, after, error, batch, m)


@kernel
def let_slide(i, margin, now, moved, batch, m):
    """Release a friction whose margin ends: to the side on which it has less of it. Where its force
    goes on from that at rest, the rate of its velocity is known to be zero too.
    """
    g, h = m.laws[margin, PARTNER], m.laws[margin, HOLDER]
    upper, lower = margins_of(i, g, batch, m)
    fades = restitution_of(i, g, batch, m) == 1.0
    fades = fades and (moved or min(upper, lower) >= -margin_noise(i, g, batch, m))
    batch.carry[i, CROSSED] = 0.0 if fades else float(1 << margin)
    know_zeros(i, h, 0, batch)
    know_zeros(i, m.laws[h, SECOND], 0, batch)
    know_zeros(i, g, 2 if fades else 1, batch)
    after = batch.mode[i] & ~(1 << h) & ~(1 << g)
    if upper < lower:
        after |= 1 << g
    note(i, h, now, RELEASE, -1, 0.0, after, clock_error(i, now, batch), batch, m)


@kernel
def throw(i, g, now, batch, m):
    """Release a friction that an impact elsewhere makes slide."""
    h = m.laws[g, HOLDER]
    know_zeros(i, g, 0, batch)
    after = batch.mode[i] & ~(1 << h) & ~(1 << g)
    if closing_of(i, g, batch, m) > 0.0:
        after |= 1 << g
    note(i, h, now, RELEASE, -1, 0.0, after, clock_error(i, now, batch), batch, m)


@kernel
def date_rubbing(i, g, modes, tau, moved, batch, m):
    """Find how the instant moves at which the law of a friction has acted, if it isn't known: by
    the boundary, or the margin, that was met. An instant at which no time has passed is that of a
    drive which jumps, and doesn't move. Needs the rates before, and `angle`.
    """
    if batch.carry[i, DATED] == 0.0:
        date_landing(i, g, modes, tau, batch, m)
        if not moved and m.laws[g, KIND] == HOLD_LAW:
            for c in range(m.sizes[TANGENTS]):
                batch.carry[i, first_date(m) + c] = 0.0


@kernel
def turns_here(i, g, noise, batch, m):
    """True if the rate of a gap is the rounding of its terms where the amplitudes stand: a memory
    leaves its limit where its input turns. Needs the terms of the gap in `p`.
    """
    r, which, total = m.row_of[g], int(batch.carry[i, SET]), 0.0
    first, at = numbers_of_gap(r, m.links[int(batch.carry[i, AT]), STEADY], m)
    for d in range(m.sizes[DRIVES]):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        total += (abs(a) + abs(b)) * abs(m.rate[which, d])
    total += total_of(m.waves, first_wave(r, m) + FASTER)
    return abs(m.stood[r, SLOPE]) <= ROUNDED * total or abs(m.p[1]) <= noise


@kernel
def date_limits(i, hits, modes, tau, batch, m):
    """Find how the instant moves at which a memory comes to its limit, if it isn't known: in the
    contact state behind it stays there whatever the start was. Needs the rates before, and `angle`.
    """
    for g in range(m.sizes[GUARDS]):
        if (hits >> g) & 1 and m.laws[g, LIMITS] != 0 and batch.carry[i, DATED] == 0.0:
            date_landing(i, g, modes, tau, batch, m)
