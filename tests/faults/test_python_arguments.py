"""Wrong, odd and extreme arguments of the Python functions are answered, or refused in words: never
by a traceback from inside.
"""

import random
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
import xarray as xr

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning, TraceError
from saltus.models import find

pytestmark = pytest.mark.filterwarnings("ignore")

rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
VERBS = (
    "simulate",
    "stroboscope",
    "attractors",
    "basins",
    "basin_fractions",
    "frequency_response",
    "bifurcation_diagram",
    "lyapunov",
    "poincare",
    "impact_statistics",
    "energy_balance",
    "compare_methods",
)
FINISHED = ("to_csv", "to_mat", "save")
ODD = [
    0, -0.0, 1, -1, 3.7, 1e-3, float("nan"), float("inf"), -float("inf"), 5e-324, 1e308, 1e16,
    2**63, 2**64, 10**400, True, None, "",
    "1 mm",
    "nan m", "1e400 m", "x", "ζ m", "1 m" * 50, "\0", b"1", 1j, np.float16(1e-3), np.int8(1),
    np.float64("nan"), np.longdouble(1e-3),
    np.array(1e-3), np.array(None), np.array("x"), np.array([]), np.array([1e-3]),
    np.array([1e-3, 2e-3]), np.zeros((2, 2)),
    np.zeros((2, 2, 2)),
    np.array(["1 mm"]), np.array([None, 1]), np.ma.masked, np.datetime64("2020-01-01"),
    np.datetime64("2020-01-01", "ns"),
    np.timedelta64(1, "s"), np.array(["2020", "2021"], "M8[ns]"), [], [1e-3], [1e-3, float("nan")],
    [[1.0, 2.0], [1.0]], (), (1, 2, 3), {},
    {"x": 1}, {"x": {"x": 1}}, {5: 1}, set(), object(), abs, range(3), Decimal("1e-3"),
    Fraction(1, 1000), int, xr.Dataset(), rig,
    sl.Taylor,
]  # fmt: skip


class StartedError(sl.SaltusError):
    """The arguments were taken; the work would begin here."""


@pytest.fixture
def only_arguments(monkeypatch):
    """Verbs end where a kernel would be compiled or loaded."""

    def kernels(*_):
        raise StartedError

    monkeypatch.setattr(sl.Taylor, "kernels", kernels)
    monkeypatch.setattr(sl.ODE45, "kernels", kernels)


class Draw(random.Random):
    """Arguments of which some are right and some are not."""

    def odd(self):
        return self.choice(ODD)

    def often(self, *good):
        """One of these, or anything, one time in four."""
        return self.odd() if self.random() < 0.25 else self.choice(good)

    def start(self):
        return self.often(
            (1e-3, 0.0),
            {"x": 1e-3, "v": 0.0},
            (self.odd(), self.odd()),
            {"x": self.odd(), "v": self.odd()},
            [[1e-3, 0.0], [0.0]],
        )

    def range(self, low, high):
        pair = self.choice(
            [
                (low, high),
                (low, high),
                (high, low),
                (low, low),
                (self.odd(), high),
                (low, self.odd()),
            ]
        )
        return self.often(
            (*pair, 3),
            (*pair, self.odd()),
            (*pair, 3, "log"),
            (*pair, 3, self.odd()),
            [low, self.odd()],
            np.array([low, high]),
        )

    def values(self):
        name = self.choice(["force", "frequency", "mass", "contact_stiffness", "nothing"])
        return self.often(
            None,
            {},
            {name: self.odd()},
            {name: [1.0, self.odd()]},
            {name: self.range(14.0, 16.0)},
            {self.odd_key(): 1.0},
        )

    def odd_key(self):
        return self.choice([5, "", "x", None, (), 1.5, "mass\0"])

    def arguments(self):
        """Arguments that some verb has, each with values that suit it and values that don't."""
        box = {"x": (-1e-3, 1e-3), "v": self.often((-0.1, 0.1), (self.odd(), self.odd()))}
        return {
            "start": self.start, "periods": lambda: self.often(1, 2, 20),
            "keep": lambda: self.often(1, None),
            "samples": lambda: self.often(1, 20),
            "t_end": lambda: self.often(0.1, "1 ms", 0, -1),
            "t_start": lambda: self.often(0.0, "1 ms"), "values": self.values,
            "method": lambda: self.often(None, sl.Taylor(), sl.ODE45(), sl.Taylor, "Taylor"),
            "flow": lambda: self.often(None, sl.Taylor(), "variational"),
            "time_errors": lambda: self.often("local", "measured", "other"),
            "threads": lambda: self.often(None, 1, 2),
            "progress": lambda: self.often(None, False), "seed": lambda: self.often(1, 2),
            "every": lambda: self.often(None, None, "0.1 s"),
            "at": lambda: self.often(None, {"x": 0.0}, {self.odd_key(): 0.0}),
            "box": lambda: self.often(box, {self.odd_key(): (0.0, 1.0)}),
            "frequency": lambda: self.range(14.0, 16.0),
            "vary": lambda: self.often({"force": self.range(1.0, 4.0)},
                {self.odd_key(): (1.0, 2.0, 2)}),
            "sample": lambda: self.often("turning_points", "stroboscope", "contacts"),
            "unit": lambda: self.often("1/s", "1/period"),
            "outputs": lambda: self.often(None, {"force": lambda x: 2 * x}, {"two": (lambda v: v,
            "m/s")}, {self.odd_key(): lambda x: x}, {"a": self.odd()}),
            "surface": lambda: self.often("upper_gap", ("x", 0.0), ("x", self.odd()), lambda x: x,
                "x turns"),
            "follow": lambda: self.often(False, True),
            "x": lambda: self.range(-1e-3, 1e-3), "v": lambda: self.range(-0.1, 0.1),
        }  # fmt: skip

    def call(self, verb):
        """Some of these arguments, which a call needs being among them most of the time."""
        likely = {
            "start": 0.7,
            "periods": 0.8,
            "frequency": 0.3,
            "vary": 0.3,
            "surface": 0.4,
            "x": 0.3,
            "v": 0.3,
        }
        if verb in ("frequency_response", "transmissibility"):
            likely |= {"frequency": 0.95, "x": 0.02, "v": 0.02}
        elif verb in ("basins", "basin_fractions"):
            likely |= {"x": 0.95, "v": 0.95, "start": 0.05}
        elif verb == "bifurcation_diagram":
            likely |= {"vary": 0.95, "x": 0.02, "v": 0.02}
        else:
            likely |= {"x": 0.02, "v": 0.02, "frequency": 0.02, "vary": 0.02}
        given = (
            getattr(sl, verb).__wrapped__.__code__
            if hasattr(getattr(sl, verb), "__wrapped__")
            else getattr(sl, verb).__code__
        )
        known = given.co_varnames[: given.co_argcount + given.co_kwonlyargcount]
        return {
            name: make() for name, make in self.arguments().items()
            if self.random() < (likely.get(name, 0.25) if name in known or name in ("x",
                "v") else 0.02)
        }  # fmt: skip


def _equation(t, x, v, *, k=1.0, f=1.0):
    return v, -k * x


def _other(draw):
    """A call of something else than a verb."""
    odd, other = draw.odd, draw.odd()
    finished, plot = (
        draw.choice(FINISHED),
        draw.choice(["history", "phase", "basins", "frequency_response", "spectrum"]),
    )
    return draw.choice([
        ("sl.Taylor",
            lambda: sl.Taylor(**{draw.choice(["order", "tolerance", "lanes", "max_steps",
                "max_events"]): other})),
        ("sl.ODE45",
            lambda: sl.ODE45(**{draw.choice(["rtol", "atol", "events", "max_steps",
                "max_events"]): other})),
        ("sl.models.delangre",
            lambda: sl.models.delangre(draw.often("a", "b"), force=odd(), frequency=odd())),
        ("models.find", lambda: find(other)),
        ("with_values",
            lambda: rig.with_values(**{draw.choice(["mass", "force", "frequency", "upper_gap",
                "zz"]): other})),
        ("system", lambda: sl.system(states=draw.often("x v", "x x", "x t", "lambda v",
            "__class__ v"), units=draw.often(None, {"x": odd()}),
                                     forced_at=draw.often(None, "f"), name=draw.often(None, "a"),
                                     source=draw.often("", "b"))(_equation)),
        ("system of", lambda: sl.system(states="x v")(other)),
        ("table",
            lambda: sl.table(sl.sin, draw.often([0.0, 1.0, 2.0]), draw.often([0.0, 1.0, 4.0]),
                kind=draw.often("linear"))),
        ("load", lambda: sl.load(draw.often("/dev/null", "", "\0", "x" * 5000))),
        ("from_dict",
            lambda: sl.System.from_dict(draw.often({**rig.to_dict(),
                draw.choice(list(rig.to_dict())): odd()}, {}))),
        (f"sl.{finished}", lambda: getattr(sl, finished)(other, odd())),
        (f"sl.plot.{plot}", lambda: getattr(sl.plot, plot)(other)),
    ])  # fmt: skip


def _answer(what, call, tried):
    try:
        return call()
    except sl.SaltusError as error:
        return error
    except Exception as error:
        raise AssertionError(f"{tried}: {what} ends in {error!r}") from error


@pytest.mark.parametrize(
    ("seed", "trials"), [(11, 3000), pytest.param(None, 60_000, marks=pytest.mark.nightly)]
)
def test_every_refusal_is_in_words(only_arguments, seed, trials):
    seed = random.randrange(2**31) if seed is None else seed
    draw, refused, taken = Draw(seed), 0, 0
    for trial in range(trials):
        if draw.random() < 0.3:
            what, call = _other(draw)
        else:
            verb = draw.choice(VERBS)
            given = draw.call(verb)
            what, call = (
                f"sl.{verb}(rig, {given})",
                lambda verb=verb, given=given: getattr(sl, verb)(rig, **given),
            )
        end = _answer(what, call, f"seed {seed}, trial {trial}")
        refused += isinstance(end, sl.SaltusError) and not isinstance(end, StartedError)
        taken += isinstance(end, StartedError)
    assert refused > trials / 3, refused
    assert taken > trials / 100, taken


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: sl.models.delangre([]), r"delangre has no case \[\]. Known: a, b, c"),
        (lambda: sl.system(states=5), 'states must be names, such as states="x v", not 5'),
        (lambda: sl.system(states="x v", units=5), "units must be a mapping"),
        (lambda: sl.system(states="x v", forced_at=[])(_equation), "forced_at must be the name of "
            "a parameter"),
        (lambda: sl.system(states="x v")(dict), "Python doesn't know the arguments"),
        (lambda: rig.with_values(force=np.datetime64("2020-01-01", "ns")), "is not a number"),
        (lambda: sl.simulate(rig, (np.timedelta64(1, "ns"), 0.0), periods=1), "is not a number"),
        (lambda: sl.simulate(rig, {5: 1.0}, periods=1), "has no state 5. Known: x, v"),
        (lambda: sl.simulate(rig, (0, 0), periods=1, values={"force": ([1, 2], 2, 3)}),
            r"force = \[1, "
            r"2\] must be one number"),
        (lambda: sl.simulate(rig, (0, 0), periods=1, time_errors=np.array(["local", "x"])),
            'time_errors '
            'must be "measured" or "local"'),
        (lambda: sl.bifurcation_diagram(rig, vary={"force": (1, 2, 2)}, sample=np.array([])),
            "sample=array.* "
            "isn't known"),
        (lambda: sl.frequency_response(rig, (14, 15, 2), start="random ²", box={"x": (0, 1)}),
            "start='random "
            "²' isn't known"),
        (lambda: sl.load("x" * 5000), "there is no file"),
    ],
)  # fmt: skip
def test_what_once_ended_inside(only_arguments, call, told):
    with pytest.raises(sl.SaltusError, match=told):
        call()


# -- what to do next -------------------------------------------------------------------------------
@sl.system(states="x v")
def unnamed(t, x, v, *, f=0.2):
    """Its forcing repeats, and nothing says so."""
    return v, -x - 0.1 * v + sl.cos(2 * sl.pi * f * t)


@sl.system(states="x v", forced_at="f")
def walled(t, x, v, *, f=0.2, gap=0.5):
    """With a rigid stop."""
    return v, -x - 0.1 * v + sl.cos(2 * sl.pi * f * t), sl.impact(x < gap, v, restitution=0.8)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sl.attractors(unnamed, (0, 0)), "depends on time, .* name it by forced_at="),
        (lambda: sl.lyapunov(unnamed, (0, 0)), "depends on time, .* name it by forced_at="),
        (lambda: sl.basin_fractions(rig, x=(-1, 1, 9), v=(0, 1)), r"x must be \(low, high\)"),
        (lambda: sl.bifurcation_diagram(rig, force=(1, 2, 3)), "vary={'force': "),
        (lambda: sl.energy_balance(rig), r"energy=\.\.\., supplied=\.\.\."),
    ],
)
def test_a_wrong_call_is_answered_by_the_right_one(call, words):
    with pytest.raises(ParameterError, match=words):
        call()


def test_comparisons_that_are_joined_need_brackets():
    with pytest.raises(TraceError, match=r"brackets, \(x > gap\) & \(v > 0\)"):

        @sl.system(states="x v")
        def made(t, x, v):
            return v, -sl.piecewise((x, x > 1.0 & v > 0.0), otherwise=0.0)


def test_a_start_beyond_a_stop_is_called_that():
    with pytest.warns(SaltusWarning, match="invalid - the start lies beyond a stop"):
        sl.simulate(walled, (0.6, 0.0), periods=1)
