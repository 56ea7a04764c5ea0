"""Truncated Fourier series, in the order in which the templates stand below the head of an
equation:

================  ==================================================================================
series            values, and all zeros of series
zeros             the call for the zeros alone
cut               a motion cut where it meets boundaries
sums              forces along it, integrated between these instants
derivatives       the derivatives of the integrals, and what shifted instants add
balance           the call for the equations of harmonic balance
================  ==================================================================================

A series is float64[2H + 1]: the mean, the H cosines, the H sines. codegen/interface.py puts the
templates together.
"""
