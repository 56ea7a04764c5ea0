"""Generated scalar code for the jump of the tangent at a contact: the saltation matrix.

``S = I + (f_after - f_before) g_y / (g_y f_before + g_t)``: identity where the force is continuous. Aizerman & Gantmakher (1958); Leine &
Nijmeijer (2004), section 7.4.
"""

from __future__ import annotations

from saltus.codegen.scalar import ScalarCode
from saltus.codegen.text import indented, parameter_leaf
from saltus.system import expression as ex
from saltus.system.derivatives import differentiate
from saltus.system.system import System


def saltation_functions(system: System) -> str:
    """``field_in(t, y, p, side, out)`` and ``gap_gradient(t, y, p, side, g, out)`` (time derivative last) of the plain system, in a mode."""
    field = ScalarCode(parameter_leaf(system, "y"), side=lambda i: f"(side[{i}] > 0.0)")
    for i, value in enumerate(field.values(system.field)):
        field.lines.append(f"out[{i}] = {value}")
    gradients = []
    for g, guard in enumerate(system.guards):
        code = ScalarCode(parameter_leaf(system, "y"), side=lambda i: f"(side[{i}] > 0.0)", prefix=f"g{g}_")
        entries = [differentiate(guard.gap, ex.state(name)) for name in system.states] + [differentiate(guard.gap, ex.TIME)]
        for i, value in enumerate(code.values(entries)):
            code.lines.append(f"out[{i}] = {value}")
        gradients += [f"if g == {g}:", *("    " + line for line in code.lines)]
    return (
        f"@kernel\ndef field_in(t, y, p, side, out):\n{indented(field.lines)}\n\n\n"
        f"@kernel\ndef gap_gradient(t, y, p, side, g, out):\n{indented(gradients)}\n"
    )
