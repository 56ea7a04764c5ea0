"""Jobs: one Dataset each, computed once and kept beside what it depends on."""

from __future__ import annotations

import hashlib
import inspect
import json
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError
from saltus.results import load, save
from saltus.results.files.atomic import ResultFileError, replacing
from saltus.results.provenance import content_hash, to_json, version
from saltus.study.identity import code_hash

if TYPE_CHECKING:
    import xarray as xr

#: Called by a job with the share done; raises what ends the job.
Show = Callable[[float], None]

#: What stands between a job's settings, which are texts of a study file, and what is computed: the models, and the reading of such files.
_READING = ("models", "study")


class JobError(SaltusError):
    """A job could not be computed."""


@dataclass(frozen=True)
class Job:
    """Something to compute.

    Attributes
    ----------
    name : str
        ``figure/what``; claims and pictures ask for the Dataset under this name.
    settings : mapping
        Everything that the result depends on beside the code and ``needs``: plain values.
    compute : callable
        ``compute(settings, inputs, show)``: from settings, the Datasets of ``needs`` by name and a progress callable to the Dataset.
    needs : tuple of str
        Jobs whose results it takes.
    """

    name: str
    settings: Mapping[str, Any]
    compute: Callable[[Mapping[str, Any], Mapping[str, xr.Dataset], Show], xr.Dataset]
    needs: tuple[str, ...] = ()

    @property
    def file_name(self) -> str:
        """The name as a file name, without suffix."""
        return re.sub(r"[^a-z0-9.]+", "-", self.name.lower()).strip("-.")

    def identity(self, inputs: Mapping[str, xr.Dataset]) -> dict[str, Any]:
        """What must be equal for a kept result to be this job's."""
        return {
            "settings": json.loads(to_json(dict(self.settings))),
            "inputs": {name: content_hash(inputs[name]) for name in self.needs},
            "code": code_hash(*_READING),
            "job": _source_hash(Path(inspect.getfile(self.compute))),
            "saltus": version("saltus"),
        }


@cache
def _source_hash(own: Path) -> str:
    """SHA-256 of the file that holds a job's function, and of the modules beside it that it may call."""
    digest = hashlib.sha256()
    for file in sorted({own, *own.parent.glob("compute*.py")}):
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


@dataclass
class Shelf:
    """The folder in which results of jobs are kept.

    Attributes
    ----------
    folder : Path
        Where.
    computed, kept : list of str
        Jobs computed by this run, and jobs whose results were there already.
    seconds : dict of str to float
        How long each took when it was computed [s].
    """

    folder: Path
    computed: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    def result(self, job: Job, inputs: Mapping[str, xr.Dataset], show: Show) -> xr.Dataset:
        """The Dataset of a job: from its file if that is this job's and whole, else computed now and kept."""
        identity = job.identity(inputs)
        ds = self._kept(job, identity)
        if ds is not None:
            self.kept.append(job.name)
            return ds
        begin = time.perf_counter()
        ds = job.compute(job.settings, inputs, show).assign_attrs(title=job.name)
        self.seconds[job.name] = time.perf_counter() - begin
        self._keep(job, identity, ds)
        self.computed.append(job.name)
        return ds

    def files(self, job: Job) -> tuple[Path, Path]:
        """The file of the Dataset and that of its identity."""
        return self.folder / f"{job.file_name}.nc", self.folder / f"{job.file_name}.json"

    def _kept(self, job: Job, identity: Mapping[str, Any]) -> xr.Dataset | None:
        data, note = self.files(job)
        try:
            told = json.loads(note.read_text(encoding="utf-8"))
            if told["identity"] != identity:
                return None
            seconds = float(told["seconds"])
            ds = load(data)
            if told["result_hash"] != content_hash(ds):  # the note of one result beside the data of another
                return None
        except (OSError, ValueError, KeyError, TypeError, ResultFileError):  # not there, half there, or damaged: it is computed again
            return None
        self.seconds[job.name] = seconds
        return ds

    def _keep(self, job: Job, identity: Mapping[str, Any], ds: xr.Dataset) -> None:
        """The identity takes its place last: a result without it counts for nothing."""
        data, note = self.files(job)
        note.unlink(missing_ok=True)
        save(ds, data)
        told = {"identity": identity, "result_hash": content_hash(ds), "seconds": self.seconds[job.name]}
        with replacing(note) as (part,):
            part.write_text(json.dumps(told, indent=1), encoding="utf-8")
