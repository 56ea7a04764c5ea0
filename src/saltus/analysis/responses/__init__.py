"""Steady responses against parameters, and the branches that they lie on."""
