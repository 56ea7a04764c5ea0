"""Motions that repeat or rest: periodic orbits, limit cycles and equilibria, stable or not."""
