"""Read-only mappings of a System, whose errors say how to get other values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.errors import ParameterError, among


class Fixed(dict[str, Any]):
    """A read-only mapping. Copies of it are plain."""

    def _why(self, name: Any) -> ParameterError:
        raise NotImplementedError

    def __setitem__(self, name: Any, _: Any) -> None:
        raise self._why(name)

    def __delitem__(self, name: Any) -> None:
        raise self._why(name)

    def __ior__(self, _: Any) -> Any:  # type: ignore[misc]
        raise self._why(None)

    def update(self, *_: Any, **changes: Any) -> None:
        """Refuse."""
        raise self._why(next(iter(changes), None))

    def pop(self, name: Any, *_: Any) -> Any:
        """Refuse."""
        raise self._why(name)

    def setdefault(self, name: Any, *_: Any) -> Any:
        """Refuse."""
        raise self._why(name)

    def popitem(self) -> Any:
        """Refuse."""
        raise self._why(None)

    def clear(self) -> None:
        """Refuse."""
        raise self._why(None)

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)


class Values(Fixed):
    """Values of parameters."""

    def _why(self, name: Any) -> ParameterError:
        return no_change(name, self)


class Units(Fixed):
    """Units of states and parameters."""

    def _why(self, _name: Any) -> ParameterError:
        return ParameterError(
            "a System is never changed. Give units where its equation is made, "
            '@sl.system(units={"x": "m"}); a value may be written in any unit that fits.'
        )


def no_change(name: Any, values: Mapping[str, Any]) -> ParameterError:
    """The error for someone who sets a value of a System."""
    change = f"{name}=..." if among(name, values) else "..."
    return ParameterError(
        f"a System is never changed. Write system = system.with_values({change}), a copy with "
        f"other values."
    )
