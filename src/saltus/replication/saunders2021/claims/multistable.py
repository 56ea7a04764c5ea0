"""Several responses at one setting: Figs. 4, 5 and 6."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.analysis.motion.settled import settled
from saltus.plot.maps import share_text
from saltus.replication.saunders2021.claims.reading import (
    EXACT,
    OFF,
    ON,
    SECTION_4,
    below,
    by_peak,
    certainty,
    check,
    count,
    exponent_text,
    listed,
    names,
)
from saltus.replication.verdict import Check, Claim, Data, Finding
from saltus.results.dataset.schema import period_text

#: Periods that the paper reads off Fig. 5, by start [mm].
PRINTED = {"1.0": 3, "0.2": 5, "0.4": 12, "2.0": 4}
#: Lower-amplitude solutions that the paper counts in Fig. 6, by frequency.
COUNTED = {"14.75 Hz": 3, "15 Hz": 4, "15.75 Hz": 2, "16 Hz": 3}
#: Band around the gap in which a start is "near or within" it [m].
NEAR = 0.2e-3


def fig4_periods(data: Data) -> Finding:
    """Low response at 17 Hz: T, no contact; high: 3T."""
    found = {kind: settled(data[f"fig4/{kind}"]) for kind in ("exact", "ode45")}
    n, contacts = found["exact"]["response_period"].values, found["exact"]["contacts_per_response"].values
    text = {
        kind: "; ".join(f"{name}: {period_text(int(p))}, {c:g} contacts" for name, p, c in zip(
            ("16 Hz", "17 Hz small", "17 Hz large"), one["response_period"].values, one["contacts_per_response"].values, strict=True))
        for kind, one in found.items()
    }  # fmt: skip
    return Finding(
        text["ode45"], text["exact"],
        (check(f"the small response at 17 Hz has period T ({period_text(int(n[1]))})", n[1] == 1),
         check(f"and no contact ({contacts[1]:g})", contacts[1] == 0),
         check(f"the large one has period 3T ({period_text(int(n[2]))})", n[2] == 3)),
        f"States repeat to {float(found['exact']['mismatch'].max()):.0e} of their range after 1000 periods.",
    )  # fmt: skip


def fig4_step(data: Data) -> Finding:
    """From 16 Hz to 17 Hz."""
    ds = data["fig4/step"]
    shares = [float((ds["basin"].values == i).mean()) for i in range(count(ds))]
    told = ", ".join(f"{name} {share_text(share)}" for name, share in zip(names(ds), shares, strict=True))
    reached = {name for name, share in zip(names(ds), shares, strict=True) if share > 0}
    return Finding(
        "Not computed.", f"From {ds.sizes['trajectory']} states along the orbit at 16 Hz, where the new forcing begins at phase 0: {told}.",
        (check("some states lead to a T response without contact", bool(((ds["attractor_period"] == 1) & (ds["attractor_contacts"] == 0)).any())),
         check("some lead to the 3T response", "3T" in reached)),
        f"{ds.sizes['trajectory']} states. The paper doesn't say at which phase the frequency changes.",
        f"The paper shows two outcomes; there are {len(reached)}." if len(reached) > 2 else "",
    )  # fmt: skip


# -- Fig. 5 --------------------------------------------------------------------------------------------------------------------
def _beside(data: Data) -> list[list[int]]:
    """Periods that the starts within a nanometre of each start lead to."""
    ds = data["fig5/beside"]
    rows = settled(ds)["response_period"].values.reshape(len(PRINTED), -1)
    return [row.tolist() for row in rows]


def _tally(periods: list[int]) -> str:
    values, counts = np.unique(periods, return_counts=True)
    return ", ".join(f"{period_text(int(n), 'unsettled')} {share_text(c / len(periods))}" for n, c in zip(values, counts, strict=True))


def fig5_periods(data: Data) -> Finding:
    """Periods from the four starts, where these decide them."""
    exact, own = (settled(data[f"fig5/{kind}"])["response_period"].values for kind in ("exact", "ode45"))
    checks: list[Check] = []
    unsure = []
    for (x, printed), n, bunch in zip(PRINTED.items(), exact, _beside(data), strict=True):
        one = set(bunch)
        told = f"from {x} mm the response is {printed}T: exact {period_text(int(n))}, within 1 nm {_tally(bunch)}"
        if len(one) > 1:
            unsure.append(f"{x} mm ({_tally(bunch)})")
        checks.append(check(told, None if len(one) > 1 and printed in one else int(n) == printed))
    return Finding(
        ", ".join(f"{x} mm: {period_text(int(n))}" for x, n in zip(PRINTED, own, strict=True)),
        ", ".join(f"{x} mm: {period_text(int(n))}" for x, n in zip(PRINTED, exact, strict=True)),
        tuple(checks),
        f"Repeats checked over the last 96 of 2000 periods; {len(_beside(data)[0])} starts within 1 nm of each.",
        f"Undecided where starts 1 nm apart lead to different responses: {'; '.join(unsure)}. There every rounding error counts, "
        "MATLAB's too." if unsure else "",
    )  # fmt: skip


def _orbit_and_inner(data: Data) -> tuple[xr.Dataset, xr.Dataset | None]:
    """The attractor that x₀ = 0.4 mm leads to, and the orbit of half its period within it, if there is one."""
    found, halved = data["fig5/attractors"], data["fig5/halved"]
    orbit = found.isel(attractor=int(found["basin"].values[list(PRINTED).index("0.4")]))
    half = np.flatnonzero(2 * halved["attractor_period"].values == int(orbit["attractor_period"]))
    return orbit, halved.isel(attractor=int(half[0])) if half.size else None


def _largest(one: xr.Dataset) -> float:
    """The multiplier of largest magnitude, with its sign."""
    real, imag = one["attractor_multiplier_real"].values, one["attractor_multiplier_imag"].values
    return float(real[np.argmax(np.hypot(real, imag))])


def fig5_twelve(data: Data) -> Finding:
    """12T or 24T."""
    orbit, inner = _orbit_and_inner(data)
    n, stable = int(orbit["attractor_period"]), abs(_largest(orbit)) < 1
    own = int(settled(data["fig5/ode45"])["response_period"].values[2])
    told = f"the attractor is {n}T, multipliers {', '.join(f'{m:.4f}' for m in orbit['attractor_multiplier_real'].values)}"
    checks = [check(f"the attractor that x₀ = 0.4 mm leads to has period 12T ({told})", n == 12 and stable)]
    if inner is not None:
        m = _largest(inner)
        if int(inner["attractor_period"]) == 12:
            checks.append(check(f"the 12T orbit is stable (multiplier {m:.4f})", abs(m) < 1))
        told += f"; the {int(inner['attractor_period'])}T orbit that it doubled from is {'unstable' if abs(m) > 1 else 'stable'}, multiplier {m:.4f}"
    return Finding(
        f"From 0.4 mm: {period_text(own)}.", told[0].upper() + told[1:] + ".", tuple(checks),
        "Orbits closed to rounding by Newton's method, multipliers from the variational equations with saltation matrices.",
        "Its points lie in pairs a few µm apart: on the scale of the figure twelve dots are seen." if n == 24 else "",
    )  # fmt: skip


def fig5_regular(data: Data) -> Finding:
    """Not chaotic."""
    exact, own = (settled(data[f"fig5/{kind}"]) for kind in ("exact", "ode45"))
    multipliers = np.hypot(data["fig5/attractors"]["attractor_multiplier_real"], data["fig5/attractors"]["attractor_multiplier_imag"])
    return Finding(
        f"{int((own['response_period'] > 0).sum())} of 4 repeat.", f"{int((exact['response_period'] > 0).sum())} of 4 repeat; largest "
        f"multiplier {float(multipliers.max()):.3f}.",
        (check("all four responses repeat", bool((exact["response_period"] > 0).all())),
         check("all their orbits are stable", bool((multipliers < 1).all()))),
        f"Repeats to {float(exact['mismatch'].max()):.0e} of the range.",
    )  # fmt: skip


def five_points(data: Data) -> Finding:
    """Five responses at 15 Hz."""
    found = {end: data[f"fig6/15 Hz, {end}"] for end in (EXACT, ON)}
    return Finding(
        f"{count(found[ON])}: {listed(found[ON])} (ode45 1e-4, 1e-7).", f"{count(found[EXACT])}: {listed(found[EXACT])}.",
        (check(f"there are five attractors ({count(found[EXACT])})", count(found[EXACT]) == 5),
         check("they are T, 3T, 4T, 5T and 12T", sorted(names(found[EXACT])) == sorted(["T", "3T", "4T", "5T", "12T"]))),
        certainty(found.values()),
    )  # fmt: skip


# -- Fig. 6 --------------------------------------------------------------------------------------------------------------------
def fig6_counts(data: Data) -> Finding:
    """Lower-amplitude solutions at four frequencies."""
    exact = {f: data[f"fig6/{f}, {EXACT}"] for f in COUNTED}
    own = {f: data[f"fig6/{f}, {ON}"] for f in COUNTED}
    return Finding(
        "; ".join(f"{f}: {count(ds) - 1} ({listed(ds)})" for f, ds in own.items()),
        "; ".join(f"{f}: {count(ds) - 1} ({listed(ds)})" for f, ds in exact.items()),
        tuple(check(f"{f}: {printed} beside the largest (exact {count(exact[f]) - 1})", count(exact[f]) - 1 == printed) for f, printed in COUNTED.items()),
        certainty(exact.values()),
        "The tolerances of Fig. 6 aren't given; ours for ode45 are those of section 5.",
    )  # fmt: skip


def fig6_frequency(data: Data) -> Finding:
    """16 or 16.5 Hz."""
    low, high = data[f"fig6/16 Hz, {EXACT}"], data[f"fig6/16.5 Hz, {EXACT}"]
    here, there = count(low) - 1, count(high) - 1
    decided = None if (here == 3) == (there == 3) else here == 3
    return Finding(
        "The same question for either way.", f"16 Hz: {listed(low)}. 16.5 Hz: {listed(high)}.",
        (check(f"three lower-amplitude solutions at 16 Hz ({here}) and not at 16.5 Hz ({there})", decided),),
        certainty([low, high]), "The text says 16.5 Hz, the caption 16 Hz.",
    )  # fmt: skip


def fig6_dominance(data: Data) -> Finding:
    """From equally dominant to one or two dominant."""
    told: list[str] = []
    shares: dict[str, np.ndarray] = {}
    for f in COUNTED:
        ds = data[f"fig6/{f}, {EXACT}"]
        low = np.sort(np.delete(ds["attractor_fraction"].values, by_peak(ds)[0]))[::-1]
        shares[f] = low / low.sum()
        told.append(f"{f}: {', '.join(share_text(s) for s in shares[f])}")
    early, late = [shares[f][0] for f in ("14.75 Hz", "15 Hz")], [shares[f][0] for f in ("15.75 Hz", "16 Hz")]
    checks = [check(f"{f}: no lower solution has more than half of the starts of all lower ones (largest {share_text(shares[f][0])})",
                    shares[f][0] <= 0.5) for f in ("14.75 Hz", "15 Hz")]  # fmt: skip
    checks.append(check(f"the largest share is larger at the two higher frequencies ({', '.join(map(share_text, late))}) than at the two lower "
                        f"ones ({', '.join(map(share_text, early))})", max(early) < min(late)))  # fmt: skip
    return Finding("See the shares in the picture.", "Shares among the lower ones. " + "; ".join(told), tuple(checks),
                   certainty([data[f"fig6/{f}, {EXACT}"] for f in COUNTED]))  # fmt: skip


def fig6_gap(data: Data) -> Finding:
    """Starts near the gap and the large solution."""
    slow = float(np.nanmax([np.abs(data["fig5/exact"]["v"].isel(trajectory=i)).max() for i in range(4)]))
    checks = []
    told: list = []
    own: list = []
    for f in COUNTED:
        for end, into in ((EXACT, told), (ON, own)):
            ds = data[f"fig6/{f}, {end}"]
            inside = (ds["x"].values >= -NEAR) & (ds["x"].values <= 0.4e-3 + NEAR)
            high = ds["basin"].values[inside] == by_peak(ds)[0]
            v = np.abs(ds["v"].values)[np.nonzero(high)[1]]
            into.append(f"{f}: {v.min():.2f} m/s" if v.size else f"{f}: at no velocity of the map")
            if end == EXACT:
                least = f"least {v.min():.2f} m/s" if v.size else "no start of the map leads there"
                checks.append(check(f"{f}: none below {2 * slow:.2f} m/s ({least})", (v >= 2 * slow).all() if v.size else None))
    return Finding(
        "Least |v₀| that leads there. " + "; ".join(own), "Least |v₀| that leads there. " + "; ".join(told), tuple(checks),
        f"Cells {np.diff(data[f'fig6/15 Hz, {EXACT}']['v'].values[:2])[0]:.3f} m/s apart. Large: twice the largest velocity in Fig. 5, {slow:.3f} m/s.",
    )  # fmt: skip


def fig6_granular(data: Data) -> Finding:
    """Sensitivity to the start."""
    maps = {f: data[f"fig6/{f}, {EXACT}"] for f in COUNTED}
    numbers = {f: float(ds.attrs["uncertainty_exponent"]) for f, ds in maps.items()}
    errors = {f: float(ds.attrs["uncertainty_exponent_error"]) for f, ds in maps.items()}
    own = {f: float(data[f"fig6/{f}, {ON}"].attrs["uncertainty_exponent"]) for f in COUNTED}
    return Finding(
        "; ".join(f"{f}: {exponent_text(value)}" for f, value in own.items()),
        "Uncertainty exponents (1: smooth boundary, 0: hopeless): " + "; ".join(f"{f}: {exponent_text(value)}" for f, value in numbers.items()),
        tuple(below(f"{f}: uncertainty exponent", value, 0.5) for f, value in numbers.items()),
        f"Standard errors: {'; '.join(f'{f}: {exponent_text(value)}' for f, value in errors.items())}. They are measurable "
        "on grids of 64 cells or more along each axis.",
    )  # fmt: skip


_FIG6 = tuple(f"fig6/{f}, {end}" for f in COUNTED for end in (EXACT, ON, OFF))

CLAIMS = (
    Claim("fig4-periods", "4", "At 17 Hz the small response has period T and no contact, the large one lies on the isolated branch, period 3T.",
          f"Section 4, Fig. 4. {SECTION_4}", "Periods and contacts of the two motions after 1000 periods.", ("fig4/exact", "fig4/ode45"), fig4_periods),
    Claim("fig4-step", "4", "Stepping from 16 to 17 Hz the oscillation drops to either of two responses, by its position then.", "Section 4, Fig. 4",
          "Of states along the orbit at 16 Hz some lead to the T and some to the 3T response.", ("fig4/exact", "fig4/step"), fig4_step),
    Claim("five-points", "5", "There are five responses at 15 Hz in case b4; the four smaller ones have periods 3T, 5T, 12T, 4T.", "Section 4.1, Fig. 3(d)",
          "The basin map at 15 Hz has five attractors; their periods are those printed.", (f"fig6/15 Hz, {EXACT}", f"fig6/15 Hz, {ON}"), five_points),
    Claim("fig5-periods", "5", "From x₀ = 1.0, 0.2, 0.4, 2.0 mm at rest the responses have periods 3T, 5T, 12T, 4T.", f"Section 4.1, Fig. 5. {SECTION_4}",
          "The exact response has the printed period; a start decides nothing if starts within 1 nm lead to several, the printed one among them.",
          ("fig5/exact", "fig5/ode45", "fig5/beside"), fig5_periods),
    Claim("fig5-twelve", "5", "The response from x₀ = 0.4 mm has period 12T.", "Section 4.1, Fig. 5",
          "The stable orbit there has period 12T; the orbit of 12T near by is stable.", ("fig5/ode45", "fig5/attractors", "fig5/halved"), fig5_twelve),
    Claim("fig5-regular", "5", "None of the four is chaotic.", "Section 4.1", "All four repeat, and all multipliers lie inside the unit circle.",
          ("fig5/exact", "fig5/ode45", "fig5/attractors"), fig5_regular),
    Claim("fig6-counts", "6", "Three, four, two and three lower-amplitude solutions at 14.75, 15, 15.75 and 16 Hz.", "Section 4.1, Fig. 6",
          "Attractors of the exact maps beside the one of largest peak.", _FIG6, fig6_counts),
    Claim("fig6-frequency", "6", "Fig. 6(d) shows 16 Hz (caption), not 16.5 Hz (text).", "Section 4.1, caption of Fig. 6",
          "Only at one of the two there are three lower-amplitude solutions.", (f"fig6/16 Hz, {EXACT}", f"fig6/16.5 Hz, {EXACT}"), fig6_frequency),
    Claim("fig6-dominance", "6", "From roughly equally dominating lower solutions to one or two dominant ones as the frequency grows.", "Section 4.1",
          "At the two lower frequencies no lower solution has more than half of the starts that lead to lower ones; the largest share is larger "
          "at both higher ones than at both lower ones.", _FIG6, fig6_dominance),
    Claim("fig6-gap", "6", "Starts near or within the gap don't lead to the largest solution unless their velocity is large.", "Section 4.1",
          "For x₀ within 0.2 mm of the gap, the least velocity that leads to the largest attractor is at least twice the largest velocity of the "
          "responses in Fig. 5.", (*_FIG6, "fig5/exact"), fig6_gap),
    Claim("fig6-granular", "6", "The basins are granular: strong sensitivity to the start.", "Section 4.1",
          "The uncertainty exponent of each exact map is below 0.5.", _FIG6, fig6_granular),
)  # fmt: skip
