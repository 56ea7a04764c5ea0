"""Template: steps of a fixed length by a Runge-Kutta method.

With contacts located the right-hand side stays in the mode of the trajectory until a step has
landed on a boundary (landing.py), so that stages beyond it see a smooth law; without, it picks its
sides from the state at every stage.

Symbols
-------
t, t_new ends of a step; t_stop the next end or break of time; h = t_new - t. Times in s.
"""

# Columns of `options` of this method: length of a step [s]; bracket of a contact after bisection,
# as a share of a step.
STEP, CLOSENESS = range(2)
#: A step ends at t_stop if it would fall short of it by a millionth of its length at most.
REACHES = 1.000001
#: Flights of fewer last brackets of bisection than this are errors of bisection.
BRACKETS = 64.0
#: Share of a step that shows the side to which a motion leaves a boundary on which it stands still.
START_OF_STEP = 0.001


@inner
def law_mode(i, batch):
    """The mode of the right-hand side."""
    return batch.mode[i] if batch.options[i, LOCATE] != 0.0 else FROM_STATE


@inner
def at_once(i, t, batch):
    """The time [s] within which two contacts can't be told apart."""
    return max(128.0 * ulp(t), BRACKETS * batch.options[i, CLOSENESS] * batch.options[i, STEP])


@inner
def least_state(i, batch):
    """The least size of every state: unknown, so zero."""
    return 0.0


@kernel
def settle_sides(i, t, batch, work):
    """Sides of the gaps that are zero at NODE, by the sign of their rates or, where these are zero
    too, by the start of a step; K1 in that mode.
    """
    gap_rates_at(t, NODE, K1, Q, RATE, work)
    begin = t + START_OF_STEP * batch.options[i, STEP]
    stages(t, begin - t, begin, law_mode(i, batch), work)
    gaps_at(begin, NEXT, Q_STAGE, AT_NEXT, work)
    for g in range(NGUARDS):
        goes = work[RATE + g] if work[RATE + g] != 0.0 else work[AT_NEXT + g]
        if work[AT_NODE + g] == 0.0 and goes > 0.0:
            batch.mode[i] |= 1 << g
    batch.mode[i] = allowed(batch.mode[i])
    rate_at(t, NODE, Q, law_mode(i, batch), K1, work)


@inner
def begin_leg(i, t, t_end, batch, work):
    """Begin a leg: nothing is special about its first step."""


@inner
def step(i, t, t_stop, t_leg, t_end, batch, work):
    """One step: (t_new, h, True if its end is finite, rejections)."""
    length = batch.options[i, STEP]
    t_new = t + length
    if REACHES * length >= t_stop - t:
        t_new = t_stop
    h = stages(t, t_new - t, t_new, law_mode(i, batch), work)
    error_norm(1.0, work)
    total = 0.0
    for j in range(NSTATES):
        total += work[NEXT + j] - work[NEXT + j]
    return t_new, h, total == 0.0, 0
