"""Template of the modal flow: the end of a run. The state there is all that a run knows which goes
on from it, and that run takes what rounding hides for what holds: a contact at rest whose force has
ended but for rounding is free, a stop whose gap and rate are rounding rests. So what that run
wouldn't tell happens in this one.
"""

from saltus.kernels.lanes import load, store
from saltus.kernels.status import GAP_MARGIN, HOLD_LAW, IMPACT_LAW, RUNNING


@kernel
def is_pressed(i, g, tau, batch, m):
    """True if the state at a start or an end presses a contact, by more than rounding, of the time
    too. Needs `angle`.
    """
    take_state(i, batch, m)
    row, which = int(batch.carry[i, AT]) * m.sizes[GUARDS] + g, int(batch.carry[i, SET])
    speed, first = 0.0, m.sizes[STATES] + 1
    for d in range(m.sizes[DRIVES]):
        speed += abs(m.presses[row, first + d] * m.rate[which, d])
    for p in range(m.sizes[COURSES]):
        speed += abs(m.presses[row, first + m.sizes[DRIVES] + p] * m.record[p, VALUE + 1])
    noise = ROUNDED * size_of(m.presses, row, 0, m) + CLOCK * abs(time_of(i, tau, batch)) * speed
    return value_of(m.presses, row, 0, m) > noise


@kernel
def tell_pressed(i, tau, batch, m):
    """Tell which stops are pressed at the start of a run, should they rest: to PRESSED. From exact
    rest what presses them may be the rounding of terms that cancel.
    """
    moves = False
    for j in range(m.sizes[STATES]):
        moves = moves or batch.state[i, j] != 0.0
    for g in range(m.sizes[GUARDS]):
        asked = moves and m.laws[g, KIND] == IMPACT_LAW
        m.found[g, PRESSED] = 1.0 if asked and is_pressed(i, g, tau, batch, m) else 0.0


@kernel
def ending_holds(i, tau, modes, steady, batch, m):
    """Bits of the hold guards whose contacts a run that began at tau would find free: their margins
    are rounding, and end.
    """
    ending, which, guards = 0, int(batch.carry[i, SET]), m.sizes[GUARDS]
    holds = 0
    for g in range(guards):
        holds |= 1 << g if m.laws[g, KIND] == HOLD_LAW and is_watched(g, batch.mode[i], m) else 0
    if holds == 0 or batch.carry[i, STARTS] > 0.5:
        return 0
    keep_state(i, tau, batch, m)
    drive(i, tau, batch, m)
    set_block_drives(modes, m)
    stand(modes, steady, which, m)
    fastest = max(m.modes[modes + 3 * m.sizes[MODE_GROUPS] - 1, LANES - 1], block_limit(modes, m))
    h = min(batch.period[i], next_break(m) - tau)  # the last step may have been rounding
    h = FOLLOWED / fastest if h * fastest > FOLLOWED else h
    end_factors(modes, h, groups_of(modes, m), m)
    for g in range(guards):
        rubs, row = m.laws[g, SECOND] >= 0, m.row_of[g]
        value, _ = here(i, g, batch, m)
        noise = ROUNDED * (m.stood[row, SIZE] + abs(m.offset[which, g]))
        asked = (holds >> g) & 1 == 1 and h > 0.0
        if asked and not rubs:
            asked = not is_pressed(i, m.laws[g, PARTNER], tau, batch, m)
        if asked and (value <= noise or not rubs):
            series_of(row, modes, steady, which, h, groups_of(modes, m), m)
            noise = terms_of(i, g, side_of(g, batch.mode[i]), batch, m)
            ending |= 1 << g if side_of_leaving(m.p, ORDER, 0, noise) < 0 else 0
    return ending


@kernel
def left_at_once(i, tau, modes, steady, batch, m):
    """Bits of the guards that the motion would cross at tau, the end, if it went on: a landing
    there isn't done before what follows from it at the same instant.
    """
    if batch.carry[i, STARTS] > 0.5:
        return 0
    keep_state(i, tau, batch, m)
    drive(i, tau, batch, m)
    set_block_drives(modes, m)
    stand(modes, steady, int(batch.carry[i, SET]), m)
    h, margin = min(batch.period[i], next_break(m) - tau), batch.minima[i, GAP_MARGIN]
    answer, d, hits = OPEN, 0.0, 0
    while answer == OPEN and h > LEAST_STEP:
        h = reach(i, h, modes, batch, m)
        answer, d, hits = look(i, tau, h, modes, steady, batch, m)
        h *= 0.5
    batch.status[i], batch.minima[i, GAP_MARGIN] = RUNNING, margin
    return hits if answer == CROSSES and d == 0.0 else 0


@kernel
def know_rests(i, tau, batch, m):
    """Know of the stops whose gaps and rates are rounding at the end that they rest."""
    at, which, loaded = int(batch.carry[i, AT]), int(batch.carry[i, SET]), False
    for g in range(m.sizes[GUARDS]):
        free = m.laws[g, KIND] == IMPACT_LAW and is_watched(g, batch.mode[i], m)
        if free and known_zeros(i, g, batch) == 0:
            if not loaded:
                take_state(i, batch, m)
                drive(i, tau, batch, m)
                for row in range(m.sizes[ROWS]):
                    store(m.moved, row, load(m.y, row, LANES))
                loaded = True
            row, r, modes = law_row(i, g, batch, m), m.row_of[g], m.links[at, MODES]
            if abs(value_of(m.acts, row, 0, m)) <= ROUNDED * size_of(m.acts, row, 0, m):
                steady = m.links[at, STEADY]
                _, rate = gap_of_moved(r, modes, steady, which, m)
                size, _, _, _ = terms_of_gap(r, modes, steady, which, m)
                if abs(rate) <= ROUNDED * size:
                    know_zeros(i, g, 2, batch)
