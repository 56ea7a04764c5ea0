"""[periodic_orbits]: the periodic orbits of a system, stable or not, from many starts."""

from __future__ import annotations

from saltus.study.answers.question import OneVerb


class Orbits(OneVerb):
    """Periodic orbits, stable and unstable."""

    place, function = "periodic_orbits", "periodic_orbits"
