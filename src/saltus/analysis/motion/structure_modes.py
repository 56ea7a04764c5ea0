"""`structure_modes`: natural frequencies and mode shapes of a structure, and the flexibility that a
reduction to the lowest modes leaves out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.inputs.verb import verb
from saltus.errors import must_be
from saltus.flow.counts import whole
from saltus.results import Subject, build, made_by
from saltus.results.dataset.schema import MODES
from saltus.system.structures import matrices
from saltus.system.structures.files import matrices_of
from saltus.system.structures.parts import Contact, direction, parts
from saltus.system.structures.reduction import flexibility, modes_of
from saltus.system.structures.structure import degree_names


@verb
def structure_modes(
    mass: Any,
    stiffness: Any = None,
    modes: int | None = None,
    *,
    at: str | Sequence[str | tuple[str, str]] | None = None,
    names: Sequence[str] | str | None = None,
) -> xr.Dataset:
    """The lowest modes of a structure, and their share of the static flexibility.

    Contacts press on few degrees of freedom. What the modes left out would have given way there,
    the residual flexibility, is missing in a reduced system: set beside that of the contact itself,
    1/stiffness, it says whether enough modes are kept.

    Parameters
    ----------
    mass, stiffness : array or SciPy sparse matrix, shape (n, n), or path
        As of :func:`saltus.structure`; both symmetric.
    modes : int, optional
        How many are kept; default all.
    at : str, or sequence of str and of pairs of them, optional
        Degrees of freedom at which the flexibility is asked for; a pair ``("x2", "x1")`` is the
        stretch between the two. Default all, or none of a structure of more than 1500.
    names : sequence of str, or str
        Names of the degrees of freedom.

    Returns
    -------
    Dataset
        Dims ``mode``, ``degree`` and ``place``. ``frequency`` [Hz]; ``shape`` over (degree, mode),
        of unit modal mass; over place ``flexibility`` [m/N], the deflection under a unit force
        there (inf where a rigid body moves), ``residual_flexibility``, the part that the modes left
        out would carry, and ``flexibility_share``, that of the modes that are kept.

    Raises
    ------
    ParameterError
        If a matrix or a name can't be used.

    Examples
    --------
    >>> import numpy as np, saltus as sl
    >>> stiffness = 1e3 * np.array([[2, -1], [-1, 1]])
    >>> table = sl.structure_modes(np.eye(2), stiffness, 1, at="x2")
    >>> round(float(table["frequency"][0]), 3), round(float(table["flexibility_share"][0]), 3)
    (3.111, 0.947)
    """
    given = matrices_of(mass, stiffness, None)
    mass = matrices.checked(given["mass"], "mass", symmetric=True)
    size = matrices.len_of(mass)
    stiffness = matrices.checked(given["stiffness"], "stiffness", size, symmetric=True)
    count = size if modes is None else whole(modes, "modes", 1, size)
    degrees = degree_names(given.get("names") if names is None else names, size)
    known = modes_of(mass, stiffness, count)
    places, vectors = _directions(at, degrees if known.shapes.shape[1] == size else [], degrees)
    total, residual = flexibility(stiffness, known, count, vectors)
    kept = known.lowest(count)
    with np.errstate(invalid="ignore"):  # a rigid body moves, or nothing does
        share = np.where(np.isfinite(total), 1 - residual / total, np.nan)

    values = {
        "frequency": kept.angular / (2 * np.pi), "shape": kept.shapes, "flexibility": total,
        "residual_flexibility": residual, "flexibility_share": share,
        "mode": np.arange(1, count + 1), "degree": degrees, "place": places,
    }  # fmt: skip
    return build(MODES, Subject((), attrs=made_by()), values)


def _directions(at: Any, usual: list[str], degrees: list[str]) -> tuple[list[str], np.ndarray]:
    """Labels of the degrees of freedom, and the directions float64[m, n] of unit forces there."""
    if isinstance(at, str):
        at = at.replace(",", " ").split()
    elif not isinstance(at, list | tuple | None):
        raise must_be("at", "names of degrees of freedom", at)
    pairs: list[tuple[Any, Any]] = [
        one if isinstance(one, tuple) and len(one) == 2 else (one, None)
        for one in (usual if at is None else at)
    ]
    labels = [first if second is None else f"{first} - {second}" for first, second in pairs]
    contacts = [
        Contact(first, 1.0, 1.0, to=second, name=f"place_{number}")
        for number, (first, second) in enumerate(pairs)
    ]
    vectors = [direction(one, degrees) for _, one in parts(Contact, contacts, "place", degrees)]
    return labels, np.array(vectors).reshape(len(vectors), len(degrees))
