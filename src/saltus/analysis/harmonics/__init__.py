"""Periodic motions as truncated Fourier series, with contacts where the series has them."""
