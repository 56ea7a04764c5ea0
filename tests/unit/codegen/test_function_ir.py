"""Functions of heads as LLVM IR: what isn't translated is refused."""

from __future__ import annotations

import pytest

from saltus.codegen.expression_ir import UntranslatableError
from saltus.codegen.function_ir import Signature, function_ir
from saltus.codegen.head_text import functions_of
from saltus.codegen.interface import ARRAY, REAL


def translated(line):
    text = f"def jump(a, y):\n    b = a\n    if a > 0.0:\n        {line}\n    y[1] = b"
    return function_ir(
        functions_of(text)[1]["jump"], Signature((REAL, ARRAY), "void", ""), 1, {}, set(), {}
    )


def test_entries_of_arrays_may_not_be_written_under_a_condition():
    """Names are selected behind it; an entry would be written in any case."""
    assert "select" in translated("b = 1.0")
    for line in ("y[0] = 1.0", "y[0] += 1.0"):
        with pytest.raises(UntranslatableError, match="y"):
            translated(line)
