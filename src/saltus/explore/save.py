"""Files of what a page shows: a study or a script that does it again, pictures, data."""

from __future__ import annotations

import io
import json
import re
import tempfile
import threading
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from saltus.explore.frames import Answer
from saltus.explore.opening import Opening
from saltus.explore.questions import QuestionError, Save
from saltus.flow.methods import Method, default_method
from saltus.models import MODELS
from saltus.results import save
from saltus.results.dataset import schema
from saltus.study.tables.write import with_unit, with_units, write
from saltus.system import System

#: Formats of each kind of file, and their media types.
FORMATS: Mapping[str, tuple[str, ...]] = {
    "study": ("toml",),
    "script": ("py",),
    "picture": ("png", "svg", "pdf"),
    "data": ("nc", "csv", "mat"),
}
_MEDIA = {
    "toml": "application/toml", "py": "text/x-python", "png": "image/png", "svg": "image/svg+xml",
    "pdf": "application/pdf", "nc": "application/x-netcdf", "csv": "text/csv",
    "mat": "application/octet-stream", "zip": "application/zip",
}  # fmt: skip
#: Parts of a view that can be saved.
PARTS = ("motion", "map", "agreement", "responses")
#: One picture at a time: the settings of matplotlib are everybody's.
_DRAWING = threading.Lock()


@dataclass(frozen=True)
class View:
    """The view of a page, in SI. What it doesn't is None.

    Attributes
    ----------
    opening : Opening
        How the explorer was opened.
    system : System
        With the values on the page.
    method : Method
    start : mapping of str to float or None
        Of the motion.
    length : mapping
        ``periods`` or ``t_end`` of the motion.
    axes : mapping of str to (float, float, int) or None
        Of the map.
    at : mapping of str to float
        Starts of the other states of the map.
    periods : int
        Periods that starts of the map are followed.
    vary : (str, float, float) or None
        Parameter and range of the responses.
    starts : mapping of str to list of float
        Where the responses are looked for.
    values_tried : int
        At how many values of the parameter.
    against : Method or None
        That the map is compared with.
    """

    opening: Opening
    system: System
    method: Method
    start: Mapping[str, float] | None = None
    length: Mapping[str, Any] | None = None
    axes: Mapping[str, tuple[float, float, int]] | None = None
    at: Mapping[str, float] | None = None
    periods: int = 2000
    vary: tuple[str, float, float] | None = None
    starts: Mapping[str, list[float]] | None = None
    values_tried: int = 12
    against: Method | None = None

    def units(self) -> dict[str, str]:
        """Units of states, parameters and sensors."""
        mine = self.system.outputs
        return {**self.system.units, **dict(zip(mine.names, mine.units, strict=True))}


def saved(question: Save, view: View, datasets: Mapping[str, Callable[[], xr.Dataset]]) -> Answer:
    """The file that a page asks for.

    Parameters
    ----------
    question : Save
        Kind of file, format, parts and name.
    view : View
        What is shown.
    datasets : mapping of str to callable
        The result of each part that is shown, computed when it is asked for.

    Raises
    ------
    QuestionError
        If there is no such file, or nothing to put into it.
    """
    if question.format not in FORMATS[question.what]:
        known = ", ".join(FORMATS[question.what])
        raise QuestionError(f"a {question.what} is written as {known}.", "format")
    parts = [part for part in question.parts or PARTS if part in datasets]
    ending, stem = question.format, _stem(question.name, view)
    if question.what == "study":
        data = study_text(view, stem).encode()
    elif question.what == "script":
        data = script_text(view).encode()
    elif not parts:
        raise QuestionError("nothing is shown that could be saved.", "parts")
    elif question.what == "picture":
        data = picture(parts[0], datasets[parts[0]](), view, ending)
    else:
        files = _files({part: datasets[part]() for part in parts}, ending)
        ending, data = (ending, next(iter(files.values()))) if len(files) == 1 else _zipped(files)
    head = {"kind": "save", "name": f"{stem}.{ending}", "media": _MEDIA[ending], "words": []}
    return head, {"file": np.frombuffer(data, np.uint8)}


def study_text(view: View, name: str) -> str:
    """The study file that does again what is shown. :func:`saltus.study.read.parse` reads it."""
    system, units = view.system, view.units()
    tables: dict[str, Any] = {"study": {"name": name}, "system": _system_table(view)}
    if view.method != default_method(system) or _options(view.method):
        tables["method"] = _method_table(view.method)
    if view.start is not None and view.length is not None:
        length = {
            key: with_unit(value, "s") if key == "t_end" else value
            for key, value in view.length.items()
        }
        tables["simulate"] = {"start": with_units(view.start, units), **length}
    if view.axes is not None:
        axes = {
            axis: {
                "first": with_unit(low, units[axis]),
                "last": with_unit(high, units[axis]),
                "count": count,
            }
            for axis, (low, high, count) in view.axes.items()
        }
        at = with_units(view.at or {}, units)
        tables["basins"] = {"axes": axes, **({"at": at} if at else {}), "periods": view.periods}
        if view.against is not None:
            mine, theirs = (_method_table(one) for one in (view.method, view.against))
            tables["basins"]["map"] = [
                {"name": view.method.name, "method": mine},
                {"name": view.against.name, "method": theirs, "compare": view.method.name},
            ]
    if view.vary is not None and view.starts is not None:
        parameter, low, high = view.vary
        ends = [with_unit(one, units[parameter]) for one in (low, high)]
        starts = {
            state: [with_unit(one, units[state]) for one in column]
            for state, column in view.starts.items()
        }
        tables["branches"] = {
            "vary": {parameter: ends}, "start": starts, "at": view.values_tried,
        }  # fmt: skip
    text = write(tables)
    if not _is_model(system) and "rates" not in tables["system"]:
        own = view.opening.file or f"FILE.py:{system.name}"
        text = f"# saltus run {name}.toml --system {own}\n{text}"
    return text


def script_text(view: View) -> str:
    """The same as calls of saltus, in Python."""
    system, method = view.system, ""
    lines = ['"""What saltus explore showed."""', "", "import saltus as sl", ""]
    if _is_model(system):
        values = ", ".join(f"{name}={value!r}" for name, value in system.values.items())
        lines.append(f"rig = sl.models.{system.name}({values})")
    else:
        data = json.dumps(system.to_dict())
        lines[2:3] = ["import json", "", "import saltus as sl"]
        lines.append(f"rig = sl.System.from_dict(json.loads({data!r}))")
    if view.method != default_method(system) or _options(view.method):
        lines.append(f"method = {_call(view.method)}")
        method = ", method=method"
    if view.start is not None and view.length is not None:
        length = ", ".join(f"{name}={value!r}" for name, value in view.length.items())
        lines += ["", f"run = sl.simulate(rig, {dict(view.start)!r}, {length}{method})"]
        lines += ["print(sl.describe(run))", 'sl.plot.history(run).figure.savefig("motion.png")']
    if view.axes is not None:
        axes = {name: tuple(one) for name, one in view.axes.items()}
        more = f"at={dict(view.at or {})!r}, periods={view.periods}{method}"
        lines += ["", f"found = sl.basins(rig, **{axes!r}, {more})"]
        lines += ["print(sl.describe(found))", 'sl.plot.basins(found).figure.savefig("map.png")']
        if view.against is not None:
            more = f"at={dict(view.at or {})!r}, periods={view.periods}"
            lines.append(
                f"other = sl.basins(rig, **{axes!r}, {more}, method={_call(view.against)})"
            )
            lines += ["both = sl.compare(found, other)", "print(sl.describe(both))"]
            lines += ['sl.plot.agreement(both)[0].figure.savefig("agreement.png")']
    if view.vary is not None and view.starts is not None:
        parameter, low, high = view.vary
        starts = {name: list(column) for name, column in view.starts.items()}
        lines += ["", f"starts = {starts!r}"]
        vary = f"{{{parameter!r}: ({low!r}, {high!r})}}"
        lines.append(f"curves = sl.branches(rig, {vary}, starts, at={view.values_tried}{method})")
        lines += ["print(sl.describe(curves))"]
        lines += ['sl.plot.branches(curves).figure.savefig("responses.png")']
    return "\n".join(lines) + "\n"


def picture(part: str, ds: xr.Dataset, view: View, ending: str) -> bytes:
    """A picture of a result as sl.plot draws it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from saltus import plot

    first = schema.outputs_in(ds)[0] if part == "motion" else None
    with _DRAWING, plot.style():
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        FigureCanvasAgg(figure)
        ax = figure.subplots()
        if part == "motion":
            plot.history(ds, state=first, ax=ax)
        elif part == "map":
            plot.basins(ds, ax=ax)
        elif part == "agreement":
            plot.agreement(ds, ax=ax)
        else:
            plot.branches(ds, ax=ax)
        if part == "motion":
            ax.set_title(view.system.name, loc="left", fontsize=9)
        target = io.BytesIO()
        figure.savefig(target, format=ending, dpi=200)
    return target.getvalue()


# -- parts -----------------------------------------------------------------------------------------
def _system_table(view: View) -> dict[str, Any]:
    system = view.system
    known = dict(view.opening.system_table)
    if not known and _is_model(system):
        known = {"model": system.name}
    known.pop("case", None)
    return {**known, **with_units(system.values, system.units)}


def _is_model(system: System) -> bool:
    """True for the equations of one of saltus's models."""
    model = MODELS.get(system.name)
    return model is not None and model().fingerprint() == system.fingerprint()


def _call(method: Method) -> str:
    """A method as it is written in Python."""
    given = ", ".join(f"{name}={value!r}" for name, value in _options(method).items())
    return f"sl.{method.name}({given})"


def _method_table(method: Method) -> dict[str, Any]:
    return {"name": method.name, **_options(method)}


def _options(method: Method) -> dict[str, Any]:
    """Options of a method that aren't its defaults."""
    usual = {one.name: one.default for one in fields(method)}  # type: ignore[arg-type]
    return {name: value for name, value in method.options().items() if value != usual[name]}


def _files(datasets: Mapping[str, xr.Dataset], ending: str) -> dict[str, bytes]:
    """Results as files, by their names."""
    with tempfile.TemporaryDirectory() as folder:
        for part, ds in datasets.items():
            save(ds, Path(folder) / f"{part}.{ending}")
        return {file.name: file.read_bytes() for file in sorted(Path(folder).iterdir())}


def _zipped(files: Mapping[str, bytes]) -> tuple[str, bytes]:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return "zip", target.getvalue()


def _stem(name: str, view: View) -> str:
    """A name that every file system takes."""
    plain = re.sub(r"[^\w-]+", "-", name or view.system.name).strip("-.")[:80]
    return plain or "saltus"


def starts_of(columns: Iterable[str], rows: np.ndarray) -> dict[str, list[float]]:
    """Starts float64[k, D] as columns by the names of the states."""
    return {name: column.tolist() for name, column in zip(columns, rows.T, strict=True)}
