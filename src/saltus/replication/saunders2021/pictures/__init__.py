"""The pictures of this paper, in the order of the report."""

from __future__ import annotations

from functools import partial

from saltus.replication.papers import Picture
from saltus.replication.saunders2021.pictures import basin_maps, motions, rows, stiffness

_ENDS = ("exact", "ode45 located", "ode45 not located")
_THREE = "Left to right: ode45 at the paper's tolerances with event location, without, and exact. A colour is the same attractor in all maps of a row."
_ROWS = (
    "A row for each attractor. Grey: exact, blue: ode45 with event location, red: without. Dots: states at whole forcing periods. Right: these "
    "states, less the exact ones (+)."
)


def _maps(figure: str, *settings: str) -> tuple[str, ...]:
    return tuple(f"{figure}/{setting}, {end}" for setting in settings for end in _ENDS)


def _basins(number: str, title: str, settings: tuple[str, ...], caption: str = "") -> Picture:
    draw = partial(basin_maps.grid, figure=f"fig{number}", settings=settings)
    return Picture(number, f"fig{number}", title, f"{_THREE} {caption}".strip(), _maps(f"fig{number}", *settings), draw)


def _rows(number: str, of: str, setting: str, title: str, caption: str = "", name: str = "") -> Picture:
    needs = _maps(of, setting)
    draw = partial(rows.attractors, figure=of, setting=setting)
    return Picture(
        number,
        name or f"fig{number}",
        title,
        f"{_ROWS} {caption}".strip(),
        (*needs, *(f"{one}, {what}" for one in needs for what in ("motions", "variational"))),
        draw,
    )


_FIG3 = tuple(f"fig3/{case}, {kind}" for case in stiffness.CASES for kind in ("exact", "ode45"))

PICTURES = (
    Picture("2", "fig2", "Event location, and what it is worth",
            "Top: the run of Table 2, coloured by region, with every contact; A to E are those of the table. Bottom left: a located contact. Bottom "
            "right: the true error of each contact time beside the error that its residual suggests.", ("fig2/ode45", "fig2/exact"), motions.located),
    Picture("3", "fig3", "Frequency responses of the six cases", "Every steady response that was found, exact, a colour for each period. Circles: ode45 at "
            "RelTol = AbsTol = 1e-12, at a few frequencies. Measured points are drawn if measured_CASE.csv stands beside the study.", _FIG3, stiffness.six_cases),
    Picture("4", "fig4", "Case a4: the response at 16 Hz, and two at 17 Hz", "Left: time histories. Right: phase portraits. Exact.", ("fig4/exact",),
            motions.three_responses),
    Picture("4", "fig4-step", "Which of them the step from 16 to 17 Hz leads to", "Each dot is a state on the orbit at 16 Hz at the moment of the step.",
            ("fig4/exact", "fig4/step"), motions.where_a_step_leads),
    Picture("5", "fig5", "Case b4 at 15 Hz from the paper's four starts", "Exact, after 2000 periods. Circles: states at whole forcing periods.",
            ("fig5/exact",), motions.four_starts),
    Picture("5", "fig5-doubled", "Twelve dots are twenty-four", "The stable orbit that x₀ = 0.4 mm leads to, and the unstable one of half its period that it "
            "doubled from.", ("fig5/halved",), motions.doubled),
    _basins("6", "Basins of case b4 at four frequencies", ("14.75 Hz", "15 Hz", "15.75 Hz", "16 Hz"), "Dashed: the gap."),
    Picture("7", "fig7-differences", "The central question: where does ode45 go wrong, and by how much?",
            "Top three: share of the stiffnesses, in a window of 0.4 decades, at which ode45 ends in another response than the exact one, with 95 % bands. "
            "Bottom: the error that it makes in one forcing period, at the paper's tolerances and (thin) at 1e-8, 1e-11. From x₀ = 0.32 mm at rest.",
            tuple(f"fig7/{panel}, {job}" for panel in "def" for job in ("compared", "tighter")), stiffness.differences),
    Picture("7", "fig7-diagrams", "Bifurcation diagrams over the contact stiffness", "Points of zero velocity of the steady response from x₀ = 0.32 mm at rest.",
            tuple(f"fig7/{panel}, {end}" for panel in "def" for end in _ENDS), stiffness.diagrams),
    Picture("7", "fig7-responses", "Frequency responses from soft to hard contact", "Every start of the paper, in three ways laid over each other.",
            tuple(f"fig7/{panel}, {end}" for panel in "abc" for end in _ENDS), stiffness.three_stiffnesses),
    _basins("8", "Basins at 5 Hz before and after the grazing", ("25.5 kN per m", "23.2 kN per m")),
    _rows("9", "fig8", "25.5 kN per m", "Attractors before the grazing, Kc = 25.5 kN/m"),
    _rows("10", "fig8", "23.2 kN per m", "Attractors after the grazing, Kc = 23.2 kN/m"),
    _basins("11", "Basins at 17 Hz before and after the period doubling", ("7694 N per m", "8833 N per m")),
    _rows("12", "fig11", "7694 N per m", "Attractors before the period doubling, Kc = 7694 N/m", name="fig12-before"),
    _rows("12", "fig11", "8833 N per m", "Attractors after it, Kc = 8833 N/m", name="fig12-after"),
    _basins("13", "Basins at 23 Hz, stiff contact", ("18.4 MN per m", "19.4 MN per m")),
    _rows("14", "fig13", "18.4 MN per m", "Attractors at stiff contact, Kc = 18.4 MN/m"),
)  # fmt: skip
