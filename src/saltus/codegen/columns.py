"""Lane code in two parts: shared code of all columns of a tangent, and code of one column, which
serves for each of them.

The columns of a tangent obey the same equations. Their coefficients - the series of the Jacobian
along the motion - are worked out once; the lines of one column are a function of their own, called
with the place where the next column begins.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

_VALUE = re.compile(r"\bs\d+\b")
#: A constant in all lanes: a load from a table, or a literal.
_CONSTANT = re.compile(r"(?!load\(y,)\w+\([^()]*\)")


class LaneCode:
    """Assignments and stores of straight-line lane code, in order.

    What is made of a value of the column belongs to the column. Its code reads shared values from
    rows of ``shared``; constants stand in it themselves.

    Attributes
    ----------
    column : list of str
        The lines of one column.
    handed : dict
        Names of the shared values that they read, and the row of each.
    """

    def __init__(self) -> None:
        self.column: list[str] = []
        self.handed: dict[str, int] = {}
        self._shared: list[tuple[str, str]] = []  # name of the value, or "", and code
        self._constants: dict[str, str] = {}
        self._of_column: set[str] = set()

    def assign(self, names: str, code: str, of_column: bool = False) -> None:
        """Add ``names = code``, with one name or two. It belongs to the column if ``of_column``, or
        if it reads a value that does.
        """
        if of_column or not self._of_column.isdisjoint(_VALUE.findall(code)):
            self._of_column.update(names.split(", "))
            self.column.append(f"{names} = {code if of_column else self._in_column(code)}")
            return
        self._shared.append((names, code))
        if not _VALUE.search(code) and _CONSTANT.fullmatch(code):
            self._constants[names] = code

    def do(self, code: str, of_column: bool = False) -> None:
        """Add a statement without a value."""
        if of_column:
            self.column.append(self._in_column(code))
        else:
            self._shared.append(("", code))

    def shared(self, first: int = 0) -> Iterator[str]:
        """The shared lines; values for the columns are stored to the rows of ``work`` from
        ``first`` on.
        """
        for names, code in self._shared:
            yield f"{names} = {code}" if names else code
            for name in names.split(", "):
                if name in self.handed:
                    yield f"store(work, {first + self.handed[name]}, {name})"

    def _in_column(self, code: str) -> str:
        return _VALUE.sub(
            lambda name: name[0] if name[0] in self._of_column else self._read(name[0]), code
        )

    def _read(self, name: str) -> str:
        if name in self._constants:
            return self._constants[name]
        return f"load(shared, {self.handed.setdefault(name, len(self.handed))}, LANES)"
