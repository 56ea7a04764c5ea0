"""Result of ``attractors`` and ``basin_fractions``: the attractors that starts settle to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.attractors import ATTRACTOR_VARIABLES
from saltus.results.dataset.kinds import LONGER, WITHOUT, Kind, sentences
from saltus.results.dataset.schema import (
    ResultKind,
    attractor_name,
    first_size,
    kind_text,
    states_of,
)
from saltus.results.dataset.variable import OUTPUT, TRAJECTORY_NUMBER, Variable, of_outputs
from saltus.results.table import (
    Column,
    TextTable,
    number,
    quantity,
    table,
    with_error,
    words,
)
from saltus.results.wording import LINES, kind_texts, meanings, more, sized, unit_of

#: Variables of the results of ``attractors`` and ``basin_fractions``.
VARIABLES = {
    **TRAJECTORY_NUMBER,
    "basin": Variable(("trajectory",), "1", "attractor", "i2"),
    "periods_to_settle": Variable(
        ("trajectory",), "1", "forcing periods until it had settled, -1 if it hadn't", "i4"
    ),
    **ATTRACTOR_VARIABLES,
    **OUTPUT,
    **of_outputs("attractor", "attractor_"),
}


#: Distance from the unit circle that rounding can make.
ROUNDING = 1e-7


# -- account ---------------------------------------------------------------------------------------
def account(ds: xr.Dataset) -> list[str]:
    """Lines on the attractors, and on the fate of the starts."""
    starts = (
        f"{ds.sizes['trajectory']} starts"
        if "trajectory" in ds.dims
        else "attractors without their starts"
    )
    return [f"extent   {starts}", *found(ds)]


def found(ds: xr.Dataset) -> list[str]:
    """The lines on attractors and on starts that maps have too."""
    if why := ds.attrs.get("no_attractor"):
        many = counted(ds.sizes["attractor"], "motion")
        return [f"found    {many}", *_attractors(ds), f"damping  {why}"]
    lines = [f"found    {counted(ds.sizes['attractor'], 'attractor')}", *_attractors(ds)]
    if "basin" not in ds:
        return lines
    lines.append(settled(ds["basin"]))
    words = own_errors(ds) if (ds["basin"].values == Kind.UNCONVERGED).any() else ""
    lines += [f"noise    {words}"] if words else []
    lines += [*families(ds, "attractor"), *untyped(ds["basin"], Kind.UNCONVERGED)]
    return lines + [f"missed   {one}" for one in missed(_computed(ds["basin"]))]


def settled(labels: xr.DataArray) -> str:
    """Line on the number of starts that lead to an attractor, and on the fate of the others."""
    codes, counts = np.unique(labels.values, return_counts=True)
    others = [
        f"{count} {meanings(labels)[int(code)]}"
        for code, count in zip(codes, counts, strict=True)
        if code < 0
    ]
    there = f"{int(counts[codes >= 0].sum())} of {labels.size} starts"
    return f"settled  {', '.join([there, *others])}"


def _computed(labels: xr.DataArray) -> int:
    """Count the starts that were followed."""
    return int((labels.values != Kind.NOT_COMPUTED).sum())


def missed(starts: int, where: str = "") -> list[str]:
    """State which basins N starts may have missed. By the rule of three, a basin above 3/N of the
    box of starts is met with 95 % confidence. Hanley & Lippman-Hand, J. Am. Med. Assoc. 249 (1983)
    1743.
    """
    if not starts:
        return []
    size = f" with a basin below {300 / starts:.2g} % of where they lie" if starts > 3 else ""
    return [f"{counted(starts, 'start')}{where}: other attractors{size} may be missed"]


def untyped(labels: xr.DataArray, *codes: Kind, longer: str = LONGER) -> list[str]:
    """Line on motions without a type, if there are starts with one of these codes."""
    return [f"untyped  {longer}"] if np.isin(labels.values, codes).any() else []


def families(ds: xr.Dataset, prefix: str) -> list[str]:
    """Line on orbits and equilibria that aren't isolated, if there are any: those with a multiplier
    of 1, or an eigenvalue of 0.
    """
    kinds = ds[f"{prefix}_type"].values
    neutral = (kinds == Kind.PERIODIC.word) & _near(ds, f"{prefix}_multiplier", 1.0)
    if f"{prefix}_eigenvalue_real" in ds:
        neutral |= (kinds == Kind.EQUILIBRIUM.word) & _near(ds, f"{prefix}_eigenvalue", 0.0)
    if not neutral.any():
        return []
    return [
        f"family   {int(neutral.sum())} of these with a multiplier of 1, as where static friction "
        "holds a body: others lie beside each, and the one that a start led to is listed"
    ]


def _near(ds: xr.Dataset, name: str, value: float) -> np.ndarray:
    """True where the leading one of complex numbers is a value but for rounding, bool[m]."""
    real, imaginary = (ds[f"{name}_{part}"].values[:, 0] for part in ("real", "imag"))
    near: np.ndarray = np.hypot(real - value, imaginary) < ROUNDING
    return near


def own_errors(ds: xr.Dataset) -> str:
    """Explain in a sentence or two how errors of the method keep starts from settling; "" for a
    method whose errors are only rounding.
    """
    attrs = ds.attrs
    method = str(attrs.get("method", ""))
    if method != "RK4" and not method.startswith("ODE"):
        return ""
    name, knob = (method, "step") if method == "RK4" else (method.lower(), "rtol")
    if "unconverged_exactly" not in attrs:
        return (
            f"Errors of {name} itself can keep a motion from settling. A smaller {knob}, or "
            "Taylor, tells."
        )
    if not attrs["unconverged_exactly"]:
        return "By exact integration from where they stand they settle to no orbit either."
    return (
        f"Errors of {name} itself keep them from having a type: exact integration from where they "
        "stand settles to "
        f"{attrs['unconverged_exactly']}, and {name} strays from there by up to "
        f"{float(attrs['unconverged_stray']):.0%} of the range of a "
        f"state. Take a smaller {knob}, or Taylor."
    )


def _attractors(ds: xr.Dataset) -> Iterator[str]:
    """A line on each of the first attractors, and one line on the others."""
    each = [ds.isel(attractor=i) for i in range(ds.sizes["attractor"])]
    texts = [_one(attractor) for attractor in each]
    for i, (attractor, text) in enumerate(zip(each[:LINES], texts, strict=False)):
        through = _through(attractor) if texts.count(text) > 1 else ""
        share = (
            f", {float(attractor['attractor_fraction']):.2%} of the starts"
            if "attractor_fraction" in attractor
            else ""
        )
        yield f"  {i}: {text}{through}{share}"
    yield from more(len(each))


def _one(attractor: xr.Dataset) -> str:
    """Kind and size of an attractor."""
    kind, period = str(attractor["attractor_type"].item()), int(attractor["attractor_period"])
    name = f"{kind} {period}T" if kind == "periodic" else kind_text(kind, period)
    if kind == "limit_cycle" and "attractor_cycle" in attractor:
        cycle = float(attractor["attractor_cycle"])
        name += f", period {cycle:.4g} s, {1 / cycle:.4g} Hz"
    of, peak = first_size(attractor, "attractor_peak", "attractor_output_peak")
    size = f"peak {sized(peak)}"
    if of != states_of(attractor)[0]:
        size = f"peak |{of}| {sized(peak)}"
    if kind == Kind.NOISY_PERIODIC.word:
        size += f", scatter {sized(attractor['attractor_scatter'], '.2g')}"
    return f"{name}, {size}"


def _through(one: xr.Dataset) -> str:
    """First point of an attractor. It distinguishes mirror images, whose sizes are equal."""
    first = one.isel(phase=0, missing_dims="ignore")
    point = ", ".join(
        f"{name} = {sized(first[attractor_name(name)])}"
        for name in states_of(one)
        if attractor_name(name) in first and np.isfinite(first[attractor_name(name)])
    )
    return f", through {point}" if point else ""


# -- rows ------------------------------------------------------------------------------------------
def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each attractor: type, contacts, size, stability, margin, share."""
    known = {
        name.removeprefix("attractor_"): ds[name]
        for name in map(str, ds.data_vars)
        if name.startswith("attractor_")
    }
    first, kinds = states_of(ds)[0], kind_texts(ds, "attractor_")
    shown, rms = first_size(ds, "attractor_rms", "attractor_output_rms")
    known |= {"peak": first_size(ds, "attractor_peak", "attractor_output_peak")[1], "rms": rms}

    def sized(heading: str, name: str, digits: int = 4) -> list[Column]:
        one = known.get(name)
        return [] if one is None else [quantity(heading, one.values, unit_of(one), digits)]

    columns = [
        words("", ds["attractor"].values, "attractor"),
        words("type", kinds),
        number("contacts", known["contacts"].values.astype(float), "g"),
        *sized(f"peak |{shown}|", "peak"),
        *sized(f"rms {shown}", "rms"),
        *sized(f"scatter {first}", "scatter", 2),
        number("|multiplier|", _largest(ds) if kinds else np.empty(0), ".4f"),
        with_error(
            "exponent", known["exponent"].values, known["exponent_error"].values, unit="1/s"
        ),
        *sized("to a graze", "margin", 3),
        *_share(ds),
    ]
    return [table(title, columns, tuple(_notes(ds)), range(len(kinds)))]


def _largest(ds: xr.Dataset) -> np.ndarray:
    """Magnitude of the first multiplier of each attractor; NaN if there is none."""
    real, imag = (ds[f"attractor_multiplier_{part}"].values[:, 0] for part in ("real", "imag"))
    sizes = np.hypot(real, imag)
    return np.where(np.isfinite(sizes), sizes, np.nan)


def _share(ds: xr.Dataset) -> list[Column]:
    """Share of the starts that lead to each attractor, with its interval."""
    if "attractor_fraction" not in ds:
        return []
    share, low, high = (
        ds[f"attractor_fraction{end}"].values.tolist() for end in ("", "_low", "_high")
    )
    return [
        Column(
            "share of starts",
            lambda i: f"{100 * share[i]:.2f} ± {50 * (high[i] - low[i]):.2g} %",
            {"share of starts": share, "share from": low, "share to": high},
        )
    ]


def _notes(ds: xr.Dataset) -> Iterator[str]:
    """Sentences on how far the numbers can be trusted."""
    if why := ds.attrs.get("no_attractor"):
        yield str(why)
    elif "basin" in ds:
        yield from (f"{one}." for one in missed(_computed(ds["basin"])))
    yield from _trust(ds)
    for note in sentences(ds["basin"].values) if "basin" in ds else ():
        yield f"{note} {own_errors(ds)}".rstrip() if WITHOUT[Kind.UNCONVERGED] in note else note
    if "attractor_scatter" in ds:
        yield (
            "Noisy: errors of the method keep the motion from closing. It stays near an exact "
            "orbit, whose numbers are in the row; "
            "scatter is its root mean square distance from there."
        )


def _trust(ds: xr.Dataset) -> Iterator[str]:
    """Sentences on the checks of a map that were made."""
    attrs = ds.attrs
    if attrs.get("flip_checked"):
        yield (
            f"{attrs['flip_checked']} starts recomputed more exactly: "
            f"{100 * attrs['flip_rate']:.2g} % lead elsewhere "
            f"({100 * attrs['flip_rate_low']:.2g} to {100 * attrs['flip_rate_high']:.2g} %)."
        )
    if np.isfinite(attrs.get("uncertainty_exponent", np.nan)):
        yield (
            f"Basin entropy {attrs['basin_entropy']:.4f}, at boundaries "
            f"{attrs['boundary_basin_entropy']:.4f}; uncertainty exponent "
            f"{attrs['uncertainty_exponent']:.3f} ± {attrs['uncertainty_exponent_error']:.2g} (1: "
            f"a smooth boundary)."
        )
    if attrs.get("unresolved_cells"):
        yield (
            f"{attrs['unresolved_cells']} starts met a graze shallower than the local "
            f"error: either outcome is possible."
        )


KIND = ResultKind(
    "sl.attractors or sl.basin_fractions", VARIABLES, ("attractor_type",), account, rows
)
