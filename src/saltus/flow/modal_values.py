"""Gaps, drives and laws that all contact states share for one set of parameter values."""

from __future__ import annotations

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
