"""Newton's method stands once: who writes another one is told here."""

import ast
from pathlib import Path

import pytest

import saltus.analysis

ROOM = Path(saltus.analysis.__file__).parent
SOLVERS = {"solve", "lstsq", "pinv", "inv"}
#: Files that solve linear systems, and why.
WHY = {
    "solve/newton.py": "Newton's method",
    "solve/linear.py": "linear systems, some of which have no solution",
    "closed/capture.py": "norms in which a neighbourhood shrinks",
    "closed/field_zeros.py": "points around an equilibrium in such a norm",
    "inputs/sensed.py": "the state of least energy at which sensors read given values",
    "branches/criticality.py": "the Lyapunov coefficient of a Hopf point",
    "branches/codimension_two.py": "the quadratic part at a fold",
    "harmonics/signals.py": "dynamic stiffness",
    "fits/search.py": "the gain that the next linear step would bring",
    "fits/windows.py": "a Kalman filter, and least squares with joints between windows",
    "branches/forced_vibration.py": "the answer of a rigid body to a static force",
}


def solves(text: str) -> bool:
    """True where a linear system is solved in a text."""
    return "linalg" in text and any(
        isinstance(node, ast.Attribute)
        and node.attr in SOLVERS
        and isinstance(node.value, ast.Attribute)
        and node.value.attr == "linalg"
        for node in ast.walk(ast.parse(text))
    )


def test_linear_systems_are_solved_where_a_reason_is_written():
    found = {
        str(file.relative_to(ROOM))
        for file in ROOM.rglob("*.py")
        if solves(file.read_text(encoding="utf-8"))
    }
    assert found == set(WHY), "take saltus.analysis.solve.newton, or write down why not"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("step = -np.linalg.solve(matrix, residual)", True),
        ("step = scipy.linalg.lstsq(a, b)[0]", True),
        ("x = newton(equations, start, scale)", False),
        ("w = np.linalg.eigvals(matrix)", False),
    ],
)
def test_a_second_newton_would_be_seen(text, expected):
    assert solves(text) == expected
