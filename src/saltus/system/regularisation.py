"""Regularised contacts: a system whose boundaries are blended over a width in place of being
located.

Each side of a guard has a weight, the step H(gap/width) or one minus it, and a piece counts with
the weight of its condition. Every analysis then works on the system as on any other, by any method.
What it costs is a force that is wrong near the boundary, by a part of width*stiffness.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from saltus.contact.blend import STEPS, Step, blended
from saltus.contact.guards import is_hold
from saltus.contact.reduction import free_field
from saltus.contact.singular import set_aside
from saltus.errors import ParameterError, TraceError, among, nearest, shown, unknown
from saltus.language import expression as ex
from saltus.language.names import why_no_name
from saltus.system import checks
from saltus.system.guard_units import gap_units
from saltus.system.named_outputs import NO_OUTPUTS
from saltus.system.outputs import with_formula
from saltus.system.read_off import joined
from saltus.system.system import System
from saltus.units import coherent_unit

#: Argument, and its negative, at which a user's law is tried.
_FAR = 100.0
#: Largest distance from 0 and 1 there: arctan is off by 0.003.
_NEAR = 0.02


def regularise(
    system: System,
    law: str | Callable[[Any], Any] = "tanh",
    *,
    width: float | str | Mapping[str, float | str],
) -> System:
    """Regularise a system: at each boundary the pieces are blended over a width.

    A piece that holds where ``gap > 0`` is multiplied by a smoothed step ``H(gap/width)``, the
    other one by ``1 - H``; a weight of joined conditions is the product of theirs. A spring behind
    a gap with ``law="tanh"`` is ``k*d*(1 + tanh(d/width))/2`` of its depth d. Comparisons of time
    stay as they are: their instants are known. Friction becomes a force of the sliding velocity:
    it creeps where it stuck, and a static limit above it is left out.

    ==============  ============================  ===============================================
    law             H(u)                          largest error of a spring's force / (k*width)
    ==============  ============================  ===============================================
    ``tanh``        (1 + tanh u)/2                0.13923
    ``sigmoid``     1/(1 + exp(-u))               0.27846
    ``polynomial``  (2 + 3u - u**3)/4 on [-1, 1]  0.08702
    ``rational``    (1 + u/sqrt(1 + u**2))/2      0.15014
    ``arctan``      1/2 + atan(u)/pi              0.31831, reached far from the boundary
    ==============  ============================  ===============================================

    Parameters
    ----------
    system : System
        Equations with boundaries.
    law : str or callable
        A name from the table, or a function of ``u = gap/width`` with the values 0 far below 0 and
        1 far above, made of functions such as :func:`saltus.exp`. The polynomial has a continuous
        slope, and two boundaries of its own for each that it replaces.
    width : float, str, or a mapping of str to them
        Width of the blend [unit of the gap], > 0; one for all boundaries, or one each by the
        guard's name. Boundaries that a mapping doesn't name stay, and are located as before.

    Returns
    -------
    System
        It has one more parameter, ``width``, or one for each entry of a mapping, such as
        ``width_upper_gap``: widths can be swept, and another one compiles nothing.

    Raises
    ------
    ParameterError, UnitError
        If the system has no boundary or one at which the state jumps, or a width, law or name can't
        be used.
    TraceError
        If a piece has no values on the other side of its boundary, as ``depth**1.5`` has none.

    Notes
    -----
    Smoothing functions for clearances, tanh and arctan among them, are compared by Kim, Rook &
    Singh 2003, J. Sound Vib. 263, 665, and by Saunders et al. 2021, Nonlinear Dyn. The blend is a
    convex one, ``a*H + b*(1 - H)``: for a force on both sides of a clearance it differs from the
    sum of two blended springs, as some publications have it, where both blends are felt, by an
    exponentially small force for tanh.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    >>> smooth = sl.regularise(rig, "tanh", width="1 um")
    >>> len(smooth.guards), smooth.parameter_text("width")
    (0, '1 µm')
    """
    if not isinstance(system, System):
        raise ParameterError(f"sl.regularise takes a System, not {shown(system)}.")
    if not system.guards:
        raise ParameterError(f"{system.name} has no boundary: there is nothing to regularise.")
    step = _step(law)
    laws = [guard.law for guard in system.guards]
    system = _without_laws(system)
    named = _names(system, width)
    static = [
        number
        for number, law in enumerate(laws)
        if law is not None and law.limit is not None and law.limit is not ex.constant(1.0)
    ]
    if kept := [system.guards[number].name for number in static if number not in named]:
        raise ParameterError(
            f"the friction at {kept[0]!r} has a static limit, which only its own law keeps. Give "
            f"it a width too."
        )
    parameters, values, units = _parameters(system, named)
    _check_both_sides(system, parameters)
    called = law if isinstance(law, str) else getattr(law, "__name__", "law").strip("<>")
    try:
        field, guards, formulas = blended(
            system.field,
            system.guards,
            system.states,
            step,
            parameters,
            system.units,
            (system.outputs.formulas, system.outputs.guards),
        )
    except TraceError as error:
        raise TraceError(f"{system.name}, regularised: ", error) from error
    slips = " Friction slips only: its static limit is left out." if static else ""
    description = (
        f"Regularised: {called} over {', '.join(values)} in place of the boundaries "
        f"{', '.join(system.guards[number].name for number in parameters)}.{slips}"
    )
    smooth = replace(
        system,
        name=f"{system.name} regularised by {called}",
        description=f"{system.description}\n\n{description}".strip(),
        field=field,
        guards=guards,
        values={**system.values, **values},
        units={**system.units, **units},
        outputs=NO_OUTPUTS,
    )
    old, new = system.outputs, replace(NO_OUTPUTS, first=system.outputs.first)
    for name, unit, formula in zip(old.names, old.units, formulas, strict=True):
        new = with_formula(smooth, new, name, *joined(formula, smooth, new), unit)
    return replace(smooth, outputs=new) if len(new) else smooth


def _without_laws(system: System) -> System:
    """The system with friction that only slips: nothing is held. Raises a ParameterError if the
    state jumps at a contact.
    """
    for guard in system.guards:
        if guard.law is not None and guard.law.reset:
            raise ParameterError(
                f"{system.name}: at {guard.name!r} the state jumps, and nothing smooth stands for "
                f"that. Write the contact as a stiff spring and a damper."
            )
    guards, outputs = system.guards, system.outputs
    left = tuple(guard for guard in guards if not is_hold(guard))
    gaps = free_field([guard.gap for guard in outputs.guards], guards)
    formulas, every = replace(
        outputs,
        formulas=free_field(outputs.formulas, guards),
        guards=tuple(replace(one, gap=gap) for one, gap in zip(outputs.guards, gaps, strict=True)),
    ).behind(left)
    return replace(
        system,
        field=free_field(system.field, guards),
        guards=left,
        outputs=replace(outputs, formulas=formulas, guards=every[len(left) :], after=len(left)),
    )


# -- arguments -------------------------------------------------------------------------------------
def _step(law: Any) -> Step:
    """The smoothed step of a law, checked."""
    if among(law, STEPS):
        return STEPS[law]
    if not callable(law):
        raise ParameterError(
            f"sl.regularise has no law {shown(law)}. {nearest(law, STEPS)} Or give a "
            f"function of gap/width."
        )
    low, high = law(-_FAR), law(_FAR)
    for value, wanted in ((low, 0.0), (high, 1.0)):
        if not isinstance(value, int | float) or not abs(value - wanted) < _NEAR:
            raise ParameterError(
                f"a law of sl.regularise is a step from 0 to 1, but this one is {shown(low)} at "
                f"gap/width = -{_FAR:g} and {shown(high)} at {_FAR:g}."
            )
    return lambda gap, width: law(gap / width)


def _names(system: System, width: Any) -> dict[int, Any]:
    """The width asked for by the number of its guard."""
    if not isinstance(width, Mapping):
        return dict.fromkeys(range(len(system.guards)), width)
    known = [guard.name for guard in system.guards]
    for name in width:
        if not among(name, known):
            raise unknown(f"{system.name} has no boundary", name, known)
    if not width:
        raise ParameterError("width={} names no boundary: there is nothing to regularise.")
    return {known.index(name): value for name, value in width.items()}


def _parameters(
    system: System, widths: Mapping[int, Any]
) -> tuple[dict[int, str], dict[str, float], dict[str, str]]:
    """Name of the width of each guard; values and units of these parameters."""
    in_units = gap_units(system)
    shared = len(set(map(id, widths.values()))) == 1 and len(widths) == len(system.guards)
    known = sorted({in_units[number] for number in widths} - {""})
    if shared and len(known) > 1:
        guards = [guard.name for guard in system.guards]
        raise ParameterError(
            f"the boundaries of {system.name} are in {' and '.join(known)}: one width can't be "
            f"both. Give each its own, width={{{guards[0]!r}: ..., {guards[-1]!r}: ...}}."
        )
    names: dict[int, str] = {}
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    for number, value in widths.items():
        if shared and names:
            names[number] = next(iter(values))
            continue
        name = _free_name(system, values, None if shared else system.guards[number].name)
        unit = (known or [""])[0] if shared else in_units[number]
        if not unit and isinstance(value, str):
            unit = coherent_unit(value, name)
        names[number], units[name] = name, unit
        values[name] = checks.resolve_one(name, value, unit, None)
        if values[name] <= 0:
            raise ParameterError(f"{name} = {values[name]:g} must be positive.")
    return names, values, units


def _free_name(system: System, others: Mapping[str, float], guard: str | None) -> str:
    """A name for the width of a guard, or for that of all."""
    name = "width" if guard is None else "width_" + re.sub(r"\W+", "_", guard).strip("_")
    if why_no_name(name) is not None:
        name = "width"
    taken = {*system.states, *system.values, *others}
    free, count = name, 1
    while free in taken:
        count += 1
        free = f"{name}_{count}"
    return free


def _check_both_sides(system: System, smoothed: Mapping[int, str]) -> None:
    """Raise a TraceError if a piece isn't defined beyond a boundary that is to be blended."""
    for number in set_aside(system.field, system.guards).guards:
        if number in smoothed:
            name = system.guards[number].name
            others = [guard.name for guard in system.guards if guard.name != name]
            way = f"width={{{others[0]!r}: ...}} leaves it as it is" if others else "leave it so"
            raise TraceError(
                f"{system.name}: on the boundary {name!r} a law begins with a root or a power "
                f"that isn't whole, such as depth**1.5, and has no values on the other side to "
                f"blend with. Such a law is continuous as it stands: {way}."
            )
