"""What the attractors are, with and without event location: Figs. 9, 10, 12 and 14."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.plot.maps import share_text
from saltus.replication.saunders2021.claims.basin_claims import NEAR_GRAZE
from saltus.replication.saunders2021.claims.reading import EXACT, OFF, ON, SECTION_5, check, count, listed, names, parameter, place_of
from saltus.replication.saunders2021.pictures.looks import strobe
from saltus.replication.saunders2021.pictures.rows import Trio, deviations, trios
from saltus.replication.verdict import Check, Claim, Data, Finding
from saltus.results.dataset.schema import kind_text, period_text

#: Deviation from the exact orbit, in units of the motion's range, that is "excellent agreement".
EXCELLENT = 0.02
#: An exponent by Wolf's algorithm is close to zero below this much a forcing period.
SMALL = 0.1
#: Scatter of states at whole periods below which a point looks like a point.
POINT = 1e-3


def _range(data: Data, figure: str, setting: str, trio: Trio) -> np.ndarray:
    run = data[f"{figure}/{setting}, {EXACT}, motions"]
    one = run.isel(trajectory=trio.number[EXACT]) if "trajectory" in run.dims else run
    return np.array([np.ptp(one[name].values) for name in ("x", "v")])


def _misses(data: Data, figure: str, setting: str) -> list[tuple[Trio, dict[str, float]]]:
    """For each exact attractor: largest deviation of each of the paper's two ways at whole periods, in units of the motion's range."""
    rows = []
    for trio in trios(data, figure, setting):
        if trio.number[EXACT] >= 0:
            clouds = deviations(data, figure, setting, trio)
            size = _range(data, figure, setting, trio)
            rows.append((trio, {end: float(np.abs(cloud / size).max()) for end, cloud in clouds.items()}))
    return rows


def _told(rows: list[tuple[Trio, dict[str, float]]], end: str) -> str:
    return ", ".join(f"{kind_text(trio.kind, trio.period)} {misses[end]:.1e}" if end in misses else f"{kind_text(trio.kind, trio.period)} not found"
                     for trio, misses in rows)  # fmt: skip


def _agree(data: Data, settings: Sequence[tuple[str, str]]) -> Finding:
    """Excellent agreement of attractors with and without location."""
    checks: list[Check] = []
    on, off = [], []
    for figure, setting in settings:
        rows = _misses(data, figure, setting)
        place = place_of(setting)
        on.append(f"{place}: {_told(rows, ON)}")
        off.append(f"{place}: {_told(rows, OFF)}")
        for trio, misses in rows:
            if ON in misses and OFF in misses:
                name = kind_text(trio.kind, trio.period)
                checks.append(check(f"{place}, {name}: both within {share_text(EXCELLENT)} of the exact one ({misses[ON]:.1e}, {misses[OFF]:.1e})",
                                    max(misses.values()) < EXCELLENT))  # fmt: skip
    return Finding(
        f"Largest deviation from the exact orbit at whole periods, in units of the motion's range. Located: {'; '.join(on)}. Not located: {'; '.join(off)}.",
        "The reference, closed to rounding.", tuple(checks), "64 periods after 256 on the attractor.",
    )  # fmt: skip


def agree_8(data: Data) -> Finding:
    """Figs. 9 and 10."""
    return _agree(data, (("fig8", "25.5 kN per m"), ("fig8", "23.2 kN per m")))


def agree_11(data: Data) -> Finding:
    """Fig. 12."""
    return _agree(data, (("fig11", "7694 N per m"), ("fig11", "8833 N per m")))


def _wolf(data: Data, figure: str, setting: str, end: str) -> np.ndarray:
    """Largest exponents by Wolf's algorithm [1/s], one for each attractor that this way of integrating finds."""
    return np.asarray(data[f"{figure}/{setting}, {end}, wolf"]["lyapunov_exponent"].values[:, 0], float)


def _largest(data: Data, setting: str, end: str, by: str) -> np.ndarray:
    """Largest exponents [1/s] along the motions of one way of integrating at stiff contact."""
    return np.asarray(data[f"fig13/{setting}, {end}, {by}"]["lyapunov_exponent"].values[:, 0], float)


def _numbers(values: np.ndarray) -> str:
    return ", ".join(f"{round(float(value), 2) + 0.0:.2f}" for value in values) or "no attractor"


def _small(values: np.ndarray, limit: float, exact: bool) -> bool | None:
    """Whether exponents by Wolf's algorithm are small. Large ones on ode45's motions decide nothing: the paper's settings aren't known."""
    if not values.size:
        return None
    return bool((np.abs(values) < limit).all()) or (False if exact else None)


def _regular(data: Data, figure: str, settings: Sequence[str]) -> Finding:
    """All attractors of some maps periodic and stable, and Wolf's exponents small."""
    checks, exact, own = [], [], []
    for setting in settings:
        ds = data[f"{figure}/{setting}, {EXACT}"]
        size = np.hypot(ds["attractor_multiplier_real"].values, ds["attractor_multiplier_imag"].values)
        place, small = place_of(setting), SMALL * parameter(ds, "frequency")
        wolf = {end: _wolf(data, figure, setting, end) for end in (EXACT, ON, OFF)}
        checks.append(check(f"{place}: all exact attractors are periodic and stable (largest multiplier {np.nanmax(size):.3f})",
                            bool((ds["attractor_type"] == "periodic").all()) and bool(np.nanmax(size) < 1)))  # fmt: skip
        for end, word in ((EXACT, "exact"), (ON, "located"), (OFF, "not located")):
            told = f"{place}, {word}: exponents by Wolf's algorithm within {small:.2g} 1/s of zero ({_numbers(wolf[end])})"
            checks.append(check(told, _small(wolf[end], small, end == EXACT)))
        largest = data[f"{figure}/{setting}, {EXACT}, variational"]["lyapunov_exponent"].values[:, 0]
        exact.append(f"{place}: {_numbers(largest)}, by Wolf {_numbers(wolf[EXACT])}")
        own.append(f"{place}: located {_numbers(wolf[ON])}, not located {_numbers(wolf[OFF])}")
    return Finding(
        "By Wolf's algorithm [1/s]: " + "; ".join(own) + ".", "Variational [1/s]: " + "; ".join(exact) + ".", tuple(checks),
        "Exact exponents are those of the closed orbit. Intervals are in the table.",
        "The paper doesn't give the settings of its Wolf algorithm, so large values by ours on ode45's motions decide nothing. It follows neighbours "
        "on the recorded motion: where ode45 scatters about an orbit, it reads the scatter as divergence.",
    )  # fmt: skip


def regular_8(data: Data) -> Finding:
    """Figs. 9, 10: periodic, small exponents."""
    return _regular(data, "fig8", ("25.5 kN per m", "23.2 kN per m"))


def regular_11(data: Data) -> Finding:
    """Fig. 12: periodic."""
    return _regular(data, "fig11", ("7694 N per m", "8833 N per m"))


def period_one(data: Data) -> Finding:
    """All of Fig. 10 period-1."""
    ds, own = data[f"fig8/23.2 kN per m, {EXACT}"], data[f"fig8/23.2 kN per m, {ON}"]
    return Finding(f"{listed(own)}.", f"{listed(ds)}.", (check(f"every attractor has period T ({', '.join(names(ds))})", set(names(ds)) == {"T"}),),
                   "Periods by closing the orbits with Newton's method.")  # fmt: skip


def fig12_doubles(data: Data) -> Finding:
    """T becomes 2T, with a near graze."""
    before, after = (data[f"fig11/{setting}, {EXACT}"] for setting in ("7694 N per m", "8833 N per m"))
    main = [int(np.argmax(ds["attractor_fraction"].values)) for ds in (before, after)]
    n = [int(ds["attractor_period"][i]) for ds, i in zip((before, after), main, strict=True)]
    margin, gap = float(after["attractor_margin"][main[1]]), parameter(after, "upper_gap")
    return Finding(
        f"Located: {listed(data[f'fig11/7694 N per m, {ON}'])}; {listed(data[f'fig11/8833 N per m, {ON}'])}.", f"{listed(before)}; {listed(after)}.",
        (check(f"the dominant attractor has period T before ({period_text(n[0])})", n[0] == 1), check(f"and 2T after ({period_text(n[1])})", n[1] == 2),
         check(f"it comes nearer to a graze than {share_text(NEAR_GRAZE)} of the gap ({1e6 * margin:.1f} µm)", margin < NEAR_GRAZE * gap)),
        "Periods and stability by Newton's method and multipliers.",
    )  # fmt: skip


# -- Fig. 14 -------------------------------------------------------------------------------------------------------------------
_STIFF = "18.4 MN per m"


def _spread(data: Data, period: int) -> dict[str, float]:
    """Scatter of states at whole periods about their own means, in units of the motion's range, of the first attractor of a period."""
    found = {}
    for trio in trios(data, "fig13", _STIFF):
        if trio.period == period and trio.number[EXACT] >= 0:
            size = _range(data, "fig13", _STIFF, trio)
            for end in (EXACT, ON, OFF):
                if trio.number[end] >= 0:
                    points = strobe(data[f"fig13/{_STIFF}, {end}, motions"], trio.number[end])
                    rows = points[: len(points) // period * period].reshape(-1, period, 2)
                    found[end] = float((np.abs(rows - rows.mean(axis=0)) / size).max())
            break
    return found


def _smeared(data: Data, period: int) -> Finding:
    spread = _spread(data, period)
    ds = data[f"fig13/{_STIFF}, {EXACT}"]
    here = ds["attractor_period"].values == period
    size = np.hypot(ds["attractor_multiplier_real"].values[here], ds["attractor_multiplier_imag"].values[here])
    largest = float(size.max()) if size.size else np.nan
    name = kind_text("periodic", period)
    told = {end: f"{spread[end]:.1e}" if end in spread else "not found" for end in (EXACT, ON, OFF)}
    return Finding(
        f"Scatter of the Poincaré points, in units of the motion's range: located {told[ON]}, not located {told[OFF]}.",
        f"A {name} orbit closed to {told[EXACT]}, multipliers up to {largest:.4f}.",
        (check(f"there is a {name} attractor", here.any()),
         check(f"by ode45 its points scatter, with location ({told[ON]})", spread[ON] > POINT if ON in spread else None),
         check(f"and without ({told[OFF]})", spread[OFF] > POINT if OFF in spread else None),
         check(f"the scatter is the motion's own: exact points scatter too ({told[EXACT]})", spread[EXACT] > POINT if EXACT in spread else None),
         check(f"the motion has some instability (largest multiplier {largest:.4f})", largest >= 1 if np.isfinite(largest) else None)),
        "64 periods after 256 on the attractor; multipliers by the variational equations.",
        "The smear is the error of ode45's steps, made afresh at each stiff contact: the exact orbit attracts and is a point." if largest < 1 else "",
    )  # fmt: skip


def smeared_1(data: Data) -> Finding:
    """Attractor 1."""
    return _smeared(data, 1)


def smeared_3(data: Data) -> Finding:
    """Attractor 2, period 3."""
    return _smeared(data, 3)


def chaotic_3(data: Data) -> Finding:
    """Attractor 3 chaotic with location."""
    maps = {end: data[f"fig13/{_STIFF}, {end}"] for end in (EXACT, ON, OFF)}
    along = {end: data[f"fig13/{_STIFF}, {end}, variational"]["kind"].values for end in maps}
    wild = {end: int((kinds == "chaotic").sum()) for end, kinds in along.items()}
    five = {end: int((ds["attractor_period"] == 5).sum()) for end, ds in maps.items()}
    rates = {end: _numbers(_largest(data, _STIFF, end, "variational")) for end in maps}
    return Finding(
        f"Located: {listed(maps[ON])}; exponents along these motions {rates[ON]} 1/s. Not located: {listed(maps[OFF])}; {rates[OFF]} 1/s.",
        f"{listed(maps[EXACT])}; {rates[EXACT]} 1/s.",
        (check(f"an exact attractor is chaotic ({wild[EXACT]})", wild[EXACT] > 0),
         check(f"by ode45 with location some motion has a positive exponent, as chaos has ({wild[ON]})", wild[ON] > 0),
         check(f"by ode45 without location one has five points ({five[OFF]})", five[OFF] > 0)),
        f"{maps[EXACT]['basin'].size} starts; a chaotic attractor with a basin below {100 * maps[EXACT].attrs['smallest_basin_seen']:.2g} % isn't excluded.",
        "ode45's errors at stiff contacts keep its motions off the orbits, and there the tangent flow expands: its trajectories look chaotic beside "
        "exact orbits that attract." if wild[ON] and not wild[EXACT] else "",
    )  # fmt: skip


def period_two(data: Data) -> Finding:
    """Attractor 4."""
    maps = {end: data[f"fig13/{_STIFF}, {end}"] for end in (EXACT, ON, OFF)}
    spread = _spread(data, 2)
    told = {end: f"{spread[end]:.1e}" if end in spread else "not found" for end in (ON, OFF)}
    return Finding(
        f"Located {count(maps[ON])} attractors, not located {count(maps[OFF])}; scatter of the 2T {told[ON]} and {told[OFF]}.",
        f"{listed(maps[EXACT])}.",
        (check("there is a 2T attractor, exact", "2T" in names(maps[EXACT])),
         check("and by ode45, both ways", "2T" in names(maps[ON]) and "2T" in names(maps[OFF])),
         check(f"without location it is coarser ({told[OFF]} against {told[ON]})", spread[OFF] > spread[ON] if {ON, OFF} <= set(spread) else None)),
        "64 periods after 256 on the attractor.",
    )  # fmt: skip


def exponents_14(data: Data) -> Finding:
    """Exponents at stiff contact."""
    ds = data[f"fig13/{_STIFF}, {EXACT}"]
    found = {end: data[f"fig13/{_STIFF}, {end}, variational"] for end in (EXACT, ON, OFF)}
    own = {end: float(np.nanmax(_largest(data, _STIFF, end, "variational"))) for end in found}
    wolf = {end: _wolf(data, "fig13", _STIFF, end) for end in (EXACT, ON, OFF)}
    high, kinds = found[EXACT]["lyapunov_high"].values[:, 0], names(ds)
    return Finding(
        f"By Wolf's algorithm [1/s]: located {_numbers(wolf[ON])}; not located {_numbers(wolf[OFF])}.",
        f"{', '.join(kinds)}: {_numbers(found[EXACT]['lyapunov_exponent'].values[:, 0])}; by Wolf's algorithm on the exact motions {_numbers(wolf[EXACT])}.",
        tuple(check(f"the {name} has a positive exponent (exact: at most {value:.3f} 1/s)", value > 0) for name, value in zip(kinds, high, strict=True)),
        "Exact exponents are those of closed orbits, which all attract; intervals are in the table.",
        f"Along ode45's own motions, kept off the orbits by its errors, the tangent flow gives up to {own[ON]:.2f} (located) and {own[OFF]:.2f} 1/s "
        f"(not located), along the exact ones {own[EXACT]:.2f}: the large exponents are those of ode45's errors." if max(own[ON], own[OFF]) > 0 > own[EXACT] else "",
    )  # fmt: skip


def _with_motions(figure: str, *settings: str) -> tuple[str, ...]:
    maps = tuple(f"{figure}/{setting}, {end}" for setting in settings for end in (EXACT, ON, OFF))
    return (*maps, *(f"{name}, {what}" for name in maps for what in ("motions", "variational", "wolf")))


_FIG8 = _with_motions("fig8", "25.5 kN per m", "23.2 kN per m")
_FIG11 = _with_motions("fig11", "7694 N per m", "8833 N per m")
_FIG13 = _with_motions("fig13", _STIFF)

CLAIMS = (
    Claim("agree-grazing", "9", "Responses with and without event location agree excellently around the grazing.", f"Section 5.1, Figs. 9, 10. {SECTION_5}",
          "Wherever ode45 finds an attractor both ways, its states at whole periods lie within 2 % of the motion's range of the exact ones.", _FIG8, agree_8),
    Claim("regular-grazing", "9", "All these responses are periodic; their largest Lyapunov exponents are close to zero.", "Section 5.1, Figs. 9, 10",
          "All exact attractors are periodic with multipliers inside the unit circle; exponents by Wolf's algorithm are below a tenth in a forcing "
          "period on the exact motions, and on ode45's, where larger ones decide nothing, as the paper's settings of the algorithm aren't known.", _FIG8, regular_8),
    Claim("period-one", "10", "After the grazing all responses are period-1.", "Section 5.1, Fig. 10", "Every exact attractor has period T.", _FIG8, period_one),
    Claim("fig12-doubles", "12", "The attractor changes from period 1 to period 2; the latter nearly grazes.", "Section 5.2, Fig. 12",
          "The attractor of the largest basin has period T before and 2T after, and misses a graze by less than 5 % of the gap.", _FIG11, fig12_doubles),
    Claim("agree-doubling", "12", "Responses with and without event location agree excellently around the period doubling.", "Section 5.2, Fig. 12",
          "As around the grazing.", _FIG11, agree_11),
    Claim("regular-doubling", "12", "These responses are periodic, their exponents small.", "Section 5.2", "As around the grazing.", _FIG11, regular_11),
    Claim("fig14-smeared", "14", "Attractor 1 is period-1 but smeared: there is some coarseness or small instability to the motion.", "Section 5.3, Fig. 14",
          "There is a T attractor; by ode45 its Poincaré points scatter by more than 0.1 % of the motion, both ways; so do the exact ones; its largest "
          "multiplier is 1 or more.", _FIG13, smeared_1),
    Claim("fig14-three", "14", "Attractor 2 is roughly period-3 and slightly unstable.", "Section 5.3, Fig. 14", "The same for a 3T attractor.", _FIG13, smeared_3),
    Claim("fig14-chaotic", "14", "Attractor 3 is chaotic with event location; without, it has five isolated points.", "Section 5.3, Fig. 14",
          "Some exact attractor is chaotic; along some motion by ode45 with location the largest exponent is positive; without, one has five points.", _FIG13, chaotic_3),
    Claim("fig14-exponents", "14", "At stiff contact the largest Lyapunov exponents are no longer small enough to neglect.", "Section 5.3, Fig. 14",
          "The largest exponent of each exact attractor is positive.", _FIG13, exponents_14),
    Claim("fig14-two", "14", "Attractor 4 is period-2; without location it is coarser.", "Section 5.3, Fig. 14",
          "There is a 2T attractor, exact and by ode45 both ways; without location its Poincaré points scatter more.", _FIG13, period_two),
)  # fmt: skip
