"""Datasets: what every variable of a result is, and arrays put under these names."""
