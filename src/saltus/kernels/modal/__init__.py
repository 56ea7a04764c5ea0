"""The modal flow, in the order in which its templates stand:

================  ==================================================================================
layout            its tables and work arrays
records           drives that are polynomials of the time between breaks
blocks            modes that go together
series            amplitudes on their way, states, and gaps there
pieces            a gap over a part of a step, by Bernstein coefficients
gaps              what the gaps do over a step
places            where a gap crosses
laws              impacts, contacts at rest, their release
impacts           several impacts at one instant
friction          friction that sticks and slides
columns           columns of the derivative, several side by side
tangents          the derivative of the state with respect to the start and to parameters
touches           tangencies
ends              what a run leaves to the next one
steps             steps, and the life of a trajectory
================  ==================================================================================
"""
