"""What every public verb says about its arguments, about compiling and about Ctrl-C."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.inputs.verb import verb
from saltus.announce import announce
from saltus.flow import engine, progress
from saltus.flow.maps import Stroboscope
from saltus.flow.progress import LogLines, reporting
from saltus.interrupt import check_stop

rig = sl.models.delangre("b")


@pytest.mark.parametrize(
    ("keywords", "teaches"),
    [
        (
            {"lower_gap": 1},
            r"parameter of delangre: give it by values={'lower_gap': \.\.\.} or "
            r"system.with_values\(lower_gap=\.\.\.\)",
        ),
        ({"v": 1}, r"state of delangre: give it by start={'x': \.\.\., 'v': \.\.\.}"),
        ({"tend": 1}, "Write t_end="),
        ({"t_eval": [1]}, "Write at="),
        ({"y0": [1, 0]}, "Write start="),
        ({"rtol": 1e-3}, "Write method=sl.ODE45"),
        ({"peroids": 1}, "Did you mean 'periods'"),
    ],
)
def test_an_argument_that_is_not_there_is_answered_by_one_that_is(keywords, teaches):
    with pytest.raises(sl.SaltusError, match=teaches):
        sl.simulate(rig, **keywords)


WING = sl.models.aeroelastic()


@pytest.mark.parametrize(
    ("call", "teaches"),
    [
        (
            lambda: sl.lyapunov(rig, (0, 0), t_end=4),
            r"periods= \(forcing periods, or samples "
            r"every= seconds of a system without",
        ),
        (
            lambda: sl.frequency_response(rig, (1, 2, 3), every=4),
            r"is periods= \(forcing "
            r"periods\)\.",
        ),
        (
            lambda: sl.simulate(rig, (0, 0), every=4),
            r"is t_end= \[s\] or periods= \(forcing "
            r"periods\)\.",
        ),
        (lambda: sl.poincare(WING, (0, 0, 0, 0), ("plunge", 0)), "no forcing period: give t_end="),
        (lambda: sl.simulate(WING, (0, 0, 0, 0), periods=4), "Give t_end= in place of periods="),
        (
            lambda: sl.stroboscope(WING),
            "no forcing period to be seen once in. Take sl.simulate with t_end=",
        ),
    ],
)
def test_each_verb_names_what_tells_it_how_long_to_go_on(call, teaches):
    with pytest.raises(sl.SaltusError, match=teaches):
        call()


def test_ranges_of_states_are_shown_where_they_are_forgotten():
    with pytest.raises(
        sl.SaltusError,
        match=r'Write sl.basins\(system, x=\("-5 mm", "5 mm", '
        r"400\)",
    ):
        sl.basins(rig, {"x": ("-1 mm", "1 mm", 5)})


def test_too_few_and_too_many():
    with pytest.raises(
        sl.SaltusError,
        match=r"missing a required argument: 'system'. Write "
        r"sl.simulate\(system, ",
    ):
        sl.simulate()
    with pytest.raises(sl.SaltusError, match="too many positional arguments"):
        sl.simulate(rig, (0, 0), 1, None, 1, 1)


def test_the_order_of_scipy_is_answered_by_that_of_saltus():
    with pytest.raises(
        sl.SaltusError,
        match=r"the start comes second, and the time is one number: "
        r"sl.simulate\(system, start",
    ):
        sl.simulate(rig, (0, 10), (1e-3, 0))


def test_a_picture_that_is_not_there_is_answered_by_one_that_is():
    with pytest.raises(AttributeError, match="Did you mean 'basins'"):
        sl.plot.basin  # noqa: B018


def test_ctrl_c_before_anything_is_finished_is_told_in_a_sentence():
    @verb
    def pressed(progress=None):
        raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted, match="stopped before anything was finished") as stopped:
        pressed()
    assert stopped.value.partial is None
    assert isinstance(stopped.value, KeyboardInterrupt)


def test_progress_false_silences_what_is_compiled_and_only_the_outermost_counts(capfd):
    @verb
    def inner(progress=None):
        announce("an equation", 20.0)

    @verb
    def outer(progress=None):
        inner(progress=False)

    inner(progress=False)
    assert capfd.readouterr().err == ""
    outer()
    assert capfd.readouterr().err == "saltus: compiling an equation, about 20 s\n"


@pytest.mark.parametrize(
    ("call", "teaches"),
    [
        (lambda: sl.ODE45(RelTol=1e-4), r"sl\.ODE45 has no option 'RelTol'\. Write rtol="),
        (lambda: sl.ODE45(rtoll=1e-4), "Did you mean 'rtol'"),
        (lambda: sl.Taylor(rtol=1e-4), "Known: .*tolerance"),
        (lambda: sl.ODE45(1e-4, 1e-7, "locate", None, 10, 3), "takes rtol=, atol="),
    ],
)
def test_options_that_a_method_has_not_are_answered_by_those_that_it_has(call, teaches):
    with pytest.raises(sl.SaltusError, match=teaches):
        call()


# -- what a System isn't ---------------------------------------------------------------------------
def test_a_system_says_what_to_do_in_place_of_calling_or_changing_it():
    with pytest.raises(sl.SaltusError, match=r"sl.simulate\(delangre, \.\.\.\)"):
        rig(0.0, (0.0, 0.0))
    with pytest.raises(sl.SaltusError, match=r"with_values\(lower_gap=\.\.\.\)"):
        rig.lower_gap = 1.0
    with pytest.raises(sl.SaltusError, match="never changed"):
        rig.name = "another"
    assert rig.name == "delangre"


def test_a_model_that_is_not_there_is_answered_by_those_that_are():
    with pytest.raises(AttributeError, match="Models: delangre, chain, gear_pair, aeroelastic"):
        sl.models.duffing  # noqa: B018


# -- progress in logs ------------------------------------------------------------------------------
def told(shares_at):
    """Lines of a work whose share done is so much at such a time [s]."""
    now, lines = [0.0], []
    show = LogLines(lines.append, clock=lambda: now[0]).show
    for when, share in shares_at:
        now[0] = when
        show(share)
    return lines


def test_a_log_has_a_line_for_each_quarter_of_long_work():
    assert told([(t, t / 100) for t in range(101)]) == [
        "2% done in 2 s, about 98 s left",
        "25% done in 25 s, about 75 s left",
        "50% done in 50 s, about 50 s left",
        "75% done in 75 s, about 25 s left",
    ]


def test_short_work_says_nothing_and_slow_work_says_that_it_lives():
    assert told([(t / 10, t / 19) for t in range(20)]) == []
    assert told([(t, 0.0) for t in range(0, 701, 10)]) == [
        "0% done in 10 s", "0% done in 310 s", "0% done in 610 s"
    ]  # fmt: skip


def test_the_time_left_does_not_count_what_came_before_the_work():
    compiled = 100.0
    assert told([(compiled, 0.0), (compiled + 10, 0.25), (compiled + 20, 0.5)]) == [
        "0% done in 100 s",
        "25% done in 110 s, about 30 s left",
        "50% done in 120 s, about 20 s left",
    ]
    assert told([(compiled, 0.3)]) == ["30% done in 100 s"]


def test_a_part_of_the_work_that_reports_nothing_is_not_silent(monkeypatch, capfd):
    """A line is written where work can be stopped: once, since no share is reported."""
    monkeypatch.setattr(LogLines, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "BEAT", 0.0)
    with reporting(None) as show:
        show(0.3)
        assert "30% done" in capfd.readouterr().err
        monkeypatch.setattr(LogLines, "EVERY", 0.0)
        check_stop()
        assert "30% done" in capfd.readouterr().err
    check_stop()
    assert capfd.readouterr().err == ""


def test_a_function_is_called_while_no_share_is_reported(monkeypatch):
    """A single long run too, slice by slice, before anything is done of the verb."""
    monkeypatch.setattr(progress, "BEAT", 0.0)
    monkeypatch.setattr(engine, "SLICE", 100)
    shares = []
    with reporting(shares.append) as show:
        check_stop()
        show(0.3)
        check_stop()
        assert shares == [0.0, 0.3, 0.3]
        before = len(shares)
        Stroboscope(rig, sl.Taylor(), threads=1).run(np.array([[1e-3, 0.0]]), 200)
        assert len(shares) > before + 10
        assert set(shares) == {0.0, 0.3}


def test_what_progress_may_be():
    with reporting(False) as show:
        assert show is None
    with pytest.raises(sl.SaltusError, match="progress must be"), reporting("bar"):
        pass


@pytest.mark.parametrize(
    "call",
    [
        lambda: sl.Taylor(order="x"),
        lambda: sl.Taylor(order=10**400),
        lambda: sl.Taylor(max_steps=float("nan")),
        lambda: sl.Taylor(max_steps=float("inf")),
        lambda: sl.Taylor(lanes=[2]),
        lambda: sl.Taylor(tolerance="small"),
        lambda: sl.ODE45(rtol=[1e-3]),
        lambda: sl.ODE45(events=[1]),
        lambda: sl.system(lambda t, x: -x),
        lambda: sl.system(states=5),
        lambda: sl.system(states=None),
        lambda: sl.stroboscope(rig, (0, 0), 10**19, keep=1),
        lambda: sl.stroboscope(rig, (0, 0), 2, keep="x"),
        lambda: sl.simulate(rig, (0, 0), periods=2**64, samples=1),
        lambda: sl.simulate(rig, (0, 0), periods=1, threads="many"),
        lambda: sl.simulate(rig, (0, 0), periods=1, values={"frequency": np.array([])}),
    ],
)
def test_wrong_types_and_sizes_are_refused_in_words(call):
    with pytest.raises(sl.SaltusError):
        call()
