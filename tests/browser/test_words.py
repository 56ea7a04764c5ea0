"""What the explorer's page says: no contradictions, in its own words, beside what it is about."""

from __future__ import annotations

import time

import pytest

from explorer_page import PATIENCE, small


def typed(seen, at, text):
    seen.page.locator(at).fill(text)
    seen.page.keyboard.press("Enter")


def test_an_event_of_ones_own_branch_is_opened_by_enter(seen):
    own = seen.get("explorer.responses.a.event_branch.at(-1)")
    seen.page.focus("#responses-canvas")
    for _ in range(own + 1):
        seen.page.keyboard.press(
            "]" if seen.get("explorer.responses.chosen") >= 0 else "ArrowRight"
        )
    while seen.get("b => explorer.responses.a.point_branch[explorer.responses.chosen] !== b", own):
        seen.page.keyboard.press("]")
    seen.page.keyboard.press("e")
    event = seen.get("explorer.responses.event")
    assert seen.get("k => explorer.responses.a.event_branch[k]", event) == own
    frequency = seen.get("k => explorer.responses.a.event_parameter[k]", event)
    seen.page.keyboard.press("Enter")
    seen.rest()
    assert seen.get("explorer.view.orbit.event") == event
    assert seen.get("explorer.view.values.frequency") == frequency
    seen.page.keyboard.press("ArrowLeft")
    assert seen.get("explorer.responses.event") == -1


def test_a_range_is_refused_beside_its_field(seen):
    typed(seen, "#range-low", "30 Hz")
    assert "must ascend" in seen.until("document.getElementById('range-note').textContent")
    assert seen.page.get_attribute("#range-low", "aria-invalid") == "true"
    assert seen.page.locator("#says").is_hidden()
    typed(seen, "#range-low", "8 Hz")
    seen.rest()
    assert seen.text("#range-note") == ""
    assert seen.get("explorer.view.range")[0] == 8.0


def test_without_damping_every_panel_says_that_nothing_attracts(seen):
    typed(seen, "[id='values.damping_ratio']", "0")
    seen.rest()
    for panel in ("#map-words", "#responses-words"):
        assert "has no attractors" in seen.text(panel), panel
    assert seen.page.locator("#legend tbody tr").count() == 0
    assert seen.page.locator("#says").is_hidden()
    assert seen.get("explorer.motion.head.values.damping_ratio") == 0
    seen.keep("undamped")
    seen.page.click("#undo")
    seen.rest()
    assert "settles to" in seen.text("#motion-what")
    assert seen.page.locator("#legend tbody tr").count() > 0


def test_moves_of_the_map_are_one_step_back_and_the_newest_change_is_another(seen):
    box = seen.get("explorer.view.box")
    for _ in range(3):
        seen.page.click("#map-in")
        seen.rest()
    moved = seen.get("explorer.view.box")
    typed(seen, "[id='values.force']", "1.6 N")
    seen.until("explorer.view.values.force === 1.6")
    seen.page.focus("#map-canvas")
    seen.page.keyboard.press("Control+z")  # before it was kept
    seen.until("explorer.view.values.force === 1.5")
    assert seen.get("explorer.view.box") == moved
    seen.page.keyboard.press("Control+z")
    seen.until("b => explorer.view.box.join() === b.join()", box)
    seen.rest()


def test_the_map_tells_the_pointer_from_the_start_of_its_cell(seen):
    place = seen.place("#map-canvas", 0.33e-3, 0.021)
    seen.page.mouse.move(*place)
    assert "cell shows the start" in seen.text("#map-under")
    seen.page.keyboard.down("Shift")
    seen.page.mouse.click(*place)
    seen.page.keyboard.up("Shift")
    seen.rest()
    start = seen.get("[explorer.view.start.x, explorer.view.start.v]")
    cell = seen.get("s => explorer.map.sheet.find(...s)", start)
    assert start == pytest.approx(cell["at"], rel=1e-12)
    label = seen.get(
        "k => explorer.map.sheet.attractors.find(o => o.key === k).name", cell["label"]
    )
    assert f"settles to {label}" in seen.text("#motion-what")


def test_what_is_shown_first_is_known_to_python_before_a_click(see, explored):
    see(small(explored))
    end = time.monotonic() + PATIENCE
    while "motion" not in explored.view and time.monotonic() < end:
        time.sleep(0.05)
    assert "[simulate]" in explored.study()
