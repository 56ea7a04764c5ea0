"""Branches of periodic orbits, stable or not: pseudo-arclength on the exact flow, and the
bifurcations along it.
"""
