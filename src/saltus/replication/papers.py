"""The papers that can be reproduced: rows beside their study files, and functions for anything a
row can't say.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from pathlib import Path
from string import Formatter
from types import ModuleType
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, nearest
from saltus.replication.claims import Data, Row
from saltus.study.code import PACKAGE

if TYPE_CHECKING:
    from saltus.replication.job import Job
    from saltus.replication.verdict import Finding
    from saltus.results.table import TextTable

#: Title of each paper, by name. Its folder is replications/NAME.
_PAPERS = {
    "saunders2021": "Contact force strength and numerical inaccuracies in piecewise-smooth "
    "systems: ode45 with and without event location",
}


@dataclass(frozen=True)
class Picture:
    """A picture of the report.

    Attributes
    ----------
    figure : str
        Number of the paper's figure that it answers to.
    name : str
        Its own name, also that of its file.
    title, caption : str
        Title, and how to read the picture.
    needs : tuple of str
        Names of the jobs that it is drawn from.
    draw : callable
        From Datasets by name to a matplotlib figure.
    """

    figure: str
    name: str
    title: str
    caption: str
    needs: tuple[str, ...]
    draw: Callable[[Data], Any]


@dataclass(frozen=True)
class Numbers:
    """A table of the report.

    Attributes
    ----------
    figure : str
        Number of the paper's figure that it stands with.
    name : str
        Its own name, also that of its file.
    needs : tuple of str
        Names of the jobs that it is made from.
    make : callable
        From Datasets by name to a table.
    """

    figure: str
    name: str
    needs: tuple[str, ...]
    make: Callable[[Data], TextTable]


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, and the way it is judged.

    Attributes
    ----------
    id : str
        Short name, also its anchor in the report.
    figure : str
        The figure that shows it.
    says : str
        The claim.
    where : str
        Place of the claim in the paper.
    rule : str
        The rule in words.
    needs : tuple of str
        Names of the jobs whose Datasets decide it.
    judge : callable
        From Datasets by name to a :class:`~saltus.replication.verdict.Finding`.
    """

    id: str
    figure: str
    says: str
    where: str
    rule: str
    needs: tuple[str, ...]
    judge: Callable[[Data], Finding]


@dataclass(frozen=True)
class Paper:
    """A paper and its replication.

    Attributes
    ----------
    name : str
        As on the command line.
    title, citation, about : str
        Of the paper; what its replication is about, a few sentences.
    figures : mapping of str to str
        Number of each figure: its title.
    jobs : callable
        From the folder of the study files and whether sizes are small to the jobs, each after those
        that it needs.
    pictures : tuple of Picture
        In the order of the report.
    claims : tuple of Claim
        In the order of the report.
    tables : tuple of Numbers
        In the order of the report.
    """

    name: str
    title: str
    citation: str
    about: str
    figures: Mapping[str, str]
    jobs: Callable[[Path, bool], list[Job]]
    pictures: tuple[Picture, ...]
    claims: tuple[Claim, ...]
    tables: tuple[Numbers, ...] = ()


def names() -> dict[str, str]:
    """Name and title of each paper that can be reproduced."""
    return dict(_PAPERS)


@cache
def find(name: str) -> Paper:
    """A paper by its name.

    Raises
    ------
    ParameterError
        If there is none of this name; the message offers the nearest.
    """
    folder = folder_of(name)
    paper, claims = (
        tomllib.loads((folder / file).read_text(encoding="utf-8"))
        for file in ("paper.toml", "claims.toml")
    )
    sets, pictures, tables = (paper.pop(key) for key in ("sets", "picture", "table"))
    return Paper(
        name=name,
        jobs=code(name, "jobs").jobs,
        **paper,
        pictures=tuple(Picture(**_part(name, row, sets, "draw")) for row in pictures),
        tables=tuple(Numbers(**_part(name, row, sets, "make")) for row in tables),
        claims=tuple(_claim(name, row, sets, claims["texts"]) for row in _whole(claims["claim"])),
    )


def _part(
    paper: str, row: Mapping[str, Any], sets: Mapping[str, Sequence[str]], function: str
) -> dict[str, Any]:
    """The entries of a row, with the names of jobs in place of patterns, and the function in place
    of its name.
    """
    said = {key: value for key, value in row.items() if key not in ("data", "with")}
    return {
        **said,
        "needs": tuple(_expanded(row["data"], sets)),
        function: _function(paper, row[function], row.get("with", {})),
    }


def _claim(
    paper: str, row: Mapping[str, Any], sets: Mapping[str, Sequence[str]], texts: Mapping[str, str]
) -> Claim:
    """A claim from its row."""
    said = _part(paper, row, sets, "read")
    claim = {name: said.pop(name) for name in ("id", "figure", "says", "where", "rule", "needs")}
    why = said.pop("why", ())
    judged = Row(**said, why=({"text": why},) if isinstance(why, str) else tuple(why))
    return Claim(**{**claim, "where": claim["where"].format(**texts)}, judge=judged.judge)


def _whole(rows: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """The rows of claims, completed from the row that they are ``like``."""
    known = {row["id"]: row for row in rows}
    for row in rows:
        whole = {**known[row["like"]], **row} if "like" in row else row
        yield {key: value for key, value in whole.items() if key != "like"}


def _expanded(patterns: Sequence[str], sets: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Names of jobs: ``{ends}`` in a pattern is replaced by each text of this set in turn."""
    for pattern in patterns:
        fields = [name for _, name, _, _ in Formatter().parse(pattern) if name]
        for values in product(*(sets[name] for name in fields)):
            yield pattern.format(**dict(zip(fields, values, strict=True)))


def _function(paper: str, place: str, arguments: Mapping[str, Any]) -> Callable[[Data], Any]:
    """The function ``module.name`` of a paper, with the arguments of its row."""
    module, _, name = place.partition(".")
    return partial(getattr(code(paper, module), name), **arguments)


# -- files that come with saltus -------------------------------------------------------------------
def folder_of(name: str) -> Path:
    """The folder of a paper: beside its modules in an installed package, beside ``src`` in the
    repository.

    Raises
    ------
    ParameterError
        If there is no paper of this name, or its folder is neither here nor there.
    """
    if name not in _PAPERS:
        raise ParameterError(f"no paper {name!r} can be reproduced. {nearest(name, _PAPERS)}")
    root = PACKAGE.parents[1] if PACKAGE.parent.name == "src" else PACKAGE
    folder = next(
        (
            one
            for one in (PACKAGE / "replications" / name, root / "replications" / name)
            if one.is_dir()
        ),
        None,
    )
    if folder is None:
        raise ParameterError(
            f"the study files of {name} are missing: no folder "
            f"{PACKAGE / 'replications' / name}. Install saltus again."
        )
    return folder


def code(name: str, module: str) -> ModuleType:
    """A module of a paper's folder, which is part of saltus. Nothing is ever imported from a user's
    folder.
    """
    package = f"saltus_{name}"
    if package not in sys.modules:
        folder = folder_of(name)
        spec = importlib.util.spec_from_file_location(
            package, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        assert spec is not None
        assert spec.loader is not None
        sys.modules[package] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[package])
    return importlib.import_module(f"{package}.{module}")
