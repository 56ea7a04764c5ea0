"""The Taylor flow, in the order in which its templates stand below the head of an equation:

================  ==================================================================================
layout            its work arrays, and the course of a step
singular          forces without a Taylor series on a boundary
crossings         crossings of gaps within a step, in all lanes at once
step              one step of all lanes: its length and its execution
contacts          contacts of one lane: what `crossings` leaves open, landing, recording
laws              impacts, jumps, contacts that are held
together          several impacts at one instant
ends              the end of a run
trajectories      the life of a lane: filled, attended to, emptied
================  ==================================================================================

codegen/interface.py puts them together, with ``clocks`` and ``impacts`` of the folder above.
"""
