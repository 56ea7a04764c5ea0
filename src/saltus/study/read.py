"""Read a study file: TOML to a checked :class:`~saltus.study.spec.Study`."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from saltus.errors import StudyError
from saltus.study.messages import content_faults, syntax_fault
from saltus.study.spec import Study


def read(path: Path | str) -> tuple[Study, str]:
    """A study file, checked as far as that is possible without its system.

    Parameters
    ----------
    path : Path or str
        The TOML file.

    Returns
    -------
    study : Study
    text : str
        The file as it stands; kept with the result.

    Raises
    ------
    StudyError
        If the file can't be read, isn't TOML, or holds a key or a value that a study may not hold. Every fault is named.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it isn't UTF-8 text"
        raise StudyError(f"the study {path} can't be read: {reason}.") from None
    return parse(text, str(path)), text


def parse(text: str, name: str = "study") -> Study:
    """A study from its text; ``name`` stands in the messages. Raises StudyError as :func:`read` does."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{name}, {syntax_fault(error, text)}") from None
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        faults = content_faults(error, data)
        raise StudyError(f"{name}: " + (faults[0] if len(faults) == 1 else "".join(f"\n  - {fault}" for fault in faults))) from None
