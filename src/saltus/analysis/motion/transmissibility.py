"""`transmissibility`: the ratio of two outputs of a response."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import xarray as xr

from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError, nearest, one_of, shown
from saltus.results.dataset.build import finish
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import RESPONSES, check

#: Quantities by which two outputs are compared.
By = Literal["amplitude", "rms", "rms_about_mean"]


@verb
@reader
def transmissibility(ds: xr.Dataset, output: str, to: str, by: By = "amplitude") -> xr.Dataset:
    """Ratio of two outputs of each response, such as the motion of a mass to that of its base.

    Parameters
    ----------
    ds : Dataset
        The result of ``frequency_response`` or ``bifurcation_diagram``.
    output, to : str
        Outputs of it, states or functions: numerator and denominator.
    by : {"amplitude", "rms", "rms_about_mean"}
        First harmonics, or root mean squares, which count what a nonlinear response sends to other
        frequencies too.

    Returns
    -------
    Dataset
        ``ds`` with ``transmissibility`` on response, and ``transmissibility_phase`` [rad], by which
        the first harmonic of ``output`` leads that of ``to``.

    Raises
    ------
    ParameterError
        If ``ds`` holds no responses, or no such output.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N")
    >>> def spring_force(x, mass, natural_frequency):
    ...     return mass * (2 * sl.pi * natural_frequency) ** 2 * x
    >>> outputs = {"spring_force": spring_force}
    >>> responses = sl.frequency_response(rig, frequency=["16 Hz"], outputs=outputs)
    >>> ratio = sl.transmissibility(responses, "spring_force", to="x")
    >>> round(float(ratio["transmissibility"][0]))  # a linear spring: its rate [N/m]
    2961
    """
    check(ds, caller="transmissibility", kinds=[RESPONSES])
    known = ds["output"].values.tolist() if "output" in ds else []
    for name in (output, to):
        if name not in known:
            raise ParameterError(
                f"transmissibility: {shown(name)} is no output. "
                f"{nearest(name, known)} Ask for functions by outputs=."
            )
    one_of(get_args(By), "transmissibility: ", by=by)
    upper, lower = ds.sel(output=output), ds.sel(output=to)
    units = [one["output_units"].item() for one in (upper, lower)]
    unit = "" if "" in units else "1" if units[0] == units[1] else f"{units[0]}/{_factor(units[1])}"
    with np.errstate(all="ignore"):
        ratio = upper[f"output_{by}"].values / lower[f"output_{by}"].values
    phase = np.angle(np.exp(1j * (upper["output_phase"].values - lower["output_phase"].values)))
    labels = {"units": unit, "long_name": f"{output} / {to}"}
    turn = {"units": "rad", "long_name": f"phase by which {output} leads {to}"}
    added = {
        "transmissibility": xr.Variable("response", ratio, labels),
        "transmissibility_phase": xr.Variable("response", phase, turn),
    }
    kept = {str(name): variable.variable for name, variable in ds.data_vars.items()}
    return finish(
        kept | added, {str(name): one.variable for name, one in ds.coords.items()}, ds.attrs
    )


def _factor(unit: str) -> str:
    """A unit in the form for a denominator."""
    return f"({unit})" if any(sign in unit for sign in "*/ ") else unit
