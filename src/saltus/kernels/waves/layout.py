"""Layout of the search for turning points of sums of waves.

On a leg a quantity is Re(sum_e r_e a_e e^{mu_e t}), mu of the contact state in which the leg is.
Rows of LANES waves, G of them for all: a contact state has G of real parts of the rates, G of
imaginary ones, G of their sizes; a leg the same of its amplitudes, a quantity the same in each
contact state.
"""

from collections import namedtuple

#: Places of `sizes`: what is looked for, G, quantities, first leg, and the one behind the last.
GOAL, GROUPS, QUANTITIES, FIRST, BEHIND = range(5)
#: Goals: smallest and largest values of all quantities, to `limits`; the smallest magnitude that
#: one of them has where it turns, to `limits`; all turning points, to `turning`.
EXTREMES, LEAST, TURNS = range(3)
#: Most halvings of a leg: a part that is smaller is rounding.
DEEPEST = 47
#: A part is small enough if what it leaves out of a bend, relative to the sizes of its waves, is
#: less: where it isn't decided then, waves cancel, and the quantity turns once at most that counts.
NARROW = 1e-7
#: Rounding of a sum of waves, relative to their sizes: what has no bend beyond it doesn't turn.
ROUNDED = 1e-15
#: A step of Newton's method that is rounding, relative to the time; one that is the last, relative
#: to a part in which a quantity turns once; and most of them.
SETTLED, LAST, MOST_STEPS = 4e-16, 1e-8, 60
#: Rows of `work` over G: the waves, real and imaginary; those that are slow in a part, and three
#: derivatives; what these leave out of a quantity, of its slope and its bend; sizes of the bends.
NOW, SLOW, REST, SHARP, WORK = 0, 2, 10, 13, 14

Waves = namedtuple(
    "Waves", "sizes rates amplitudes state length quantities limits turning work sums opened many"
)
