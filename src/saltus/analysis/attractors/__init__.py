"""Attractors that trajectories settle to: closed motions, and those that never repeat - found, told
apart and described, from one start or from many at many values of a parameter.
"""
