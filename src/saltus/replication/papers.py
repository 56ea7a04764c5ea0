"""The papers that can be reproduced, and where their study files stand."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, nearest

if TYPE_CHECKING:
    import xarray as xr

    from saltus.replication.job import Job
    from saltus.replication.verdict import Claim
    from saltus.study.table import TextTable

#: Name of each paper: what it is. Its module is saltus.replication.NAME.
_PAPERS = {
    "saunders2021": "Contact force strength and numerical inaccuracies in piecewise-smooth systems: ode45 with and without event location",
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
        What it shows; how to read it.
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
    draw: Callable[[Mapping[str, xr.Dataset]], Any]


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
    make: Callable[[Mapping[str, xr.Dataset]], TextTable]


@dataclass(frozen=True)
class Paper:
    """A paper and how it is reproduced.

    Attributes
    ----------
    name : str
        As on the command line.
    title, citation, about : str
        Of the paper; what its replication is about, a few sentences.
    figures : mapping of str to str
        Number of each figure: its title.
    jobs : callable
        From the folder of the study files and whether sizes are small to the jobs, each after those that it needs.
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


def find(name: str) -> Paper:
    """A paper by its name.

    Raises
    ------
    ParameterError
        If there is none of this name; the message offers the nearest.
    """
    if name not in _PAPERS:
        raise ParameterError(f"no paper {name!r} can be reproduced. {nearest(name, _PAPERS)}")
    paper: Paper = importlib.import_module(f"saltus.replication.{name}").PAPER
    return paper


def folder_of(name: str) -> Path:
    """The folder of a paper's study files: in an installed package beside its modules, in the repository beside ``src``.

    Raises
    ------
    ParameterError
        If neither is there.
    """
    package = Path(str(resources.files("saltus")))
    places = [package / "replications" / name, package.parents[1] / "replications" / name]
    for place in places:
        if place.is_dir():
            return place
    raise ParameterError(f"the study files of {name} are missing: no folder {' or '.join(map(str, places))}. Install saltus again.")
