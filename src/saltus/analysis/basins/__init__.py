"""Which attractor each start leads to, how large the basins are and how far the map
can be trusted.
"""
