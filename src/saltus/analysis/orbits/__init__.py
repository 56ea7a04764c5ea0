"""What trajectories settle to: periodic orbits, equilibria, limit cycles, aperiodic attractors -
found, verified and described.
"""
