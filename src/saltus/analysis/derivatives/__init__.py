"""Derivatives of motions with respect to parameters, through their contacts."""
