"""What one sees and does on the explorer's page, beside what saltus says of the same."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.plot.palette import hues


def word(sheet):
    """JavaScript: label of the map at a start."""
    return f"([x, y]) => {{ const at = {sheet}.find(x, y); return at && at.label }}"


def pixel(seen, x, y):
    """Colour of the map at a start."""
    ask = """([x, y]) => { const [px, py] = explorer.map.pixel([x, y]), at = document.getElementById('map-canvas');
        return [...at.getContext('2d').getImageData(px * devicePixelRatio, py * devicePixelRatio, 1, 1).data].slice(0, 3) }"""
    return np.array(seen.get(ask, [x, y]))


def samples(seen, name):
    return np.array(seen.get("name => [...explorer.motion.sample(name)]", name), np.float32)


def click(seen, x, y):
    seen.page.mouse.click(*seen.place("#map-canvas", x, y))
    seen.rest()


def now(seen):
    return seen.get("explorer.view.values")


def wrong_marks(seen):
    """Panels that show numbers of other values and don't say so, or the other way round."""
    return seen.get(
        """[...document.querySelectorAll('.panel')].filter(p => { const of = p.querySelector('.of');
            return of && (of.textContent !== '') !== p.classList.contains('stale') && !of.textContent.includes('another view') }).map(p => p.id)"""
    )


# -- the map ---------------------------------------------------------------------------------------
def test_every_pixel_of_the_map_has_the_hue_of_its_start(seen, rig):
    """Labels of the page are those of sl.basins; each start is drawn in a shade of its hue."""
    (a, b, c, d), size = seen.get("explorer.map.sheet.box"), seen.get("explorer.map.sheet.n")
    theirs = sl.basins(rig, x=(a, b, size), v=(c, d, size), progress=False)
    labels = np.array(seen.get("[...explorer.map.sheet.label]")).reshape(size, size)
    table = {one["key"]: one for one in seen.get("explorer.map.sheet.attractors")}
    ids = {}
    for key, name in zip(labels.ravel().tolist(), theirs["basin"].values.ravel().tolist(), strict=True):
        assert ids.setdefault(key, name) == name  # one attractor, one key
    row = hues(24) * 255
    x, v = np.linspace(a, b, size), np.linspace(c, d, size)
    for i, j in np.random.default_rng(20261126).integers(1, size - 1, (40, 2)):
        if labels[i, j] < 0 or seen.get("([i, j]) => Math.hypot(...explorer.map.pixel([i, j]).map((v, k) => v - explorer.map.pixel(explorer.map.at)[k])) < 16", [x[i], v[j]]):
            continue
        seen_color, hue = pixel(seen, x[i], v[j]), row[table[int(labels[i, j])]["hue"]]
        shades = np.array(seen.get("key => explorer.about.hue_shades[key]", table[int(labels[i, j])]["hue"]))
        near = np.abs(shades - seen_color).max(axis=1).min()
        assert near <= 2 or any(np.hypot(*(np.subtract(seen.get("p => explorer.map.pixel(p)", p[:2]), seen.get("p => explorer.map.pixel(p)", [x[i], v[j]])))) < 9 for one in table.values() for p in one["points"]), (i, j, seen_color, hue)
    assert "all known" in seen.text("#status")
    seen.keep("rest")
