"""Analyses: one file per question a scientist asks. They speak to flows only, and answer with Datasets."""

from saltus.analysis.settled import settled
from saltus.analysis.simulate import simulate
from saltus.analysis.stroboscope import stroboscope

__all__ = ["settled", "simulate", "stroboscope"]
