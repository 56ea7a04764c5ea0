"""What `lyapunov` says about arguments that it can't use."""

import pytest

import saltus as sl
from saltus.errors import ParameterError, UnitError

RIG = sl.models.delangre("a")
WING = sl.models.find("aeroelastic")()


@pytest.mark.parametrize(
    ("system", "arguments", "message"),
    [
        (RIG, {"method": "wulf"}, "no method 'wulf'. Did you mean 'wolf'"),
        (RIG, {"method": sl.ODE45()}, r"flow=sl.ODE45"),
        (RIG, {"unit": "1/sec"}, "aren't given in '1/sec'. Did you mean '1/s'"),
        (RIG, {"periods": 10}, "periods must be a whole number of at least 64"),
        (RIG, {"periods": 100.5}, "periods must be a whole number"),
        (RIG, {"transient": -1}, "transient must be a whole number of at least 0"),
        (RIG, {"start": (float("nan"), 0.0)}, "start of x isn't finite"),
        (RIG, {"start": (0.0,)}, "2 numbers"),
        (RIG, {"every": 0.1}, r"is forced.*Leave every= out"),
        (RIG, {"exponents": 3}, "exponents must be at most 2"),
        (RIG, {"exponents": 1, "method": "wolf"}, "largest exponent only. Leave exponents= out"),
        (RIG, {"flow": "Taylor"}, "method must be such as sl.Taylor"),
        (RIG, {"values": {"fequency": 3.0}}, "Did you mean 'frequency'"),
        (RIG, {"start": ("1 s", 0)}, "x is measured in m"),
        (WING, {"every": -1.0}, "every must be a positive time"),
        (
            WING,
            {"every": 0.2, "unit": "bit/period"},
            "has no forcing period, so 'bit/period'.*Take unit=.bit/s.",
        ),
        ("rig", {}, "must be a System"),
    ],
)
def test_arguments_that_can_not_be_used(system, arguments, message):
    start = arguments.pop("start", None) if "start" in arguments else None
    with pytest.raises((ParameterError, UnitError), match=message):
        sl.lyapunov(system, start, **arguments)
