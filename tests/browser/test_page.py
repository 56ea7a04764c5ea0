"""What one sees and does on the explorer's page, beside what saltus says of the same."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from explorer_page import small
from saltus.plot.palette import hues, shades

#: Colours of the map at starts; none where a mark lies on it.
COLOURS = """starts => {
  const map = explorer.map, at = document.getElementById('map-canvas');
  const { data } = at.getContext('2d').getImageData(0, 0, at.width, at.height);
  const points = map.sheet.attractors.flatMap(one => one.points);
  const marks = [map.at, ...points].map(p => map.pixel(p));
  return starts.map(start => {
    const [x, y] = map.pixel(start);
    if (marks.some(([u, v]) => Math.hypot(u - x, v - y) < 16)) return null;
    const [column, row] = [x, y].map(v => Math.floor(v * devicePixelRatio));
    const first = 4 * (row * at.width + column);
    return [...data.slice(first, first + 3)];
  }) }"""
#: How much longer the script of a draw takes than that of one plain path through its samples: the
#: quickest of rounds that take turns, so that load weighs on both.
DRAWN = """(() => {
  const { history, motion } = explorer, y = motion.sample('x');
  const c = new OffscreenCanvas(800, 200).getContext('2d');
  const path = () => {
    c.beginPath();
    for (let i = 0; i < y.length; i++) c.lineTo(i * 800 / y.length, 100 + 1e5 * y[i]);
    c.stroke();
  };
  const took = what => {
    const begun = performance.now();
    for (let k = 0; k < 10; k++) what();
    return performance.now() - begun;
  };
  const rounds = [...Array(9)].map(() => [took(() => history.paint()), took(path)]);
  const [draw, plain] = [0, 1].map(i => Math.min(...rounds.map(round => round[i])));
  return draw / plain;
})()"""
#: Panels whose words of values don't agree with their numbers.
WRONG = """[...document.querySelectorAll('.panel.stale')].filter(
  panel => panel.querySelector('.of').textContent === '').map(panel => panel.id)"""


def samples(seen, name):
    return np.array(seen.get("name => [...explorer.motion.sample(name)]", name), np.float32)


def click(seen, x, y):
    seen.page.mouse.click(*seen.place("#map-canvas", x, y))
    seen.rest()


def test_every_start_of_the_map_has_the_hue_of_its_attractor(seen, rig):
    (a, b, c, d), n = seen.get("explorer.map.sheet.box"), seen.get("explorer.map.sheet.n")
    theirs = sl.basins(rig, x=(a, b, n), v=(c, d, n), progress=False)
    keys = np.array(seen.get("[...explorer.map.sheet.label]")).reshape(n, n)
    pairs = set(zip(keys.ravel().tolist(), theirs["basin"].values.ravel().tolist(), strict=True))
    assert len(pairs) == len({key for key, _ in pairs}) == len({name for _, name in pairs})
    hue = {one["key"]: one["hue"] for one in seen.get("explorer.map.sheet.attractors")}
    cells = np.random.default_rng(20261126).integers(1, n - 1, (200, 2)).tolist()
    x, v = np.linspace(a, b, n), np.linspace(c, d, n)
    colours = seen.get(COLOURS, [[x[i], v[j]] for i, j in cells])
    assert sum(colour is not None for colour in colours) > 100
    row = shades(hues(24), 13) * 255
    for (i, j), colour in zip(cells, colours, strict=True):
        if colour is not None and keys[i, j] >= 0:
            assert np.abs(row[hue[keys[i, j]]] - colour).max(axis=1).min() <= 1, (i, j)
    shares = {one["key"]: one["fraction"] for one in seen.get("explorer.map.sheet.attractors")}
    for key, name in pairs:
        if key >= 0:
            assert shares[key] == pytest.approx(
                float(theirs["attractor_fraction"].sel(attractor=name))
            )
    seen.keep("rest")


def test_a_click_shows_the_motion_of_simulate(seen, rig):
    click(seen, 0.3e-3, 0.02)
    start = seen.get("explorer.view.start")
    box = np.array(seen.get("explorer.view.box")).reshape(2, 2)
    assert (
        np.abs(np.subtract([start["x"], start["v"]], [0.3e-3, 0.02])) < 0.005 * np.ptp(box, axis=1)
    ).all()
    run = sl.simulate(rig, (start["x"], start["v"]), periods=30, samples=200, progress=False)
    for name in ("x", "v"):
        assert np.array_equal(samples(seen, name), run[name].values.astype(np.float32))
    times = seen.get("[...explorer.motion.contactTime]")
    assert np.array_equal(times, run["contact_time"].values)
    rows = seen.page.locator("#contacts tbody tr")
    assert float(rows.first.locator("td").nth(1).inner_text()) == pytest.approx(times[0], abs=1e-7)
    assert f"{len(times)} contacts" in seen.text("#motion-what")
    assert "settles to" in seen.text("#motion-what")


def test_a_draw_is_as_quick_as_a_few_paths(seen):
    assert seen.get(DRAWN) < 4  # one, measured


def test_a_dragged_slider_is_followed_and_every_panel_says_of_which_values_it_is(seen):
    seen.page.locator("[aria-label=frequency][type=range]").scroll_into_view_if_needed()
    box = seen.page.locator("[aria-label=frequency][type=range]").bounding_box()
    y, x0 = box["y"] + box["height"] / 2, box["x"]
    middle = seen.get("document.querySelector('[aria-label=frequency][type=range]').value / 1000")
    before = seen.get("explorer.map.sheet.key")
    seen.page.mouse.move(x0 + middle * box["width"], y)
    seen.page.mouse.down()
    for i in range(1, 9):
        seen.page.mouse.move(x0 + (middle + 0.005 * i) * box["width"], y)
        seen.until("explorer.motion.head.values.frequency === explorer.view.values.frequency")
        assert not seen.get(WRONG)
    seen.until(
        """explorer.map.sheet.covered
        || document.getElementById('map-of').textContent.includes('frequency 10 Hz')"""
    )
    assert "of frequency" in seen.text("#motion-of")
    seen.keep("dragging")
    seen.page.mouse.up()
    seen.rest()
    assert seen.get("explorer.map.sheet.key") != before
    now = seen.get("explorer.view.values.frequency")
    assert now != 10.0
    assert seen.get("explorer.map.sheet.values.frequency") == now
    assert [seen.text(f"#{panel}-of") for panel in ("map", "motion", "phase", "orbit")] == [""] * 4
    assert not seen.get("document.querySelector('.panel.stale')")


def test_values_are_typed_with_units_and_refused_beside_their_field(seen):
    field = seen.page.locator("[id='values.upper_gap']")
    field.fill("0.3 mm")
    field.press("Enter")
    seen.rest()
    assert seen.get("explorer.view.values.upper_gap") == pytest.approx(3e-4, rel=1e-15)
    field.fill("0.25")  # in the unit that the field shows
    field.press("Enter")
    seen.rest()
    assert seen.get("explorer.view.values.upper_gap") == pytest.approx(2.5e-4, rel=1e-15)
    field.fill("3 kg")
    field.press("Enter")
    note = seen.until("document.getElementById('values.upper_gap-note').textContent")
    assert "kg" in note
    assert field.get_attribute("aria-invalid") == "true"
    assert seen.get("explorer.view.values.upper_gap") == pytest.approx(2.5e-4, rel=1e-15)
    seen.keep("refused")
    start = seen.page.locator("[id='start.x']")
    start.fill("0.8 mm")
    start.press("Enter")
    seen.rest()
    assert seen.get("explorer.motion.head.start.x") == 8e-4


def test_zooming_keeps_the_old_cells_paler_until_finer_ones_come(seen, rig):
    whole = seen.get("explorer.view.box")
    seen.page.mouse.move(*seen.place("#map-canvas", 0.3e-3, 0.02))
    seen.page.mouse.wheel(0, -600)
    seen.until("explorer.map.paler")
    assert "another view" in seen.text("#map-of")
    seen.rest()
    assert seen.text("#map-of") == ""
    a, b, c, d = seen.get("explorer.map.sheet.box")
    assert b - a == pytest.approx((whole[1] - whole[0]) * np.exp(-1.2), rel=1e-6)
    assert a < 0.3e-3 < b
    theirs = sl.basins(rig, x=(a, b, 40), v=(c, d, 40), progress=False)["basin"].values
    keys = np.array(seen.get("[...explorer.map.sheet.label]")).reshape(40, 40)
    pairs = set(zip(keys.ravel().tolist(), theirs.ravel().tolist(), strict=True))
    assert len(pairs) == len({key for key, _ in pairs})
    seen.keep("zoomed")


def test_back_and_undo_show_the_view_before(seen):
    whole, first = seen.get("explorer.view.box"), seen.get("explorer.view.start")
    click(seen, 0.3e-3, 0.02)
    second = seen.get("explorer.view.start")
    seen.page.click("#map-in")
    seen.rest()
    assert seen.get("explorer.view.box") != whole
    seen.page.go_back()
    seen.rest()
    assert seen.get("explorer.view.box") == whole
    assert seen.get("explorer.view.start") == second
    seen.page.click("#undo")
    seen.rest()
    assert seen.get("explorer.view.start") == first
    assert seen.get("explorer.motion.head.start") == first
    seen.page.keyboard.press("Control+y")
    seen.rest()
    assert seen.get("explorer.view.start") == second


def test_an_address_opens_its_view_and_a_damaged_one_says_so(see, seen, explored):
    click(seen, 0.3e-3, 0.02)
    seen.page.locator("[id='values.force']").fill("1.6 N")
    seen.page.keyboard.press("Enter")
    seen.rest()
    other = see(seen.get("explorer.address()"))
    for part in ("values", "start", "box", "size", "periods"):
        assert other.get(f"explorer.view.{part}") == seen.get(f"explorer.view.{part}")
    assert "token" not in other.page.url
    damaged = see(
        f"{explored.url}&view=%7B%22size%22:[40,30],%22values%22:%7B%22force%22:%22DROP%22%7D,%22box%22:[1,0,0,1]%7D"
    )
    assert "damaged" in damaged.text("#says")
    assert damaged.get("explorer.view.values.force") == 1.5
    assert damaged.get("explorer.view.size") == [40, 30]


def test_methods_are_compared_in_the_history_and_in_words(see, explored, rig):
    seen = see(small(explored, box=[-1e-2, 1e-2, -0.6, 0.6]))  # a twelfth leads elsewhere
    seen.page.select_option("#against", "ODE45")
    seen.rest()
    other = seen.get("[...explorer.motion.arrays['other:x']]")
    start = seen.get("explorer.view.start")
    run = sl.simulate(
        rig,
        (start["x"], start["v"]),
        periods=30,
        samples=200,
        method=sl.ODE45(1e-4, 1e-7),
        progress=False,
    )
    assert np.array_equal(np.float32(other), run["x"].values.astype(np.float32))
    assert "hey part by" in seen.text("#motion-what") or "hey agree" in seen.text("#motion-what")
    (a, b, c, d), n = seen.get("explorer.view.box"), seen.get("explorer.view.size[0]")
    axes = {"x": (a, b, n), "v": (c, d, n)}
    maps = [sl.basins(rig, **axes, method=method) for method in (None, sl.ODE45(1e-4, 1e-7))]
    agreement = sl.compare(*maps)["agreement"].values
    shown = seen.get("[...explorer.map.agreement.sheet.label]")
    assert shown == agreement.ravel().tolist()
    inner = np.argwhere(np.isin(agreement[1:-1, 1:-1], (0, 1))) + 1
    at = np.stack([np.linspace(a, b, n)[inner[:, 0]], np.linspace(c, d, n)[inner[:, 1]]], axis=1)
    looks = {0: (0xD5, 0x5E, 0x00), 1: (0xE4, 0xE4, 0xE4)}
    colours = seen.get(COLOURS, at.tolist())
    known = [
        (looks[int(agreement[tuple(cell)])], colour)
        for cell, colour in zip(inner, colours, strict=True)
        if colour
    ]
    assert {wanted for wanted, _ in known} == set(looks.values())
    assert all(np.abs(np.subtract(wanted, colour)).max() <= 1 for wanted, colour in known)
    assert "lead to the same attractor" in seen.text("#map-under")
    seen.keep("compare")
    seen.page.click("#map-differ")
    assert seen.get("explorer.map.agreement") is None
