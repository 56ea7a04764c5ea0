"""A study of basins small enough for tests: the rig at 16 Hz, four attractors; cut to any size."""


def small_study(first: int, second: int | None = None) -> str:
    """Its text, with so many starts along x and v."""
    return f"""
[study]
name = "small"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "16 Hz"
[basins]
axes.x = {{ first = "-5 mm", last = "5 mm", count = {first} }}
axes.v = {{ first = "-1 m/s", last = "1 m/s", count = {second or first} }}
"""
