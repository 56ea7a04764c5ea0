"""Sets of uncertain values and their statistics, and what is refused."""

import numpy as np
import pytest
from scipy import stats

import saltus as sl
from saltus.analysis.scatter.numbers import QUANTILES, quantiles, sobol_indices
from saltus.analysis.scatter.sets import design_of
from saltus.errors import ParameterError, SaltusWarning

RIG = sl.models.delangre("a", force="4 N", frequency="15 Hz")
GAP = {"upper_gap": sl.normal("0.4 mm", "0.02 mm")}
TWO = GAP | {"contact_stiffness": sl.uniform("12 kN/m", "16 kN/m")}


def test_any_part_of_the_sets_is_the_part_of_all_of_them():
    design = design_of(RIG, TWO, 32, 5, True)
    every = design.values(np.arange(len(design)))
    assert len(design) == 32 * 4
    some = np.array([127, 3, 40, 64, 96])
    assert (design.values(some) == every[some]).all()
    a, b, first, second = every.reshape(4, 32, 2)
    assert (first[:, 0] == b[:, 0]).all()
    assert (first[:, 1] == a[:, 1]).all()
    assert (second[:, 1] == b[:, 1]).all()
    assert (design_of(RIG, TWO, 32, 5, False).values(np.arange(32)) == a).all()
    assert not (design_of(RIG, TWO, 32, 6, False).values(np.arange(32)) == a).any()


def test_threads_change_no_bit():
    one, two = (sl.scatter(RIG, GAP, samples=12, threads=n) for n in (1, 2))
    assert one.identical(two)


def test_indices_are_those_of_scipy():
    rng = np.random.default_rng(11)
    a, b = rng.normal(size=(2, 64))
    ab = rng.normal(size=(3, 64))
    first, total = sobol_indices(a, b, ab, 1)
    known = stats.sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": ab[:, None]}, n=64)
    assert first[0] == pytest.approx(known.first_order, rel=1e-12)
    assert total[0] == pytest.approx(known.total_order, rel=1e-12)


def test_intervals_of_quantiles_hold_as_often_as_they_say():
    trials, n = 2000, 100
    drawn = np.random.default_rng(20261126).exponential(size=(n, trials))
    _, low, high = quantiles(drawn)
    exact = -np.log1p(-np.array(QUANTILES))[:, None]
    holds = (~(low > exact) & ~(high < exact)).mean(axis=1)
    assert (holds > 0.95 - 3 * np.sqrt(0.05 * 0.95 / trials)).all()
    assert np.isnan(high[-1]).all()  # 100 values have none that is above the quantile of 99 %


@pytest.mark.parametrize(
    ("one", "known"),
    [
        (sl.normal("0.4 mm", "0.02 mm"), stats.norm(0.4e-3, 2e-5)),
        (sl.uniform("0.3 mm", 5e-4), stats.uniform(3e-4, 2e-4)),
        (sl.lognormal("0.4 mm", 1.2), stats.lognorm(np.log(1.2), scale=4e-4)),
        (sl.triangular("0 mm", "0.1 mm", "0.4 mm"), stats.triang(0.25, 0, 4e-4)),
        (
            sl.truncated(sl.normal("0.4 mm", "0.1 mm"), "0.35 mm", "0.6 mm"),
            stats.truncnorm(-0.5, 2.0, 4e-4, 1e-4),
        ),
        (sl.distribution(stats.beta(2, 5), "mm"), stats.beta(2, 5, 0, 1e-3)),
    ],
)
def test_distributions_are_those_of_scipy(one, known):
    shares = np.linspace(0.01, 0.99, 7)
    assert one.values(shares, "m", "gap") == pytest.approx(known.ppf(shares), rel=1e-9)


def test_sets_that_the_system_refuses_are_counted():
    masses = {"mass": sl.normal("1 kg", "1 kg")}
    with pytest.warns(SaltusWarning, match=r"\d sets of 16 were refused .* mass .*positive"):
        found = sl.scatter(RIG, masses, ask=lambda _, values: {"m": values["mass"]}, samples=16)
    refused = found["set_status"].values == "refused"
    assert (refused == (found["value"].values[:, 0] <= 0)).all()
    assert (np.isnan(found["number"].values[:, 0, 0]) == refused).all()


def _ask(_, values):
    return {"a": np.zeros(3)}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"uncertain": {}}, "uncertain must be a mapping of parameters to distributions"),
        ({"uncertain": {"uper_gap": GAP["upper_gap"]}}, "Did you mean 'upper_gap'"),
        ({"uncertain": {"upper_gap": "0.4 mm"}}, "upper_gap has no distribution but '0.4 mm'"),
        ({"uncertain": {"upper_gap": sl.normal("0.4 mm", 0)}}, "a standard deviation above 0"),
        ({"uncertain": {"upper_gap": sl.normal("0.4 N", "1 N")}}, "0.4 N"),
        ({"uncertain": {"mass": sl.uniform("-2 kg", "-1 kg")}}, "takes none of the 1024 sets"),
        (
            {"uncertain": {"mass": sl.truncated(sl.uniform("1 kg", "2 kg"), "3 kg", "4 kg")}},
            "no value of mass lies in the range",
        ),
        ({"samples": 2**23, "indices": True}, "sets are too many"),
        ({"ask": _ask, "samples": 8}, "ask gives shape .3,. as 'a'. It gets an array of 8 values"),
        ({"ask": _ask, "start": (0, 0)}, "give start to what it calls"),
        ({"ask": 3}, "ask must be a"),
        ({"box": {"x": (0, 1)}}, "box.* is for random starts"),
    ],
)
def test_what_can_not_be_meant_is_refused_in_words(arguments, said):
    with pytest.raises(sl.SaltusError, match=said):
        sl.scatter(RIG, **{"uncertain": GAP} | arguments)
    with pytest.raises(ParameterError, match="frozen"):
        sl.distribution(stats.norm)


def test_what_was_finished_survives_ctrl_c():
    def ask(_, values):
        if len(values["upper_gap"]) < 1024:
            raise KeyboardInterrupt
        return {"gap": values["upper_gap"]}

    with pytest.raises(sl.Interrupted) as stopped:
        sl.scatter(RIG, GAP, ask=ask, samples=1100)
    part = stopped.value.partial
    assert (part["set_status"].values == "computed").sum() == 1024
    assert np.isfinite(part["quantile_of"].values).all()


def test_pictures_have_a_panel_for_each_parameter():
    found = sl.scatter(RIG, TWO, {"x": ["0 mm", "5 mm"], "v": 0}, samples=8)
    axes = sl.plot.scatter(found, "v rms", start=1).figure.axes
    assert [one.get_xlabel() for one in axes] == [
        "upper gap [mm]", "contact stiffness [kN/m]", "sets",
    ]  # fmt: skip
    drawn = np.concatenate([line.get_xdata() for line in axes[0].lines])
    assert np.sort(drawn) == pytest.approx(1e3 * np.sort(found["value"].values[:, 0]))
    assert len(sl.plot.corner(found).figure.axes) == 4
    with pytest.raises(ParameterError, match="Did you mean 'x peak'"):
        sl.plot.scatter(found, "x peek")
