"""The table of what ``structure_modes`` returns."""

from __future__ import annotations

from saltus.results.dataset.variable import Variable

#: Variables of what ``structure_modes`` returns.
MODES_VARIABLES = {
    "frequency": Variable(("mode",), "Hz", "natural frequency"),
    "shape": Variable(("degree", "mode"), "kg^-0.5", "mode shape of unit modal mass"),
    "flexibility": Variable(("place",), "m/N", "static flexibility"),
    "residual_flexibility": Variable(("place",), "m/N", "static flexibility of the modes left out"),
    "flexibility_share": Variable(
        ("place",), "1", "share of the static flexibility that the modes carry"
    ),
    "mode": Variable(("mode",), "1", "mode", "i8", coord=True),
    "degree": Variable(("degree",), "", "degree of freedom", "str", coord=True),
    "place": Variable(("place",), "", "where the flexibility is asked for", "str", coord=True),
}
