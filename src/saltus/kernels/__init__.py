"""Templates of kernels and their pure helpers: functions of numbers that allocate nothing in a loop
and raise nothing.

A folder holds the templates of a kind of flow: ``taylor``, ``modal``, ``stepping`` (all other
methods). ``harmonics`` and ``waves`` move nothing: equations of harmonic balance, and turning
points of sums of waves. What several of them share stands beside the folders.
"""
