"""[method]: how to integrate; keys and defaults are those of the methods themselves."""

from __future__ import annotations

import functools
import operator
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Field

from saltus.flow import methods
from saltus.study.tables.signature import WrittenAs, options

_EXAMPLES = {
    "lanes": 4, "max_steps": 1_000_000, "tolerance": 1e-12, "rtol": 1e-4, "atol": 1e-7,
    "step": "1 ms",
}  # fmt: skip
METHODS: dict[str, Any] = {
    name: options(method, _EXAMPLES) for name, method in methods.METHODS.items()
}
if TYPE_CHECKING:
    Method: TypeAlias = Any
else:
    Method = Annotated[
        functools.reduce(operator.or_, METHODS.values()), Field(discriminator="name")
    ]
#: A method of one question.
OWN_METHOD = WrittenAs(
    Method, ({"name": "Taylor"},), "How to integrate; the study's [method] by default."
)
