"""Template: Newton's law of impact where several stops close at one instant, for every flow.

It is a law of one contact. Where several close at once the impacts are taken one after the other
until none closes; if what comes out depends on the order, the equations don't say what happens.
Brogliato, Nonsmooth Mechanics (2016), section 5.2.

Symbols
-------
t the time [s]; p, held and mode as the head's ``reset`` takes them, told the two numbers that it
returns; stops the bits of those at which the state stands; rows five states, one behind the other:
the state, and at TRIED, AT_FIRST, BY_GUARDS, WAY the one behind the next impact, the one before
all, the one behind them in the order of the guards, and the way that each has gone.
"""

from saltus.kernels.parts import part
from saltus.kernels.status import AMBIGUOUS_IMPACT, IMPACT_LAW, INVALID_RESTITUTION, OK

#: Least relative effect of an impact: the change of another contact's constraint over the closing
#: velocity.
FELT = 1.0e-9
#: Part of the first closing velocity at which successive impacts of one instant count as ended in a
#: comparison of orders; the most impacts of it.
ENDED, MOST_IMPACTS = 1.0e-12, 50_000
#: Rounding that may carry a coefficient of restitution out of [0, 1].
RESTITUTION_ROUNDING = 1.0e-12


@inner
def is_possible(g, told):
    """True unless the law of guard g has reported an impact with an impossible restitution."""
    e, strikes = told[0], LAW[g] == IMPACT_LAW and told[1] > 0.0
    return not strikes or -RESTITUTION_ROUNDING <= e <= 1.0 + RESTITUTION_ROUNDING


@kernel
def closes_at(t, rows, p, held, mode, after, g, told):
    """The velocity at which stop g closes; the state behind its impact, which leads from one mode
    to another, at TRIED.
    """
    for i in range(NSTATES):
        rows[TRIED + i] = rows[i]
    reset(t, part(rows, TRIED, NSTATES), p, held, mode, after, g, told)
    return told[1]


@kernel
def closing_of(t, rows, p, held, mode, stops, told):
    """Number of stops that close, and the largest closing velocity; velocities that are rounding
    beside it don't count.
    """
    closing, fastest = 0, 0.0
    for g in range(NGUARDS):
        if (stops >> g) & 1:
            fastest = max(fastest, closes_at(t, rows, p, held, mode, mode, g, told))
    for g in range(NGUARDS):
        if (stops >> g) & 1 and closes_at(t, rows, p, held, mode, mode, g, told) > FELT * fastest:
            closing += 1
    return closing, fastest


@kernel
def take_impacts(t, rows, p, held, mode, after, stops, backwards, least, told):
    """The state after all impacts of this instant, in the order of the guards or against it, until
    none closes faster than `least`: the first leads from one mode to another. Returns OK, or the
    status that ends the motion; impacts without end have no order.
    """
    for _ in range(MOST_IMPACTS):
        struck = False
        for place in range(NGUARDS):
            g = NGUARDS - 1 - place if backwards else place
            if not struck and (stops >> g) & 1:
                struck = closes_at(t, rows, p, held, mode, after, g, told) > least
                if struck and not is_possible(g, told):
                    return INVALID_RESTITUTION
        if not struck:
            return OK
        for i in range(NSTATES):
            rows[WAY + i] += abs(rows[TRIED + i] - rows[i])
            rows[i] = rows[TRIED + i]
        mode = after
    return AMBIGUOUS_IMPACT


@kernel
def order_of_impacts(t, rows, p, held, mode, stops, told):
    """Test that the impacts of this instant lead to one state, in the order of the guards and
    against it: OK, or the status that ends the motion. The tangent isn't compared.
    """
    closing, fastest = closing_of(t, rows, p, held, mode, stops, told)
    if closing < 2:
        return OK
    for i in range(NSTATES):
        rows[AT_FIRST + i], rows[WAY + i] = rows[i], 0.0
    for backwards in range(2):
        for i in range(NSTATES):
            rows[BY_GUARDS + i], rows[i] = rows[i], rows[AT_FIRST + i]
        status = take_impacts(
            t, rows, p, held, mode, mode, stops, backwards == 1, ENDED * fastest, told
        )
        if status != OK:
            return status
    for i in range(NMOVED):
        least = FELT * (rows[WAY + i] + abs(rows[AT_FIRST + i]))
        if not abs(rows[i] - rows[BY_GUARDS + i]) <= least:
            return AMBIGUOUS_IMPACT
    return OK
