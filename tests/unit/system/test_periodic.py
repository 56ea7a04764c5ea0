"""A forced system repeats after its forcing period: by formula, by samples, and asked again for
every new value.
"""

from dataclasses import replace

import numpy as np
import pytest

from saltus.analysis.inputs.starts import ensemble
from saltus.contact import freeplay
from saltus.errors import ParameterError, TraceError
from saltus.language import cos, exp, mod, pi, piecewise, sin
from saltus.system import periodic, system
from saltus.system.periodic import check_periodic, repeats_by_formula, timing_of

# equations that use some of their parameters only
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.UnusedParameterWarning")


def forced(law, **options):
    def rig(t, x, v, *, amplitude=1e-3, stiffness=1e4, frequency=15.0, other=30.0):
        return v, law(t, x, amplitude, frequency, other) - stiffness * x - freeplay(
            x, stiffness=stiffness, gap=0.1
        )

    return system(**{"states": "x v", "forced_at": "frequency", **options})(rig)


SMOOTH = [
    lambda t, x, a, f, g: a * cos(2 * pi * f * t + x) ** 3 * exp(sin(2 * pi * g * t)) - x,
    lambda t, x, a, f, g: (
        a * cos(2 * pi * f * t - 2 * pi * g * t + 1.0) + a * sin(2 * pi * g * (t + x))
    ),
    lambda t, x, a, f, g: a * cos(2 * pi * mod(g * t, 1.0)),
]
CLOCKS = [
    lambda t, x, a, f, g: a * piecewise((1.0, cos(2 * pi * g * t) > 0.3), otherwise=-x),
    lambda t, x, a, f, g: a * mod(t, 1 / g) * x,
]
OTHERS = {30.0: True, 31.0: False, 45.0: True, 30.0 + 1e-4: False, 7.5: False}


def verdicts(made):
    """Whether the system repeats with each of the other frequencies."""
    passed = []
    for other in OTHERS:
        try:
            check_periodic(
                replace(made, values={**made.values, "other": other}, forced_at="frequency")
            )
            passed.append(True)
        except TraceError:
            passed.append(False)
    return passed


@pytest.mark.parametrize("law", SMOOTH + CLOCKS)
def test_the_formula_tells_all_where_time_enters_as_phases_and_clocks(law, monkeypatch):
    def refuse(*_):
        raise TraceError("no formula says that it repeats")

    monkeypatch.setattr(periodic, "_check_samples", refuse)
    assert verdicts(forced(law, forced_at=None)) == list(OTHERS.values())


@pytest.mark.parametrize("law", SMOOTH)
def test_samples_find_the_same(law, monkeypatch):
    """Of smooth laws: short pulses lie between samples, which is why clocks have the
    formula only.
    """
    made = forced(law, forced_at=None)
    monkeypatch.setattr(
        periodic, "timing_of", lambda entry: replace(timing_of(entry), clocks=(), complete=False)
    )
    assert verdicts(made) == list(OTHERS.values())


def test_every_value_that_sets_a_period_is_looked_at():
    """What passed with some values doesn't with others."""
    fixed = forced(lambda t, x, a, f, g: a * cos(2 * pi * f * t) + a * sin(60 * pi * t))
    assert fixed.with_values(frequency=10.0).period() == 0.1
    with pytest.raises(TraceError, match="multiple"):
        fixed.with_values(frequency=20.0)
    assert fixed.with_values(frequency=30.0, amplitude=0.0, other=7.0).period() == 1 / 30


@pytest.mark.parametrize(
    "law",
    [
        lambda t, x, a, f, g: a * cos(2 * pi * f * t) + (g - 30.0) * t,
        lambda t, x, a, f, g: a * cos(2 * pi * f * t + (g - 30.0) * t**2),
        lambda t, x, a, f, g: (
            a * cos(2 * pi * f * t + piecewise((x, x > 0), otherwise=(g - 30.0) * t))
        ),
        lambda t, x, a, f, g: a * cos(2 * pi * f * t + (g - 30.0) * t * x),
    ],
)
def test_what_no_formula_tells_is_sampled_with_each_value(law):
    rig = forced(law)
    assert not timing_of(rig.field[1]).complete
    assert rig.with_values(amplitude=2.0, frequency=16.0).period() == 1 / 16
    with pytest.raises(TraceError, match="dv/dt doesn't repeat"):
        rig.with_values(other=31.0)


def test_a_step_in_time_is_no_phase():
    """An angle that jumps once: its rate is the same on both sides."""
    with pytest.raises(TraceError, match="dv/dt doesn't repeat"):
        forced(
            lambda t, x, a, f, g: a * cos(2 * pi * f * t + piecewise((0.5, t > 0.1), otherwise=0.0))
        )


@pytest.mark.parametrize("law", SMOOTH + CLOCKS)
def test_many_values_repeat_by_formula_only_if_each_of_them_does(law):
    """Whole multiples of a frequency repeat, a phase that is no clock by its formula too; one value
    among many that doesn't is enough.
    """
    rig = forced(law)
    good = np.array([value for value, repeats in OTHERS.items() if repeats])
    known = repeats_by_formula(rig, {"other": good})
    assert known == all(timing_of(entry).complete for entry in rig.field)
    frequency = np.array([10.0, 15.0])
    assert repeats_by_formula(rig, {"frequency": frequency, "other": 3 * frequency}) == known
    for value, repeats in OTHERS.items():
        if not repeats:
            assert not repeats_by_formula(rig, {"other": np.append(good, value)})
            with pytest.raises(ParameterError, match=r"trajectory 2: .*doesn't repeat"):
                ensemble(rig, (0, 0), {"other": np.append(good, value)})
