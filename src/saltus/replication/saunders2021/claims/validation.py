"""Section 3 and the frequency responses of section 4: Figs. 2 and 3, Table 2."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.replication.papers import folder_of
from saltus.replication.saunders2021 import printed
from saltus.replication.saunders2021.claims.reading import SECTION_4, band, check, where
from saltus.replication.verdict import Claim, Data, Finding
from saltus.results.dataset.schema import period_text
from saltus.results.files.measured import read_measured
from saltus.study.answers.simulate_compare import residuals

#: Agreement of event times with printed ones that only the same arithmetic gives [s].
SAME_DIGITS = 1e-12
#: What "a few orders of magnitude" of machine precision may be.
FEW = 1e3
#: Rounding of frequencies of a grid [Hz].
TICK = 1e-6
CASES = ("a1.5", "a4", "b1.5", "b4", "c1.5", "c4")


def _time_errors(data: Data) -> np.ndarray:
    ours, exact = data["fig2/ode45"]["contact_time"].values, data["fig2/exact"]["contact_time"].values
    shared = min(len(ours), len(exact))
    return np.abs(ours[:shared] - exact[:shared])


def table2_digits(data: Data) -> Finding:
    """Our ode45 against the printed digits."""
    times = data["fig2/ode45"]["contact_time"].values
    misses = {letter: abs(times[number] - time) for letter, number, time in printed.contacts()}
    exact = data["fig2/exact"]["contact_time"].values
    off = max(abs(exact[number] - time) for _, number, time in printed.contacts())
    return Finding(
        f"The five printed times to {max(misses.values()):.1e} s.",
        f"Exact times differ from the printed ones by up to {off:.2e} s.",
        tuple(check(f"event {letter}: within 1e-12 s of the printed time ({miss:.1e} s)", miss < SAME_DIGITS)
              for letter, miss in misses.items()),
        "The paper doesn't name the run; no other setting is known that gives these digits (README of the replication).",
    )  # fmt: skip


def table2_residual(data: Data) -> Finding:
    """The residuals of located contacts."""
    rest = residuals(data["fig2/ode45"])
    return Finding(
        f"Largest |x − j| of {rest.size} contacts: {rest.max():.1e} m.",
        "0: the state is put on the boundary, and the residual is no measure of anything.",
        (check(f"every contact lies within 1e-15 m of its boundary (largest {rest.max():.1e} m)", rest.max() <= 1e-15),),
        f"All {rest.size} contacts of the run.",
    )


def table2_time(data: Data) -> Finding:
    """Errors of the located times."""
    error = _time_errors(data)
    run = data["fig2/ode45"]
    limit = FEW * np.finfo(float).eps
    claimed = float(data["fig2/exact"]["contact_time_error"].max())
    return Finding(
        f"Times are off by {error[0]:.1e} s at the first contact and by up to {error.max():.1e} s.",
        f"The same contacts with an estimated error of up to {claimed:.0e} s.",
        (check(f"times are right to 1000 units of machine precision, {limit:.0e} s a second (worst {error.max():.1e} s in "
               f"{float(run['contact_time'].max()):.1f} s)", (error <= limit * np.maximum(run["contact_time"].values[: error.size], 1e-3)).all()),
         check(f"the residual |x − j| / |v| tells the error of the time within a factor of 1000 (it is {np.median(error):.0e} s, not "
               f"{np.median(residuals(run) / np.abs(run['contact_velocity'].values)):.0e} s)", not np.median(error) > 1000.0 * np.median(residuals(run) / np.abs(run["contact_velocity"].values)))),
        f"Exact times by Taylor series; from further runs with shorter steps their error is estimated as up to {claimed:.0e} s.",
        "odezero puts the state of ode45's interpolant on the boundary; the error of the step before it (RelTol = 1e-4) is in the time.",
    )  # fmt: skip


# -- Fig. 3 --------------------------------------------------------------------------------------------------------------------
def _branch(ds: xr.Dataset, multiple: int, low: float, high: float) -> np.ndarray:
    """Frequencies between two at which a response has a multiple of a period, ascending."""
    period = ds["response_period"].values
    mask = where(ds, "frequency", low, high) & (period > 0) & (period % multiple == 0)
    return np.unique(ds["response_frequency"].values[mask])


def _isolated(ds: xr.Dataset, frequencies: np.ndarray) -> tuple[bool, float]:
    """Whether, wherever a 3T response exists, a T response does too whose rms is at least a fifth smaller; and the smallest ratio."""
    ratios = []
    for f in frequencies:
        here = np.abs(ds["response_frequency"].values - f) < 1e-9
        period, rms = ds["response_period"].values[here], ds["response_rms"].values[here]
        if not (period == 1).any():
            return False, np.nan
        ratios.append(rms[(period > 0) & (period % 3 == 0)].min() / rms[period == 1].min())
    return bool(ratios) and min(ratios) > 1.2, float(min(ratios, default=np.nan))


def isolated_branch(data: Data) -> Finding:
    """The isolated branch of the symmetric cases."""
    bands, checks, own = {}, [], []
    for case in ("a1.5", "a4"):
        ds = data[f"fig3/{case}, exact"]
        peak = float(ds["response_frequency"].values[np.argmax(ds["response_rms"].values)])
        bands[case] = _branch(ds, 3, peak + 0.01, 30.0)
        apart, ratio = _isolated(ds, bands[case])
        checks.append(check(f"{case}: 3T responses above the resonance peak ({peak:g} Hz): {band(bands[case])}", bands[case].size > 0))
        told = f"{case}: at each of these frequencies a T response coexists, at least a fifth smaller (3T is {ratio:.2f} times as large or more)"
        checks.append(check(told, apart if bands[case].size else False))
        tight = _branch(data[f"fig3/{case}, ode45"], 3, peak + 0.01, 30.0)
        own.append(f"{case}: 3T at {', '.join(f'{f:g} Hz' for f in tight) or 'none of the frequencies asked'}")
    width = {case: float(np.ptp(one)) if one.size else 0.0 for case, one in bands.items()}
    checks.append(
        check(f"the band is wider at 4 N ({width['a4']:.1f} Hz) than at 1.5 N ({width['a1.5']:.1f} Hz)", width["a4"] > width["a1.5"])
    )
    return Finding(
        "; ".join(own), "; ".join(f"{case}: 3T at {band(one)}" for case, one in bands.items()), tuple(checks),
        f"{data['fig3/a4, exact'].sizes['frequency']} frequencies, {data['fig3/a4, exact'].sizes['start']} starts; every orbit closed by "
        "Newton's method. A band's end is known to one step of the frequency.",
    )  # fmt: skip


def three_points(data: Data) -> Finding:
    """Measured points near 18 Hz on the isolated branch."""
    ds = data["fig3/a4, exact"]
    here = where(ds, "frequency", 17.5, 18.5) & (ds["response_period"].values % 3 == 0) & (ds["response_period"].values > 0)
    rms = ds["response_rms"].values[here]
    branch = f"3T with rms {1e3 * rms.min():.3f} to {1e3 * rms.max():.3f} mm at 17.5 to 18.5 Hz" if rms.size else "no 3T response at 18 Hz"
    path = folder_of("saunders2021") / "measured_a4.csv"
    passed, why = None, "The measured points exist only as dots in the paper's figure. Put them into measured_a4.csv, and this is decided."
    if path.exists():
        points = read_measured(path, "frequency", "Hz", "m")
        near = np.abs(points["frequency"].values - 18.0) <= 0.5
        size = points["amplitude"].values[near]
        passed = bool(rms.size) and int(((size > 0.9 * rms.min()) & (size < 1.1 * rms.max())).sum()) >= 3
        why = f"{int(near.sum())} measured points near 18 Hz."
    return Finding("The same question.", f"{branch[0].upper() + branch[1:]}.", (check("three measured points within 10 % of the branch", passed),),
                   "Responses of the branch are closed by Newton's method.", why)  # fmt: skip


def subharmonics(data: Data) -> Finding:
    """Subharmonic structures at 19 to 25 Hz in the asymmetric cases."""
    checks = []
    exact: list = []
    own: list = []
    for case in CASES[2:]:
        ds = data[f"fig3/{case}, exact"]
        here = where(ds, "frequency", 19.0, 25.0) & (ds["response_period"].values >= 2)
        found = np.unique(ds["response_period"].values[here])
        checks.append(check(f"{case}: responses of two or more forcing periods at 19 to 25 Hz ({_periods(found)})",
                            here.any()))  # fmt: skip
        exact.append(f"{case}: {_periods(found)}")
        tight = data[f"fig3/{case}, ode45"]
        mask = where(tight, "frequency", 19.0, 25.0) & (tight["response_period"].values >= 2)
        own.append(f"{case}: {_periods(np.unique(tight['response_period'].values[mask]))}")
    return Finding("; ".join(own), "; ".join(exact), tuple(checks), _grid(data))


def third_order(data: Data) -> Finding:
    """A third-order subharmonic near 15 Hz."""
    there, doubled, own = (
        _cases_with_thirds(data, "exact", (3,)),
        _cases_with_thirds(data, "exact", (6, 12, 24)),
        _cases_with_thirds(data, "ode45", (3,)),
    )
    either = sorted({*there, *doubled})
    return Finding(
        f"3T at 14 to 16 Hz in {', '.join(own) or 'no case'} (at a few frequencies only).",
        f"3T at 14 to 16 Hz in {', '.join(there) or 'no case'}; 6T, 12T or 24T, as period doublings of it have, in {', '.join(doubled) or 'no case'}.",
        (check(f"at least three of six cases have 3T responses at 14 to 16 Hz ({len(there)} have)", len(there) >= 3),
         check(f"at least three have 3T or what period doublings make of it ({len(either)} have)", len(either) >= 3)),
        _grid(data),
        "That it is the cubic spring and not the gaps that makes it is not tested here.",
    )  # fmt: skip


def _cases_with_thirds(data: Data, kind: str, periods: tuple[int, ...]) -> list[str]:
    """Cases with a response of one of some periods at 14 to 16 Hz."""
    sets = {case: data[f"fig3/{case}, {kind}"] for case in CASES}
    return [
        case
        for case, ds in sets.items()
        if (where(ds, "frequency", 14.0 - TICK, 16.0 + TICK) & np.isin(ds["response_period"].values, periods)).any()
    ]


def erratic(data: Data) -> Finding:
    """Period-adding and chaos at 11 to 15 Hz in the asymmetric cases."""
    checks = []
    exact: list = []
    own: list = []
    for case in CASES[2:]:
        for kind, into in (("exact", exact), ("ode45", own)):
            ds = data[f"fig3/{case}, {kind}"]
            here = where(ds, "frequency", 11.0, 15.0)
            chaos = int((ds["response_type"].values[here] == "chaotic").sum())
            periods = np.unique(ds["response_period"].values[here])
            into.append(f"{case}: {chaos} chaotic; {_periods(periods)}")
            if kind == "exact":
                checks.append(check(f"{case}: chaotic responses at 11 to 15 Hz ({chaos})", chaos > 0))
                checks.append(check(f"{case}: periods of 3T or more there", (periods >= 3).any()))
    return Finding("; ".join(own), "; ".join(exact), tuple(checks), _grid(data))


def _periods(values: np.ndarray) -> str:
    """Periods in words, the first eight: ``T, 2T, 3T``."""
    some = [period_text(int(n)) for n in values if n > 0]
    return ", ".join(some[:8]) + (f" and {len(some) - 8} more" if len(some) > 8 else "") or "none"


def _grid(data: Data) -> str:
    ds = data["fig3/b4, exact"]
    return (
        f"{ds.sizes['frequency']} frequencies and {ds.sizes['start']} starts a case, exact; {data['fig3/b4, ode45'].sizes['frequency']} by ode45. "
        "The paper doesn't give its starts, so a response with a small basin may be missed, by both."
    )


_FIG3 = tuple(f"fig3/{case}, {kind}" for case in CASES for kind in ("exact", "ode45"))

CLAIMS = (
    Claim("table2-digits", "2", "Contacts A to E occur at the printed times.", "Table 2",
          "Each of the five times of our ode45 lies within 1e-12 s of the printed one.", ("fig2/ode45", "fig2/exact"), table2_digits),
    Claim("table2-residual", "2", "Located contacts lie on the boundary to 1e-16 to 1e-18 m.", "Section 3, Table 2",
          "No contact of the run lies farther than 1e-15 m from its boundary.", ("fig2/ode45",), table2_residual),
    Claim("table2-time", "2", "So event detection resolves the time of a contact within a few orders of magnitude of machine precision.",
          "Section 3, after Table 2", "Errors of the times, against exact ones, stay below 1000 units of machine precision; and the residual "
          "tells that error within a factor of 1000.", ("fig2/ode45", "fig2/exact"), table2_time),
    Claim("isolated-branch", "3", "In the symmetric cases an isolated subharmonic branch appears at higher frequencies, for both forces; its "
          "band grows with the force.", f"Section 4, Fig. 3(a, b). {SECTION_4}", "Above the resonance peak there are 3T responses; wherever they "
          "are, a T response coexists that is at least a fifth smaller; their band is wider at 4 N.",
          tuple(name for name in _FIG3 if "/a" in name), isolated_branch),
    Claim("three-points", "3", "In case a4 three measured points near 18 Hz lie on the isolated branch.", "Section 4, Fig. 3(b)",
          "At least three points of measured_a4.csv between 17.5 and 18.5 Hz lie within 10 % of the 3T branch.", ("fig3/a4, exact",), three_points),
    Claim("subharmonics", "3", "In the asymmetric cases there are subharmonic resonances at 19 to 25 Hz.", "Section 4, Fig. 3(c-f)",
          "In each of the four cases some response at 19 to 25 Hz has a period of two or more forcing periods.",
          tuple(name for name in _FIG3 if "/a" not in name), subharmonics),
    Claim("third-order", "3", "The cubic spring makes a third-order subharmonic near 15 Hz, visible in several cases.", "Section 4",
          "3T responses exist at 14 to 16 Hz in at least three of the six cases; 3T, 6T, 12T or 24T ones do.", _FIG3, third_order),
    Claim("erratic", "3", "At 11 to 15 Hz the asymmetric cases show period-adding and chaos.", "Section 4",
          "In each of the four cases, at 11 to 15 Hz, some response is chaotic and some has a period of 3T or more.", _FIG3, erratic),
)  # fmt: skip
