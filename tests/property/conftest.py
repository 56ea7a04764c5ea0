"""Hypothesis: few examples, the same ones in every run, no deadline (the first example of a system
compiles it).
"""

from __future__ import annotations

from hypothesis import HealthCheck, settings

settings.register_profile(
    "saltus",
    max_examples=25,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("saltus")
