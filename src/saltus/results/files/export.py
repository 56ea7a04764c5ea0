"""Results to files: netCDF, CSV and MATLAB's .mat."""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from saltus.errors import ParameterError, nearest, shown
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import KINDS, NAMES, check, kind_of
from saltus.results.describe import describe
from saltus.results.files import known
from saltus.results.files.atomic import path_of, replacing
from saltus.results.files.ending import checksum_in, with_ending
from saltus.results.files.sheets import notes_of, write_rows
from saltus.results.files.texts import place_of_control
from saltus.results.provenance import file_hash

Target = str | os.PathLike[str]

_MATLAB_KEYWORDS = frozenset(
    ("break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function",
        "global", "if", "otherwise", "parfor",
     "persistent", "return", "spmd", "switch", "try", "while")
)  # fmt: skip
_MATLAB_LENGTH = 31  # the longest name that savemat writes as it stands


def save(ds: xr.Dataset, path: Target) -> Path:
    """Write a result to a file: ``.nc``, ``.csv`` or ``.mat`` by its name.

    The file is there in full or not at all, and the same result gives the same bytes. A ``.nc``
    file keeps everything and is read back by :func:`saltus.results.load`; it is netCDF-4 where
    h5netcdf and h5py are installed (``pip install "saltus[io]"``), else netCDF-3.

    Parameters
    ----------
    ds : Dataset
        Result of ``simulate`` or ``stroboscope``.
    path : str or path
        File to write, in a folder that exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If ``ds`` isn't a result of saltus, or the suffix is another one.
    ResultFileError
        If the file can't be written: a full disk, a missing folder.

    Examples
    --------
    >>> import saltus as sl
    >>> run = sl.simulate(sl.models.delangre("a", force="4 N"), periods=2)
    >>> file = sl.save(run, "run.nc")
    >>> sl.load(file).identical(run)
    True
    """
    path = path_of(path)
    writers = {".nc": to_netcdf, ".csv": to_csv, ".mat": to_mat}
    if path.suffix not in writers:
        raise ParameterError(
            f"the file {shown(path.name)} has no suffix that says how to write "
            f"it. {nearest(path.suffix, writers)}"
        )
    return writers[path.suffix](ds, path)


@reader
def to_netcdf(ds: xr.Dataset, path: Target) -> Path:
    """Write a result to a netCDF file; see :func:`save`. A checksum of the numbers goes with it,
    and one of the file, at its end.
    """
    _check(ds, "to_netcdf", NAMES)
    marked = ds.assign_attrs(file_hash=file_hash(ds))
    try:
        # to memory: the HDF5 library crashes the process when it meets a full disk
        content = _content(marked)
    except ValueError as error:
        if "safely cast" not in str(error):
            raise
        raise ParameterError(
            f'{path}: a count is too large for netCDF-3. Install "saltus[io]", '
            f"which writes netCDF-4."
        ) from error
    data = with_ending(content)
    with replacing(Path(path)) as (part,):
        part.write_bytes(data)
    known.note(checksum_in(data))
    return Path(path)


def _check(ds: xr.Dataset, caller: str, kinds: Sequence[str]) -> None:
    """Raise ParameterError unless a Dataset is a result of one of these kinds, and its texts are
    plain.
    """
    check(ds, caller=caller, kinds=kinds)
    place = place_of_control(ds)
    if place:
        raise ParameterError(
            f"{caller}: {place} holds control characters, which a terminal would "
            f"obey. Write plain text."
        )


def _content(ds: xr.Dataset) -> bytes | memoryview:
    """Bytes of a netCDF-4 file, or of netCDF-3 if the writer of netCDF-4 isn't installed."""
    if not (_has("h5netcdf") and _has("h5py")):
        return ds.to_netcdf(engine="scipy")
    from saltus.results.files import hdf5

    return hdf5.content(ds)


def _has(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


# -- CSV -------------------------------------------------------------------------------------------
@reader
def to_csv(ds: xr.Dataset, path: Target) -> Path:
    """Write a result as CSV, numbers with all their digits.

    ``run.csv`` holds a row for each sample (of a batch: trajectory after trajectory),
    ``run_contacts.csv`` a row for each contact, and for a batch ``run_trajectories.csv`` a row for
    each trajectory. The header row has units (``x [m]``). Lines that start with ``#`` say where the
    result comes from; ``pandas.read_csv(path, comment="#")`` skips them.

    Of responses the file holds a row for each response, and ``NAME_events.csv`` one for each thing
    that happens to a branch.

    Parameters
    ----------
    ds : Dataset
        Result of ``simulate``, ``stroboscope``, ``frequency_response`` or ``bifurcation_diagram``.
    path : str or path
        The file of samples, or of responses; the others get their names from it.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If ``ds`` isn't a result of saltus.
    ResultFileError
        If a file can't be written. None is left half-written.

    Examples
    --------
    >>> import saltus as sl
    >>> run = sl.simulate(sl.models.delangre("a", force="4 N"), periods=2)
    >>> file = sl.to_csv(run, "run.csv")
    >>> [line for line in file.read_text(encoding="utf-8").splitlines() if line[0] != "#"][0]
    'time [s],period,x [m],v [m/s],mode'
    """
    try:
        _check(ds, "to_csv", [name for name, kind in KINDS.items() if kind.sheets is not None])
    except ParameterError as error:
        if not isinstance(ds, xr.Dataset) or "saltus_result" not in ds.attrs:
            raise
        raise ParameterError(
            f"{error} Write .nc or .mat; or one table of it, "
            f"ds[['...']].to_dataframe().to_csv({str(path)!r}). "
            "A study writes its tables as CSV."
        ) from None
    path, sheets = path_of(path), KINDS[kind_of(ds)].sheets
    assert sheets is not None
    files = {
        path.with_name(f"{path.stem}_{end}{path.suffix}") if end else path: columns
        for end, columns in sheets(ds).items()
        if columns
    }
    with replacing(*files) as parts:
        for part, columns in zip(parts, files.values(), strict=True):
            rows = zip(*(column.tolist() for column in columns.values()), strict=True)
            write_rows(part, notes_of(ds), [list(columns), *rows])
    return path


# -- MATLAB ----------------------------------------------------------------------------------------
@reader
def to_mat(ds: xr.Dataset, path: Target) -> Path:
    """Write a result as a MATLAB file: ``run = load("run.mat"); plot(run.time, run.x)``.

    Variables: ``time``, ``period``, each state and ``mode`` as columns (a batch: one column a
    trajectory), ``status`` and the counters; the structs ``contact`` (``run.contact.time``, ...),
    ``guard``, ``units`` and ``provenance``. Texts are character arrays, lists of texts cell arrays.
    A name that MATLAB can't take (a keyword, not ASCII, over 31 characters) is changed and the
    change kept in ``names``.

    Parameters
    ----------
    ds : Dataset
        Result of ``simulate`` or ``stroboscope``.
    path : str or path
        File to write.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ParameterError
        If ``ds`` isn't a result of saltus, or a variable exceeds the 2 GB of this format.
    ResultFileError
        If the file can't be written.

    Examples
    --------
    >>> import saltus as sl
    >>> run = sl.simulate(sl.models.delangre("a", force="4 N"), periods=2)
    >>> import scipy.io
    >>> scipy.io.loadmat(sl.to_mat(run, "run.mat"))["x"].shape
    (401, 1)
    """
    from scipy.io import savemat  # 0.2 s that only this function needs
    from scipy.io.matlab import MatWriteError

    _check(ds, "to_mat", NAMES)
    path = path_of(path)
    with replacing(path) as (part,):
        try:
            savemat(part, _matlab(ds), appendmat=False, oned_as="column")
        except MatWriteError as error:
            raise ParameterError(
                f"{path}: {error}. Write '.nc', which has no limit, or keep fewer samples."
            ) from error
        # Replace the header, 116 bytes of text: scipy writes the time of day into it.
        with part.open("r+b") as file:
            file.write(b"MATLAB 5.0 MAT-file, written by saltus".ljust(116))
    return path


def _matlab(ds: xr.Dataset) -> dict[str, Any]:
    """A result as nested dictionaries that savemat understands."""
    groups: dict[str, dict[str, Any]] = {"": {}, "contact": {}, "guard": {}}
    units: dict[str, str] = {}
    for name in map(str, ds.variables):
        group = next((group for group in ("contact", "guard") if group in ds[name].dims), "")
        field = name.removeprefix(f"{group}_") if group else name
        groups[group]["name" if field == group else field] = _matlab_value(ds[name].variable)
        units[name] = ds[name].attrs.get("units", "")
    changed: dict[str, str] = {}
    structs = {
        "contact": _matlab_names(groups["contact"], changed),
        "guard": _matlab_names(groups["guard"], changed),
        "units": _matlab_names(units, changed),
        "provenance": _matlab_names(ds.attrs, changed),
    }
    top = _matlab_names(groups[""], changed, taken=(*structs, "names"))
    return {
        **top,
        **{name: struct for name, struct in structs.items() if struct},
        **({"names": changed} if changed else {}),
    }


def _matlab_value(variable: xr.Variable) -> Any:
    """Samples run down the rows, trajectories across; texts become cells, a single one a character
    array.
    """
    values = (
        variable.transpose(..., "trajectory").values
        if "trajectory" in variable.dims
        else variable.values
    )
    if values.dtype.kind in "fiu":
        return values
    return values.astype(object) if values.ndim else str(values)


def _matlab_names(
    values: Mapping[Any, Any], changed: dict[str, str], taken: Sequence[str] = ()
) -> dict[str, Any]:
    """The mapping under names that MATLAB takes, in the same order; changed ones are noted as new
    name to old name.
    """
    result: dict[str, Any] = {}
    for name, value in values.items():
        base = re.sub(r"\W", "_", str(name), flags=re.ASCII)
        base = (
            base
            if re.match(r"[A-Za-z]", base) and base not in _MATLAB_KEYWORDS
            else f"v_{base.lstrip('_')}"
        )
        valid, number = base[:_MATLAB_LENGTH], 1
        while valid in result or valid in taken:
            number += 1
            valid = f"{base[: _MATLAB_LENGTH - 1 - len(str(number))]}_{number}"
        result[valid] = value
        if valid != name:
            changed[valid] = str(name)
    return result


@xr.register_dataset_accessor("saltus")
class Accessor:
    """``ds.saltus``: methods that a result has besides those of every Dataset."""

    def __init__(self, ds: xr.Dataset) -> None:
        self._ds = ds

    def to_csv(self, path: Target) -> Path:
        """See :func:`to_csv`."""
        return to_csv(self._ds, path)

    def to_mat(self, path: Target) -> Path:
        """See :func:`to_mat`."""
        return to_mat(self._ds, path)

    def save(self, path: Target) -> Path:
        """See :func:`save`."""
        return save(self._ds, path)

    def describe(self) -> str:
        """See :func:`saltus.results.describe`."""
        return describe(self._ds)
