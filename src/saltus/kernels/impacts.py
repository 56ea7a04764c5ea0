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

#: Part of the closing velocity of an impact by which the constraint of another contact changes, if
#: it changes at all.
FELT = 1.0e-9
#: Part of the first closing velocity at which impacts of one instant, each caused by the one
#: before, have come to an end for a comparison of orders; the most of them.
ENDED, MOST_IMPACTS = 1.0e-12, 50_000
#: By how much rounding may carry a coefficient of restitution out of [0, 1].
RESTITUTION_ROUNDING = 1.0e-12


@inner
def is_possible(g, told):
    """Whether the law of guard g has told no impact with an impossible restitution."""
    e, strikes = told[0], LAW[g] == IMPACT_LAW and told[1] > 0.0
    return not strikes or -RESTITUTION_ROUNDING <= e <= 1.0 + RESTITUTION_ROUNDING


@kernel
def closes_at(t, rows, p, held, mode, g, told):
    """The velocity at which stop g closes; the state behind its impact, at TRIED."""
    for i in range(NSTATES):
        rows[TRIED + i] = rows[i]
    reset(t, part(rows, TRIED, NSTATES), p, held, mode, mode, g, told)
    return told[1]


@kernel
def closing_of(t, rows, p, held, mode, stops, told):
    """How many of the stops close, and the largest velocity at which one does; what rounding leaves
    of a velocity doesn't count beside it.
    """
    closing, fastest = 0, 0.0
    for g in range(NGUARDS):
        if (stops >> g) & 1:
            fastest = max(fastest, closes_at(t, rows, p, held, mode, g, told))
    for g in range(NGUARDS):
        if (stops >> g) & 1 and closes_at(t, rows, p, held, mode, g, told) > FELT * fastest:
            closing += 1
    return closing, fastest


@kernel
def take_impacts(t, rows, p, held, mode, stops, backwards, least, told):
    """The state behind all impacts of this instant, in the order of the guards or against it, until
    none closes faster than `least`. Returns OK, or what ends the motion; impacts that come to no
    end have no order.
    """
    for _ in range(MOST_IMPACTS):
        struck = False
        for place in range(NGUARDS):
            g = NGUARDS - 1 - place if backwards else place
            if not struck and (stops >> g) & 1:
                struck = closes_at(t, rows, p, held, mode, g, told) > least
                if struck and not is_possible(g, told):
                    return INVALID_RESTITUTION
        if not struck:
            return OK
        for i in range(NSTATES):
            rows[WAY + i] += abs(rows[TRIED + i] - rows[i])
            rows[i] = rows[TRIED + i]
    return AMBIGUOUS_IMPACT


@kernel
def order_of_impacts(t, rows, p, held, mode, stops, told):
    """Whether the impacts of this instant lead to one state, taken in the order of the guards and
    against it: OK, or what ends the motion. The tangent isn't asked.
    """
    closing, fastest = closing_of(t, rows, p, held, mode, stops, told)
    if closing < 2:
        return OK
    for i in range(NSTATES):
        rows[AT_FIRST + i], rows[WAY + i] = rows[i], 0.0
    for backwards in range(2):
        for i in range(NSTATES):
            rows[BY_GUARDS + i], rows[i] = rows[i], rows[AT_FIRST + i]
        status = take_impacts(t, rows, p, held, mode, stops, backwards == 1, ENDED * fastest, told)
        if status != OK:
            return status
    for i in range(NMOVED):
        least = FELT * (rows[WAY + i] + abs(rows[AT_FIRST + i]))
        if not abs(rows[i] - rows[BY_GUARDS + i]) <= least:
            return AMBIGUOUS_IMPACT
    return OK
