"""Trajectories and their evaluation: histories, sections, spectra, impacts, energy."""
