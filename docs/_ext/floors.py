"""The directive ``floors``: the picture of a house of floors, drawn from the import contracts of
pyproject.toml that ``lint-imports`` holds.
"""

from __future__ import annotations

import html
import tomllib
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

#: Where the contracts stand.
PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
#: Width of the picture, height of a floor, space between rooms [px].
WIDTH, FLOOR, SPACE = 720, 34, 6


def floors(package: str) -> list[list[str]]:
    """The floors of a package from the top, each a list of rooms.

    Raises
    ------
    LookupError
        If no contract says so.
    """
    contracts = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["tool"]["importlinter"]
    for contract in contracts["contracts"]:
        if contract["type"] == "layers" and contract["containers"] == [package]:
            return [[room.strip() for room in floor.split("|")] for floor in contract["layers"]]
    raise LookupError(f"no contract of layers is about {package}")


def picture(package: str) -> str:
    """The floors of a package as SVG; what stands higher imports what stands lower."""
    rows, boxes = floors(package), []
    for i, rooms in enumerate(rows):
        wide = (WIDTH - SPACE * (len(rooms) + 1)) / len(rooms)
        for j, room in enumerate(rooms):
            x, y = SPACE + j * (wide + SPACE), SPACE + i * (FLOOR + SPACE)
            boxes.append(
                f'<rect x="{x:.1f}" y="{y}" width="{wide:.1f}" height="{FLOOR}" rx="4" '
                f'fill="none" stroke="currentColor"/><text x="{x + wide / 2:.1f}" '
                f'y="{y + FLOOR / 2 + 5:.0f}" text-anchor="middle">{html.escape(room)}</text>'
            )
    height = SPACE + len(rows) * (FLOOR + SPACE)
    said = f"Floors of {package}, from the top: " + "; ".join(", ".join(rooms) for rooms in rows)
    return (
        f'<svg viewBox="0 0 {WIDTH} {height}" width="100%" role="img" font-size="14" '
        f'aria-label="{html.escape(said)}" fill="currentColor">{"".join(boxes)}</svg>'
    )


class Floors(SphinxDirective):
    """The picture of one package."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        self.env.note_dependency(str(PROJECT))
        try:
            return [nodes.raw("", picture(self.arguments[0]), format="html")]
        except LookupError as error:
            raise self.error(str(error)) from None


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("floors", Floors)
    return {"parallel_read_safe": True}
