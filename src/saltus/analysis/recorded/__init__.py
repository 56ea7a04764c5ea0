"""Exponents of recorded series: what a laboratory measured, without an equation."""
