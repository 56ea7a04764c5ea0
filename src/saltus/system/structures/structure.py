"""`structure`: a system from a mass, a damping and a stiffness matrix, with contacts and forces
given as data.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from saltus.arguments import checked
from saltus.contact.boundaries import numbers_of
from saltus.contact.contacts import renamed
from saltus.errors import ParameterError, SaltusWarning, among, must_be, shown
from saltus.system.structures import matrices, told
from saltus.system.structures.drives import FREQUENCY
from saltus.system.structures.equations import UNITS, Coordinates, Loads, traced
from saltus.system.structures.files import matrices_of
from saltus.system.structures.interfaces import seen_by_contacts
from saltus.system.structures.matrices import ASYMMETRY
from saltus.system.structures.parts import Base, Contact, Force, direction, parts, ways_of
from saltus.system.structures.reduction import Modes, modal_damping, modes_of, with_residuals
from saltus.system.structures.sensors import with_sensors
from saltus.system.system import System
from saltus.units import to_si

#: Most coordinates of a system: the compiled code grows with them.
MOST_COORDINATES = 128


#: Advice on arguments that a structure lacks or calls otherwise.
_ELSEWHERE = {
    **dict.fromkeys(("zeta", "xi", "loss_factor"), "Write damping_ratio=, such as \"2 %\"."),
    **dict.fromkeys(("n_modes", "nmodes", "modes_kept", "number"), "Write modes=."),
    **dict.fromkeys(("c", "C"), "Write damping=."),
    **dict.fromkeys(("k", "K"), "Write stiffness=."),
    **dict.fromkeys(("m", "M"), "Write mass=."),
    **dict.fromkeys(("dofs", "dof", "nodes", "labels", "states"), "Write names=."),
    **dict.fromkeys(("freq", "f", "forcing", "forced_at"), "Write frequency=."),
    **dict.fromkeys(("support", "ground", "excitation", "quake"),
        "Write base=sl.Base(direction, acceleration)."),
    **dict.fromkeys(("outputs", "output", "observers", "probes"),
        "Write sensors={\"tip\": \"x3\"}."),
}  # fmt: skip


@functools.partial(checked, elsewhere=_ELSEWHERE)
def structure(
    mass: Any,
    stiffness: Any = None,
    damping: Any = None,
    *,
    contacts: Sequence[Any] = (),
    forces: Sequence[Any] = (),
    base: Base | Sequence[Any] | Mapping[str, Any] | None = None,
    frequency: float | str | None = None,
    damping_ratio: Any = None,
    modes: int | None = None,
    residual: bool = False,
    names: Sequence[str] | str | None = None,
    unit: str = "m",
    name: str = "structure",
    source: str = "",
    sensors: Mapping[str, Any] | None = None,
) -> System:
    """A system of n degrees of freedom, from its matrices, with contacts and forces given as data.

    Its equation of motion is::

        mass x'' + damping x' + stiffness x = forces - contacts - mass direction acceleration

    Parameters
    ----------
    mass : array or SciPy sparse matrix, shape (n, n), or path
        Symmetric and positive definite [kg]. It is inverted once. Alone, the path of a file that
        holds all matrices: a ``.npz`` of NumPy or a ``.mat`` of MATLAB with M, K and, if you like,
        C (or mass, stiffness, damping) and ``names``.
    stiffness : array or sparse matrix, shape (n, n), or path
        [N/m] Each matrix may be a file of its own: Matrix Market's ``.mtx``, ``.npy``, or a
        ``.npz`` of SciPy's sparse matrices.
    damping : array or sparse matrix, shape (n, n), or path, optional
        [N*s/m] Default: none.
    contacts : sequence of Contact, or of mappings of its arguments
        Stops behind gaps, such as ``sl.Contact("x3", stiffness="1 MN/m", gap="1 mm")``, or
        ``sl.Contact("x3", restitution=0.7, gap="1 mm")`` of a rigid one.
    forces : sequence of Force, or of mappings of its arguments
        Harmonic forces, such as ``sl.Force("x1", "2 N", phase="90 deg")``, and functions of the
        time, ``sl.Force("x1", sl.recorded(times, values, "N"))``.
    base : Base, or a sequence of them, optional
        Acceleration of the base, such as ``sl.Base("z", sl.recorded(times, values, "g0"))``. The
        deflections are then relative to the base.
    frequency : float or str, optional
        Forcing frequency [Hz], ``"40 Hz"`` or ``"40 rad/s"``; needed with forces that oscillate. A
        structure with a force or a base that doesn't repeat has no forcing frequency: ``t_end=``
        ends its motion.
    damping_ratio : float, str or sequence, optional
        In place of ``damping``: the ratio of every mode, such as 0.02 or ``"2 %"``, or one each for
        the lowest of them.
    modes : int, optional
        Number of the lowest modes kept; the states are then their coordinates. Default: all
        degrees of freedom, as they are. ``modes=n`` loses nothing, and makes a full mass matrix
        quicker to compile.
    residual : bool
        Whether the static deflections that the kept modes miss under the forces of contacts and
        drives are coordinates too, one more for each of these: nothing of the static flexibility
        there is lost then, and of the dynamic little (MacNeal, Comput. Struct. 1 (1971) 581-601).
    names : sequence of str, or str
        Names of the degrees of freedom; default ``x1``, ``x2``, ... The velocity of ``x1`` is
        called ``v1``, that of any other name ``NAME_rate``.
    unit : {"m", "rad", ""}
        Unit of all degrees of freedom; ``""`` if they differ.
    name, source : str
        As of :func:`saltus.system`.
    sensors : mapping, optional
        Named outputs, which every result holds and every picture shows: a degree of freedom for its
        deflection, a pair of them for a stretch, ``sl.velocity("x3")``, ``sl.acceleration("x3")``,
        ``sl.contact_force("stop")``, or a function of the states as of
        :meth:`saltus.System.with_outputs`. Default, with ``modes=``: ``deflection at stop``,
        ``velocity at stop`` and ``force at stop`` of each contact ``stop``, since no one measures
        coordinates of modes; without contacts those of the points where forces act. ``{}``: none.

    Returns
    -------
    System
        States are the deflections, then their rates; those of modes are ``q1``, ``q2``, ... and
        ``q1_rate``, ... What a contact or force is made of is a parameter: ``stop_gap``, ``force``;
        so is the frequency. Each contact is a guard of its name, ``stop`` or, on two sides, ``stop
        lower`` and ``stop upper``. The description says what the kept modes carry of the static
        flexibility at each contact; so does :func:`saltus.structure_modes`.

    Raises
    ------
    ParameterError, UnitError
        If a matrix has a wrong shape, isn't finite, or the mass matrix isn't symmetric and positive
        definite; if a contact, force or sensor can't be used, or there are too many degrees of
        freedom.

    Notes
    -----
    Modes are those of the undamped structure without contacts, of unit modal mass. Numbers in the
    matrices have no units, so the units of the equations aren't checked.

    Examples
    --------
    >>> import numpy as np, saltus as sl
    >>> stiffness = 1e3 * np.array([[2, -1], [-1, 1]])
    >>> pair = sl.structure(
    ...     np.eye(2), stiffness, 2e-3 * stiffness, frequency="4 Hz",
    ...     contacts=[sl.Contact("x2", stiffness="50 kN/m", gap="1 mm")],
    ...     forces=[sl.Force("x1", "2 N")],
    ... )
    >>> pair.states, list(pair.values), pair.guards[0].name
    (('x1', 'x2', 'v1', 'v2'), ['stop_gap', 'stop_stiffness', 'force', 'frequency'], 'stop')
    """
    if not among(unit, UNITS):
        raise must_be("unit", "'m', 'rad' or ''", unit)
    reduced = modes is not None or damping_ratio is not None
    given = matrices_of(mass, stiffness, damping)
    mass = matrices.checked(given["mass"], "mass", symmetric=True)
    size = matrices.len_of(mass)
    stiffness = matrices.checked(given["stiffness"], "stiffness", size, symmetric=reduced)
    damping = given.get("damping")
    if damping is not None:
        damping = matrices.checked(damping, "damping", size)
        if damping_ratio is not None:
            raise ParameterError(
                "give a damping matrix, damping= or that of a file, or damping_ratio=, not both."
            )
    degrees = degree_names(given.get("names") if names is None else names, size)
    touching = parts(Contact, contacts, "stop", degrees)
    driving = parts(Force, forces, "force", degrees)
    bases = base if isinstance(base, list | tuple) else [base] if base is not None else []
    shaking = parts(Base, bases, "base", degrees)
    loads = Loads(
        touching,
        [*driving, *shaking],
        [direction(one, degrees) for _, one in driving]
        + [-(mass @ direction(one, degrees)) for _, one in shaking],
    )
    count = _count(modes, size)
    if count < size and abs(stiffness).max() == 0:
        raise ParameterError(
            "all entries of stiffness are zero, so all modes have the frequency 0, and none are "
            "the lowest. Give the stiffness matrix, or leave modes= out."
        )
    known, kept = modes_of(mass, stiffness, count) if reduced else None, count
    if residual:
        known = _completed(
            known if modes is not None else None, count, mass, stiffness, degrees, loads
        )
        count = len(known.angular)
    if known is not None and damping_ratio is not None:
        damping = _ratio(damping_ratio, known, count if modes is not None else size)
    if known is None or modes is None:
        if known is not None:  # the damping ratios of all modes, back among degrees of freedom
            shapes = matrices.dense(mass) @ known.shapes
            damping = shapes @ damping @ shapes.T
        moving = _physical(mass, stiffness, damping, degrees)
        words = told.unreduced(size, _angular(moving, stiffness))
    else:
        if damping is not None and damping_ratio is None:
            damping = modal_damping(damping, known, count)
        moving = _modal(known.lowest(count), damping)
        words = told.reduced(mass, stiffness, known, kept, count, degrees, loads, unit)
    words += told.travels(loads.drives, unit)
    angular = known.angular if known is not None else _angular(moving, stiffness)
    told.doubt(angular)
    told.doubt_damping(moving.damping, moving.transform is not None)
    made, sides = traced(moving, degrees, loads, frequency, unit=unit, name=name, source=source)
    for label, contact in touching:
        spring = made.values.get(f"{label}_stiffness")
        if spring is not None and contact.power in (None, 1):
            compliance = moving.compliance(moving.along(direction(contact, degrees)))
            told.doubt_stiff(label, spring, compliance, angular[:count].max(initial=0.0))
    words += told.closed(touching, made.values, degrees, unit)
    told.doubt_frequency(frequency, FREQUENCY in made.values)
    numbers = dict(zip(sides, numbers_of(sides.values(), made.guards), strict=True))
    named = {number: label for label, number in numbers.items() if number is not None}
    made = replace(made, guards=renamed(made.guards, named), description=words)
    made = replace(made, interfaces=seen_by_contacts(made, moving, degrees, loads, frequency, unit))
    return with_sensors(made, sensors, moving, degrees, loads, unit)


# -- coordinates -----------------------------------------------------------------------------------
def degree_names(names: Any, size: int) -> list[str]:
    """Names of the degrees of freedom. Raises ParameterError unless there is one for each, and none
    stands twice.
    """
    if names is None:
        return [f"x{i}" for i in range(1, size + 1)]
    given = names.tolist() if isinstance(names, np.ndarray) else names
    found = given.replace(",", " ").split() if isinstance(given, str) else given
    if not isinstance(found, list | tuple) or not all(isinstance(one, str) for one in found):
        raise must_be("names", f"the names of {size} degrees of freedom, as texts", names)
    if len(found) != size:
        raise ParameterError(
            f"names must name {size} degrees of freedom, not {len(found)}: {shown(names)}."
        )
    found = [str(one) for one in found]  # those of NumPy are texts of its own kind
    if len(set(found)) < size:
        twice = next(one for one in found if found.count(one) > 1)
        raise ParameterError(f"names: two degrees of freedom are called {twice!r}.")
    if "" in found:
        raise ParameterError(f"names: that of degree of freedom {found.index('') + 1} is empty.")
    return found


def rate_name(name: str) -> str:
    """The name of the velocity of a degree of freedom."""
    return f"v{name[1:]}" if name.startswith("x") else f"{name}_rate"


def _count(modes: Any, size: int) -> int:
    """Number of coordinates of the system, checked."""
    if modes is None:
        if size > MOST_COORDINATES:
            raise ParameterError(
                f"{size} degrees of freedom are too many to compile. Keep the lowest ones by "
                f"modes=, at most {MOST_COORDINATES}."
            )
        return size
    if isinstance(modes, bool) or not isinstance(modes, int | np.integer) or modes < 1:
        raise must_be("modes", "a whole number, 1 or more", modes)
    if modes > min(size, MOST_COORDINATES):
        raise ParameterError(f"modes = {modes}, but at most {min(size, MOST_COORDINATES)} can be.")
    return int(modes)


def _completed(
    modes: Modes | None, count: int, mass: Any, stiffness: Any, degrees: list[str], loads: Loads
) -> Modes:
    """The lowest modes, and the static deflections that they miss under contacts and drives."""
    if modes is None:
        raise ParameterError("residual=True is of the modes that are left out: give modes=.")
    ways = [way for _, contact in loads.contacts for way in ways_of(contact, degrees)]
    if not ways and not loads.along:
        return modes.lowest(count)
    return with_residuals(modes.lowest(count), mass, stiffness, [*ways, *loads.along])


def _physical(mass: Any, stiffness: Any, damping: Any, degrees: list[str]) -> Coordinates:
    inverse = matrices.inverse_of_mass(mass)
    return Coordinates(
        degrees, [rate_name(one) for one in degrees], inverse, stiffness, damping, None
    )


def _modal(modes: Modes, damping: Any) -> Coordinates:
    names = [f"q{i}" for i in range(1, len(modes.angular) + 1)]
    return Coordinates(
        names,
        [f"{one}_rate" for one in names],
        None,
        np.diag(modes.angular**2),
        damping,
        modes.shapes,
    )


def _angular(moving: Coordinates, stiffness: Any) -> np.ndarray:
    """Angular natural frequencies [rad/s], ascending; empty for a stiffness that isn't
    symmetric.
    """
    full = matrices.dense(stiffness)
    if moving.inverse is None or np.abs(full - full.T).max() > ASYMMETRY * np.abs(full).max():
        return np.zeros(0)
    squares = np.linalg.eigvals(moving.inverse @ full).real
    return np.asarray(np.sqrt(np.sort(np.maximum(squares, 0.0))))


def _ratio(ratio: Any, modes: Modes, count: int) -> np.ndarray:
    """The damping matrix of modes with given damping ratios."""
    try:
        several = isinstance(ratio, list | tuple)
        plain = np.asarray([_share(one) for one in ratio] if several else _share(ratio))
        if plain.dtype.kind == "b":
            raise TypeError(ratio)
        ratios = np.broadcast_to(plain.astype(float), count)
    except (TypeError, ValueError, OverflowError):
        raise must_be("damping_ratio", f"one number or {count} of them", ratio) from None
    if not (np.isfinite(ratios).all() and (ratios >= 0).all()):
        raise must_be("damping_ratio", "0 or more", ratio)
    if (ratios > 1).any():
        warnings.warn(
            f"damping_ratio = {ratios.max():g} is more than critical damping, 1: such modes don't "
            f"vibrate. Of per cent write '{ratios.max():g} %'.",
            SaltusWarning,
            stacklevel=4,
        )
    return np.diag(2 * ratios * modes.angular[:count])


def _share(ratio: Any) -> Any:
    """A ratio as a number; the unit of a text such as ``"2 %"`` is removed."""
    return to_si(ratio, "1", "damping_ratio") if isinstance(ratio, str) else ratio
