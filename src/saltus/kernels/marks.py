"""Marks of the functions that are compiled: ``kernel``, ``inner`` for those that are to be inlined,
``entry`` for the one that is called.

In plain Python they change nothing; codegen/lowering reads them.
"""

from __future__ import annotations

from typing import TypeVar

Function = TypeVar("Function")


def kernel(function: Function) -> Function:
    """A function that is compiled."""
    return function


inner = entry = kernel
