"""Read a study file: TOML to a checked :class:`~saltus.study.spec.Study`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from saltus import fence
from saltus.errors import StudyError
from saltus.study.messages import content_faults, syntax_fault
from saltus.study.spec import Study
from saltus.system.formula import LONGEST


def read(path: Path | str) -> tuple[Study, str]:
    """Read a study file, and check it as far as possible without its system.

    Parameters
    ----------
    path : Path or str
        The TOML file.

    Returns
    -------
    study : Study
    text : str
        The file to the byte; stored with the result.

    Raises
    ------
    StudyError
        If the file can't be read, isn't TOML, or holds a key or a value that a study may not hold.
        Every fault is named.
    """
    path = Path(path)
    try:
        data = fence.content(path, fence.STUDY_BYTES)
        fence.text(data)
    except fence.RefusedError as refused:
        raise StudyError(f"the study {path} {refused}") from None
    text = data.decode("utf-8")
    return parse(text, str(path)), text


def parse(text: str, name: str = "study") -> Study:
    """A study from its text; ``name`` stands in the messages. Raises StudyError as :func:`read`
    does.
    """
    text = text.removeprefix("\ufeff")  # the mark of Windows editors
    try:
        data = fence.toml(text)
        _short(data)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{name}, {syntax_fault(error, text)}") from None
    except fence.RefusedError as refused:
        raise StudyError(f"{name} {refused}") from None
    return study_of(data, name)


def study_of(data: Mapping[str, Any], name: str = "study") -> Study:
    """A study from its parsed TOML. Raises StudyError as :func:`read` does."""
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        faults = content_faults(error, data)
        faults = [
            *faults[:_FAULTS],
            *([f"and {len(faults) - _FAULTS} more."] if len(faults) > _FAULTS else []),
        ]
        raise StudyError(
            f"{name}: "
            + (faults[0] if len(faults) == 1 else "".join(f"\n  - {fault}" for fault in faults))
        ) from None


#: Most errors in one message.
_FAULTS = 12
#: Longest texts by key [characters]: titles and paths may be longer than quantities and words,
#: descriptions longer still.
_LONGEST = {
    "name": 200,
    "printed": 400,
    "exact": 400,
    "measured": 400,
    **dict.fromkeys(("mass", "stiffness", "damping"), 400),
    "description": 20_000,
    "source": 20_000,
}
_WORD = 100
#: Tables whose texts are formulas.
_FORMULAS = (
    "rates",
    "terms",
    "guards",
    "outputs",
    "energy",
    "friction",
    "force",
    "surface",
    "amplitude",
)


def _short(data: Any, key: str = "", most: int = _WORD) -> None:
    """Refuse a text that is too long; ``most`` is the limit for keys without one."""
    if isinstance(data, dict):
        for name, value in data.items():
            _short(value, name, LONGEST if name in _FORMULAS else most)
    elif isinstance(data, list):
        for value in data:
            _short(value, key, most)
    elif isinstance(data, str) and len(data) > (longest := _LONGEST.get(key, most)):
        raise fence.RefusedError(
            f"has a text of {len(data)} characters in {key!r}, where at most {longest} fit."
        )
