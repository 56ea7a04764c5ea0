"""The explorer's page by keyboard, in small windows, at night, for readers of screens, and when its
line is lost.
"""

from __future__ import annotations

import numpy as np
import pytest

from explorer_page import small

#: Focus on what a key is meant for.
ON_MAP, ON_RESPONSES = "#map-canvas", "#responses-canvas"


@pytest.fixture(scope="session")
def axe(web):
    return (web / "node_modules" / "axe-core" / "axe.min.js").read_text()


def violations(seen, axe):
    """What axe-core finds, in words."""
    seen.get(axe)
    found = seen.get("axe.run(document, { resultTypes: ['violations'] })")["violations"]
    return [(one["id"], [node["html"][:160] for node in one["nodes"]]) for one in found]


@pytest.mark.parametrize(
    ("name", "window"),
    [
        ("light", {}),
        ("dark", {"color_scheme": "dark"}),
        ("narrow", {"width": 700}),
        ("zoomed-200", {"width": 700, "height": 450, "device_scale_factor": 2}),
    ],
)
def test_axe_finds_nothing(see, explored, axe, name, window):
    seen = see(small(explored), **window)
    assert violations(seen, axe) == []
    seen.keep(name)
    assert seen.get("document.getElementById('map-canvas').clientHeight > 150")
    # nothing is wider than the window: nobody scrolls sideways
    assert seen.get("document.documentElement.scrollWidth <= innerWidth")
    if name in ("narrow", "zoomed-200"):
        return
    seen.page.click("#save-open")
    assert violations(seen, axe) == []
    seen.keep(f"save-{name}")
    seen.page.keyboard.press("Escape")
    seen.page.click("#keys-open")
    assert violations(seen, axe) == []


def test_what_can_be_pressed_is_large_enough(seen):
    small_ones = seen.get(
        """[...document.querySelectorAll('button, select, input, canvas')].filter(one => {
          const { width, height } = one.getBoundingClientRect();
          const inLabel = ['range', 'checkbox', 'radio'].includes(one.type);
          return one.checkVisibility() && !inLabel && (width < 24 || height < 24);
        }).map(one => one.id || one.outerHTML)"""
    )
    assert small_ones == []


def test_the_map_is_moved_by_keys(seen):
    seen.page.focus(ON_MAP)
    start, box = seen.get("explorer.view.start"), seen.get("explorer.view.box")
    for _ in range(5):
        seen.page.keyboard.press("ArrowRight")
    seen.rest()
    moved = seen.get("explorer.view.start")
    assert moved["x"] - start["x"] == pytest.approx(0.05 * (box[1] - box[0]))
    assert seen.get("explorer.motion.head.start.x") == moved["x"]
    assert "x =" in seen.text("#map-under")
    seen.page.keyboard.press("Shift+ArrowUp")
    seen.page.keyboard.press("+")
    seen.rest()
    closer = seen.get("explorer.view.box")
    assert closer[1] - closer[0] == pytest.approx(0.8 * (box[1] - box[0]))
    assert closer != box
    seen.page.keyboard.press("0")
    seen.rest()
    assert seen.get("explorer.view.box") == box
    views = []
    for key in ("Shift+ArrowRight", "Shift+ArrowUp"):
        seen.page.keyboard.press(key)
        seen.rest()
        views.append(seen.get("explorer.map.sheet.box"))
    first, second = (
        [np.linspace(*view[i : i + 2], 40) for i in (0, 2)] for view in views
    )  # panned views share their starts to the bit
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1][4:], second[1][:-4])
    seen.page.keyboard.press("f")
    assert seen.get("document.getElementById('map').classList.contains('whole')")
    seen.page.keyboard.press("f")
    assert not seen.get("document.querySelector('.whole')")


def test_a_slider_is_moved_by_keys(seen):
    seen.page.focus("[aria-label=force][type=range]")
    for _ in range(3):
        seen.page.keyboard.press("ArrowRight")
    seen.rest()
    force = seen.get("explorer.view.values.force")
    assert force > 1.5
    assert seen.get("explorer.map.sheet.values.force") == force
    spoken = seen.page.get_attribute("[aria-label=force][type=range]", "aria-valuetext")
    assert float(spoken.split()[0]) == pytest.approx(force, rel=1e-5)


def test_contacts_are_chosen_in_their_table(seen):
    seen.page.mouse.click(*seen.place(ON_MAP, -0.9e-3, -0.04))
    seen.rest()
    seen.page.focus("#contacts-scroll")
    for _ in range(3):
        seen.page.keyboard.press("ArrowDown")
    assert seen.get("explorer.history.chosen") == 2
    assert seen.get("document.querySelector('#contacts .chosen').rowIndex") == 3


def test_the_status_is_heard(seen):
    assert seen.page.get_attribute("#status", "role") == "status"
    seen.page.keyboard.press("Escape")
    seen.until("document.getElementById('status').textContent === 'stopped'")


def test_a_lost_line_is_said_and_tried_again(see, explored):
    lines = []

    def hold(page):
        def route(line):
            server = line.connect_to_server()
            lines.append((line, server))

        page.route_web_socket(lambda address: address.endswith("/socket"), route)

    seen = see(small(explored), before=hold, hurried=False)
    line, server = lines[-1]
    server.close()
    line.close(code=1012)
    assert "trying again in 0.5 s" in seen.until("document.getElementById('says').innerText")
    seen.keep("lost-line")
    seen.until("document.getElementById('says').hidden")
    seen.rest()
    assert len(lines) == 2
    seen.page.mouse.click(*seen.place(ON_MAP, 0.3e-3, 0.02))
    seen.rest()
    assert seen.get("explorer.motion.head.start.x") == seen.get("explorer.view.start.x")


def test_a_wrong_token_is_told_what_to_do(see, explored):
    seen = see(explored.url.split("token=")[0] + "token=guessed", rest=False)
    seen.until("document.getElementById('says').innerText.includes('printed')")
    assert seen.get("document.getElementById('main').hidden")


def test_two_pages_share_a_desk(see, seen, explored):
    other = see(small(explored))
    for page in (seen, other):
        assert page.get("explorer.map.sheet.done")
    label = "[...explorer.map.sheet.label].join()"
    assert seen.get(label) == other.get(label)
