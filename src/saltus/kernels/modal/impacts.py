"""Template of the modal flow: several impacts at one instant. They are taken one after the
other until none closes; if what comes out depends on the order, the equations don't say what
happens. See kernels/impacts.py.
"""

from saltus.kernels.status import AMBIGUOUS_IMPACT, INVALID_RESTITUTION, RUNNING


@inner
def fastest_of(i, stops, batch, m):
    """The largest velocity at which one of some stops closes."""
    fastest = 0.0
    for g in range(m.sizes[GUARDS]):
        if (stops >> g) & 1:
            fastest = max(fastest, closing_of(i, g, batch, m))
    return fastest


@inner
def exchange(row, m):
    """Exchange the state with a row of `struck`."""
    for j in range(m.sizes[STATES]):
        other = m.struck[row, j]
        m.struck[row, j] = m.state[j // LANES, j % LANES]
        m.state[j // LANES, j % LANES] = other


@kernel
def take_impacts(i, stops, backwards, least, now, columns, batch, m):
    """Take all impacts of this instant, in the order of the guards or against it, until none closes
    faster than `least`; if `columns`, let them act on the derivative as well. Returns RUNNING, or
    the status that ends the motion; impacts without end have no order.
    """
    guards, first = m.sizes[GUARDS], 2 * width_of(m)
    for _ in range(MOST_IMPACTS):
        struck = False
        for place in range(guards):
            g = guards - 1 - place if backwards else place
            if not struck and (stops >> g) & 1 == 1:
                closing, e = closing_of(i, g, batch, m), restitution_of(i, g, batch, m)
                struck = closing > least
                if struck and not -PART <= e <= 1.0 + PART:
                    return INVALID_RESTITUTION
                if struck and columns:
                    strike_columns(i, g, now, batch, m)
                if struck:
                    push(i, g, -(1.0 + e) * closing, batch, m)
                    for j in range(m.sizes[STATES]):
                        by = (1.0 + e) * closing * m.acts[law_row(i, g, batch, m), first + j]
                        m.struck[WAY, j] += abs(by)
        if not struck:
            return RUNNING
    return AMBIGUOUS_IMPACT


@kernel
def order_of_impacts(i, stops, batch, m):
    """Test that the impacts of this instant lead to one state, in the order of the guards and
    against it: RUNNING, or the status that ends the motion. Leaves the state as it was.
    """
    fastest, closing = fastest_of(i, stops, batch, m), 0
    for g in range(m.sizes[GUARDS]):
        if (stops >> g) & 1 and closing_of(i, g, batch, m) > FELT * fastest:
            closing += 1
    if closing < 2:
        return RUNNING
    states = m.sizes[STATES]
    for j in range(states):
        m.struck[AT_FIRST, j], m.struck[WAY, j] = m.state[j // LANES, j % LANES], 0.0
        m.struck[BY_GUARDS, j] = m.struck[AT_FIRST, j]
    status = take_impacts(i, stops, False, ENDED * fastest, 0.0, False, batch, m)
    exchange(BY_GUARDS, m)
    if status == RUNNING:
        status = take_impacts(i, stops, True, ENDED * fastest, 0.0, False, batch, m)
    for j in range(states):
        least = FELT * (m.struck[WAY, j] + abs(m.struck[AT_FIRST, j]))
        apart = abs(m.state[j // LANES, j % LANES] - m.struck[BY_GUARDS, j])
        if status == RUNNING and not apart <= least:
            status = AMBIGUOUS_IMPACT
        m.state[j // LANES, j % LANES] = m.struck[AT_FIRST, j]
    return status


@kernel
def end_impacts(i, stops, now, batch, m):
    """Complete impacts that cause each other without end at one instant; what neither closes nor
    opens then is known to stand. True if one closed; the state before is kept then.
    """
    fastest = fastest_of(i, stops, batch, m)
    if fastest <= 0.0:
        return False
    for j in range(m.sizes[STATES]):
        m.struck[AT_FIRST, j] = m.state[j // LANES, j % LANES]
    take_impacts(i, stops, False, CLOSED * fastest, now, False, batch, m)
    batch.carry[i, CROSSED] = float(stops)
    for g in range(m.sizes[GUARDS]):
        if (stops >> g) & 1 and (batch.mode[i] >> m.laws[g, PARTNER]) & 1 == 0:
            snap(i, g, batch, m)
            stands = abs(closing_of(i, g, batch, m)) <= FELT * fastest
            know_zeros(i, g, 2 if stands else 1, batch)
    turn_over(i, -1, now, batch, m)
    return True


@kernel
def repeat_impacts(i, stops, now, batch, m):
    """Let impacts that were completed act on the derivative, from the state before them."""
    exchange(AT_FIRST, m)
    take_impacts(i, stops, False, CLOSED * fastest_of(i, stops, batch, m), now, True, batch, m)
