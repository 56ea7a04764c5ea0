"""Datasets: the description of every variable, and the building of Datasets by it."""
