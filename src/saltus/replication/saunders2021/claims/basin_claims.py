"""Basins with and without event location: Figs. 8, 11 and 13, and what all maps together say."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.analysis.basins.compare import compare
from saltus.plot.maps import share_text
from saltus.replication.saunders2021.claims.reading import (
    EXACT,
    OFF,
    ON,
    SECTION_5,
    below,
    by_peak,
    certainty,
    check,
    count,
    exponent_text,
    listed,
    micrometres,
    names,
    parameter,
)
from saltus.replication.verdict import Claim, Data, Finding
from saltus.results.dataset.schema import period_text

BEFORE, AFTER = "25.5 kN per m", "23.2 kN per m"
T_BEFORE, T_AFTER = "7694 N per m", "8833 N per m"
#: A graze is seen if an attractor is closer to it than this share of the gap: about the width of a line in the paper's figures.
NEAR_GRAZE = 0.05
STIFF = ("18.4 MN per m", "19.4 MN per m")
SETTINGS = {"fig8": (BEFORE, AFTER), "fig11": (T_BEFORE, T_AFTER), "fig13": STIFF}


def _three(data: Data, figure: str, setting: str) -> dict[str, xr.Dataset]:
    return {end: data[f"{figure}/{setting}, {end}"] for end in (EXACT, ON, OFF)}


def _own(maps: dict[str, xr.Dataset]) -> str:
    return f"located {count(maps[ON])} ({listed(maps[ON])}), not located {count(maps[OFF])} ({listed(maps[OFF])})"


def fig8_before(data: Data) -> Finding:
    """Two attractors before the grazing."""
    maps = _three(data, "fig8", BEFORE)
    high = by_peak(maps[EXACT])[0]
    share = float(maps[EXACT]["attractor_fraction"][high])
    return Finding(
        _own(maps) + ".", f"{count(maps[EXACT])}: {listed(maps[EXACT])}.",
        (check(f"two attractors, exact ({count(maps[EXACT])})", count(maps[EXACT]) == 2),
         check(f"two by ode45 with ({count(maps[ON])}) and without location ({count(maps[OFF])})", count(maps[ON]) == count(maps[OFF]) == 2),
         check(f"the larger one has most of the starts ({share_text(share)})", share > 0.5)),
        certainty(maps.values()),
    )  # fmt: skip


def fig8_after(data: Data) -> Finding:
    """Three attractors after it, the third with location only."""
    maps = _three(data, "fig8", AFTER)
    rare = {end: data[f"fig8/rare, {name}"] for end, name in ((EXACT, "exact"), (ON, "on"), (OFF, "off"))}
    if count(maps[EXACT]) != 3:
        told = f"three attractors, exact ({count(maps[EXACT])})"
        return Finding(_own(maps) + ".", f"{listed(maps[EXACT])}.", (check(told, None if count(maps[EXACT]) < 3 else False),), certainty(maps.values()),
                       "This grid is too coarse to meet a basin as small as the third one's." if count(maps[EXACT]) < 3 else "")  # fmt: skip
    third = int(np.argmin(maps[EXACT]["attractor_fraction"].values))
    peak = float(maps[EXACT]["attractor_peak"][third])
    hits = {}
    for end, ds in rare.items():
        same = np.abs(ds["attractor_peak"].values - peak) < 0.01 * peak
        other = np.abs(maps[end]["attractor_peak"].values - peak) < 0.01 * peak
        hits[end] = int(np.isin(ds["basin"].values, np.flatnonzero(same)).sum()) + int(
            np.isin(maps[end]["basin"].values, np.flatnonzero(other)).sum()
        )
    starts = maps[EXACT]["basin"].size + rare[EXACT].sizes["trajectory"]
    return Finding(
        f"Starts that lead to the third: located {hits[ON]}, not located {hits[OFF]}, of {starts}.",
        f"{count(maps[EXACT])} attractors: {listed(maps[EXACT])}; the third has a peak of {1e3 * peak:.3f} mm.",
        (check(f"three attractors, exact ({count(maps[EXACT])})", count(maps[EXACT]) == 3),
         check(f"ode45 with location finds the third ({hits[ON]} starts)", hits[ON] > 0),
         check(f"ode45 without location doesn't ({hits[OFF]} starts)", hits[OFF] == 0)),
        f"{maps[EXACT]['basin'].size} starts a map, and {rare[EXACT].sizes['trajectory']} on and around the exact basin of the third by each method. "
        "That none of these leads there is no proof that none does.",
    )  # fmt: skip


def fig8_few(data: Data) -> Finding:
    """A few points."""
    maps = _three(data, "fig8", AFTER)
    share = float(maps[EXACT]["attractor_fraction"].min())
    low, high = (float(maps[EXACT][f"attractor_fraction_{end}"].min()) for end in ("low", "high"))
    rare = maps[EXACT]["basin"].values == int(np.argmin(maps[EXACT]["attractor_fraction"].values))
    return Finding(
        f"Located: {share_text(float(maps[ON]['attractor_fraction'].min())) if count(maps[ON]) == 3 else 'none on this grid'}.",
        f"{int(rare.sum())} of {rare.size} starts, {100 * share:.3f} %.",
        (check(f"the third basin has less than 0.1 % of the starts ({100 * share:.3f} %)", share < 1e-3 if count(maps[EXACT]) == 3 else None),),
        f"95 % interval {100 * low:.3f} to {100 * high:.3f} %.",
    )  # fmt: skip


def fig8_dominance(data: Data) -> Finding:
    """Equal dominance after the grazing, a slightly larger amplitude."""
    before, after = data[f"fig8/{BEFORE}, {EXACT}"], data[f"fig8/{AFTER}, {EXACT}"]
    two = np.sort(after["attractor_fraction"].values)[-2:]
    top = [float(ds["attractor_peak"].max()) for ds in (before, after)]
    return Finding(
        f"{listed(data[f'fig8/{AFTER}, {ON}'])}.", f"{listed(after)}; largest peak {1e3 * top[0]:.3f} mm before, {1e3 * top[1]:.3f} mm after.",
        (check(f"the two large basins differ by less than a factor 1.5 ({share_text(two[1])}, {share_text(two[0])})", two[1] < 1.5 * two[0]),
         check(f"the largest amplitude grows, by less than 10 % ({1e3 * top[0]:.3f} to {1e3 * top[1]:.3f} mm)", top[0] < top[1] < 1.1 * top[0])),
        certainty([before, after]),
    )  # fmt: skip


def coarser(data: Data) -> Finding:
    """Boundaries coarser without location."""
    checks, told, exact = [], [], []
    for setting in SETTINGS["fig8"]:
        maps, place = _three(data, "fig8", setting), setting.replace(" per ", "/")
        share = {end: compare(maps[EXACT], maps[end]).attrs for end in (ON, OFF)}
        alpha = {end: (float(ds.attrs["uncertainty_exponent"]), float(ds.attrs["uncertainty_exponent_error"])) for end, ds in maps.items()}
        text = {end: f"{exponent_text(value)} ± {exponent_text(error)}" for end, (value, error) in alpha.items()}
        told.append(f"{place}: uncertainty exponent located {text[ON]}, not located {text[OFF]}; as exact {share_text(share[ON]['agreement'])} and "
                    f"{share_text(share[OFF]['agreement'])} of the starts")  # fmt: skip
        exact.append(f"{place}: {text[EXACT]}")
        apart = alpha[ON][0] - alpha[OFF][0] if np.isfinite(alpha[ON][0] - alpha[OFF][0]) else 0.0
        beyond = abs(apart) > 2 * np.hypot(alpha[ON][1], alpha[OFF][1])
        checks.append(check(f"{place}: the boundary is more intricate without location: smaller uncertainty exponent, by two standard errors "
                            f"({text[OFF]} against {text[ON]})", apart > 0 if beyond else None))  # fmt: skip
        checks.append(check(f"{place}: it lies farther from the exact one: fewer starts lead to their exact attractor, beyond the 95 % intervals",
                            share[ON]["agreement_low"] > share[OFF]["agreement_high"]))  # fmt: skip
    return Finding(
        "; ".join(told), "Uncertainty exponents. " + "; ".join(exact), tuple(checks), certainty([data[f"fig8/{BEFORE}, {EXACT}"]])
    )


def fig11_one(data: Data) -> Finding:
    """One attractor on both sides."""
    checks, own, exact = [], [], []
    for setting in SETTINGS["fig11"]:
        maps = _three(data, "fig11", setting)
        place = setting.replace(" per ", "/")
        checks.append(check(f"{place}: one attractor, exact ({listed(maps[EXACT])})", count(maps[EXACT]) == 1))
        own.append(f"{place}: {_own(maps)}")
        exact.append(f"{place}: {listed(maps[EXACT])}")
    every = [ds for setting in SETTINGS["fig11"] for ds in _three(data, "fig11", setting).values()]
    after = data[f"fig11/{T_AFTER}, {EXACT}"]
    seen = float(after["attractor_fraction"].min()) * after["basin"].size
    return Finding(
        "; ".join(own), "; ".join(exact), tuple(checks), certainty(every),
        f"The second one has {seen:.0f} of {after['basin'].size} starts here; a map of few starts has none."
        if count(after) > 1 else "",
    )  # fmt: skip


def fig13_four(data: Data) -> Finding:
    """Four attractors in total."""
    checks, own, exact = [], [], []
    for setting in STIFF:
        maps = _three(data, "fig13", setting)
        place = setting.replace(" per ", "/")
        checks.append(check(f"{place}: four attractors, exact ({count(maps[EXACT])})", count(maps[EXACT]) == 4))
        checks += [
            check(f"{place}: four by ode45, {word} ({count(maps[end])})", count(maps[end]) == 4)
            for end, word in ((ON, "located"), (OFF, "not located"))
        ]
        own.append(f"{place}: {_own(maps)}")
        exact.append(f"{place}: {listed(maps[EXACT])}")
    return Finding(
        "; ".join(own), "; ".join(exact), tuple(checks),
        certainty([ds for setting in STIFF for ds in _three(data, "fig13", setting).values()]), _same_peaks(data[f"fig13/{STIFF[0]}, {EXACT}"]),
    )  # fmt: skip


def _same_peaks(ds: xr.Dataset) -> str:
    """The two attractors whose peaks are nearest each other, in a sentence."""
    order = by_peak(ds)
    gaps = np.abs(np.diff(ds["attractor_peak"].values[order])) / ds["attractor_peak"].values[order[:-1]]
    if not gaps.size or gaps.min() > 0.01:
        return ""
    i = int(np.argmin(gaps))
    return f"Peaks of {names(ds)[order[i]]} and {names(ds)[order[i + 1]]} differ by {100 * gaps[i]:.1g} %: the paper's colours can't tell them apart."


def fig13_dominant(data: Data) -> Finding:
    """The attractor of highest amplitude dominant."""
    checks = []
    told: list = []
    own: list = []
    for setting in STIFF:
        for end in (EXACT, ON):
            ds = data[f"fig13/{setting}, {end}"]
            peak = ds["attractor_peak"].values
            level = peak > 0.98 * peak.max()
            share = float(ds["attractor_fraction"].values[level].sum())
            text = f"{setting.replace(' per ', '/')}: {', '.join(np.array(names(ds))[level])} have peaks within 2 %, together {share_text(share)}"
            (told if end == EXACT else own).append(text)
            if end == EXACT:
                checks.append(
                    check(
                        f"{setting.replace(' per ', '/')}: attractors of the highest peak (within 2 %) have most starts ({share_text(share)})",
                        share > 0.5,
                    )
                )
                checks.append(check("and that is one attractor", int(level.sum()) == 1))
    return Finding("; ".join(own), "; ".join(told), tuple(checks), certainty([data[f"fig13/{s}, {EXACT}"] for s in STIFF]),
                   "By peak amplitude, the paper's colour, several attractors look like one.")  # fmt: skip


def fig13_same(data: Data) -> Finding:
    """The same attractors before and after: no transition."""
    exact, own = ([data[f"fig13/{setting}, {end}"] for setting in STIFF] for end in (EXACT, ON))
    both = compare(*exact)
    alone = [
        names(ds)[i]
        for ds, side in zip(exact, "ab", strict=True)
        for i in range(count(ds))
        if i not in both[f"match_{side}"].values[_paired(both)]
    ]
    single = data[f"fig7/f, {EXACT}"]
    here = (single["contact_stiffness"].values > 0.95 * 1.84e7) & (single["contact_stiffness"].values < 1.05 * 1.94e7)
    periods = [period_text(int(n), "unsettled") for n in single["period"].values[here, 0]]
    return Finding(
        f"{listed(own[0])}; {listed(own[1])}.", f"{listed(exact[0])}; {listed(exact[1])}.",
        (check(f"each exact attractor at 18.4 MN/m has its like at 19.4 MN/m, and the other way round ({', '.join(alone) or 'none'} without)", not alone),
         check(f"the single start of Fig. 7(f) leads to several of them between 17.5 and 20.4 MN/m ({', '.join(dict.fromkeys(periods))})",
               len(set(periods)) > 1 if periods else None)),
        certainty(exact),
    )  # fmt: skip


def _paired(both: xr.Dataset) -> np.ndarray:
    """Which rows of a comparison name an attractor of both maps, bool."""
    return (both["match_a"].values >= 0) & (both["match_b"].values >= 0)


def fig13_granular(data: Data) -> Finding:
    """No structure in the basins."""
    numbers = [float(data[f"fig13/{setting}, {EXACT}"].attrs["uncertainty_exponent"]) for setting in STIFF]
    flips = [float(data[f"fig13/{setting}, {EXACT}"].attrs["flip_rate"]) for setting in STIFF]
    return Finding(
        f"Located: {'; '.join(exponent_text(float(data[f'fig13/{s}, {ON}'].attrs['uncertainty_exponent'])) for s in STIFF)}.", f"Uncertainty exponents {exponent_text(numbers[0])} and {exponent_text(numbers[1])}; {share_text(max(flips))} of starts lead elsewhere when recomputed.",
        tuple(below(f"{setting.replace(' per ', '/')}: uncertainty exponent", value, 0.2) for setting, value in zip(STIFF, numbers, strict=True)),
        certainty([data[f"fig13/{s}, {EXACT}"] for s in STIFF]),
    )  # fmt: skip


def boundaries_only(data: Data) -> Finding:
    """No location changes boundaries, not attractors."""
    invented, lost, absent, told, changed = [], [], [], [], []
    for figure, settings in (("fig6", ("14.75 Hz", "15 Hz", "15.75 Hz", "16 Hz")), *SETTINGS.items()):
        for setting in settings:
            maps = _three(data, figure, setting)
            place = f"Fig. {figure[3:]}, {setting.replace(' per ', '/')}"
            invented += [f"{name} in {place}" for name in _unmatched(maps[EXACT], maps[OFF], "b")]
            lost += [f"{name} in {place}" for name in _unmatched(maps[ON], maps[OFF], "a")]
            absent += [f"{name} in {place}" for name in _unmatched(maps[EXACT], maps[ON], "a")]
            agree = {a + b: float(compare(maps[a], maps[b]).attrs["agreement"]) for a, b in ((ON, OFF), (EXACT, ON), (EXACT, OFF))}
            changed.append(1.0 - agree[ON + OFF])
            told.append(
                f"{place}: {share_text(agree[ON + OFF])} (as exact: {share_text(agree[EXACT + ON])}, {share_text(agree[EXACT + OFF])})"
            )
    return Finding(
        f"Starts that lead to the same attractor with and without location (in brackets: located and not located to the exact one): {'; '.join(told)}.",
        f"Exact attractors that ode45 lacks with location too: {'; '.join(absent) or 'none'}.",
        (check(f"no attractor is found without location that isn't there in exact arithmetic ({'; '.join(invented) or 'none'})", not invented),
         check(f"none that ode45 has with location is lost without ({'; '.join(lost) or 'none'})", not lost),
         check(f"basins change: somewhere more than 5 % of the starts lead elsewhere (most: {share_text(max(changed))})", max(changed) > 0.05)),
        "Attractors are matched by their orbits (sl.compare). Missing may mean a basin smaller than the map resolves. "
        + certainty([data[f"{figure}/{s}, {end}"] for figure, settings in SETTINGS.items() for s in settings for end in (EXACT, ON, OFF)]),
        "Part of the change isn't due to contacts: where with location, too, many starts lead elsewhere than exactly, rounding would do."
    )  # fmt: skip


def _unmatched(a: xr.Dataset, b: xr.Dataset, side: str) -> list[str]:
    """Attractors of one of two maps, ``a`` or ``b``, that the other doesn't have."""
    both = compare(a, b)
    rows = (both["match_a"].values >= 0) != (both["match_b"].values >= 0)
    mine = rows & (both[f"match_{side}"].values >= 0)
    return [period_text(int(n), "an aperiodic one") for n in both["match_period"].values[mine]]


def graze_margins(data: Data) -> Finding:
    """Grazing contacts: one attractor before, two after."""
    found = {setting: data[f"fig8/{setting}, {EXACT}"] for setting in (BEFORE, AFTER)}
    near = {setting: int((ds["attractor_margin"].values < NEAR_GRAZE * parameter(ds, "upper_gap")).sum()) for setting, ds in found.items()}
    told = "; ".join(
        f"{setting.replace(' per ', '/')}: {', '.join(micrometres(float(m)) for m in ds['attractor_margin'].values)}"
        for setting, ds in found.items()
    )
    return Finding(
        "Not computed: its errors are as large as these distances.",
        f"Distance of each attractor from a graze: {told}.",
        (
            check(
                f"before: one attractor is closer to a graze than {share_text(NEAR_GRAZE)} of the gap ({near[BEFORE]})", near[BEFORE] == 1
            ),
            check(f"after: two are ({near[AFTER]})", near[AFTER] == 2),
        ),
        "Margins from samples a thousandth of a period apart, with parabolas through the extremes.",
    )


_FIG8 = tuple(f"fig8/{s}, {end}" for s in SETTINGS["fig8"] for end in (EXACT, ON, OFF))
_FIG11 = tuple(f"fig11/{s}, {end}" for s in SETTINGS["fig11"] for end in (EXACT, ON, OFF))
_FIG13 = tuple(f"fig13/{s}, {end}" for s in STIFF for end in (EXACT, ON, OFF))
_FIG6 = tuple(f"fig6/{f}, {end}" for f in ("14.75 Hz", "15 Hz", "15.75 Hz", "16 Hz") for end in (EXACT, ON, OFF))
_RARE = tuple(f"fig8/rare, {name}" for name in ("exact", "on", "off"))

CLAIMS = (
    Claim("fig8-before", "8", "Before the grazing (Kc = 2.55e4 N/m) there are two attractors, with and without location; the larger is dominant.",
          f"Section 5.1, Fig. 8(a, b). {SECTION_5}", "Attractors of the three maps; the larger has more than half of the starts.", _FIG8, fig8_before),
    Claim("fig8-after", "8", "After it (Kc = 2.32e4 N/m) there are three; the third is captured only with event location.", "Section 5.1, Fig. 8(c, d)",
          "The exact map has three attractors; ode45 leads some start of the map, or around the exact basin of the third, to it with location, and none "
          "without.", (*_FIG8, *_RARE), fig8_after),
    Claim("fig8-few", "8", "The third comprises just a few points of the map.", "Section 5.1", "Its basin has less than 0.1 % of the starts.", _FIG8, fig8_few),
    Claim("fig8-dominance", "8", "After it the two larger attractors are equally dominant, and the largest amplitude has grown slightly.", "Section 5.1",
          "Their shares differ by less than a factor 1.5; the largest peak grows by less than 10 %.", _FIG8, fig8_dominance),
    Claim("coarser", "8", "Without event location the boundaries of the basins are coarser.", "Section 5.1",
          "At both stiffnesses the uncertainty exponent of the map is smaller without location, by two standard errors; and fewer starts lead to their exact "
          "attractor, beyond the 95 % intervals.", _FIG8, coarser),
    Claim("graze-margins", "10", "A grazing contact is seen for one attractor before, for two after.", "Section 5.1, Figs. 9, 10",
          "One exact attractor is closer to a graze than 5 % of the gap before, two are after: about the width of a line in the figure.", _FIG8, graze_margins),
    Claim("fig11-one", "11", "There is only one attractor before the period doubling, and only one after.", "Section 5.2, Fig. 11",
          "The exact maps have one attractor each.", _FIG11, fig11_one),
    Claim("fig13-four", "13", "Near the transition to chaos there are four attractors.", "Section 5.3, Fig. 13",
          "The exact maps, and those by ode45 with and without location, have four attractors each.", _FIG13, fig13_four),
    Claim("fig13-dominant", "13", "In all cases the attractor of highest amplitude is dominant.", "Section 5.3",
          "Attractors whose peaks are within 2 % of the highest have more than half of the starts, and that is one attractor.", _FIG13, fig13_dominant),
    Claim("fig13-same", "13", "The attractors are the same before and after the 'transition': the single start just leads to another one.", "Section 5.3",
          "Each exact attractor at the one stiffness has its like at the other; between them the single start of Fig. 7(f) leads to several.",
          (*_FIG13, f"fig7/f, {EXACT}"), fig13_same),
    Claim("fig13-granular", "13", "The basins have no structure, they are granular throughout.", "Section 5.3",
          "The uncertainty exponent of both exact maps is below 0.2.", _FIG13, fig13_granular),
    Claim("boundaries-only", "13", "Neglecting event location changes basin boundaries, but no attractors; fictitious ones are never formed.",
          "Abstract, section 6", "Over all maps, ode45 without location finds no attractor that isn't there and misses none; and somewhere more than "
          "5 % of the starts lead elsewhere.", (*_FIG6, *_FIG8, *_FIG11, *_FIG13), boundaries_only),
)  # fmt: skip
