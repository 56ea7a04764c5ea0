"""That each point of a closed motion leads to the next is stated once: who asks a map for its
derivative elsewhere says what for.
"""

import ast
from pathlib import Path

import pytest

import saltus.analysis

ROOM = Path(saltus.analysis.__file__).parent
#: Files that ask for the derivative of a map, and why. Branches have parameters among their
#: unknowns: see branches/shooting.py.
WHY = {
    "closed/shooting.py": "the equations of closed motions",
    "closed/orbits.py": "multipliers of attracting orbits",
    "closed/all_orbits.py": "multipliers of orbits of many points",
    "closed/cycles.py": "multipliers of attracting limit cycles",
    "closed/all_cycles.py": "multipliers of limit cycles of many points",
    "closed/capture.py": "norms in which a neighbourhood shrinks",
    "attractors/edge.py": "the direction that leaves an orbit on the boundary",
    "attractors/families.py": "the direction in which nothing grows or dies out",
    "attractors/growth.py": "growth of deviations",
    "lyapunov/segments.py": "growth of deviations",
    "lyapunov/spectrum.py": "exponents on an orbit",
    "methods/compare_methods.py": "compiles before time is taken",
}


def differentiates(text: str) -> bool:
    """Whether a map is asked for its derivative after some iterates."""
    return ".tangent(" in text and any(
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "tangent"
        and len(node.args) > 1
        for node in ast.walk(ast.parse(text))
    )


def test_maps_are_differentiated_where_a_reason_is_written():
    found = {
        str(file.relative_to(ROOM))
        for file in ROOM.rglob("*.py")
        if differentiates(file.read_text(encoding="utf-8"))
    }
    rest = {name for name in found if not name.startswith("branches/")}
    assert rest == set(WHY), "take saltus.analysis.closed.shooting, or write down why not"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("end, matrix = map_.rows(rows).tangent(x, n[rows])", True),
        ("away = leg.tangent(z)", False),
        ("residual, derivative, ends = guess.shots()", False),
    ],
)
def test_a_second_statement_would_be_seen(text, expected):
    assert differentiates(text) == expected
