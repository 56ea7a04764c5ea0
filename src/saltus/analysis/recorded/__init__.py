"""Exponents of recorded series: measurements without an equation."""
