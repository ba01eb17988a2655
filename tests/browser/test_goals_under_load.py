"""Goals that are dragged on the page of a live cell beside busy processes: minutes of work."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from lariat.scenario import load
from tests.browser.chromium import NO_CHROMIUM, comes, drag, on_screen, opened, press_set_goal
from tests.browser.stack import running

pytestmark = [pytest.mark.live, pytest.mark.slow, NO_CHROMIUM]

SCENARIO = load("three-cylinders")
BUSY_PROCESSES = 2
GOALS = 10
ARROW_SHARE = 0.75 * 0.25
"""Distance from a grip to the arrow of its gizmo, in lengths of the rope [-]."""
RISE = 0.04
"""Distance by which a goal is dragged, up and down in turn [m]."""

SETTLING_TIME = 1000.0
"""Time within which a goal shows in the fields [ms]."""


@pytest.fixture
def page() -> Iterator[Page]:
    with ExitStack() as stack:
        for _ in range(BUSY_PROCESSES):
            busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            stack.callback(busy.wait)
            stack.callback(busy.kill)
        address = stack.enter_context(running("three-cylinders"))
        yield stack.enter_context(opened(address, 1280, 640, niceness=19))


def test_ten_goals_dragged_one_after_the_other_are_followed_without_a_start(page: Page) -> None:
    reached = page.get_by_text(re.compile(r"^Reached: "))
    page.get_by_role("button", name="Start").click()
    expect(reached).to_be_visible(timeout=120_000)
    grip = SCENARIO.grips(SCENARIO.goal)[1].position.copy()
    for number in range(GOALS):
        page.get_by_role("button", name="Edit goal").click()
        expect(page.get_by_text("The present goal", exact=True)).to_be_visible()
        page.wait_for_timeout(SETTLING_TIME)
        height = page.get_by_role("textbox").nth(5)
        before = float(height.input_value())
        grip[2] = 1e-3 * before
        arrow = grip + np.array([0.0, 0.0, ARROW_SHARE * SCENARIO.rope.length])
        way = np.array([0.0, 0.0, RISE if number % 2 == 0 else -RISE])
        drag(page, on_screen(page, SCENARIO, arrow), on_screen(page, SCENARIO, arrow + way))
        expect(page.get_by_text("Reachable", exact=True)).to_be_visible()
        dragged = comes(page, lambda f=height, b=before: abs(float(f.input_value()) - b) > 15.0)
        assert dragged, f"goal {number + 1}: from {before} mm to {height.input_value()} mm"
        press_set_goal(page)
        # On the way to it at first, then there, and nothing but the goal was pressed.
        expect(page.get_by_text(re.compile(r"^(Running|Held|Paused).*: "))).to_be_visible()
        expect(reached).to_be_visible(timeout=120_000)
        print(f"goal {number + 1} of {GOALS} was followed", flush=True)
