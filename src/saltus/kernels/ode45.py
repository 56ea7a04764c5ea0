"""Template: ode45 as MATLAB runs it, digit for digit. codegen puts a generated head and odezero.py before this text.

One trajectory after the other, one step reads: step -> (odezero) -> write samples -> land or resume. The right-hand side picks its sides
from the state at every stage; with location on, a step that ends beyond a boundary is cut there and the method starts afresh.

Sources: the pair and its dense output, Dormand & Prince, J. Comput. Appl. Math. 6 (1980), and Shampine, Math. Comp. 46 (1986); the rules of
error control and step length, Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997). Sums are taken from left to right
and a stage is y + h*(sum), as MATLAB does it since it holds each stage in a variable of its own: the last digits depend on that.

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); y, y_new states; k_i stages, k_1 = k_7 of the step
before; h = t_new - t; length the step length that was asked for; theta = AbsTol/RelTol; err the error estimate on RelTol's scale;
c parameter-only constants; q time-only parts of the right-hand side.

The head supplies NSTATES, NGUARDS, NCONST, NDRIVE, GAPS_IN_TIME (whether a gap depends on time otherwise than through the state), and
prepare(p, c), drive(t, c, q), field(t, y, c, q, out), gaps(t, y, c, q, out), gap_rates(t, y, dy, c, q, out).
"""

import math
from collections import namedtuple

import numpy as np

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
    REC_TIME_ERROR,
    REC_TRAJECTORY,
    REC_VELOCITY,
    RECORD_FLOATS,
    REJECTED,
    RUNNING,
    STEPS,
    VIOLATIONS,
)

# Rows of `work`: the stages, the states at the ends of the step, a point between them, the error estimate divided by h, and zeros.
K1, K2, K3, K4, K5, K6, K7, NODE, NEXT, POINT, ERROR, REST = range(12)
WORK_ROWS = 12
# Columns of `carry`, what a paused trajectory needs besides its state: time, start of the leg [s], next step length [s].
TIME, LEG, LENGTH = range(3)
CARRY = 3
# Columns of `options`.
RTOL, ATOL, LOCATE, MAX_STEPS, MAX_EVENTS = range(5)

# The pair: times, stages, error estimate.
A2, A3, A4, A5 = 1 / 5, 3 / 10, 4 / 5, 8 / 9
B21 = 1 / 5
B31, B32 = 3 / 40, 9 / 40
B41, B42, B43 = 44 / 45, -56 / 15, 32 / 9
B51, B52, B53, B54 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
B61, B62, B63, B64, B65 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
B71, B73, B74, B75, B76 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E1, E3, E4, E5, E6, E7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
# Dense output: weight of k_i at s is (s for i = 1) + s^2 (D_i2 + s (D_i3 + D_i4 s)).
D12, D13, D14 = -183 / 64, 37 / 12, -145 / 128
D32, D33, D34 = 1500 / 371, -1000 / 159, 1000 / 371
D42, D43, D44 = -125 / 32, 125 / 12, -375 / 64
D52, D53, D54 = 9477 / 3392, -729 / 106, 25515 / 6784
D62, D63, D64 = -11 / 7, 11 / 3, -55 / 28
D72, D73, D74 = 3 / 2, -4.0, 5 / 2
#: Exponent of the step length rules, 1 / (order of the error estimate + 1).
POWER = 1 / 5
#: Below this err/RelTol the rule 1.25 (err/RelTol)^(1/5) <= 0.2 lets a step grow five times; 0.16^5 = 1.048576e-4, less a little.
TINY = 1.04e-4

Bench = namedtuple("Bench", "work gap c q")
Batch = namedtuple(
    "Batch",
    "period origin param stride state count phase mode fresh carry status end_count end_phase counters minima "
    "sample_count sample_fraction cursor samples sample_mode rec_first rec_i rec_f rec_used options",
)


# -- one step --------------------------------------------------------------------------------------------------------------------------
@inner
def try_step(t, length, t_new, work, c, q):
    """The stages of a step of the length asked for, and its end at t_new; returns h."""
    h = length
    for i in range(NSTATES):
        work[POINT, i] = work[NODE, i] + h * (B21 * work[K1, i])
    stage(t + h * A2, K2, work, c, q)
    for i in range(NSTATES):
        work[POINT, i] = work[NODE, i] + h * (B31 * work[K1, i] + B32 * work[K2, i])
    stage(t + h * A3, K3, work, c, q)
    for i in range(NSTATES):
        work[POINT, i] = work[NODE, i] + h * (B41 * work[K1, i] + B42 * work[K2, i] + B43 * work[K3, i])
    stage(t + h * A4, K4, work, c, q)
    for i in range(NSTATES):
        work[POINT, i] = work[NODE, i] + h * (B51 * work[K1, i] + B52 * work[K2, i] + B53 * work[K3, i] + B54 * work[K4, i])
    stage(t + h * A5, K5, work, c, q)
    for i in range(NSTATES):
        slope = B61 * work[K1, i] + B62 * work[K2, i] + B63 * work[K3, i] + B64 * work[K4, i] + B65 * work[K5, i]
        work[POINT, i] = work[NODE, i] + h * slope
    stage(t + h, K6, work, c, q)
    if t_new != t + h:
        drive(t_new, c, q)
    h = t_new - t
    for i in range(NSTATES):
        slope = B71 * work[K1, i] + B73 * work[K3, i] + B74 * work[K4, i] + B75 * work[K5, i] + B76 * work[K6, i]
        work[NEXT, i] = work[NODE, i] + h * slope
    field(t_new, work[NEXT], c, q, work[K7])
    return h


@inner
def stage(time, row, work, c, q):
    """The right-hand side at POINT."""
    drive(time, c, q)
    field(time, work[POINT], c, q, work[row])


@inner
def error_norm(work, threshold):
    """Max norm of the error estimate, divided by h, on the scale of the states; NaN if any of it is NaN."""
    norm = 0.0
    for i in range(NSTATES):
        error = E1 * work[K1, i] + E3 * work[K3, i] + E4 * work[K4, i] + E5 * work[K5, i] + E6 * work[K6, i] + E7 * work[K7, i]
        work[ERROR, i] = error
        ratio = abs(error / max(max(abs(work[NODE, i]), abs(work[NEXT, i])), threshold))
        if ratio > norm or ratio != ratio:
            norm = ratio
    return norm


@inner
def step(t, t_end, longest, length, rtol, threshold, work, c, q):
    """One accepted step: (t_new, h, its length, err, rejections). Failed if not err <= rtol: NaN, or no step is short enough."""
    shortest = 16.0 * ulp(t)
    length = min(longest, max(shortest, length))
    last = 1.1 * length >= t_end - t
    if last:
        length = t_end - t
    rejections = 0
    while True:
        t_new = t_end if last else t + length
        h = try_step(t, length, t_new, work, c, q)
        err = length * error_norm(work, threshold)
        if not err > rtol or length <= shortest:
            return t_new, h, length, err, rejections
        length = max(shortest, length * max(0.1, 0.8 * (rtol / err) ** POWER) if rejections == 0 else 0.5 * length)
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
def first_length(t, t_end, rtol, threshold, work):
    """Default length of the first step of a leg, from NODE and K1."""
    norm = 0.0
    for i in range(NSTATES):
        norm = max(norm, abs(work[K1, i] / max(abs(work[NODE, i]), threshold)))
    rate = norm / (0.8 * rtol**POWER)
    length = min(longest_step(t, t_end), t_end - t)
    if length * rate > 1.0:
        length = 1.0 / rate
    return max(length, 16.0 * ulp(t))


@inner
def longest_step(t_leg, t_end):
    """A tenth of the leg's span."""
    return 0.1 * (t_end - t_leg)


@inner
def dense(time, t, h, work):
    """The state at a time inside the step, in row POINT: the quartic of the pair."""
    s = (time - t) / h
    s2 = s * s
    w1 = s + s2 * (D12 + s * (D13 + D14 * s))
    w3 = s2 * (D32 + s * (D33 + D34 * s))
    w4 = s2 * (D42 + s * (D43 + D44 * s))
    w5 = s2 * (D52 + s * (D53 + D54 * s))
    w6 = s2 * (D62 + s * (D63 + D64 * s))
    w7 = s2 * (D72 + s * (D73 + D74 * s))
    for i in range(NSTATES):
        slope = work[K1, i] * w1 + work[K3, i] * w3 + work[K4, i] * w4 + work[K5, i] * w5 + work[K6, i] * w6 + work[K7, i] * w7
        work[POINT, i] = work[NODE, i] + h * slope


# -- sides -------------------------------------------------------------------------------------------------------------------------------
@inner
def sides(gap, row):
    """Mode bits: bit g is set where gap g is positive."""
    bits = 0
    for g in range(NGUARDS):
        if gap[row, g] > 0.0:
            bits |= 1 << g
    return bits


@inner
def check_sides(i, batch, gap):
    """After a step without contact: the sides are those of the gaps. A gap that has changed sides unseen is counted."""
    for g in range(NGUARDS):
        side = 1 if gap[AT_NEXT, g] > 0.0 else 0
        if side != (batch.mode[i] >> g) & 1 and gap[AT_NODE, g] != 0.0:
            batch.counters[i, VIOLATIONS] += 1
    batch.mode[i] = sides(gap, AT_NEXT)


# -- samples -----------------------------------------------------------------------------------------------------------------------------
@inner
def due(i, batch):
    """Time of the next sample [s], infinite if there is none."""
    m = batch.cursor[i]
    if m >= batch.sample_count.shape[0]:
        return math.inf
    return batch.origin[i] + batch.sample_count[m] * batch.period[i] + batch.sample_fraction[m] * batch.period[i]


@kernel
def write_sample(i, time, row, batch, bench):
    """Write a row of `work` as the next sample."""
    m = batch.cursor[i]
    for j in range(NSTATES):
        batch.samples[i, m, j] = bench.work[row, j]
    drive(time, bench.c, bench.q)
    gaps(time, bench.work[row], bench.c, bench.q, bench.gap[TRY])
    batch.sample_mode[i, m] = sides(bench.gap, TRY)
    batch.cursor[i] = m + 1


@kernel
def write_samples(i, t, h, t_node, batch, bench):
    """Write the samples that the step has passed on its way from t to t_node, whose state stands in NEXT."""
    time = due(i, batch)
    while time <= t_node:
        if time == t_node:
            write_sample(i, time, NEXT, batch, bench)
        else:
            dense(time, t, h, bench.work)
            write_sample(i, time, POINT, batch, bench)
        time = due(i, batch)


@kernel
def write_samples_here(i, until, batch, bench):
    """Write the samples due until a time from the state at NODE: at the start, and those that rounding has put past the end."""
    while due(i, batch) <= until:
        write_sample(i, due(i, batch), NODE, batch, bench)


# -- contacts ----------------------------------------------------------------------------------------------------------------------------
@inner
def touch_down(t, t_hit, t_new, h, work):
    """The state at a contact, in row NEXT."""
    if t_hit < t_new:
        dense(t_hit, t, h, work)
        for i in range(NSTATES):
            work[NEXT, i] = work[POINT, i]


@kernel
def land(i, t_hit, h, batch, bench):
    """Record every gap that closes at t_hit, where NEXT is the state and K1 its rate; sets the mode."""
    work, gap, c, q = bench
    gap_rates(t_hit, work[NEXT], work[REST], c, q, gap[RATE_AT_REST])
    gap_rates(t_hit, work[NEXT], work[ERROR], c, q, gap[TRY])
    gap_rates(t_hit, work[NEXT], work[K1], c, q, gap[RATE])
    before, after = batch.mode[i], batch.mode[i]
    for g in range(NGUARDS):
        if changes_sign(gap, LEFT, RIGHT, g):
            up = gap[RIGHT, g] > gap[LEFT, g]
            before = before & ~(1 << g) if up else before | (1 << g)
            after = after | (1 << g) if up else after & ~(1 << g)
    for g in range(NGUARDS):
        if changes_sign(gap, LEFT, RIGHT, g):
            speed = abs(gap[RATE, g])
            error = abs(h * (gap[TRY, g] - gap[RATE_AT_REST, g]))
            batch.counters[i, EVENTS] += 1
            batch.minima[i, CONTACT_SPEED] = min(batch.minima[i, CONTACT_SPEED], speed)
            record(i, g, t_hit, error / speed if speed > 0.0 else math.inf, before, after, batch, bench)
    batch.mode[i] = after


@kernel
def record(i, g, t_hit, time_error, before, after, batch, bench):
    """Write one contact, if it is not before the first period that is kept and there is a table."""
    period = batch.period[i]
    elapsed = t_hit - batch.origin[i]
    count = int(math.floor(elapsed / period))
    if batch.rec_i.shape[0] == 0 or count < batch.rec_first[i]:
        return
    r = batch.rec_used[0]
    batch.rec_used[0] = r + 1
    row, values = batch.rec_i[r], batch.rec_f[r]
    row[REC_TRAJECTORY], row[REC_PERIOD], row[REC_GUARD], row[REC_KIND] = i, count, g, CROSSING
    row[REC_DIRECTION] = 1 if bench.gap[RIGHT, g] > bench.gap[LEFT, g] else -1
    row[REC_MODE_BEFORE], row[REC_MODE_AFTER] = before, after
    values[REC_PHASE] = elapsed - count * period
    values[REC_VELOCITY], values[REC_TIME_ERROR] = bench.gap[RATE, g], time_error
    for j in range(NSTATES):
        values[RECORD_FLOATS + j] = bench.work[NEXT, j]
    values[RECORD_FLOATS + NSTATES] = t_hit


# -- one trajectory ------------------------------------------------------------------------------------------------------------------------
@inner
def end_time(i, batch):
    """Time at which a trajectory ends [s]."""
    return batch.origin[i] + batch.end_count[i] * batch.period[i] + batch.end_phase[i]


@inner
def move_on(work, stage):
    """The end of a step becomes the start of the next: NEXT to NODE, a stage to K1."""
    for i in range(NSTATES):
        work[NODE, i] = work[NEXT, i]
        work[K1, i] = work[stage, i]


@kernel
def take_up(i, batch, bench):
    """Bring a trajectory to the bench, from its start or from where it was paused: (t, start of the leg, next step length)."""
    work, gap, c, q = bench
    prepare(batch.param[i * batch.stride], c)
    t, t_leg, length = batch.carry[i, TIME], batch.carry[i, LEG], batch.carry[i, LENGTH]
    starts = batch.mode[i] < 0
    if starts:
        t = batch.origin[i] + batch.count[i] * batch.period[i] + batch.phase[i]
    for j in range(NSTATES):
        work[NODE, j], work[REST, j] = batch.state[i, j], 0.0
    drive(t, c, q)
    gaps(t, work[NODE], c, q, gap[AT_NODE])
    field(t, work[NODE], c, q, work[K1])
    if starts:
        t_leg = t
        length = first_length(t, end_time(i, batch), batch.options[RTOL], batch.options[ATOL] / batch.options[RTOL], work)
        batch.mode[i] = sides(gap, AT_NODE)
        write_samples_here(i, t, batch, bench)
    return t, t_leg, length


@kernel
def put_back(i, t, t_leg, length, status, batch, bench):
    """Write a trajectory back from the bench."""
    for j in range(NSTATES):
        batch.state[i, j] = bench.work[NODE, j]
    batch.carry[i, TIME], batch.carry[i, LEG], batch.carry[i, LENGTH] = t, t_leg, length
    batch.status[i] = status
    if batch.options[LOCATE] == 0.0:
        drive(t, bench.c, bench.q)
        gaps(t, bench.work[NODE], bench.c, bench.q, bench.gap[AT_NODE])
        batch.mode[i] = sides(bench.gap, AT_NODE)
    batch.phase[i] = t - (batch.origin[i] + batch.count[i] * batch.period[i])
    if status == OK:
        write_samples_here(i, t + 4.0 * ulp(t), batch, bench)
        batch.count[i], batch.phase[i] = batch.end_count[i], batch.end_phase[i]


@inner
def state_of(i, t, t_end, batch):
    """Status of a trajectory at a node."""
    if t >= t_end:
        return OK
    if batch.counters[i, EVENTS] > batch.options[MAX_EVENTS]:
        return BUDGET_EVENTS
    return BUDGET_STEPS if batch.counters[i, STEPS] >= batch.options[MAX_STEPS] else RUNNING


@inner
def has_room(batch):
    """Whether the contacts of one more step fit in the table."""
    return batch.rec_i.shape[0] == 0 or batch.rec_used[0] + NGUARDS <= batch.rec_i.shape[0]


@kernel
def advance(i, budget, batch, bench):
    """Move a trajectory to its end, or until the budget of steps is used up or the table of contacts is full; returns the budget left."""
    work, gap, c, q = bench
    rtol, threshold = batch.options[RTOL], batch.options[ATOL] / batch.options[RTOL]
    locate = batch.options[LOCATE] != 0.0
    t, t_leg, length = take_up(i, batch, bench)
    t_end = end_time(i, batch)
    status = state_of(i, t, t_end, batch)
    while status == RUNNING and budget > 0 and has_room(batch):
        t_new, h, length, err, rejections = step(t, t_end, longest_step(t_leg, t_end), length, rtol, threshold, work, c, q)
        budget -= 1 + rejections
        batch.counters[i, REJECTED] += rejections
        if not err <= rtol:
            status = NONFINITE
            break
        batch.counters[i, STEPS] += 1
        lands, t_hit = False, t_new
        if locate:
            gaps(t_new, work[NEXT], c, q, gap[AT_NEXT])
            if any_sign_change(gap, AT_NODE, AT_NEXT):
                t_hit, lands = odezero(t, t_new, t_leg, h, work, gap, c, q)
        if lands:
            touch_down(t, t_hit, t_new, h, work)
            write_samples(i, t, h, t_hit, batch, bench)
            drive(t_hit, c, q)
            field(t_hit, work[NEXT], c, q, work[K1])
            land(i, t_hit, h, batch, bench)
            gaps(t_hit, work[NEXT], c, q, gap[AT_NODE])
            move_on(work, K1)
            length = first_length(t_hit, t_end, rtol, threshold, work)
            t = t_leg = t_hit
        else:
            write_samples(i, t, h, t_new, batch, bench)
            if locate:
                check_sides(i, batch, gap)
                for g in range(NGUARDS):
                    gap[AT_NODE, g] = gap[AT_NEXT, g]
            move_on(work, K7)
            length = next_length(length, err, rejections, rtol)
            t = t_new
        status = state_of(i, t, t_end, batch)
    put_back(i, t, t_leg, length, status, batch, bench)
    return budget


def workspace():
    """The memory that one call of `propagate` works in; one set for each thread."""
    return np.zeros((WORK_ROWS, NSTATES)), np.zeros((GAP_ROWS, max(NGUARDS, 1))), np.zeros(max(NCONST, 1)), np.zeros(max(NDRIVE, 1))


@entry
def propagate(period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count, end_phase, counters, minima,
              sample_count, sample_fraction, cursor, samples, sample_mode, rec_first, rec_i, rec_f, rec_used, options, budget,
              work, gap, c, q):  # fmt: skip
    """Move every trajectory whose status is RUNNING to its end, `budget` tries of a step at most. See flow/engine.py for the arrays."""
    batch = Batch(period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count, end_phase, counters, minima,
                  sample_count, sample_fraction, cursor, samples, sample_mode, rec_first, rec_i, rec_f, rec_used, options)  # fmt: skip
    bench = Bench(work, gap, c, q)
    for i in range(status.shape[0]):
        if status[i] == RUNNING:
            budget = advance(i, budget, batch, bench)
            if status[i] == RUNNING:
                return PAUSED
    return FINISHED
