"""Data of a clock: kinds of clocks and columns of their numbers, shared by the template clocks.py
and the code that reads them.
"""

from __future__ import annotations

# Kinds: a comparison linear in time, one with a sine, one with a remainder; a remainder, a table.
LEVEL, WAVE, PULSE, CYCLE, TABLE = range(5)
# Columns of each clock: its piece, its side (+1/-1), the reference phase of its polynomial, the
# polynomial's coefficients.
PIECE, ON, REF, C0, C1, C2, C3, HELD = range(8)
#: Numbers of each clock that depend on parameters only.
NUMBERS = 4
