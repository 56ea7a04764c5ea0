"""Fits of parameters to measurements.

``fit`` is the verb. ``measurement`` reads what was measured, ``unknowns`` what is free; ``motion``
and ``windows`` compute what the equations say to it, ``misfit`` compares both, ``search`` looks for
the least misfit and ``verdict`` says what the data decide.
"""
