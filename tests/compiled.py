"""Functions in the Python of generated heads, compiled as an equation is: by codegen/lane_ir.py and
LLVM.
"""

from __future__ import annotations

import ctypes
from types import SimpleNamespace

import numpy as np

from saltus.codegen import machine
from saltus.codegen.interface import ARRAY, REAL, WHOLE
from saltus.codegen.lane_ir import equation_ir

_CTYPES = {ARRAY: ctypes.c_void_p, WHOLE: ctypes.c_int64, REAL: ctypes.c_double}


def compiled(text: str, arguments: tuple[str, ...], lanes: int):
    """The one function of a text, to be called with arrays and numbers."""
    name = text.split("def ", 1)[1].split("(", 1)[0]
    interface = SimpleNamespace(functions={name: arguments}, truths=())
    code = machine.object_code(None, [equation_ir(text, (), interface, lanes)], [f"saltus_{name}"])
    loaded = machine.loaded([code], f"saltus_{name}")
    function = ctypes.CFUNCTYPE(None, *(_CTYPES[kind] for kind in arguments))(loaded.address)

    def call(*values: np.ndarray | float) -> None:
        function(
            *(
                value.ctypes.data if kind == ARRAY else value
                for value, kind in zip(values, arguments, strict=True)
            )
        )

    call.keeper = loaded
    return call
