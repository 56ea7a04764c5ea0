"""What must be the same for a result to be that of a study."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from saltus.results.provenance import to_json, version

if TYPE_CHECKING:
    from saltus.system import System


def identity(system: System, method: Any, arguments: Mapping[str, Any]) -> dict[str, str]:
    """Texts that must be the same to go on with what was computed: equations, values, method, arguments, code."""
    return {
        "equations": system.fingerprint(), "values": to_json(dict(system.values)), "method": method.name,
        "method options": to_json(method.options()), **{name: to_json(value) for name, value in arguments.items()},
        "saltus": version("saltus"), "code": code_hash(),
    }  # fmt: skip


@cache
def code_hash() -> str:
    """SHA-256 of all code that a result depends on."""
    digest = hashlib.sha256()
    for package in ("system", "kernels", "codegen", "flow", "analysis"):
        for file in sorted(resources.files(f"saltus.{package}").iterdir(), key=lambda item: item.name):
            if file.name.endswith(".py"):
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()
