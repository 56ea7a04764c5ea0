"""A user's own system, named on the command line: ``my_rig.py:rig``. The only place where saltus
runs a file of the user's.
"""

from __future__ import annotations

import importlib.util
import re
import shlex
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from saltus.errors import ParameterError, SaltusError, StudyError, nearest

if TYPE_CHECKING:
    from saltus.system import System


def own_system(reference: str) -> System:
    """The system in a Python file.

    Parameters
    ----------
    reference : str
        ``FILE.py:NAME``; ``:NAME`` may be left out if the file holds just one system.

    Raises
    ------
    ParameterError
        If the file is missing, fails, or holds no such system.
    """
    from saltus.system import System

    file, _, name = reference.rpartition(":") if ".py:" in reference else (reference, "", "")
    path = Path(file)
    if path.suffix != ".py" or not path.is_file():
        raise ParameterError(
            f"{reference}: there is no Python file {str(path)!r}. Write "
            "FILE.py:NAME, such as my_rig.py:rig."
        )
    found = {key: value for key, value in vars(_module(path)).items() if isinstance(value, System)}
    if name in found:
        return found[name]
    if not found:
        raise ParameterError(
            f"{reference}: {path} holds no system. Put @sl.system(states=...) above the equation."
        )
    if name:
        raise ParameterError(
            f"{reference}: {path} holds no system {name!r}. {nearest(name, found)}"
        )
    if len(found) > 1:
        raise ParameterError(
            f"{reference}: {path} holds {', '.join(found)}. Say which: "
            f"--system {file}:{next(iter(found))}"
        )
    return next(iter(found.values()))


def check_beside(study: Path) -> None:
    """Raise a StudyError for a study without a system of its own if a Python file beside it may
    hold one: the message says how to run the two together.
    """
    for file in sorted(study.parent.glob("*.py")):
        with suppress(OSError, UnicodeDecodeError):
            if re.search(r"\bsl\.(system|structure)\(|from saltus import", file.read_text("utf-8")):
                raise StudyError(
                    f"{study}: [system] names no model, and {file} lies beside it. Write: "
                    f"{shlex.join(['saltus', 'run', str(study), '--system', str(file)])}"
                )


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"saltus_own_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module.__name__] = module  # for dataclasses and pickling
    sys.path.insert(0, str(path.parent.resolve()))  # the file may import its neighbours
    try:
        spec.loader.exec_module(module)
    except SaltusError as error:
        raise ParameterError(f"{path}: {error}") from error
    except Exception as error:
        frames = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if Path(frame.filename).resolve() == path.resolve()
        ]
        line = getattr(error, "lineno", None) or (frames[-1].lineno if frames else None)
        place = f"{path}, line {line}" if line else str(path)
        raise ParameterError(f"{place}: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(str(path.parent.resolve()))
    return module
