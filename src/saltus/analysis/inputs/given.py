"""Types of what verbs are given, for editors and type checkers: numbers [SI] or texts with a unit,
alone, in ranges, and for many trajectories.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np
import xarray as xr

from saltus.system.read_off import Quantity

#: A number [SI] or a text with a unit.
Value: TypeAlias = float | str
#: One value, or one for each trajectory.
Values: TypeAlias = Value | Sequence[Value] | np.ndarray | xr.DataArray
#: Ends (low, high).
Range: TypeAlias = Sequence[Value] | np.ndarray
#: A range (first, last, count) or (first, last, count, "log"), or a list or array of the values.
Axis: TypeAlias = Sequence[Value] | np.ndarray | xr.DataArray
#: A value for each state; a mapping of states to values; an array (n, states); words such as
#: "random 20".
Starts: TypeAlias = Sequence[Values] | Mapping[str, Values] | np.ndarray | xr.DataArray | str
#: A condition that ends a motion: a text, or a function of the names of the system.
UntilTrue: TypeAlias = str | Callable[..., object]
#: A quantity that is read off a motion: a function, or it with its unit.
Reading: TypeAlias = Quantity | tuple[Quantity, str]
