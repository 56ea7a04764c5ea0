"""The generated head of harmonic balance: forces with their slopes, gaps and their slopes."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.codegen.scalar import ScalarCode, indented
from saltus.language import expression as ex
from saltus.language.expression import Expr


def forces_text(
    entries: Sequence[Expr], gap_slopes: Sequence[Expr], gaps: Sequence[Expr],
    states: Sequence[str], parameters: Sequence[str],
) -> str:  # fmt: skip
    """The functions that kernels/harmonics asks for, as text.

    Parameters
    ----------
    entries : sequence of Expr
        Forces and slopes.
    gap_slopes : sequence of Expr
        Of each gap by each state, one after the other.
    gaps : sequence of Expr
        That are polynomials of the states, but for linear ones.
    states, parameters : sequence of str
        In their order.
    """
    functions = {"forces": entries, "gap_slopes": gap_slopes, "gap_values": gaps}
    return "\n".join(
        f"@kernel\ndef {name}(t, y, p, mode, out):\n{_body(roots, states, parameters)}\n"
        for name, roots in functions.items()
    )


def _body(roots: Sequence[Expr], states: Sequence[str], parameters: Sequence[str]) -> str:
    places = {ex.state(name): f"y[{i}]" for i, name in enumerate(states)}
    places |= {ex.parameter(name): f"p[{i}]" for i, name in enumerate(parameters)}
    places[ex.TIME] = "t"
    # what time alone decides isn't balanced: analysis/harmonics/balance.py
    switches: dict[ex.Relation, str] = {}
    code = ScalarCode(
        places.get, lambda guard: f"((mode >> {guard}) & 1) == 1", switch=switches.__getitem__
    )
    code.lines += [f"out[{i}] = {value}" for i, value in enumerate(code.values(roots))]
    return indented(code.lines)
