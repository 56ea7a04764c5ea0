"""The jump of the tangent at a contact, generated: the saltation matrix S = I + (f_after -
f_before) n' / (n' f_before + g_t).

It is the identity where the force is continuous. Aizerman & Gantmakher, J. Mech. Appl. Math. 11
(1958); Leine & Nijmeijer (2004), section 7.4.
"""

from __future__ import annotations

from collections.abc import Callable

from saltus.codegen.clocks import Clocks
from saltus.codegen.scalar import ScalarCode, indented, parameter_leaf
from saltus.system import expression as ex
from saltus.system.derivatives import differentiate
from saltus.system.singular import SetAside, set_aside
from saltus.system.system import System
from saltus.system.tangent import first_column


def jump_function(system: System, clocks: Clocks) -> str:
    """``jump(t, y, p, h, before, after, g)``: multiply the tangent rows of y by S at a crossing of
    guard g, between two modes (bits).

    Does nothing for a system that carries no tangent. A crossing at zero rate makes the tangent
    infinite, as it is.
    """
    base = system.tangent_of
    if base is None or not base.guards:
        return "@kernel\ndef jump(t, y, p, h, before, after, g):\n    pass\n"
    size = len(base.states)
    # what has no derivative on the boundary is zero on it, and no jump
    aside = set_aside(base.field, base.guards)
    leaf = parameter_leaf(base, "y", clocks.value)
    lines = []
    for word in ("before", "after"):
        code = ScalarCode(leaf, side=_bit_of(word, aside), prefix=f"{word}_", switch=clocks.side)
        for i, value in enumerate(code.values(aside.field)):
            code.lines.append(f"rate_{word}_{i} = {value}")
        lines += code.lines
    lines += [f"leap_{i} = rate_after_{i} - rate_before_{i}" for i in range(size)]
    lines += [f"if {' and '.join(f'leap_{i} == 0.0' for i in range(size))}:", "    return"]
    lines += [f"n_{i} = 0.0" for i in range(size + 1)]
    for g, guard in enumerate(base.guards):
        code = ScalarCode(
            leaf, side=_bit_of("before", aside), prefix=f"gap{g}_", switch=clocks.side
        )
        entries = [
            differentiate(guard.gap, leaf) for leaf in (*map(ex.state, base.states), ex.TIME)
        ]
        for i, value in enumerate(code.values(entries)):
            code.lines.append(f"n_{i} = {value}")
        lines += [f"if g == {g}:", *("    " + line for line in code.lines)]
    lines.append(
        "closing = " + " + ".join([*(f"n_{i} * rate_before_{i}" for i in range(size)), f"n_{size}"])
    )
    given = ", ".join([*(f"leap_{i}, n_{i}" for i in range(size)), "closing"])
    lines += [f"jump_of_column(y[{j}:], {given})" for j in range(size)]
    column = [f"y[{i}]" for i in first_column(system)]
    leap = [
        f"along = ({' + '.join(f'n_{i} * {entry}' for i, entry in enumerate(column))}) / closing"
    ]
    leap += [f"{entry} += leap_{i} * along" for i, entry in enumerate(column)]
    return (
        f"@kernel\ndef jump_of_column(y, {given}):\n{indented(leap)}\n\n"
        f"@kernel\ndef jump(t, y, p, h, before, after, g):\n{indented(lines)}\n"
    )


def _bit_of(word: str, aside: SetAside) -> Callable[[int], str]:
    """Code for the side of a guard in a mode; beyond the guards, for the bits that set terms aside:
    those of the boundary crossed.
    """
    return lambda i: (
        f"(({word} >> {i}) & 1) == 1"
        if i < aside.first
        else f"g == {aside.guards[i - aside.first]}"
    )
