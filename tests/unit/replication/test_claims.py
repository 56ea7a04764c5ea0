"""Judges on small made-up data: each rule can pass and can fail."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from saltus.replication import find
from saltus.replication.papers import code
from saltus.replication.verdict import FAILS, HOLDS, IN_PART, UNDECIDED

PAPER = find("saunders2021")
CLAIMS = {claim.id: claim.judge for claim in PAPER.claims}
multistable, stiffness, validation, attractors_, sameness = (
    code("saunders2021", name)
    for name in (
        "read_multistable",
        "read_stiffness",
        "read_validation",
        "read_attractors",
        "sameness",
    )
)

KINDS = {"c": "chaotic", "1": "periodic", "2": "periodic", "u": "unconverged"}
ENDS = ("exact", "ode45 located", "ode45 not located")


def diagram(text, rms=None):
    """A bifurcation diagram over 1e3 to 1e9 N/m; a letter of the text for each stiffness."""
    stiffness_ = np.logspace(3, 9, len(text))
    period = np.array([int(one) if one.isdigit() else 0 for one in text])
    sizes = np.full(len(text), 1e-3) if rms is None else np.asarray(rms, float)
    variables = {"type": np.array([KINDS[one] for one in text]), "period": period, "rms": sizes}
    return xr.Dataset(
        {
            name: (("contact_stiffness", "start"), values[:, None])
            for name, values in variables.items()
        },
        {"contact_stiffness": stiffness_},
    )


def attractors(kinds, peaks=None, shares=None, margins=None, multiplier=0.5, **attrs):
    """A map with attractors such as "1 1 3 c"."""
    kinds = kinds.split()
    periods = [0 if one == "c" else int(one) for one in kinds]
    count = len(kinds)
    of = {
        "attractor_type": ["chaotic" if one == "c" else "periodic" for one in kinds],
        "attractor_period": periods,
        "attractor_peak": peaks or [1e-3 * (i + 1) for i in range(count)],
        "attractor_fraction": shares or [1 / count] * count,
        "attractor_margin": margins or [1e-4] * count,
    }  # fmt: skip
    ds = xr.Dataset(
        {name: ("attractor", values) for name, values in of.items()},
        {"attractor": np.arange(count)},
    )
    ds["attractor_multiplier_real"] = ("attractor", "multiplier"), np.full((count, 2), multiplier)
    ds["attractor_multiplier_imag"] = ("attractor", "multiplier"), np.zeros((count, 2))
    for end in ("low", "high"):
        ds[f"attractor_fraction_{end}"] = ds["attractor_fraction"]
    ds["basin"] = ("x", "v"), np.arange(100).reshape(10, 10) % count
    numbers = {
        "smallest_basin_seen": 0.03,
        "flip_rate": 0.0,
        "uncertainty_exponent": 0.1,
        "parameters": '{"upper_gap": 8e-4, "frequency": 5.0}',
    }
    return ds.assign_attrs({**numbers, **attrs})


# -- over the stiffness ----------------------------------------------------------------------------
def test_chaos_beyond_a_stiffness_holds_or_not():
    hard, soft = "1" * 70 + "c" * 30, "1" * 90 + "c1" * 5
    judge = CLAIMS["chaos-17"]
    data = {f"fig7/e, {end}": diagram(hard) for end in ENDS}
    assert judge(data).verdict == HOLDS
    data = {f"fig7/e, {end}": diagram(soft) for end in ENDS}
    assert judge(data).verdict == FAILS


def test_what_only_ode45_takes_for_chaos_is_told():
    data = {"fig7/e, exact": diagram("1" * 100)} | {
        f"fig7/e, {end}": diagram("1" * 60 + "u" * 40) for end in ENDS[1:]
    }
    finding = CLAIMS["chaos-17"](data)
    assert finding.verdict == FAILS
    assert "looks like chaos" in finding.why
    assert (
        "looks like chaos"
        not in CLAIMS["chaos-17"]({f"fig7/e, {end}": diagram("1" * 100) for end in ENDS}).why
    )


def test_onset_of_chaos_that_persists():
    kinds = np.array([KINDS[one] for one in "1c1111cccc"])
    assert stiffness.onset(np.arange(10.0), kinds) == 6.0
    assert np.isnan(stiffness.onset(np.arange(3.0), np.array(["periodic"] * 3)))


@pytest.mark.parametrize(("where", "verdict"), [(8.0e3, HOLDS), (3e4, FAILS)])
def test_the_period_doubling_is_looked_for_where_it_is(where, verdict):
    text = "".join("1" if value < where else "2" for value in np.logspace(3, 9, 601))
    assert CLAIMS["doubling"]({f"fig7/e, {end}": diagram(text) for end in ENDS}).verdict == verdict


def beside(exact, on, off, error=(1e-4, 1e-4)):
    """What compare_methods returns: rms of the three ways along the stiffness."""
    rms = np.array([exact, on, off], float)[:, :, None]
    at = np.logspace(3, 9, rms.shape[1])
    errors = np.stack([np.zeros(len(at)), np.full(len(at), error[0]), np.full(len(at), error[1])])
    kinds = np.where(np.isnan(rms), "unconverged", "periodic")
    return xr.Dataset(
        {"rms": (("method", "contact_stiffness", "start"), rms),
            "type": (("method", "contact_stiffness", "start"), kinds),
         "step_error_rms": (("method", "contact_stiffness"), errors)}, {"contact_stiffness": at},
    )  # fmt: skip


def tighter(*errors):
    """The errors of one period of two further methods along the stiffness."""
    values = np.repeat(np.array(errors)[:, None], 50, axis=1)
    return xr.Dataset(
        {"step_error_rms": (("method", "contact_stiffness"), values)},
        {"contact_stiffness": np.logspace(3, 9, 50)},
    )


def test_errors_at_intermediate_stiffness():
    at = np.logspace(3, 9, 301)
    hump = np.where((at > 1e5) & (at < 1e7), 2.0, 1.0)
    data = {f"fig7/{panel}, compared": beside(np.ones(301), np.ones(301), hump) for panel in "def"}
    for ds in data.values():
        ds["step_error_rms"][2] = np.where((at > 1e4) & (at < 1e8), 2e-4, 1e-4)
    assert [check.passed for check in CLAIMS["intermediate"](data).checks] == [True] * 6
    nearly = {
        f"fig7/{panel}, compared": beside(np.ones(301), np.ones(301), np.ones(301), (1e-4, 1e-4))
        for panel in "def"
    }
    assert [check.passed for check in CLAIMS["intermediate"](nearly).checks] == [None] * 6
    growing = {
        f"fig7/{panel}, compared": beside(np.ones(301), np.ones(301), np.where(at > 1e7, 2.0, 1.0))
        for panel in "def"
    }
    assert [check.passed for check in CLAIMS["intermediate"](growing).checks[:3]] == [False] * 3


def test_location_helps_only_if_it_does():
    wrong, right = np.full(50, 2.0), np.ones(50)
    good = {f"fig7/{panel}, compared": beside(right, right, wrong, (1e-5, 1e-3)) for panel in "def"}
    good |= {f"fig7/{panel}, tighter": tighter(1e-6, 1e-4) for panel in "def"}
    assert CLAIMS["location-helps"](good).verdict == HOLDS
    bad = {f"fig7/{panel}, compared": beside(right, wrong, right, (1e-3, 1e-5)) for panel in "def"}
    bad |= {f"fig7/{panel}, tighter": tighter(1e-6, 1e-6) for panel in "def"}
    assert CLAIMS["location-helps"](bad).verdict == FAILS


def test_two_sets_of_dots():
    on, off = (
        np.array([[1.0, 2.0], [1.0, 1.0], [1.0, np.nan]]),
        np.array([[2.0, 1.01], [1.0, 3.0], [1.0, 1.0]]),
    )
    assert stiffness.curves_differ(on, off).tolist() == [False, True, False]


# -- sameness --------------------------------------------------------------------------------------
def test_same_other_unsettled():
    ds = beside([1.0, 1.0, 1.0], [1.04, 1.06, np.nan], [1.0, 1.0, 1.0])
    assert sameness.classes(ds, 1)[:, 0].tolist() == [
        sameness.SAME_ONE,
        sameness.OTHER,
        sameness.UNSETTLED,
    ]


def test_two_chaotic_motions_are_the_same():
    ds = beside([1.0], [1.5], [1.0])
    ds["type"][:2] = "chaotic"
    assert sameness.classes(ds, 1)[0, 0] == sameness.SAME_ONE


def test_the_running_share_of_a_step():
    at = np.logspace(3, 9, 1201)
    places, share, low, high = sameness.running_share(at, at > 1e6)
    assert share[places < 1e5].max() == 0.0
    assert share[places > 1e7].min() == 1.0
    assert share[np.argmin(np.abs(places - 1e6))] == pytest.approx(0.5, abs=0.02)
    assert (low <= share).all()
    assert (share <= high).all()


# -- attractors and basins -------------------------------------------------------------------------
@pytest.mark.parametrize(("after", "verdict"), [("1", HOLDS), ("1 2", IN_PART)])
def test_one_attractor_on_both_sides(after, verdict):
    data = {
        f"fig11/{setting}, {end}": attractors(kinds)
        for setting, kinds in (("7694 N per m", "1"), ("8833 N per m", after))
        for end in ENDS
    }
    assert CLAIMS["fig11-one"](data).verdict == verdict


@pytest.mark.parametrize(("off", "verdict"), [(0, HOLDS), (3, IN_PART)])
def test_a_third_attractor_with_location_only(off, verdict):
    three = attractors("1 1 1", shares=[0.2, 0.799, 0.001])
    two = attractors("1 1", peaks=[1e-3, 2e-3])
    data = {
        f"fig8/23.2 kN per m, {end}": ds for end, ds in zip(ENDS, (three, three, two), strict=True)
    }
    for name, hits in (("exact", 4), ("on", 2), ("off", off)):
        rare = attractors("1 1 1")
        rare["basin"] = "trajectory", np.array([2] * hits + [0] * (9 - hits))
        data[f"fig8/rare, {name}"] = rare
    assert CLAIMS["fig8-after"](data).verdict == verdict


def test_granular_basins_that_no_grid_measures_are_not_decided():
    names = [
        f"fig13/{setting}, {end}" for setting in ("18.4 MN per m", "19.4 MN per m") for end in ENDS
    ]
    data = {name: attractors("1 2", uncertainty_exponent=np.nan) for name in names}
    assert CLAIMS["fig13-granular"](data).verdict == UNDECIDED
    data = {name: attractors("1 2", uncertainty_exponent=0.8) for name in names}
    assert CLAIMS["fig13-granular"](data).verdict == FAILS


@pytest.mark.parametrize(
    ("wild", "off", "verdict"),
    [(ENDS[:2], "1 2 3 5", HOLDS), (ENDS[1:2], "1 2 3 6", IN_PART), ((), "1 2 3 6", FAILS)],
)
def test_a_chaotic_attractor_at_stiff_contact(wild, off, verdict):
    """Exponents along the motions decide, not what the map calls them."""
    data = {}
    for end in ENDS:
        name = f"fig13/18.4 MN per m, {end}"
        data[name] = attractors(off if end == ENDS[2] else "1 2 3 6")
        kinds, rates = (["chaotic"], [5.0]) if end in wild else (["periodic"], [-0.9])
        data[f"{name}, variational"] = xr.Dataset(
            {
                "kind": ("trajectory", kinds),
                "lyapunov_exponent": (("trajectory", "number"), [[*rates, -2.0]]),
            }
        )
    finding = CLAIMS["fig14-chaotic"](data)
    assert finding.verdict == verdict
    assert ("look chaotic" in finding.why) == (verdict == IN_PART)


@pytest.mark.parametrize(
    ("n", "inner", "verdict"), [(12, -1.0673, HOLDS), (24, -1.0673, FAILS), (24, -0.5, IN_PART)]
)
def test_twelve_or_twenty_four(n, inner, verdict, monkeypatch):
    """The orbit of half the period says something only if it is the 12T one: a stable 12T may have
    doubled from an unstable 6T.
    """
    halved = attractors(f"{n} {n // 2}")
    halved["attractor_multiplier_real"][1] = [inner, -0.2]
    found = attractors(f"{n} 30").drop_vars("basin").assign(basin=("trajectory", [1, 1, 0, 1]))
    told = xr.Dataset({"response_period": ("trajectory", [3, 5, n, 4])})
    monkeypatch.setattr(multistable, "settled", lambda _: told)
    finding = CLAIMS["fig5-twelve"](
        {"fig5/halved": halved, "fig5/attractors": found, "fig5/ode45": None}
    )
    assert finding.verdict == verdict
    assert ("twelve dots" in finding.why) == (n == 24)


def test_a_third_attractor_that_the_map_misses_is_not_decided():
    two = attractors("1 1", shares=[0.2, 0.8])
    data = {f"fig8/23.2 kN per m, {end}": two for end in ENDS} | {
        f"fig8/rare, {name}": two for name in ("exact", "on", "off")
    }
    assert CLAIMS["fig8-after"](data).verdict == UNDECIDED
    assert CLAIMS["fig8-few"](data).verdict == UNDECIDED


def test_large_exponents_by_wolf_on_inexact_motions_decide_nothing():
    assert attractors_.small(np.array([0.1, -0.1]), 0.5, exact=False) is True
    assert attractors_.small(np.array([0.1, 7.0]), 0.5, exact=False) is None
    assert attractors_.small(np.array([0.1, 7.0]), 0.5, exact=True) is False
    assert attractors_.small(np.array([]), 0.5, exact=True) is None


@pytest.mark.parametrize(
    ("bunch", "passed"), [([4] * 5, True), ([4, 5, 4, 5, 24], None), ([5] * 5, False)]
)
def test_a_start_decides_only_if_its_neighbours_agree(bunch, passed, monkeypatch):
    exact = xr.Dataset({"response_period": ("trajectory", [3, 5, 24, bunch[0]])})
    rows = xr.Dataset({"response_period": ("trajectory", [3] * 5 + [5] * 5 + [24] * 5 + bunch)})
    monkeypatch.setattr(multistable, "settled", lambda ds: rows if ds == "beside" else exact)
    checks = CLAIMS["fig5-periods"](
        {"fig5/exact": "exact", "fig5/ode45": "ode45", "fig5/beside": "beside"}
    ).checks
    assert [check.passed for check in checks] == [True, True, False, passed]


# -- contact times ---------------------------------------------------------------------------------
def contacts(shift):
    """Three contacts with tiny residuals, at times that are off by ``shift``."""
    of = {
        "contact_time": np.array([0.1, 0.2, 0.3]) + shift, "contact_time_error": np.full(3, 1e-15),
        "contact_x": np.full(3, 1e-17),
        "contact_velocity": np.ones(3), "contact_guard": np.array(["lower"] * 3),
    }  # fmt: skip
    ds = xr.Dataset(
        {name: ("contact", values) for name, values in of.items()}, {"guard": ["lower"]}
    )
    return ds.assign(guard_boundary=("guard", [0.0]), guard_state=("guard", ["x"]))


@pytest.mark.parametrize(("shift", "verdict"), [(1e-15, HOLDS), (1e-5, FAILS)])
def test_a_small_residual_is_no_exact_time(shift, verdict):
    assert (
        CLAIMS["table2-time"]({"fig2/ode45": contacts(shift), "fig2/exact": contacts(0.0)}).verdict
        == verdict
    )


def test_three_measured_points_are_not_decided_without_them():
    ds = xr.Dataset({name: ("response", values) for name, values in {
        "response_frequency": [18.0], "response_period": [3],
        "response_rms": [4e-4]}.items()})  # fmt: skip
    assert CLAIMS["three-points"]({"fig3/a4, exact": ds}).verdict == UNDECIDED


@pytest.mark.parametrize(("rms", "verdict"), [("0.41", HOLDS), ("0.1", FAILS)])
def test_three_measured_points_decide_if_they_are_given(rms, verdict, tmp_path, monkeypatch):
    (tmp_path / "measured_a4.csv").write_text(
        "frequency [Hz],amplitude [mm]\n" + "".join(f"{f},{rms}\n" for f in (17.8, 18.0, 18.2))
    )
    monkeypatch.setattr(validation, "folder_of", lambda _: tmp_path)
    ds = xr.Dataset({name: ("response", values) for name, values in {
        "response_frequency": [18.0], "response_period": [3],
        "response_rms": [4e-4]}.items()})  # fmt: skip
    assert CLAIMS["three-points"]({"fig3/a4, exact": ds}).verdict == verdict


# -- jobs ------------------------------------------------------------------------------------------
@pytest.mark.parametrize("quick", [False, True])
def test_whatever_is_asked_for_is_computed(quick):
    from saltus.replication.papers import folder_of
    from saltus.study.tables.parts import slug

    paper = PAPER
    jobs = paper.jobs(folder_of(paper.name), quick)
    names = [job.name for job in jobs]
    assert len(set(names)) == len(names) == len({slug(job.name) for job in jobs})
    for one in (*paper.pictures, *paper.claims, *paper.tables):
        assert set(one.needs) <= set(names), one
    for place, job in enumerate(jobs):
        assert set(job.needs) <= set(names[:place])
