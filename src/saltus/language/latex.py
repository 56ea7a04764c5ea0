"""Expressions as LaTeX."""

from __future__ import annotations

import re

from saltus.language.expression import Condition, Expr
from saltus.language.operations import ATOM, ELEMENTARY, FUNCTIONS, PRODUCT
from saltus.language.text import PI_MULTIPLES, Writer

_GREEK = frozenset([
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda",
    "mu", "nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega", "Gamma", "Delta",
    "Theta", "Lambda", "Xi", "Pi", "Sigma", "Phi", "Psi", "Omega",
])  # fmt: skip


class LatexWriter(Writer):
    """Writes expressions as LaTeX math."""

    name_from = 200
    greater, less = r" \gt ", r" \lt "

    def joint(self, both: bool) -> str:
        """The word between two conditions."""
        return r" \;\text{and}\; " if both else r" \;\text{or}\; "

    def name(self, name: str) -> str:
        """The symbol of a name."""
        return latex_name(name)

    def number(self, value: float) -> tuple[str, int]:
        """A constant, powers of ten written out."""
        if value in PI_MULTIPLES:
            return {"pi": r"\pi", "2*pi": r"2 \pi", "4*pi": r"4 \pi", "pi/2": r"\frac{\pi}{2}"}[
                PI_MULTIPLES[value]
            ], ATOM
        text, strength = super().number(value)
        mantissa, _, exponent = text.partition("e")
        return (
            (text, strength)
            if not exponent
            else (
                rf"{mantissa} \cdot "
                rf"10^{{{exponent}}}",
                min(strength, PRODUCT),
            )
        )

    def infix(self, op: str, left: Expr, right: Expr) -> tuple[str, int]:
        """An infix operation: quotients as fractions, products without a sign."""
        if op == "div":
            return rf"\frac{{{self.text(left)}}}{{{self.text(right)}}}", ATOM
        if op == "mul":
            return (
                rf"{self.part(left, PRODUCT)} \, "
                rf"{self.part(right, PRODUCT, after_sign=True)}"
            ), PRODUCT
        return super().infix(op, left, right)

    def power(self, base: Expr, exponent: Expr) -> str:
        """A power as a superscript."""
        text = self.part(base, ATOM)
        braced = text if base.op in ("state", "param", "time") else f"{{{text}}}"
        return f"{braced}^{{{self.text(exponent)}}}"

    def call(self, function: str, *arguments: Expr) -> str:
        """A function or a root."""
        inner = ", ".join(map(self.text, arguments))
        if function == "sqrt":
            return rf"\sqrt{{{inner}}}"
        if function not in ELEMENTARY:
            return latex_name(function) + self.parentheses(inner)
        return rf"\{FUNCTIONS[function].latex or function}{self.parentheses(inner)}"

    def piece(self, value: Expr, condition: Condition) -> str:
        """One line of cases."""
        return rf"{self.text(value)} & \text{{if }} {self.condition(condition)} \\"

    def piecewise(self, pieces: list[str], otherwise: Expr) -> str:
        """A piecewise expression as cases."""
        return (
            rf"\begin{{cases}} {' '.join(pieces)} {self.text(otherwise)} & \text{{otherwise}} "
            rf"\end{{cases}}"
        )

    def parentheses(self, text: str) -> str:
        """Add parentheses that grow."""
        return rf"\left({text}\right)"

    def line(self, name: str, text: str) -> str:
        """One aligned line."""
        return f"{name} &= {text}"


def latex_name(name: str) -> str:
    r"""A name as LaTeX: one letter in italics, Greek letters by name, ``m_1`` with a subscript,
    words upright.
    """
    head, _, rest = name.partition("_")
    letters = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    if letters is None or not (len(letters[1]) == 1 or letters[1] in _GREEK) or "_" in rest:
        return (
            r"\mathrm{"
            + "".join(
                c if c.isalnum() and c.isascii() else r"\_" if c == "_" else rf"\text{{{c}}}"
                for c in name
            )
            + "}"
        )
    symbol = letters[1] if len(letters[1]) == 1 else "\\" + letters[1]
    below = rest or letters[2]
    if letters[2] and rest:  # m2_b
        return rf"{symbol}_{{\mathrm{{{letters[2]} {rest}}}}}"
    if not below:
        return symbol
    return f"{symbol}_{{{below if below.isdigit() or len(below) == 1 else latex_name(below)}}}"
