"""The System: equations with contacts, and values for their parameters."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.contact.singular import is_steep
from saltus.errors import ParameterError, among, nearest, shown, unknown
from saltus.language.derivatives import gradients
from saltus.language.expression import Expr
from saltus.system import checks, serial
from saltus.system.display import equation_lines, system_html, system_text
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.fixed import Units, Values, no_change
from saltus.system.modes import field
from saltus.system.outputs import with_more
from saltus.system.periodic import check_periodic
from saltus.units import from_si


@dataclass(frozen=True, eq=False, repr=False)
class System(EquationsOfMotion):
    """Equations of motion with contacts. Made by :func:`saltus.system`, not by hand; never changed,
    only copied.

    Attributes
    ----------
    name, description, source : str
        Name, description, publication.
    states : tuple of str
        Names of the states.
    field : tuple of Expr
        Time derivative of each state [SI per second]. Conditions hold bits: see ``guards``.
    guards : tuple of Guard
        The boundaries at which the equations change.
    values : mapping of str to float
        Parameter values [SI]; read-only.
    units : mapping of str to str
        Coherent SI unit of each state and parameter; ``""`` if not declared, ``"1"`` for a plain
        number; read-only.
    forced_at : str or None
        The parameter that holds the forcing frequency, in Hz or rad/s as its unit says. None for a
        system without a period.
    tangent_of : System or None
        The system whose variational equations this one carries (see tangent.py); None for any
        other.
    tangent_by : tuple of str
        The parameters with respect to which it carries the derivative of the state as well.
    outputs : NamedOutputs
        Named functions of the motion, which results hold besides the states (see
        :meth:`with_outputs`).
    interfaces : Interfaces or None
        Of a structure with spring stops: its contacts and the linear structure between them, for
        methods that ask for no more (see structures/interfaces.py).
    made : int
        How many of the last states elements with a memory have brought (see contact/memory.py); a
        start that doesn't give them is zero.
    """

    tangent_of: System | None = None
    interfaces: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", Values(self.values))
        object.__setattr__(self, "units", Units(self.units))
        for name, value in self.values.items():
            checks.check_range(name, value, self.forced_at)
        checks.check_guards(self.name, len(self.guards))
        checks.check_values(self, self.values)
        check_periodic(self)

    # -- values ------------------------------------------------------------------------------------
    def with_values(self, *unnamed: Any, **values: Any) -> System:
        """The same equations with other parameter values. Nothing is traced or compiled again.

        Parameters
        ----------
        *unnamed
            None: what stands here is answered by how to write it.
        **values : float or str
            By parameter name: a number in SI, or text with a unit, such as ``contact_stiffness="70
            kN/m"``.

        Raises
        ------
        ParameterError
            If a name is unknown, a value has none, or it isn't a finite number in the parameter's
            range.
        UnitError
            If a text value has the wrong unit.
        """
        if unnamed:
            name = next(iter(self.values), "name")
            raise ParameterError(
                f"with_values takes values by name, and {shown(unnamed[0])} has "
                f"none. Write with_values({name}=...)."
            )
        new = {
            name: checks.resolve_one(self._known(name), value, self.units[name], self.forced_at)
            for name, value in values.items()
        }
        if not new:
            return self
        copy = replace(self, values={**self.values, **new})
        object.__setattr__(copy, "_origin", self.origin)
        return copy

    @property
    def origin(self) -> System:
        """The system that this one copies with other values, or itself; it holds everything that
        depends on the equations alone.
        """
        origin: System = vars(self).get("_origin", self)
        return origin

    def with_outputs(self, outputs: Mapping[str, Any]) -> System:
        """The same equations with named outputs: sensors, forces, accelerations, whatever is read
        off the motion. Every function then gives them besides the states. Nothing is compiled
        again.

        Parameters
        ----------
        outputs : mapping of str to callable, or to (callable, unit)
            Functions of (t, states, parameters), arguments found by name: ``{"tip": lambda q1, q2:
            0.3 * q1 - 0.1 * q2, "spring force": (lambda x, k: k * x, "N")}``. ``*q`` takes the
            states ``q1``, ``q2``, ...: ``lambda *q: row @ q``. One may use those before it. They
            come behind the outputs that the system has.

        Raises
        ------
        ParameterError
            If a name is taken or can't be one, or there are too many.
        UnitError
            If a unit isn't that of its formula.
        TraceError
            If a function can't be traced, or doesn't repeat with the forcing.
        """
        return replace(self, outputs=with_more(self, outputs))

    def resolve(self, name: str, value: Any) -> Any:
        """A value for a parameter, in SI and checked; the system itself stays as it is.

        Parameters
        ----------
        name : str
            A parameter.
        value : float or str, or a list or array of them
            Numbers in SI, or text with a unit.

        Returns
        -------
        float, or ndarray of float64 of the shape of the array

        Raises
        ------
        ParameterError, UnitError
            As :meth:`with_values`.
        """
        return checks.resolve(self._known(name), value, self.units[name], self.forced_at)

    def _known(self, name: str) -> str:
        """The name of a parameter, checked."""
        if not among(name, self.values):
            raise unknown(f"{self.name} has no parameter", name, self.values)
        return name

    # -- equations ---------------------------------------------------------------------------------
    @functools.cached_property
    def jacobian(self) -> tuple[tuple[Expr, ...], ...]:
        """Derivative of each entry of the field (row) with respect to each state (column), in a
        frozen mode.
        """
        return gradients(self.field, self.states)

    @functools.cached_property
    def is_steep(self) -> bool:
        """True if an entry of the Jacobian is infinite where a contact begins, as that of
        ``depth**0.25``: derivatives of the flow are differences then.
        """
        if self.origin is not self:
            return self.origin.is_steep
        return is_steep((entry for row in self.jacobian for entry in row), self.guards)

    @functools.cached_property
    def guard_gradients(self) -> tuple[tuple[Expr, ...], ...]:
        """Derivative of each gap (row) with respect to each state (column), in a frozen mode."""
        return gradients([guard.gap for guard in self.guards], self.states)

    def rhs(self, t: Any, y: Any) -> np.ndarray:
        """The right-hand side as a plain function: time derivatives of the states, by NumPy.

        For other integrators to be held against: ``scipy.integrate.solve_ivp(rig.rhs, (0, 1),
        y0)``. It knows no modes: which piece holds is read off the state, and no contact is
        located. Trajectories of saltus are computed by generated code, some thousand times faster.

        Parameters
        ----------
        t : float or array
            Time [s].
        y : array, shape (states, ...)
            The states, in their order [SI].

        Returns
        -------
        ndarray, shape (states, ...)
            [SI per second].

        Raises
        ------
        ParameterError
            If ``t`` or ``y`` holds something else than numbers, their shapes don't fit, or ``y``
            has another number of states.
        """
        return field(self, *checks.point(self, t, y))

    def equations(self) -> list[str]:
        """The equations as text, one line each; long parts that are used twice come
        first, named.
        """
        return list(self.origin._lines)

    @functools.cached_property
    def _lines(self) -> list[str]:
        return equation_lines(self)

    def fingerprint(self) -> str:
        """Hash of the equations (64 hexadecimal digits): the same for other values, another name
        and in another process.
        """
        return self.origin._fingerprint

    @functools.cached_property
    def _fingerprint(self) -> str:
        return serial.fingerprint(self)

    # -- units and display -------------------------------------------------------------------------
    def state_unit(self, name: str) -> str:
        """Unit of a state; ``""`` if not declared. Raises ParameterError for an unknown state."""
        if not among(name, self.states):
            raise unknown(f"{self.name} has no state", name, self.states)
        return self.units[name]

    def parameter_text(self, name: str) -> str:
        """A parameter's value as people write it, such as ``0.4 mm``. Raises ParameterError for an
        unknown parameter.
        """
        return from_si(self.values[self._known(name)], self.units[name])

    def __repr__(self) -> str:
        return system_text(self)

    def _repr_html_(self) -> str:
        return system_html(self)

    # -- data --------------------------------------------------------------------------------------
    def to_dict(self) -> dict[str, Any]:
        """The system as JSON-able data, which :meth:`from_dict` reads back to the last bit."""
        return serial.to_dict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> System:
        """A system from :meth:`to_dict`'s data. No code is run. Raises SaltusError if the data is
        damaged or of another version.
        """
        return cls(**serial.arguments(data))

    def __reduce__(self) -> tuple[Any, ...]:
        return System.from_dict, (self.to_dict(),)

    # -- misuse ------------------------------------------------------------------------------------
    def __call__(self, *_: Any, **__: Any) -> Any:
        """Refuse: a System is no function. Raises ParameterError."""
        raise ParameterError(
            f"{self.name} is a System, not a function. Run it with sl.simulate({self.name}, ...); "
            f"other values are {self.name}.with_values(...)."
        )

    def __getitem__(self, name: Any) -> Any:
        """Refuse: a System has no items. Raises ParameterError."""
        raise ParameterError(f"a System has no items: {self._instead(name)}")

    def __setitem__(self, name: Any, _: Any) -> None:
        """Refuse: a System is never changed. Raises ParameterError."""
        raise ParameterError(f"a System is never changed: {self._instead(name)}")

    def __getattr__(self, name: str) -> Any:
        """Refuse: parameters and states aren't attributes. Raises AttributeError."""
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(f"a System has no attribute {shown(name)}: {self._instead(name)}")

    def _instead(self, name: Any) -> str:
        """Advice about a parameter or a state by its name."""
        if among(name, self.values):
            return (
                f"{self.name}.values[{name!r}] is the value of a parameter, "
                f"{self.name}.with_values({name}=...) a copy with another one."
            )
        if among(name, self.states):
            return (
                f"{shown(name)} is a state. Its motion is sl.simulate({self.name}, ...)[{name!r}]."
            )
        if among(name, self.outputs.names):
            return f"{shown(name)} is an output: sl.simulate({self.name}, ...)[{name!r}]."
        if among(name, _DONE_ELSEWHERE):
            return f"write {_DONE_ELSEWHERE[name].format(self.name)}."
        return (
            f"its parameters are in {self.name}.values, its states in {self.name}.states. "
            f"{nearest(name, [*self.values, *self.states])}"
        )


#: Names that people try on a System, and the functions that do it.
_DONE_ELSEWHERE = {
    **dict.fromkeys(("simulate", "solve", "run", "integrate", "compute"), "sl.simulate({}, ...)"),
    **dict.fromkeys(("copy", "set", "update", "replace"), "{}.with_values(name=...)"),
    **dict.fromkeys(("parameters", "params", "pars", "p"), "{}.values"),
    **dict.fromkeys(("plot", "show", "draw"), "sl.plot.phase(sl.simulate({}, ...))"),
    **dict.fromkeys(("f", "fun", "field_at"), "{}.rhs(t, y)"),
}


def _refuse_change(self: System, name: str, _value: Any) -> None:
    raise no_change(name, self.values)


System.__setattr__ = _refuse_change  # type: ignore[assignment]  # in place of dataclass's own refusal, which doesn't say what to do
