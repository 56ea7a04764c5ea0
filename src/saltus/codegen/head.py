"""The generated head of a method for one equation: the numbers and functions that the templates
leave open.
"""

from __future__ import annotations

from dataclasses import dataclass

Constant = int | float | bool | tuple[int | float, ...]


@dataclass(frozen=True)
class Head:
    """The numbers and functions that codegen/interface.py names.

    Attributes
    ----------
    constants : dict
        Sizes, flags and tables.
    functions : str
        Their text: plain Python, and what function_ir.py translates.
    """

    constants: dict[str, Constant]
    functions: str

    @property
    def text(self) -> str:
        """The whole head as Python, to be put above the templates."""
        return (
            "\n".join(f"{name} = {value!r}" for name, value in self.constants.items())
            + "\n\n"
            + self.functions
        )
