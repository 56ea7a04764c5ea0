"""The search for turning points of sums of waves, in the order in which its templates stand:

================  ==================================================================================
layout            its arrays, and what it looks for
sums              waves on a leg, what they add up to, and bounds of both
search            turning points, smallest and largest values
================  ==================================================================================

Below :mod:`saltus.kernels.exponential`. The same for all systems.
"""
