"""Side of each contact on which a sample lies, and the colour and name of that side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from saltus.plot.style import CYCLE, OKABE_ITO
from saltus.results.dataset.schema import equations_of

#: Outwards from the free region; a contact with more stages repeats the last colour.
_ABOVE = (OKABE_ITO["vermillion"], OKABE_ITO["orange"])
_BELOW = (OKABE_ITO["blue"], OKABE_ITO["sky blue"])
_FREE = OKABE_ITO["green"]
#: Sets of touching contacts with a colour each; of more sets the number of contacts is told apart.
_OWN_SETS = 5
#: Last words of the names of hold guards.
_HELD = (" at rest", " held")


@dataclass(frozen=True)
class ContactLine:
    """A value of a state at which a contact begins.

    Attributes
    ----------
    name : str
        Name of the guard.
    value : float
        Its position [unit of the state].
    """

    name: str
    value: float

    @property
    def label(self) -> str:
        """The name as text."""
        return self.name.replace("_", " ")


@dataclass(frozen=True)
class Region:
    """One side: its colour, its name in a legend, True for a contact, and the interval of the state
    that it covers.
    """

    color: str
    label: str
    contact: bool
    below: float = -np.inf
    above: float = np.inf


@dataclass(frozen=True)
class Regions:
    """Sides that a picture distinguishes.

    Attributes
    ----------
    regions : tuple of Region
        In the order of the state, where there is one.
    boundaries : tuple of Boundary
        Between the regions; empty where the guards don't bound one state.
    state : str or None
        The state that is bounded.
    codes : array of int, shape (region,)
        The bits of each region.
    bits : tuple of int
        The guards that count.
    """

    regions: tuple[Region, ...]
    boundaries: tuple[ContactLine, ...]
    state: str | None
    bits: tuple[int, ...]
    codes: np.ndarray

    def of(self, mode: np.ndarray) -> np.ndarray:
        """Index of the region of each mode."""
        if self.state is not None:
            return _positive(mode, self.bits)
        return np.searchsorted(self.codes, mode & _mask(self.bits))


def _mask(bits: Sequence[int]) -> int:
    return sum(1 << bit for bit in bits)


def _positive(mode: np.ndarray, bits: Sequence[int]) -> np.ndarray:
    """Count the positive guards. Along one state the count is the index among its boundaries."""
    return sum(
        ((np.asarray(mode) >> bit) & 1 for bit in bits),
        start=np.zeros(np.shape(mode), dtype=np.int64),
    )


def find(ds: xr.Dataset, shown: Sequence[str]) -> Regions:
    """The regions of a single trajectory in a picture of some states.

    Parameters
    ----------
    ds : Dataset
        One trajectory.
    shown : sequence of str
        States on the axes, the most important first. Their own guards decide; if they have none,
        those of the only state that has any; else every guard does, a colour for each combination
        of sides that occurs. Where contacts can be held, at rest or stuck, that is what is told
        apart.
    """
    if held := [i for i, name in enumerate(ds["guard"].values) if str(name).endswith(_HELD)]:
        return _by_holding(ds, shown, held)
    owners = ds["guard_state"].values.tolist()
    bounded = [state for state in shown if state in owners] or (
        owners[:1] if len(set(owners)) == 1 and owners[0] else []
    )
    if not owners or not bounded:
        return _by_mode(ds)
    return along(ds, bounded[0])


def _by_holding(ds: xr.Dataset, shown: Sequence[str], held: Sequence[int]) -> Regions:
    """Regions with a colour for every set of contacts that are held together, and the boundaries of
    the first state that has any.
    """
    owners = ds["guard_state"].values.tolist()
    lines = next((along(ds, state).boundaries for state in shown if state in owners), ())
    codes = np.unique(_modes(ds) & _mask(held))
    colors = [_FREE, *_ABOVE, *_BELOW]
    names = [str(name).replace("_", " ") for name in ds["guard"].values]
    regions = [
        Region(
            colors[min(place, len(colors) - 1)] if code else _FREE,
            ", ".join(names[bit] for bit in held if (int(code) >> bit) & 1) or "free",
            contact=bool(code),
        )
        for place, code in enumerate(codes, start=int(codes[0] != 0))
    ]
    return Regions(tuple(regions), lines, None, tuple(held), codes)


def along(ds: xr.Dataset, state: str) -> Regions:
    """Regions between the boundaries of one state; one free region if there are none."""
    values = ds["guard_boundary"].values
    mine = [
        i
        for i, owner in enumerate(ds["guard_state"].values.tolist())
        if owner == state and np.isfinite(values[i])
    ]
    bits = tuple(sorted(mine, key=lambda i: values[i]))
    boundaries = tuple(ContactLine(str(ds["guard"].values[i]), float(values[i])) for i in bits)
    free = _free_region(boundaries)
    edges = [-np.inf, *(boundary.value for boundary in boundaries), np.inf]
    regions = []
    for i in range(len(bits) + 1):
        color, label = _FREE, "free"
        if i > free:
            color, label = _ABOVE[min(i - free, len(_ABOVE)) - 1], _contact_label(boundaries[i - 1])
        elif i < free:
            color, label = _BELOW[min(free - i, len(_BELOW)) - 1], _contact_label(boundaries[i])
        regions.append(Region(color, label, i != free, edges[i], edges[i + 1]))
    return Regions(tuple(regions), boundaries, state, bits, np.arange(len(regions)))


def _free_region(boundaries: Sequence[ContactLine]) -> int:
    """Index of the region free of contact: above the guards called lower and below those called
    upper, else the region that holds zero.

    If zero is a boundary, it is the middle region, and the region below a single boundary.
    """
    lower = ["lower" in boundary.name for boundary in boundaries]
    if boundaries and all(
        low or "upper" in boundary.name for low, boundary in zip(lower, boundaries, strict=True)
    ):
        return sum(lower)
    if any(boundary.value == 0 for boundary in boundaries):
        return len(boundaries) // 2
    return sum(boundary.value < 0 for boundary in boundaries)


def _contact_label(boundary: ContactLine) -> str:
    """Name of the contact at a boundary: ``upper contact`` for ``upper_gap``; ``beyond ...`` for a
    boundary without such a name.
    """
    stem = boundary.name.removesuffix("_gap")
    return (
        f"{stem.replace('_', ' ')} contact"
        if stem != boundary.name and stem.isidentifier()
        else f"beyond {boundary.label}"
    )


def _by_mode(ds: xr.Dataset) -> Regions:
    """Regions with a colour for every combination of sides that occurs, named after the sides. If
    all guards are contacts of a structure, they are named after the contacts that touch.
    """
    names = ds["guard"].values.tolist()
    codes = np.unique(_modes(ds))
    touching = _touching_sides(ds)
    changing = _changing(codes.tolist(), len(names))
    if changing and all(i in touching for i in changing):
        return _by_touching(codes, names, touching)
    regions = []
    for color, label in zip(
        _mode_colors(codes.tolist()), _mode_labels(codes.tolist(), names), strict=True
    ):
        regions.append(Region(color, label, contact=False))
    if not names:
        regions = [Region(CYCLE[0], "", contact=False)]
        codes = np.zeros(1, dtype=np.int64)
    return Regions(tuple(regions), (), None, tuple(range(len(names))), codes)


def _touching_sides(ds: xr.Dataset) -> dict[int, int]:
    """Value of the guard's bit at touch, for each guard that is a contact of `sl.structure`."""
    equations = " ".join(equations_of(ds))
    sides = {}
    for i, name in enumerate(map(str, ds["guard"].values)):
        label, _, side = name.partition(" ")
        if f"{label}_stiffness*" in equations and side in ("", "lower", "upper"):
            sides[i] = int(f"< -{label}_gap" not in equations if side == "" else side == "upper")
    return sides


def _by_touching(codes: np.ndarray, names: Sequence[str], touching: Mapping[int, int]) -> Regions:
    """Regions with a colour for every set of contacts that touch together, or for the number of
    contacts.
    """
    sets = [
        [names[bit] for bit, side in touching.items() if int(code) >> bit & 1 == side]
        for code in codes
    ]
    if len({tuple(members) for members in sets}) > _OWN_SETS:
        keys = [f"{len(members)} contacts" if len(members) > 1 else "1 contact" for members in sets]
    else:
        keys = [
            " and ".join(members) + (" touch" if len(members) > 1 else " touches")
            for members in sets
        ]
    labels = [key if members else "free" for key, members in zip(keys, sets, strict=True)]
    ranked = sorted(
        {label: len(members) for label, members in zip(labels, sets, strict=True)}.items(),
        key=lambda item: item[1],
    )
    others = [color for color in (*_ABOVE, *_BELOW, *CYCLE) if color != _FREE]
    colors = dict(
        zip([label for label, count in ranked if count], dict.fromkeys(others), strict=False)
    )
    colors["free"] = _FREE
    regions = [Region(colors.get(label, others[-1]), label, contact=False) for label in labels]
    return Regions(tuple(regions), (), None, tuple(range(len(names))), codes)


def _modes(ds: xr.Dataset) -> np.ndarray:
    """Modes of the samples and after the contacts."""
    if "mode" not in ds:
        return np.zeros(1, dtype=np.int64)
    return np.concatenate([np.ravel(ds["mode"].values), ds["contact_mode_after"].values])


def _freeplay(codes: Sequence[int]) -> tuple[int, int, int] | None:
    """Indices of the free mode, and of the modes below and above it; None if the modes aren't those
    of a freeplay.

    Two gaps of a freeplay give the modes none, one, both positive if they point the same way, and
    none, one, the other if they don't.
    """
    if len(codes) != 3:
        return None
    if codes[0] & codes[1] == codes[0] and codes[1] & codes[2] == codes[1]:
        return 1, 0, 2
    return (0, 2, 1) if codes[0] == 0 and all(code.bit_count() == 1 for code in codes[1:]) else None


def _mode_colors(codes: Sequence[int]) -> list[str]:
    """Colours of the modes. Those of a freeplay keep green for free; others get one colour each."""
    places = _freeplay(codes)
    if places:
        return [
            color for _, color in sorted(zip(places, (_FREE, _BELOW[0], _ABOVE[0]), strict=True))
        ]
    if len(codes) == 2 and codes[0] == 0 and codes[1].bit_count() == 1:
        return [_FREE, _ABOVE[0]]
    return [CYCLE[i % len(CYCLE)] for i in range(len(codes))]


def _mode_labels(codes: Sequence[int], names: Sequence[str]) -> list[str]:
    """Modes in words: those of a freeplay by the contact, others by the guards in which they
    differ. A single mode has no name.
    """
    places = _freeplay(codes)
    changing = _changing(codes, len(names))
    if places and len(changing) == 2:
        free = codes[places[0]]
        met = [names[(code ^ free).bit_length() - 1] if code != free else None for code in codes]
        return ["free" if name is None else f"beyond {name.replace('_', ' ')}" for name in met]
    return [", ".join(_side(names[bit], code >> bit & 1) for bit in changing) for code in codes]


def _changing(codes: Sequence[int], count: int) -> list[int]:
    """Guards that change side between modes."""
    return [bit for bit in range(count) if len({code >> bit & 1 for code in codes}) > 1]


def _side(name: str, positive: int) -> str:
    """Side of a guard in words: ``gap`` is the name of a boundary, ``x - y = gap`` its equation."""
    left, equal, right = name.replace("_", " ").partition(" = ")
    return (
        f"{left} {'>' if positive else '<'} {right}"
        if equal
        else (f"{'above' if positive else 'below'} {left}")
    )
