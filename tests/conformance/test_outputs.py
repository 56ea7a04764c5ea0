"""An output changes nothing else: every verb gives the same numbers of a system with outputs, and
what it gives can be saved, described and read back.
"""

from functools import cache

import numpy as np
import pytest
from tests.conformance.test_every_verb import CALLS, takes

import saltus as sl

pytestmark = pytest.mark.usefixtures("few_scouts")

OUTPUTS = {
    "stop force": lambda x, contact_stiffness, upper_gap: (
        contact_stiffness * sl.max(x - upper_gap, 0)
    ),
    "drive": (lambda t, force, frequency: force * sl.cos(2 * sl.pi * frequency * t), "N"),
}
#: Verbs that look for the turning points of each output: the motion is cut there too.
CUT_BY_OUTPUTS = ("sensitivity",)
#: One with a boundary of its own, at which the pieces of a motion are cut: sums round otherwise.
BEYOND = {"beyond": lambda x: sl.piecewise((x, x > 0.2e-3), otherwise=0)}
#: Those that take the rig.
VERBS = [name for name in CALLS if takes(name, "system") and name != "equilibria"]


def call_of(name):
    """A verb, its system and the other arguments of a call without outputs."""
    system, arguments = CALLS[name]("in SI")
    return getattr(sl, name), system, {k: v for k, v in arguments.items() if k != "outputs"}


@cache
def plain_result(name):
    verb, system, arguments = call_of(name)
    return verb(system, **arguments)


@pytest.mark.parametrize("outputs", [OUTPUTS, OUTPUTS | BEYOND], ids=["smooth", "cut"])
@pytest.mark.parametrize("name", VERBS)
def test_an_output_changes_nothing_else(name, outputs, tmp_path):
    verb, system, arguments = call_of(name)
    plain, more = plain_result(name), verb(system.with_outputs(outputs), **arguments)
    for key, one in plain.drop_vars("method_cpu_seconds", errors="ignore").variables.items():
        other = more[key]
        for dim in {"output", "outcome"}.intersection(one.dims):  # the states stand first
            other = other.isel({dim: slice(0, one.sizes[dim])})
        exact = outputs is OUTPUTS and name not in CUT_BY_OUTPUTS
        if exact or one.dtype.kind != "f":
            np.testing.assert_array_equal(one.values, other.values, err_msg=key)
        else:
            # a mean may be zero: what it rounds with is the motion's size
            size = plain[key.replace("output_mean", "output_rms")].values
            atol = 1e-12 * np.abs(size[np.isfinite(size)]).max(initial=0.0)
            np.testing.assert_allclose(one.values, other.values, rtol=1e-12, atol=atol, err_msg=key)
    assert "outputs" not in plain.attrs
    file = sl.save(more, tmp_path / "more.nc")
    assert sl.load(file).identical(more)
    assert sl.describe(more)
