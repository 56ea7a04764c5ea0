"""What must be the same for a result to be that of a study."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from saltus.results.provenance import to_json, version
from saltus.system.formula import Formula

if TYPE_CHECKING:
    from saltus.system import System

#: All code that takes part in the way from equations, values and arguments to a Dataset: these packages and modules import nothing else of
#: saltus, but for messages. Models and the reading of study files stand in the equations, values and arguments themselves.
COMPUTING = ("fence", "interrupt", "unit_table", "units", "system", "kernels", "codegen", "codegen.lowering", "flow", "results", "analysis")


def identity(system: System, method: Any, arguments: Mapping[str, Any]) -> dict[str, str]:
    """Texts that must be the same to go on with what was computed: equations, values, method, arguments, code."""
    return {
        "equations": system.fingerprint(), "values": to_json(dict(system.values)), "method": method.name,
        "method options": to_json(method.options()), **{name: to_json(_plain(value)) for name, value in arguments.items()},
        "saltus": version("saltus"), "code": code_hash(),
    }  # fmt: skip


def _plain(value: Any) -> Any:
    """A value with data in place of formulas."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value.data() if isinstance(value, Formula) else value


@cache
def code_hash(*more: str) -> str:
    """SHA-256 of all code that a result depends on: :data:`COMPUTING`, and ``more`` packages or modules of saltus.

    ``more`` is for results that are kept under what a study file says, before it is read: the models and the reading count there too.
    """
    digest = hashlib.sha256()
    for place in (*COMPUTING, *more):
        for name, source in _sources(place):
            digest.update(f"{place}/{name}\n".encode() + source)
    return digest.hexdigest()


def _sources(place: str) -> list[tuple[str, bytes]]:
    """Name and text of the modules of a package of saltus, such as ``study.questions``, or of one module that stands alone."""
    parent, _, alone = f"saltus.{place}".rpartition(".")
    found = {file.name: file for file in resources.files(parent).iterdir()}
    if f"{alone}.py" in found:
        return [(f"{alone}.py", found[f"{alone}.py"].read_bytes())]
    files = sorted(resources.files(f"saltus.{place}").iterdir(), key=lambda item: item.name)
    return [(file.name, file.read_bytes()) for file in files if file.name.endswith(".py")]
