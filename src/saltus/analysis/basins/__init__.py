"""Basins of attraction: the attractor of each start, the sizes of the basins, and measures of trust
in the map.
"""
