"""The compiled flow of one equation for the engine: first with sizes read at run time, compiled
again once it has work.

Two tiers give the same bits, for they are the same operations in the same order:

generic   the templates' machine code serves all equations and is on disk; only the equation is
          compiled, in a fraction of a second
full      sizes, tables and the equation are known to the compiler: one piece of code

A flow begins generic. After `STEADY_AFTER` seconds of work another process compiles the full tier,
stores it on disk, and the flow changes to it between two calls. The next process begins with it:
also where this one has ended before, for the one that compiles goes on.
"""

from __future__ import annotations

import contextlib
import ctypes
import math
import threading
import time
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from saltus import cache
from saltus.codegen import machine, templates
from saltus.codegen.building import BuildOrder, built, built_to_keep
from saltus.codegen.head import Constant, Head
from saltus.codegen.interface import BATCH, Interface, columns_of
from saltus.codegen.lane_ir import constants_ir, equation_ir

GENERIC, FULL = TIERS = ("generic", "full")
#: Final tier of a flow.
STEADY = FULL
#: Seconds of work after which the full tier is compiled. That takes some three seconds of another
#: processor, and gains a tenth (the rig) to a half (five modes with two stops).
STEADY_AFTER = 2.0
#: Constants known to the generic code too, so that loops over them are unrolled.
_BAKED = (
    "ORDER", "HALF", "NEWTON_DEGREE_1", "NEWTON_DEGREE_2", "HORNER", "FINER", "SHORTEST",
    "STAGES", "STAGE_TIME", "WEIGHT", "ERROR_WEIGHT", "DENSE_WEIGHT", "RULES",
)  # fmt: skip
#: Equations of many systems are the same: a tenth of a second for a long one.
_text_of = lru_cache(maxsize=64)(equation_ir)
_DTYPES = {"float64": np.dtype(np.float64), "int64": np.dtype(np.int64)}


#: The address of a contiguous array, in a quarter of the time of ``array.ctypes``: a call has
#: fifty.
_beginning: Callable[[Any], Any] = ctypes.c_char.from_buffer
_place: Callable[[Any], int] = ctypes.addressof


def _refused(array: np.ndarray, dtype: np.dtype, axes: int, columns: int | None) -> TypeError:
    known = "" if columns is None else f" and {columns} columns"
    return TypeError(
        f"a kernel takes a contiguous array of {dtype} with {axes} "
        f"axes{known}, not of {array.dtype} {array.shape}."
    )


class Call:
    """The arguments of a compiled function as one block of numbers: address, shape and strides of
    each array.
    """

    def __init__(self, arguments: tuple[str, ...]) -> None:
        self._kinds = [
            (
                None if kind == "int64" else _DTYPES[kind.partition("[")[0]],
                kind.count(",") + 1,
                columns_of(kind),
            )
            for kind in arguments
        ]
        # for each argument the number that its shape doesn't contain: its value, or its address
        places, used = [], 0
        for dtype, axes, _ in self._kinds:
            places.append(used if dtype is None else used + 4)
            used += 1 if dtype is None else 5 + 2 * axes
        self._places = np.array(places, np.int64)
        self._shaped = lru_cache(maxsize=64)(self._of_shapes)

    def __len__(self) -> int:
        return len(self._kinds)

    def block(self, values: tuple[Any, ...]) -> np.ndarray:
        """The arguments as the function reads them. int64[m].

        Raises
        ------
        TypeError
            If an array isn't of its type, has other columns, or isn't contiguous.
        """
        numbers, shapes = [], []
        for value, (dtype, axes, columns) in zip(values, self._kinds, strict=True):
            if dtype is None:
                numbers.append(int(value))
                continue
            shape = value.shape
            own = value.dtype
            if (
                (own is not dtype and own != dtype)
                or len(shape) != axes
                or (columns is not None and shape[-1] != columns)
            ):
                raise _refused(value, dtype, axes, columns)
            shapes.append(shape)
            if 0 in shape:
                numbers.append(0)
                continue
            try:
                numbers.append(_place(_beginning(value)))
            except TypeError:  # it is read-only, or not contiguous
                if not value.flags.c_contiguous:
                    raise _refused(value, dtype, axes, columns) from None
                numbers.append(int(value.ctypes.data))
        block = self._shaped(tuple(shapes)).copy()
        block[self._places] = numbers
        return block

    def _of_shapes(self, shapes: tuple[tuple[int, ...], ...]) -> np.ndarray:
        """The block for arrays of some shapes, without their addresses."""
        numbers: list[int] = []
        given = iter(shapes)
        for dtype, *_ in self._kinds:
            if dtype is None:
                numbers.append(0)
            else:
                shape = next(given)
                strides = [8 * math.prod(shape[i + 1 :]) for i in range(len(shape))]
                numbers += (0, 0, math.prod(shape), 8, 0, *shape, *strides)
        return np.array(numbers, np.int64)


class Kernels:
    """The compiled flow of one equation.

    Parameters
    ----------
    interface : Interface
        The names that the templates leave open.
    template : str
        Name of their bitcode.
    head : Head
        The numbers and functions of the equation.
    title : str
        Its title in `saltus cache`.
    what : str
        What is said to be compiled, if that takes long.

    Raises
    ------
    CacheError
        If it can't be compiled here.
    """

    def __init__(
        self, interface: Interface, template: str, head: Head, title: str, what: str
    ) -> None:
        self.interface, self.template, self.title, self.what = interface, template, title, what
        self._layout = layout_of(interface, head.constants)
        self._constants = _open_constants(interface, head.constants, self._layout)
        self._functions = head.functions
        self._lanes = int(head.constants.get("LANES", 1))  # type: ignore[arg-type]
        self._call = Call(interface.arguments[: len(BATCH)])
        self._own = Call(interface.arguments[len(BATCH) :])
        self._worked, self._asked = 0.0, threading.Lock()
        self._memory = threading.local()
        self._kept: list[machine.Loaded] = []  # a function that was called may still be running
        self.tier = ""
        order = self._order(STEADY)
        found = cache.read(order.key)
        self._begin(STEADY, [found]) if found is not None else self.exchange(GENERIC)

    def __getattr__(self, name: str) -> Any:
        """Names of the layout, such as CARRY and STEP_RECORDS."""
        try:
            return self.__dict__["_layout"][name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no {name!r}") from None

    def workspace(self) -> tuple[np.ndarray, ...]:
        """The work arrays of one call; one set for each thread, made once: many calls take no
        longer than making it.
        """
        memory = self._memory
        if not hasattr(memory, "arrays"):
            memory.arrays = self._layout["workspace"]()
            memory.block = self._own.block(memory.arrays)
        arrays: tuple[np.ndarray, ...] = memory.arrays
        return arrays

    def propagate(self, *values: Any) -> int:
        """Call the kernel, without the GIL; kernels/batch.py describes its arrays."""
        return self._run(self._block(values))

    def bound(self, *values: Any) -> Callable[[], int]:
        """A call with these arrays, to be repeated as often as wanted, on this thread."""
        block = self._block(values)

        def call() -> int:
            return self._run(block, values)

        return call

    def _run(self, block: np.ndarray, _: tuple[Any, ...] = ()) -> int:
        """Call with a block of arguments, while the arrays in it are alive."""
        begun = time.perf_counter()
        answer = int(self._entry(_place(_beginning(block))))
        self._worked += time.perf_counter() - begun
        if (
            self._worked > STEADY_AFTER
            and self.tier != STEADY
            and self._asked.acquire(blocking=False)
        ):
            threading.Thread(
                target=self._settle, name=f"kernels: {self.title}", daemon=True
            ).start()
        return answer

    def _block(self, values: tuple[Any, ...]) -> np.ndarray:
        """The arguments of a call; the addresses of the workspace are known."""
        rest = len(values) - len(self._own)
        given, own = values[rest:], getattr(self._memory, "arrays", ())
        known = len(own) > 0 and all(a is b for a, b in zip(given, own, strict=True))
        behind = self._memory.block if known else self._own.block(given)
        return np.concatenate([self._call.block(values[:rest]), behind])

    def exchange(self, tier: str) -> None:
        """Change to another tier, made here if it isn't on disk. The next call uses it; a call
        under way ends as it began.
        """
        self._begin(tier, [built(order) for order in self._orders(tier)])

    def _settle(self) -> None:
        """Compile the full tier in a thread that no Ctrl-C of the caller's work ends. A failure
        here costs speed, no result.
        """
        with contextlib.suppress(Exception):
            self._begin(STEADY, [built_to_keep(order) for order in self._orders(STEADY)])

    def _begin(self, tier: str, objects: list[bytes]) -> None:
        loaded = machine.loaded(objects, f"saltus_{self.interface.entry}")
        self._kept.append(loaded)
        self._entry: Callable[[int], int] = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(
            loaded.address
        )
        self.tier = tier

    def _orders(self, tier: str) -> list[BuildOrder]:
        """The objects of a tier."""
        return [self._order(tier)] if tier == FULL else [self._order(tier), self._equation()]

    def _order(self, tier: str) -> BuildOrder:
        entry = f"saltus_{self.interface.entry}"
        baked = {name: value for name, value in self._constants.items() if name in _BAKED}
        texts = [constants_ir(baked if tier == GENERIC else self._constants, self.interface)]
        if tier == FULL:
            texts.append(self._equation_text)
        title = f"{self.title if tier == FULL else self.template}, {tier}"
        return BuildOrder(
            self.template, tuple(texts), (entry,), title, self._said(tier), tier == GENERIC
        )

    def _said(self, tier: str) -> str:
        return "what all equations share, for this processor: once" if tier == GENERIC else ""

    def _equation(self) -> BuildOrder:
        """The equation alone, with the sizes and tables that generic code reads."""
        rest = {name: value for name, value in self._constants.items() if name not in _BAKED}
        called = tuple(f"saltus_{name}" for name in (*self.interface.functions, *rest))
        texts = (constants_ir(rest, self.interface), self._equation_text)
        return BuildOrder("", texts, called, self.title, f"{self.what}: once for each new equation")

    @cached_property
    def _equation_text(self) -> str:
        sizes = tuple((name, n) for name, n in self._constants.items() if isinstance(n, int))
        return _text_of(
            self._functions, sizes, self.interface, self._lanes, machine.register_width()
        )


def layout_of(interface: Interface, constants: dict[str, Constant]) -> dict[str, Any]:
    """The names of a layout for the sizes of a head."""
    space: dict[str, Any] = dict(constants)
    if interface.layout:
        exec(templates.layout_code(interface.layout), space)
    return space


def _open_constants(
    interface: Interface, constants: dict[str, Constant], layout: dict[str, Any]
) -> dict[str, Constant]:
    """All constants that the templates read: sizes, flags, tables, and the values that the layout
    derives from them.
    """
    names = [*interface.sizes, *interface.flags, *interface.tables]
    return {name: constants[name] for name in names} | {
        name: layout[name] for name in templates.open_names_of(interface)
    }
