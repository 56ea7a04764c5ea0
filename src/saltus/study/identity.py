"""What must be the same for a result to be that of a study."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.results.provenance import to_json, version
from saltus.system.formula import Formula

if TYPE_CHECKING:
    from saltus.system import System

#: The folder of saltus.
PACKAGE = Path(__file__).parents[1]
#: All code that takes part in the way from equations, values and arguments to a Dataset: these packages and modules import nothing else of
#: saltus, but for messages. Models and the reading of study files stand in the equations, values and arguments themselves.
COMPUTING = ("fence", "intervals", "interrupt", "unit_table", "units", "system", "kernels", "codegen", "flow", "results", "analysis")


def identity(system: System, method: Any, arguments: Mapping[str, Any]) -> dict[str, str]:
    """Texts that must be the same to go on with what was computed: equations, values, method, arguments, code."""
    own = {
        "equations": system.fingerprint(), "values": to_json(dict(system.values)), "method": method.name,
        "method options": to_json(method.options()), "saltus": version("saltus"), "code": code_hash(),
    }  # fmt: skip
    asked = {f"{name} of the question" if name in own else name: value for name, value in arguments.items()}
    return own | {name: to_json(_plain(value)) for name, value in asked.items()}


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
    for name, source in dict(pair for place in (*COMPUTING, *more) for pair in _sources(place)).items():
        digest.update(f"{name}\n".encode() + source)
    return digest.hexdigest()


def _sources(place: str) -> Iterator[tuple[str, bytes]]:
    """Name and text of the modules of a package of saltus, such as ``study.questions``, rooms in it too, or of one module alone."""
    alone = PACKAGE / f"{place.replace('.', '/')}.py"
    for file in [alone] if alone.is_file() else sorted(alone.with_suffix("").rglob("*.py")):
        yield file.relative_to(PACKAGE).as_posix(), file.read_bytes()
