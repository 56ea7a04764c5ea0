"""Texts that must be the same for a result to be that of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import TYPE_CHECKING, Any

from saltus.results.provenance import to_json, version
from saltus.study.code import code_hash
from saltus.system.formula import Formula

if TYPE_CHECKING:
    from saltus.system import System


def identity(system: System, method: Any, arguments: Mapping[str, Any]) -> dict[str, str]:
    """Texts that must be the same to go on with what was computed: equations, values, method,
    arguments, code.
    """
    fixed = {
        "equations": system.fingerprint(),
        "values": to_json(dict(system.values)),
        "method": method.name,
        "method options": to_json(method.options()),
        "saltus": version("saltus"),
        "code": code_hash(),
    }
    if len(system.outputs):
        fixed["outputs"] = to_json(system.to_dict()["outputs"])
    asked = {
        f"{name} of the question" if name in fixed else name: value
        for name, value in arguments.items()
    }
    return fixed | {name: to_json(_plain(value)) for name, value in asked.items()}


def _plain(value: Any) -> Any:
    """Convert a value to plain data: formulas and options become data."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Formula):
        return value.data()
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
