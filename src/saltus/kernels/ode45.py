"""Template: ode45 as MATLAB runs it, digit for digit. codegen puts a generated head,
dormand_prince.py and odezero.py before this text.

One trajectory after the other; one step reads: step -> find the contact -> write samples -> land or
go on. The right-hand side picks its sides from the state at every stage; with location on, a step
that ends beyond a boundary is cut there and the method starts afresh from the contact with its
default first step. Rules of error control and step length: Shampine & Reichelt, The MATLAB ODE
Suite, SIAM J. Sci. Comput. 18 (1997).

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); t_end end of
the trajectory; h = t_new - t; length what is asked for h; theta = AbsTol/RelTol; err the error
estimate on RelTol's scale. Times in s.
"""

import math

from saltus.kernels.batch import Batch
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    FINISHED,
    NONFINITE,
    OK,
    PAUSED,
    REC_DIRECTION,
    REC_GUARD,
    REC_KIND,
    REC_MODE_AFTER,
    REC_MODE_BEFORE,
    REC_PERIOD,
    REC_PHASE,
    REC_STEPS,
    REC_TIME_ERROR,
    REC_TRAJECTORY,
    REC_VELOCITY,
    RECORD_FLOATS,
    REJECTED,
    RUNNING,
    STEPS,
    VIOLATIONS,
)

# Columns of `options`.
RTOL, ATOL, LOCATE, MAX_STEPS, MAX_EVENTS = range(5)

#: Exponent of the step length rules, 1 / (order of the error estimate + 1).
POWER = 1 / 5
#: Below this err/RelTol the rule 1.25 (err/RelTol)^(1/5) <= 0.2 lets a step grow five times; 0.16^5
#: = 1.048576e-4, less a little.
TINY = 1.04e-4


# -- step length -----------------------------------------------------------------------------------
@inner
def step(t, t_end, longest, length, rtol, theta, work):
    """One accepted step: (t_new, h, its length, err, rejections). Failed if not err <= rtol: NaN,
    or no step is short enough.
    """
    shortest = 16.0 * ulp(t)
    length = min(longest, max(shortest, length))
    last = 1.1 * length >= t_end - t
    if last:
        length = t_end - t
    rejections = 0
    while True:
        t_new = t_end if last else t + length
        h = try_step(t, length, t_new, work)
        err = length * error_norm(theta, work)
        if not err > rtol or length <= shortest:
            return t_new, h, length, err, rejections
        length = max(
            shortest,
            length * max(0.1, 0.8 * (rtol / err) ** POWER) if rejections == 0 else 0.5 * length,
        )
        last = False
        rejections += 1


@inner
def next_length(length, err, rejections, rtol):
    """Length of the step after an accepted one."""
    if rejections > 0:
        return length
    ratio = err / rtol
    if ratio < TINY:
        return 5.0 * length
    shrink = 1.25 * ratio**POWER
    return length / shrink if shrink > 0.2 else 5.0 * length


@inner
def first_length(t, t_end, rtol, theta, work):
    """Default length of the first step of a leg, from NODE and K1."""
    norm = 0.0
    for i in range(NSTATES):
        norm = max(norm, abs(work[K1 + i] / max(abs(work[NODE + i]), theta)))
    rate = norm / (0.8 * rtol**POWER)
    length = longest_step(t, t_end)
    if length * rate > 1.0:
        length = 1.0 / rate
    return max(length, 16.0 * ulp(t))


@inner
def longest_step(t_leg, t_end):
    """A tenth of the leg's span."""
    return 0.1 * (t_end - t_leg)


# -- sides -----------------------------------------------------------------------------------------
@inner
def sides(at, work):
    """Mode bits: bit g is set where gap g is positive."""
    bits = 0
    for g in range(NGUARDS):
        if work[at + g] > 0.0:
            bits |= 1 << g
    return bits


@inner
def check_sides(i, batch, work):
    """After a step without contact: the sides are those of the gaps. A gap that has changed sides
    unseen is counted.
    """
    now = sides(AT_NEXT, work)
    if now != batch.mode[i]:
        for g in range(NGUARDS):
            if (now ^ batch.mode[i]) >> g & 1 and work[AT_NODE + g] != 0.0:
                batch.counters[i, VIOLATIONS] += 1
        batch.mode[i] = now


# -- samples ---------------------------------------------------------------------------------------
@inner
def due(i, batch):
    """Time of the next sample, infinite if there is none."""
    m = batch.cursor[i]
    if m < 0 or m >= batch.sample_count.shape[0]:
        return math.inf
    return (
        batch.origin[i]
        + batch.sample_count[m] * batch.period[i]
        + batch.sample_fraction[m] * batch.period[i]
    )


@kernel
def write_sample(i, time, state, batch, work):
    """Write a state as the next sample."""
    m = batch.cursor[i]
    for j in range(NSTATES):
        batch.samples[i, m, j] = work[state + j]
    drive_at(time, Q, work)
    gaps_at(time, state, Q, TRY, work)
    batch.sample_mode[i, m] = sides(TRY, work)
    batch.cursor[i] = m + 1


@kernel
def write_samples(i, t, h, t_node, batch, work):
    """Write the samples that the step has passed on its way from t to t_node, whose state stands in
    NEXT.
    """
    time = due(i, batch)
    while time <= t_node:
        if time == t_node:
            write_sample(i, time, NEXT, batch, work)
        else:
            dense(time, t, h, work)
            write_sample(i, time, POINT, batch, work)
        time = due(i, batch)


@kernel
def write_samples_here(i, until, batch, work):
    """Write the samples due until a time from the state at NODE: at the start, and those that
    rounding has put past the end.
    """
    while due(i, batch) <= until:
        write_sample(i, due(i, batch), NODE, batch, work)


# -- contacts --------------------------------------------------------------------------------------
@kernel
def land(i, t, t_hit, t_new, h, batch, work):
    """Cut the step at a contact: NEXT becomes the state there, K1 its rate, AT_NEXT its gaps; the
    contact is recorded.
    """
    if t_hit < t_new:
        dense(t_hit, t, h, work)
        for j in range(NSTATES):
            work[NEXT + j] = work[POINT + j]
    write_samples(i, t, h, t_hit, batch, work)
    drive_at(t_hit, Q, work)
    rate_at(t_hit, NEXT, Q, K1, work)
    gap_rates_at(t_hit, NEXT, K1, Q, RATE, work)
    gap_errors(i, t_hit, batch, work)
    record_contacts(i, t_hit, batch, work)
    if TANGENT:
        rate_at(t_hit, NEXT, Q, K1, work)
    gaps_at(t_hit, NEXT, Q, AT_NEXT, work)


@kernel
def gap_errors(i, t_hit, batch, work):
    """How far the errors of all steps so far have moved each gap at most, to TRY; how errors grow
    from step to step is left out.
    """
    gap_rates_at(t_hit, NEXT, REST, Q, RATE_AT_REST, work)
    for g in range(NGUARDS):
        work[TRY + g] = 0.0
    for j in range(NSTATES):
        work[REST + j] = batch.carry[i, ERRORS + j]
        gap_rates_at(t_hit, NEXT, REST, Q, AT_NEXT, work)
        work[REST + j] = 0.0
        for g in range(NGUARDS):
            work[TRY + g] += abs(work[AT_NEXT + g] - work[RATE_AT_REST + g])


@inner
def record_contacts(i, t_hit, batch, work):
    """Count and record every gap that closes at t_hit; sets the mode."""
    before, after = batch.mode[i], batch.mode[i]
    for g in range(NGUARDS):
        if changes_sign(work, LEFT, RIGHT, g):
            rises = work[RIGHT + g] > work[LEFT + g]
            before = before & ~(1 << g) if rises else before | (1 << g)
            after = after | (1 << g) if rises else after & ~(1 << g)
    for g in range(NGUARDS):
        if changes_sign(work, LEFT, RIGHT, g):
            batch.counters[i, EVENTS] += 1
            batch.minima[i, CONTACT_SPEED] = min(
                batch.minima[i, CONTACT_SPEED], abs(work[RATE + g])
            )
            record(i, g, t_hit, before, after, batch, work)
    batch.mode[i] = after
    if TANGENT:
        saltate(i, t_hit, before, after, batch, work)


@inner
def saltate(i, t_hit, before, after, batch, work):
    """The jumps of the tangent that the states carry, guard by guard where several
    cross together.
    """
    mode = before
    for g in range(NGUARDS):
        if changes_sign(work, LEFT, RIGHT, g):
            flipped = (mode & ~(1 << g)) | (after & (1 << g))
            h = part(work, H, HELD * NCLOCKS)
            jump(
                t_hit, part(work, NEXT, NSTATES), batch.param[i * batch.stride], h, mode, flipped, g
            )
            mode = flipped


@kernel
def record(i, g, t_hit, before, after, batch, work):
    """Write one contact, if there is a table and it lies in a period that is kept."""
    period, elapsed = batch.period[i], t_hit - batch.origin[i]
    count = math.floor(elapsed / period)
    if batch.rec_i.shape[0] == 0 or count < batch.rec_first[i]:
        return
    r = batch.rec_used[0]
    batch.rec_used[0] = r + 1
    row, values = batch.rec_i[r], batch.rec_f[r]
    row[REC_TRAJECTORY], row[REC_PERIOD], row[REC_GUARD], row[REC_KIND] = i, count, g, CROSSING
    row[REC_DIRECTION] = 1 if work[RIGHT + g] > work[LEFT + g] else -1
    row[REC_MODE_BEFORE], row[REC_MODE_AFTER], row[REC_STEPS] = (
        before,
        after,
        batch.counters[i, STEPS],
    )
    values[REC_PHASE], values[REC_VELOCITY] = elapsed - count * period, work[RATE + g]
    values[REC_TIME_ERROR] = (
        work[TRY + g] / abs(work[RATE + g]) if work[RATE + g] != 0.0 else math.inf
    )
    for j in range(NSTATES):
        values[RECORD_FLOATS + j] = work[NEXT + j]
    values[RECORD_FLOATS + NSTATES] = t_hit


# -- one trajectory --------------------------------------------------------------------------------
@inner
def end_time(i, batch):
    """Time at which a trajectory ends."""
    return batch.origin[i] + batch.end_count[i] * batch.period[i] + batch.end_phase[i]


@inner
def go_on(rate, work):
    """The end of a step becomes the start of the next: NEXT, a rate and AT_NEXT to NODE, K1 and
    AT_NODE.
    """
    for i in range(NSTATES):
        work[NODE + i] = work[NEXT + i]
        work[K1 + i] = work[rate + i]
    for g in range(NGUARDS):
        work[AT_NODE + g] = work[AT_NEXT + g]


@kernel
def take_up(i, theta, batch, work):
    """Load a trajectory, from its start (mode < 0) or from where it was paused: (t, start of the
    leg, next step length, next break).
    """
    prepare(batch.param[i * batch.stride], part(work, C, NCONST))
    t, t_leg, length = batch.carry[i, TIME], batch.carry[i, LEG], batch.carry[i, LENGTH]
    if batch.mode[i] < 0:
        t = batch.origin[i] + batch.count[i] * batch.period[i] + batch.phase[i]
    for j in range(NSTATES):
        work[NODE + j], work[REST + j] = batch.state[i, j], 0.0
    t_break = follow_clocks(i, t, False, batch, work)
    drive_at(t, Q, work)
    gaps_at(t, NODE, Q, AT_NODE, work)
    rate_at(t, NODE, Q, K1, work)
    if batch.mode[i] < 0:
        t_leg, length = t, first_length(t, end_time(i, batch), batch.options[i, RTOL], theta, work)
        batch.mode[i] = sides(AT_NODE, work)
        write_samples_here(i, t, batch, work)
    return t, t_leg, length, t_break


@kernel
def follow_clocks(i, t, known, batch, work):
    """Bring the clocks to their pieces at a time, from those that they hold if these are known;
    returns the next break.
    """
    if NCLOCKS == 0:
        return math.inf
    n = part(work, N, (NUMBERS + 1) * NCLOCKS)
    place_clocks(batch.param[i * batch.stride], 0.0, 1.0, 0, n, batch.data)
    return set_clocks(t, 0.0, n, batch.data, known, part(work, H, HELD * NCLOCKS))


@kernel
def start_leg(i, t, t_end, rtol, theta, batch, work):
    """Start afresh at a break, where the equations change: rates, gaps and sides at NODE; returns
    the length of the next step.
    """
    drive_at(t, Q, work)
    gaps_at(t, NODE, Q, AT_NODE, work)
    rate_at(t, NODE, Q, K1, work)
    if batch.options[i, LOCATE] != 0.0:
        batch.mode[i] = sides(AT_NODE, work)
    return first_length(t, t_end, rtol, theta, work)


@kernel
def put_back(i, t, t_leg, length, status, batch, work):
    """Store a trajectory that has ended or is paused."""
    for j in range(NSTATES):
        batch.state[i, j] = work[NODE + j]
    batch.carry[i, TIME], batch.carry[i, LEG], batch.carry[i, LENGTH] = t, t_leg, length
    batch.status[i] = status
    if batch.options[i, LOCATE] == 0.0:
        drive_at(t, Q, work)
        gaps_at(t, NODE, Q, AT_NODE, work)
        batch.mode[i] = sides(AT_NODE, work)
    batch.phase[i] = t - (batch.origin[i] + batch.count[i] * batch.period[i])
    if status == OK:
        write_samples_here(i, t + 4.0 * ulp(t), batch, work)
        batch.count[i], batch.phase[i] = batch.end_count[i], batch.end_phase[i]


@inner
def status_at(i, t, t_end, batch):
    """Status of a trajectory at a node."""
    if t >= t_end:
        return OK
    if batch.counters[i, EVENTS] > batch.options[i, MAX_EVENTS]:
        return BUDGET_EVENTS
    return BUDGET_STEPS if batch.counters[i, STEPS] >= batch.options[i, MAX_STEPS] else RUNNING


@inner
def has_room(batch):
    """Whether the contacts of one more step fit in the table."""
    return batch.rec_i.shape[0] == 0 or batch.rec_used[0] + NGUARDS <= batch.rec_i.shape[0]


@inner
def find_contact(t, t_new, t_leg, h, work):
    """(time of the first contact of the step, or its end; whether there is one)."""
    gaps_at(t_new, NEXT, Q6, AT_NEXT, work)
    if any_sign_change(work, AT_NODE, AT_NEXT):
        return odezero(t, t_new, t_leg, h, work)
    return t_new, False


@kernel
def advance(i, budget, batch, work):
    """Move a trajectory to its end, or until the budget of tries is used up or the table of
    contacts is full; returns the budget left.
    """
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    locate = batch.options[i, LOCATE] != 0.0
    t_end = end_time(i, batch)
    t, t_leg, length, t_break = take_up(i, theta, batch, work)
    status = status_at(i, t, t_end, batch)
    while status == RUNNING and budget > 0 and has_room(batch):
        t_new, h, length, err, rejections = step(
            t, min(t_end, t_break), longest_step(t_leg, t_end), length, rtol, theta, work
        )
        budget -= 1 + rejections
        batch.counters[i, REJECTED] += rejections
        if not err <= rtol:
            status = NONFINITE
            break
        batch.counters[i, STEPS] += 1
        for j in range(NSTATES):
            batch.carry[i, ERRORS + j] += abs(h * work[ERROR + j])
        t_hit, lands = find_contact(t, t_new, t_leg, h, work) if locate else (t_new, False)
        if lands:
            land(i, t, t_hit, t_new, h, batch, work)
            go_on(K1, work)
            length = first_length(t_hit, t_end, rtol, theta, work)
            t = t_leg = t_hit
        else:
            write_samples(i, t, h, t_new, batch, work)
            if locate:
                check_sides(i, batch, work)
            go_on(K7, work)
            length = next_length(length, err, rejections, rtol)
            t = t_new
        if NCLOCKS > 0 and t + SAME_BREAK * abs(t) >= t_break:
            t_break = follow_clocks(i, t, True, batch, work)
            length = start_leg(i, t, t_end, rtol, theta, batch, work)
            t_leg = t
        status = status_at(i, t, t_end, batch)
    put_back(i, t, t_leg, length, status, batch, work)
    return budget


@entry
def propagate(
    period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
    end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
    rec_first, rec_i, rec_f, rec_used, options, data, budget, work,
):  # fmt: skip
    """Move every trajectory whose status is RUNNING to its end, `budget` tries of a step at most.
    See kernels/batch.py for the arrays.
    """
    batch = Batch(
        period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
        end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
        rec_first, rec_i, rec_f, rec_used, options, data,
    )  # fmt: skip
    for i in range(status.shape[0]):
        if status[i] == RUNNING:
            budget = advance(i, budget, batch, work)
            if status[i] == RUNNING:
                return PAUSED
    return FINISHED
