"""The dashboard of the real stack in a real browser."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from lariat.scenario import load
from tests.browser.chromium import NO_CHROMIUM, drag, on_screen, opened, press_set_goal
from tests.browser.stack import running

pytestmark = [pytest.mark.live, NO_CHROMIUM]

SCENARIO = load("scenarios/three-cylinders.toml")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    # A browser that renders in software and a simulated camera are too much for two cores.
    text = SCENARIO.text.replace('source = "camera"', 'source = "truth"')
    assert text != SCENARIO.text
    path = tmp_path_factory.mktemp("scenario") / "three-cylinders.toml"
    path.write_text(text)
    with running(str(path)) as address, opened(address, 1280, 640, niceness=19) as page:
        yield page


def remaining_distance(page: Page) -> float:
    """Return the remaining distance that the headline shows [mm]."""
    text = page.get_by_text(
        re.compile(r"^(Ready|Running|Held|Reached|Paused).*: ")
    ).first.inner_text()
    found = re.search(r"([\d.]+) mm", text)
    assert found is not None, text
    return float(found[1])


def follow_to_the_goal(page: Page, timeout: float = 60.0) -> None:
    """Wait for the goal; go on where a busy machine has made the arms hold."""
    reached = page.get_by_text(re.compile(r"^Reached: "))
    go_on = page.get_by_role("button", name="Continue")
    started = time.monotonic()
    while not reached.is_visible():
        assert time.monotonic() - started < timeout, page.get_by_text(" to go").first.inner_text()
        if go_on.is_visible():
            go_on.click()
        page.wait_for_timeout(300)


def test_start_moves_the_rope_to_the_goal(page: Page) -> None:
    expect(page.get_by_text(re.compile(r"^Ready: [\d.]+ mm to go"))).to_be_visible(timeout=30_000)
    before = remaining_distance(page)
    assert before > 100.0
    go_on = page.get_by_role("button", name="Continue")
    if go_on.is_visible():
        go_on.click()
    page.get_by_role("button", name="Start").click()
    expect(page.get_by_text(re.compile("^(Running|Held|Reached)"))).to_be_visible()
    follow_to_the_goal(page)
    assert remaining_distance(page) < 0.05 * before


def test_dragged_goal_shows_how_the_rope_would_rest(page: Page) -> None:
    grip = SCENARIO.grips(SCENARIO.goal)[1].position
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("The present goal", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Set goal")).to_be_disabled()
    arrow = grip + np.array([0.0, 0.0, 0.75 * 0.25 * SCENARIO.rope.length])
    up = np.array([0.0, 0.0, 0.06])
    drag(page, on_screen(page, SCENARIO, arrow), on_screen(page, SCENARIO, arrow + up))
    height = page.get_by_role("textbox").nth(5)
    assert float(height.input_value()) > 1e3 * grip[2] + 30.0
    expect(page.get_by_text("Reachable", exact=True)).to_be_visible()
    press_set_goal(page)
    # At least 10 mm of way to the new goal.
    further = page.get_by_text(re.compile(r": [1-9]\d+\.\d mm to go"))
    expect(further).to_be_visible(timeout=20_000)
