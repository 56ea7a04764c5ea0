"""Descriptions of structures, and doubts about their matrices."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError, SaltusWarning, listed, shown
from saltus.language.inputs import Record
from saltus.system.display import STRUCTURE
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.structures.laws import sides
from saltus.system.structures.matrices import dense
from saltus.system.structures.parts import Base, Contact, direction
from saltus.system.structures.reduction import RIGID, Modes, flexibility
from saltus.units import from_si

#: Natural frequency [Hz] below which mass and stiffness may be swapped.
_SWAPPED = 3e-2
#: Natural frequencies [Hz] outside of which the units may be wrong.
_USUAL = (1e-3, 1e6)
#: A spring on which the structure vibrates more quickly than its highest mode by this factor is
#: doubted.
_STIFF = 1e3
#: Share of the fastest velocity of a record below which it ends at rest.
_AT_REST = 0.05
#: Share of the largest entry of a damping matrix below which an eigenvalue is rounding.
_NOTHING = 1e-9
#: Natural frequencies that the description lists, and modes of which it says what mass they move.
_TOLD = 6
#: Share of a flexibility that may be left out where all of it is said to be kept.
_WHOLE = 5e-5
#: Units of a flexibility and of an inertia, by that of a deflection.
_UNITS = {"m": (" m/N", " kg"), "rad": (" rad/(N*m)", " kg*m^2"), "": ("", "")}


def unreduced(size: int, angular: np.ndarray) -> str:
    """The description of a structure whose states are its degrees of freedom."""
    return f"{STRUCTURE} {size} degrees of freedom{_frequencies(angular)}."


def reduced(
    mass: Any,
    stiffness: Any,
    modes: Modes,
    lowest: int,
    count: int,
    degrees: list[str],
    loads: Any,
    unit: str,
) -> str:
    """The description of a structure by its lowest modes.

    It says what they carry of the static flexibility at each contact, and of the mass that moves
    with each base.
    """
    words = (
        f"{STRUCTURE} {len(degrees)} degrees of freedom, by its lowest {lowest} modes, up to "
        f"{modes.angular[lowest - 1] / (2 * math.pi):.6g} Hz{_frequencies(modes.angular[:lowest])}."
    )
    compliance, inertia = _UNITS[unit]
    words += _kept_at_contacts(stiffness, modes, count, degrees, loads.contacts, compliance)
    for label, drive in loads.drives:
        if isinstance(drive, Base):
            words += _moved(label, mass, modes.lowest(count), direction(drive, degrees), inertia)
    return words


def travels(drives: list[tuple[str, Any]], unit: str) -> str:
    """Sentences on the bases whose records leave them in motion: as a shock does, or a record whose
    baseline isn't corrected.
    """
    words = ""
    for label, drive in drives:
        if not isinstance(drive, Base) or not isinstance(drive.amplitude, Record):
            continue
        record, times = drive.amplitude, drive.amplitude.table.points
        ends, middles = record(times), record((times[:-1] + times[1:]) / 2)
        gains = np.diff(times) * (ends[:-1] + 4 * middles + ends[1:]) / 6  # exact: it is cubic
        velocity = np.cumsum(gains)
        last, most = velocity[-1], np.abs(velocity).max()
        if abs(last) > _AT_REST * most:
            words += (
                f" The record of {label} leaves it at {last:.3g} {unit}/s, "
                f"{100 * abs(last) / most:.3g} % of its fastest: the base travels on, which "
                f"deflections, relative to it, don't show. If it should come to rest, subtract the "
                f"record's mean, {last / record.duration:.3g} {unit}/s^2."
            )
    return words


def by_modes(system: EquationsOfMotion) -> bool:
    """True for a structure whose states are the coordinates of modes, which no user knows."""
    return system.states[0] == "q1" and system.description.startswith(STRUCTURE)


def _kept_at_contacts(
    stiffness: Any,
    modes: Modes,
    count: int,
    degrees: list[str],
    contacts: list[tuple[str, Any]],
    unit: str,
) -> str:
    if not contacts:
        return ""
    at = np.array([direction(one, degrees) for _, one in contacts])
    totals, residuals = flexibility(stiffness, modes, count, at)
    words, whole = "", list[str]()
    for (name, _), total, residual in zip(contacts, totals, residuals, strict=True):
        if 0 < total < np.inf and residual <= _WHOLE * total:
            whole.append(name)
            continue
        if math.isnan(residual):
            words += f" The flexibility left out at {name} isn't known: a rigid body moves there."
            continue
        share = f", {100 * (1 - residual / total):.4g} % of it kept" if 0 < total < np.inf else ""
        words += f" Static flexibility at {name}: {residual:.3g}{unit} left out{share}."
    if whole:
        words += f" Static flexibility at {listed(whole)}: 100 % of it kept."
    return words


def _moved(label: str, mass: Any, kept: Modes, moved: np.ndarray, unit: str) -> str:
    """The mass that moves with a base, in all and by mode."""
    load = mass @ moved
    total, masses = float(moved @ load), (kept.shapes.T @ load) ** 2
    largest = [i for i in np.argsort(-masses)[:_TOLD].tolist() if masses[i] > 5e-3 * total]
    parts = ", ".join(f"{100 * masses[i] / total:.3g} % in mode {i + 1}" for i in sorted(largest))
    return (
        f" Of the {total:.4g}{unit} that move with {label}, the modes hold "
        f"{100 * masses.sum() / total:.4g} %{': ' if parts else ''}{parts}."
    )


def _frequencies(angular: np.ndarray) -> str:
    """The lowest natural frequencies, as the end of a sentence: 0 of rigid bodies."""
    if not len(angular):
        return ""
    known = np.where(angular > RIGID * angular.max(), angular, 0.0) / (2 * math.pi)
    lowest = ", ".join(f"{one:.4g}" for one in known[:_TOLD])
    return f"; natural frequencies {lowest}{', ...' if len(angular) > _TOLD else ''} Hz"


def doubt(angular: np.ndarray) -> None:
    """Warn of natural frequencies that no structure has."""
    highest = angular.max(initial=0.0) / (2 * math.pi)
    elastic = angular[angular > RIGID * angular.max(initial=0.0)] / (2 * math.pi)
    if 0 < highest < _SWAPPED:
        _warn(
            f"the highest natural frequency of this structure is {highest:.3g} Hz. The mass comes "
            f"first, sl.structure(mass, stiffness, ...): with the two swapped the lowest would be "
            f"{1 / (4 * math.pi**2 * highest):.4g} Hz."
        )
    elif len(elastic) and not _USUAL[0] <= elastic.min() <= _USUAL[1]:
        _warn(
            f"the lowest natural frequency of this structure is {elastic.min():.3g} Hz. Are its "
            f"matrices in kg and N/m, or in other units that fit together?"
        )


def doubt_frequency(frequency: Any, used: bool) -> None:
    """Warn of a forcing frequency that no drive has."""
    if frequency is not None and not used:
        _warn(
            f"frequency = {shown(frequency)} isn't used, since nothing of this structure "
            f"oscillates with it. Give a drive that does, forces=[sl.Force(...)] or "
            f"base=sl.Base(...) with an amplitude, or leave frequency= out."
        )


def doubt_damping(damping: Any, modal: bool) -> None:
    """Warn of a damping matrix that feeds energy; it is that of modes or of degrees of freedom."""
    if damping is None:
        return
    symmetric = dense(damping + damping.T) / 2  # gyroscopic parts do no work
    lowest = float(np.linalg.eigvalsh(symmetric)[0])
    if lowest < -_NOTHING * abs(damping).max():
        _warn(
            f"damping has a negative eigenvalue, {lowest:.3g} "
            f"{'1/s among the modes' if modal else 'N*s/m'}: it feeds energy, and motions may grow "
            f"without end. A damping that takes energy is positive."
        )


def closed(
    contacts: list[tuple[str, Contact]], values: Mapping[str, float], degrees: list[str], unit: str
) -> str:
    """Sentences on the stops that touch where the structure stands without load.

    A rigid one is doubted: no motion can start there.

    Raises
    ------
    ParameterError
        If rigid stops of the two sides leave no room between them.
    """
    _check_room(contacts, values, degrees, unit)
    words = ""
    for label, contact in contacts:
        gap = values[f"{label}_gap"]
        if gap > 0:
            continue
        depth = from_si(-gap, unit)
        if gap == 0:
            words += f" Without load the structure touches {label}."
        elif contact.restitution is None:
            words += f" Without load the structure presses {depth} into {label}."
        else:
            words += f" Without load the structure stands {depth} beyond {label}, a rigid stop."
            place = from_si(gap if contact.side == "upper" else -gap, unit)
            _warn(
                f"{label}_gap = {from_si(gap, unit)}: without load the structure stands {depth} "
                f"beyond this rigid stop, so no motion starts from rest there. Give a start in "
                f'front of it, by a sensor of {contact.at} such as {{"tip": "{place}"}}; or '
                f"stiffness= in place of restitution=."
            )
    return words


def _check_room(
    contacts: list[tuple[str, Contact]], values: Mapping[str, float], degrees: list[str], unit: str
) -> None:
    """Raise a ParameterError where a rigid stop of one side lies beyond one of the other side."""
    rigid = [(label, one) for label, one in contacts if one.restitution is not None]
    faced = [
        (label, way if side == "upper" else -way)
        for label, one in rigid
        for way in [direction(one, degrees)]
        for side in sides(one)
    ]
    for number, (label, way) in enumerate(faced):
        for other, opposite in faced[number + 1 :]:
            room = values[f"{label}_gap"] + values[f"{other}_gap"]
            if room < 0 and np.array_equal(way, -opposite):
                raise ParameterError(
                    f"{label} and {other} are rigid stops of two sides, and overlap by "
                    f"{from_si(-room, unit)}: nothing fits between. One gap may be negative as far "
                    f"as the other is open."
                )


def doubt_stiff(label: str, stiffness: float, compliance: float, highest: float) -> None:
    """Warn of a spring that is rigid beside the structure.

    Parameters
    ----------
    label : str
        Of the contact.
    stiffness : float
        [N/m]
    compliance : float
        1/mass of the structure at the contact [1/kg].
    highest : float
        Highest angular frequency of the structure [rad/s].
    """
    angular = math.sqrt(max(stiffness * compliance, 0.0))
    if angular > _STIFF * highest > 0:
        _warn(
            f"{label}_stiffness = {stiffness:.3g} N/m: in contact the structure vibrates at "
            f"{angular / (2 * math.pi):.3g} Hz there, {angular / highest:.2g} times its highest "
            f"mode, so the force follows the modes that are kept. For a rigid stop write "
            f"restitution= in place of stiffness=."
        )


def _warn(words: str) -> None:
    warnings.warn(words, SaltusWarning, stacklevel=5)
