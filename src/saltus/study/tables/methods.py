"""[method]: how to integrate; keys and defaults are those of the methods themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Field

from saltus.flow.methods import ODE45 as _ODE45
from saltus.flow.methods import Taylor as _Taylor
from saltus.study.tables.parts import Table
from saltus.study.tables.signature import Kind, options

_EXAMPLES = {"lanes": 4, "max_steps": 1_000_000, "tolerance": 1e-12, "rtol": 1e-4, "atol": 1e-7}
Taylor: Any = options(_Taylor, _EXAMPLES)
ODE45: Any = options(_ODE45, _EXAMPLES)
METHODS: dict[str, type[Table]] = {"Taylor": Taylor, "ODE45": ODE45}
if TYPE_CHECKING:
    Method: TypeAlias = Any
else:
    Method = Annotated[Taylor | ODE45, Field(discriminator="name")]
#: A method of one question.
OWN_METHOD = Kind(
    Method, ({"name": "Taylor"},), "How to integrate; the study's [method] by default."
)
