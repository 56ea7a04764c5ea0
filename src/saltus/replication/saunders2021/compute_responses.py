"""What the jobs of Figs. 3 and 7 compute: steady responses over a parameter, and three ways of integrating side by side.

Each job runs on one thread; several run at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.dataset_parts import provenance
from saltus.analysis.methods.compare_methods import compare_methods, method_label
from saltus.analysis.methods.method_errors import one_period_errors
from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
from saltus.analysis.responses.frequency_response import frequency_response
from saltus.flow import Taylor
from saltus.replication.job import Show
from saltus.replication.saunders2021.compute import Inputs, Settings, method_in
from saltus.results import methods_dataset
from saltus.study.setting import quantities
from saltus.study.setting.setting import system_of
from saltus.study.tables.parts import SystemTable

if TYPE_CHECKING:
    import xarray as xr

    from saltus.system import System

#: Verbs by the names of their tables.
VERBS: dict[str, Callable[..., xr.Dataset]] = {"frequency_response": frequency_response, "bifurcation_diagram": bifurcation_diagram}


def _system(settings: Settings) -> System:
    system = system_of(SystemTable.model_validate(settings["system"]))
    return system.with_values(**quantities.parameters(system, settings["table"].get("values", {})))


def _arguments(table: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments that the analysis takes, from a table of the study file; it reads texts with units itself."""
    keep = ("start", "periods", "sample")
    return {**{name: table[name] for name in keep if name in table}, **_axis(table)}


def _axis(table: Mapping[str, Any]) -> dict[str, Any]:
    if "frequency" in table:
        return {"frequency": _range(table["frequency"])}
    return {"vary": {name: _range(given) for name, given in table["vary"].items()}}


def _range(given: Mapping[str, Any]) -> tuple[Any, ...]:
    ends = (given["first"], given["last"], given["count"])
    return (*ends, "log") if given.get("scale") == "log" else ends


def responses(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001  (all jobs are called alike)
    """The [frequency_response] or [bifurcation_diagram] of the settings."""
    return VERBS[settings["question"]](
        _system(settings), method=method_in(settings), threads=1, progress=show, **_arguments(settings["table"])
    )


def compared(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """Both of the paper's ways of integrating beside the exact one, from the three Datasets that exist already."""
    methods = [method_in({"method": table}) for table in settings["methods"]]
    labels = [method_label(method) for method in (Taylor(), *methods)]
    return compare_methods(
        _system(settings), settings["question"], methods, computed=dict(zip(labels, inputs.values(), strict=True)), threads=1,
        progress=False, **_arguments(settings["table"]),
    )  # fmt: skip


def period_errors(settings: Settings, inputs: Inputs, show: Show) -> xr.Dataset:  # noqa: ARG001
    """The error of one forcing period by further methods, begun on the exact responses of another job."""
    (exact,) = inputs.values()
    system, methods = _system(settings), [method_in({"method": table}) for table in settings["methods"]]
    errors = [one_period_errors(system, Taylor(), method, exact, threads=1) for method in methods]
    no_long_runs = np.full((len(methods), *exact["response_of"].shape), -1, np.int8)
    return methods_dataset(
        base=exact, labels=[method_label(method) for method in methods], columns={},
        fields={"agrees": no_long_runs, **{name: np.stack([error[name] for error in errors]) for name in errors[0]}},
        attrs=provenance(system, methods[0], system.values) | {"analysis": settings["question"]},
    )  # fmt: skip
