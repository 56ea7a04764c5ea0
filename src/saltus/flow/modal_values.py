"""Gaps, drives and laws that all contact states share for one set of parameter values."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from saltus.system.courses import Course
from saltus.system.linear import LinearPiece
from saltus.system.linear_laws import Impacts


@dataclass(frozen=True)
class ValueSet:
    """Gaps and drives for one set of parameter values, in any contact state; whether a friction
    would be negative.
    """

    values: dict[str, float]
    gaps: LinearPiece
    rates: np.ndarray
    lags: np.ndarray
    courses: tuple[Course, ...]
    impacts: Impacts
    pushes: bool

    @functools.cached_property
    def is_finite(self) -> bool:
        """True if they are made of numbers, whatever formulas say."""
        pieces = self.gaps, self.impacts.closing
        parts = [part for one in pieces for part in (one.matrix, one.constant, one.driven)]
        parts += [self.rates, self.lags, self.impacts.push, self.impacts.restitution]
        parts += [one.terms for one in self.courses]
        return all(bool(np.isfinite(part).all()) for part in parts)
