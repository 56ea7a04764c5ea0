"""Marks of compiled functions: ``kernel``, ``inner`` for inlined ones, ``entry`` for the one that
is called.

In plain Python they change nothing; codegen/lowering reads them.
"""

from __future__ import annotations

from typing import TypeVar

Function = TypeVar("Function")


def kernel(function: Function) -> Function:
    """Mark a function that is compiled."""
    return function


inner = entry = kernel
