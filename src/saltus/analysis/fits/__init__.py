"""Fits of parameters to measurements.

``fit`` is the verb. ``measurement`` reads what was measured, ``unknowns`` what is free; ``motion``
and ``steady`` compute what the equations say to histories and to responses, ``search``,
``growth`` and ``windows`` look for the least misfit, and ``verdict`` says what the data decide.
"""
