"""Jobs: one Dataset each, stored as a study stores its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.results.provenance import content_hash
from saltus.study.code import statement_hash
from saltus.study.identity import identity
from saltus.study.run.stored import load_or_compute
from saltus.study.tables.parts import slug

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.run.running import Running
    from saltus.system import System

#: Attribute of a result: the time it took [s].
SECONDS = "seconds"


@dataclass(frozen=True)
class Job:
    """One computation.

    Attributes
    ----------
    name : str
        ``figure/what``; claims and pictures ask for the Dataset under this name.
    compute : callable
        An analysis of saltus, or a function beside the study files. Called with the system, the
        Datasets of ``needs``, and ``method``, ``threads``, ``progress`` and the arguments by name.
    system : System
        With the values of this job.
    method : Method
        The method of integration.
    arguments : mapping
        Plain values.
    needs : tuple of str
        Jobs whose results it takes.
    """

    name: str
    compute: Callable[..., xr.Dataset]
    system: System
    method: Any
    arguments: Mapping[str, Any]
    needs: tuple[str, ...] = ()

    def identity(self, inputs: Mapping[str, xr.Dataset]) -> dict[str, str]:
        """The settings that must be equal for a stored result to be this job's."""
        given = {
            "arguments": dict(self.arguments),
            "inputs": {name: content_hash(inputs[name]) for name in self.needs},
        }
        return {
            **identity(self.system, self.method, given),
            "analysis": f"{self.compute.__name__} {_own_code(self.compute.__module__)}",
        }

    def result(self, inputs: Mapping[str, xr.Dataset], at: Running) -> tuple[xr.Dataset, bool]:
        """The Dataset, and True if it was computed now. Otherwise it was in the folder, complete,
        with the same settings and code.
        """
        new: list[bool] = []

        def compute(show: Callable[[float], None]) -> xr.Dataset:
            begin = time.perf_counter()
            needed = [inputs[name] for name in self.needs]
            how = {"method": self.method, "threads": at.resources.threads, "progress": show}
            ds = self.compute(self.system, *needed, **how, **self.arguments)
            new.append(True)
            return ds.assign_attrs({SECONDS: time.perf_counter() - begin})

        return load_or_compute(
            slug(self.name), self.name, self.identity(inputs), compute, at
        ), bool(new)


@cache
def _own_code(module: str) -> str:
    """Hash of the statements of a module outside saltus; the code of saltus counts in every
    identity.
    """
    return (
        ""
        if module.startswith("saltus.")
        else statement_hash(Path(str(sys.modules[module].__file__)).read_bytes())
    )
