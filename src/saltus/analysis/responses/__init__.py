"""Steady responses against parameters: grids, branches and where they end."""
