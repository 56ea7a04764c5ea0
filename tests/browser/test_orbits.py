"""Orbits on the explorer's page: of branches, of attractors, under a slider; and what is saved."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import explorer_systems as systems
import saltus as sl
from explorer_page import opened, small

#: Index of the point of an unstable orbit that is farthest from all others.
UNSTABLE = """(() => { const { point_stable: stable, point_branch: branch } = explorer.responses.a;
  const i = [...stable.keys()].filter(
    k => !stable[k] && branch[k - 1] === branch[k] && branch[k + 1] === branch[k]);
  return i[i.length >> 1] })()"""


def unstable(seen):
    """An unstable point of the responses: its parameter and its peak."""
    ask = "i => [explorer.responses.x[i], explorer.responses.y[i]]"
    return seen.get(ask, seen.get(UNSTABLE))


def test_a_click_on_an_unstable_branch_shows_that_orbit(seen, rig):
    frequency, peak = unstable(seen)
    seen.page.mouse.click(*seen.place("#responses-canvas", frequency, peak))
    seen.rest()
    shown = seen.get("explorer.responses.chosen")
    frequency = seen.get("i => explorer.responses.x[i]", shown)
    assert not seen.get("i => explorer.responses.a.point_stable[i]", shown)
    assert seen.get("explorer.view.values.frequency") == frequency
    assert "unstable" in seen.text("#orbit-what")
    assert "nothing is integrated on" in seen.text("#motion-what")
    x, time = (
        np.array(seen.get(f"[...{what}]"))
        for what in ("explorer.motion.sample('x')", "explorer.motion.time")
    )
    assert time[-1] - time[0] == pytest.approx(4 / frequency, rel=1e-9)
    each = (len(x) - 1) // 4
    assert np.array_equal(x[:each], x[each : 2 * each])  # repeated
    assert np.abs(x).max() == pytest.approx(
        seen.get("i => explorer.responses.y[i]", shown), rel=1e-3
    )
    start = seen.get("explorer.motion.head.start")
    at = rig.with_values(frequency=frequency)
    once = sl.simulate(at, (start["x"], start["v"]), periods=1, samples=200, progress=False)
    assert np.allclose(x[: each + 1], once["x"].values, atol=1e-6 * np.abs(x).max())
    assert not seen.get("document.querySelector('.panel.stale')")
    seen.keep("unstable-orbit")
    seen.page.click("#orbit-leave")
    seen.rest()
    assert seen.get("explorer.motion.head.kind") == "motion"


def test_an_orbit_follows_a_slider_by_newtons_method(seen):
    frequency, peak = unstable(seen)
    seen.page.mouse.click(*seen.place("#responses-canvas", frequency, peak))
    seen.rest()
    seen.page.focus("[aria-label=force][type=range]")
    seen.page.keyboard.press("ArrowRight")
    seen.rest()
    head = seen.get("({ ...explorer.motion.head, arrays: [] })")
    assert head["kind"] == "track"
    assert head["values"]["force"] == seen.get("explorer.view.values.force") != 1.5
    x = seen.get("[...explorer.motion.sample('x')]")
    assert x[0] == pytest.approx(x[(len(x) - 1) // 4], rel=1e-5)  # it closes
    assert seen.text("#orbit-of") == ""


def test_branches_are_walked_by_keys_and_read_in_a_table(seen):
    seen.page.focus("#responses-canvas")
    for key in ("ArrowRight", "ArrowRight", "]", "e"):
        seen.page.keyboard.press(key)
    assert "fold" in seen.text("#responses-under") or "graz" in seen.text("#responses-under")
    log, peak = seen.page.locator("#responses-log"), unstable(seen)
    places = []
    for _ in range(2):
        before = log.get_attribute("aria-pressed")
        log.click()
        assert log.get_attribute("aria-pressed") != before
        places.append(seen.place("#responses-canvas", *peak))
    assert places[0][0] == places[1][0]
    assert places[0][1] != places[1][1]
    seen.page.focus("#responses-canvas")
    seen.page.keyboard.press("[")
    seen.page.keyboard.press("Enter")
    seen.rest()
    assert seen.get("explorer.view.orbit") is not None
    seen.page.keyboard.press("t")
    rows = seen.page.locator("#points tbody tr")
    points, events = seen.get(
        "[explorer.responses.x.length, explorer.responses.head.events.length]"
    )
    assert rows.count() == points + events
    rows.nth(events).locator("button").press("Enter")
    seen.rest()
    assert seen.get("explorer.responses.chosen") == 0


def test_a_hue_of_the_legend_shows_its_orbit_alone(seen):
    key = seen.get("explorer.map.sheet.attractors[1].key")
    seen.page.click(f"[data-key='{key}']")
    seen.rest()
    assert seen.get("explorer.map.only") == key
    assert seen.get("explorer.motion.orbit")
    peak = seen.get("explorer.map.sheet.attractors[1].peak.x")
    assert np.abs(seen.get("[...explorer.motion.sample('x')]")).max() == pytest.approx(
        peak, rel=1e-3
    )
    seen.page.click(f"[data-key='{key}']")
    seen.rest()
    assert seen.get("explorer.map.only") is None


def test_hues_stay_with_orbits_when_values_change(seen):
    table = "explorer.map.sheet.attractors.map(one => [one.contacts, one.hue])"
    before = dict(seen.get(table))
    seen.page.locator("[id='values.frequency']").fill("10.2 Hz")
    seen.page.keyboard.press("Enter")
    seen.rest()
    after = dict(seen.get(table))
    assert after == before


def saved(seen, kind, part=None):
    """A file that the save sheet makes."""
    seen.page.click("#save-open")
    seen.page.check(f"input[name=kind][value={kind}]")
    if part is not None:
        for box in seen.page.locator("input[name=part]").all():
            if box.get_attribute("value") == part:
                box.check()
            elif box.get_attribute("type") == "checkbox":
                box.uncheck()
    with seen.page.expect_download() as download:
        seen.page.click("#save-download")
    seen.keep(f"save-{kind}")
    seen.page.keyboard.press("Escape")
    return download.value


def test_what_is_seen_is_saved_and_is_what_saltus_says(seen, rig, tmp_path):
    seen.page.mouse.click(*seen.place("#map-canvas", 0.3e-3, 0.02))
    seen.rest()
    study = tomllib.loads(saved(seen, "study").path().read_text())
    assert {"system", "simulate", "basins"} <= set(study)
    saved(seen, "data", "map").save_as(tmp_path / "map.nc")
    (a, b, c, d), n = seen.get("explorer.view.box"), seen.get("explorer.view.size[0]")
    theirs = sl.basins(rig, x=(a, b, n), v=(c, d, n), progress=False)
    assert np.array_equal(sl.load(tmp_path / "map.nc")["basin"].values, theirs["basin"].values)
    script = saved(seen, "script").path().read_text()
    compile(script, "script", "exec")
    picture = saved(seen, "picture", "map")
    assert picture.suggested_filename.endswith(".png")
    assert picture.path().read_bytes()[:4] == b"\x89PNG"


def test_a_structure_shows_its_sensors_and_a_free_system_its_cycle(see):
    with opened(systems.beam()) as explorer:
        seen = see(small(explorer, size=[16, 16]))
        assert seen.get("explorer.view.history") == "tip"
        assert "history of tip" in seen.get("explorer.history.canvas.ariaLabel")
        seen.page.mouse.click(*seen.place("#map-canvas", 4e-3, 0.2))
        seen.rest()
        assert set(seen.get("explorer.view.start")) == {"tip", "tip speed"}
        x = seen.get("[explorer.motion.sample('tip')[0], explorer.view.start.tip]")
        assert x[0] == pytest.approx(x[1], rel=1e-6)
        seen.keep("structure")
        seen.page.select_option("#map-first", "q1")
        seen.rest()
        assert seen.get("explorer.view.axes") == ["q1", "q2"]
        assert len(seen.get("explorer.view.start")) == 4
    with opened(systems.van_der_pol) as explorer:
        seen = see(small(explorer, size=[16, 16], start={"x": 1.0, "y": 0.0}))
        assert "limit cycle" in seen.text("#legend")
        assert "limit cycle" in seen.text("#motion-what")
        assert seen.page.locator("#contacts-period").is_hidden()
        seen.keep("free")


@pytest.mark.nightly
def test_the_pictures_of_the_documentation_can_be_taken(see):
    """SALTUS_PICTURES=docs/pictures takes them anew: explore.png, explore-orbit.png, ..."""
    with opened(sl.models.delangre("b", force="4 N", frequency="15 Hz")) as explorer:
        view = {"size": [160, 160], "periods": 60, "box": [-5e-3, 5e-3, -1, 1], "range": [12, 18]}
        view |= {"start": {"x": 1e-3, "v": 0.0}}
        seen = see(small(explorer, **view), patience=600.0)
        seen.keep("explore")
        low, high = 15.5, 16.0
        pick = """([low, high]) => { const { x, y, a } = explorer.responses;
          return [...x.keys()].filter(k => !a.point_stable[k] && x[k] > low && x[k] < high)
            .sort((i, k) => y[k] - y[i]).map(k => [x[k], y[k]])[0] }"""
        seen.page.mouse.click(*seen.place("#responses-canvas", *seen.get(pick, [low, high])))
        seen.rest()
        seen.keep("explore-orbit")
        seen.page.click("#undo")
        seen.rest()
        slider = seen.page.locator("[aria-label=frequency][type=range]")
        box, at = slider.bounding_box(), int(slider.input_value()) / 1000
        place = box["y"] + box["height"] / 2
        seen.page.mouse.move(box["x"] + at * box["width"], place)
        seen.page.mouse.down()
        seen.page.mouse.move(box["x"] + at * box["width"] + 2, place)
        seen.until("explorer.motion.head.values.frequency === explorer.view.values.frequency")
        seen.until("document.getElementById('map-of').textContent !== ''")
        seen.keep("explore-dragging")
        seen.page.mouse.up()
