"""Curves of a study: measured points from a file as a table that formulas call."""

from __future__ import annotations

import numpy as np

from saltus.errors import SaltusError
from saltus.language import Table, curve
from saltus.results.files.measured import columns
from saltus.study.setting.inputs import Input
from saltus.study.tables.parts import MeasuredCurve
from saltus.study.tables.toml import fault


def curve_of(file: Input, how: MeasuredCurve, name: str) -> Table:
    """The curve through the points of a file: its first two columns, in SI by the units of their
    headings.

    Raises
    ------
    StudyError
        If the file holds something else, or the points can't be those of a curve. What it holds
        isn't repeated.
    """
    try:
        points, values = columns(file.data, file.path)
        return curve(
            np.array(points), np.array(values), how.kind, how.outside, name, title=file.name
        )
    except SaltusError as error:
        raise fault(f"system.tables.{name}", error) from None
