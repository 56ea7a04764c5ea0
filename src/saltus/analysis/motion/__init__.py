"""Trajectories and what is read off them: histories, sections, spectra, impacts, energy."""
