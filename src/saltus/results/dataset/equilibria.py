"""The table of what ``equilibria`` returns."""

from __future__ import annotations

from saltus.results.dataset.variable import Variable

_EACH = ("equilibrium",)
_EIGENVALUE = ("equilibrium", "eigenvalue")

#: Variables of what ``equilibria`` returns.
EQUILIBRIA_VARIABLES = {
    "equilibrium": Variable(_EACH, "1", "equilibrium", "i8", coord=True),
    "equilibrium_type": Variable(_EACH, "", "node, focus, saddle, ... by its eigenvalues", "str"),
    "equilibrium_place": Variable(
        _EACH, "", "in a region, on a boundary, or held by contacts", "str"
    ),
    "equilibrium_stable": Variable(
        _EACH, "1", "whether it attracts", "i1", flags={0: "no", 1: "yes"}
    ),
    "equilibrium_contacts": Variable(
        _EACH, "", "guards whose contacts are held, or whose gap is zero", "str"
    ),
    "equilibrium_mode": Variable(_EACH, "1", "mode, bit i is guard i", "i8"),
    "equilibrium_margin": Variable(_EACH, "<gap>", "distance to the nearest other boundary"),
    "equilibrium_dimension": Variable(_EACH, "1", "dimension of a continuum, 0 if isolated", "i8"),
    "equilibrium_eigenvalue_real": Variable(
        _EIGENVALUE, "1/s", "eigenvalue of the Jacobian, real part"
    ),
    "equilibrium_eigenvalue_imag": Variable(
        _EIGENVALUE, "1/s", "eigenvalue of the Jacobian, imaginary part"
    ),
    "equilibrium_<state>": Variable(_EACH, "<state>", "<state> at rest"),
    "equilibrium_<state>_from": Variable(
        _EACH, "<state>", "<state> at the beginning of an interval of equilibria"
    ),
    "equilibrium_<state>_to": Variable(
        _EACH, "<state>", "<state> at the end of an interval of equilibria"
    ),
}
