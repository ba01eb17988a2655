"""Goal of which only a stretch or the ends count, in a real browser, by mouse and keyboard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from lariat.geometry import polylines
from shared import topics
from shared.messages import TaskRequest, chain
from tests.browser.cell import SCENARIO, Cell, opened_cell
from tests.browser.chromium import (
    NO_CHROMIUM,
    choose,
    comes,
    drag,
    field,
    on_screen,
    press_set_goal,
)

pytestmark = NO_CHROMIUM


@pytest.fixture(scope="module")
def bench() -> Iterator[tuple[Cell, Page]]:
    with opened_cell() as both:
        yield both


def type_stretch(page: Page, begin: str, end: str) -> None:
    """Type the two ends of the stretch [mm]."""
    ends = field(page, "Counts [mm]")
    for k, text in enumerate((begin, end)):
        ends.nth(k).fill(text)
        ends.nth(k).press("Tab")


def greenness(page: Page, place: np.ndarray) -> float:
    """Green of a place of the window [pixels], as a multiple of its red and blue."""
    clip = {"x": place[0] - 2.0, "y": place[1] - 2.0, "width": 5.0, "height": 5.0}
    image = cv2.imdecode(np.frombuffer(page.screenshot(clip=clip), np.uint8), 1)
    assert image is not None
    blue, green, red = image.reshape(-1, 3).astype(float).mean(axis=0)
    return 2.0 * green / (red + blue)


def test_stretch_of_an_unchanged_goal_is_set(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    cell.forget()
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("The present goal")).to_be_visible()
    set_goal = page.get_by_role("button", name="Set goal")
    expect(set_goal).to_be_disabled()
    expect(field(page, "Counts [mm]").nth(1)).to_have_value("450")
    for label in ("Left [mm]", "Right [mm]", "Counts [mm]"):
        for number in field(page, label).all():
            assert number.evaluate("e => e.scrollWidth <= e.clientWidth"), f"{label} is clipped"
    type_stretch(page, "100", "300")
    expect(page.get_by_text("100 to 300 mm of the rope count, the rest is free.")).to_be_visible()
    nodes = chain(cell.goal().positions)
    counted = polylines.within(nodes, 0.1, 0.3)
    inside = on_screen(page, SCENARIO, nodes[np.flatnonzero(counted)[8]])
    outside = on_screen(page, SCENARIO, nodes[np.flatnonzero(~counted)[-6]])
    assert comes(page, lambda: greenness(page, inside) > 1.2), greenness(page, inside)
    assert comes(page, lambda: greenness(page, outside) < 1.1), greenness(page, outside)
    set_goal.click()
    request = cell.asked(topics.TASK_REQUEST)
    assert request.action == TaskRequest.SET_GOAL
    assert list(request.goal.part) == pytest.approx([0.1, 0.3])
    assert chain(request.goal.positions) == pytest.approx(nodes, abs=1e-6)
    assert cell.sent(topics.TASK_GOAL_DRAFT)
    expect(field(page, "Counts [mm]")).to_have_count(0)


def test_impossible_stretch_cannot_be_set_and_says_why(bench: tuple[Cell, Page]) -> None:
    _, page = bench
    page.get_by_role("button", name="Edit goal").click()
    set_goal = page.get_by_role("button", name="Set goal")
    expect(page.get_by_text("The present goal")).to_be_visible()
    type_stretch(page, "300", "100")
    expect(page.get_by_text("What counts ends before it begins")).to_be_visible()
    expect(set_goal).to_be_disabled()
    type_stretch(page, "90", "100")
    expect(page.get_by_text("which make no shape; give at least 35 mm.")).to_be_visible()
    expect(set_goal).to_be_disabled()
    # The fields themselves keep to the rope.
    type_stretch(page, "0", "99999")
    expect(field(page, "Counts [mm]").nth(1)).to_have_value("450")
    expect(page.get_by_text("The rope will rest in this shape.")).to_be_visible()
    expect(set_goal).to_be_enabled()
    page.get_by_role("button", name="Cancel").click()


def test_dragged_end_keeps_the_stretch(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    cell.forget()
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("The present goal")).to_be_visible()
    type_stretch(page, "50", "200")
    before = SCENARIO.grips(SCENARIO.goal)[0].position
    arrow = before + np.array([0.0, 0.0, 0.75 * 0.25 * SCENARIO.rope.length])
    up = np.array([0.0, 0.0, 0.08])
    drag(page, on_screen(page, SCENARIO, arrow), on_screen(page, SCENARIO, arrow + up))
    expect(page.get_by_text("50 to 200 mm of the rope count")).to_be_visible()
    press_set_goal(page)
    goal = cell.asked(topics.TASK_REQUEST).goal
    assert list(goal.part) == pytest.approx([0.05, 0.2])
    assert 0.06 < goal.left.position[2] - before[2] < 0.1


def test_saved_stretch_is_downloaded_and_loaded_again(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    wanted = cell.goal()
    wanted.part[:] = 0.1, 0.3
    cell.set_goal(wanted)
    page.get_by_text("Saved goals").click()
    name = field(page, "Goal name")
    name.fill("clip")
    name.press("Tab")
    # By the keyboard: the new goal's line above may move the button from under the pointer.
    save = page.get_by_role("button", name="Save goal")
    expect(save).to_be_enabled()
    save.press("Enter")
    assert cell.asked(topics.GOAL_LIST_REQUEST).goal == wanted
    choose(page, "Saved goal", "clip")
    with page.expect_download() as download:
        page.get_by_role("button", name="Download goal (CSV)").click()
    text = Path(download.value.path()).read_text()
    assert '# goal = {nodes = "clip.csv", part = [0.1, 0.3]}' in text
    cell.forget()
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Load shape (CSV)").click()
    chooser.value.set_files({"name": "clip.csv", "mimeType": "text/csv", "buffer": text.encode()})
    goal = cell.asked(topics.TASK_REQUEST).goal
    assert list(goal.part) == [0.1, 0.3]
    assert chain(goal.positions) == pytest.approx(chain(wanted.positions), abs=1e-6)
    page.get_by_text("Saved goals").click()


def test_goal_of_the_ends_stays_one_unless_its_switch_is_turned(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    of_ends = cell.goal()
    del of_ends.part[:]
    of_ends.ends_only = True
    cell.set_goal(of_ends)
    expect(page.get_by_text("Running:")).to_contain_text(" of the ends to go")
    cell.forget()
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("Drag an end.")).to_be_visible()
    switch = page.get_by_role("checkbox", name="Only the ends count")
    expect(switch).to_be_checked()
    expect(page.get_by_text("Counts [mm]", exact=True)).to_be_hidden()
    expect(page.get_by_text("Pull at node")).to_be_hidden()
    height = field(page, "Right [mm]").nth(2)
    height.fill(f"{float(height.input_value()) + 20.0:g}")
    height.press("Tab")
    expect(page.get_by_text("Both ends count, the shape between them is free.")).to_be_visible()
    press_set_goal(page)
    goal = cell.asked(topics.TASK_REQUEST).goal
    assert goal.ends_only
    assert goal.right.position[2] == pytest.approx(of_ends.right.position[2] + 0.02, abs=1e-6)
    # The whole shape counts only where a person says so.
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("Drag an end.")).to_be_visible()
    switch.uncheck()
    expect(page.get_by_text("The rope will rest in this shape.")).to_be_visible()
    expect(page.get_by_text("Pull at node")).to_be_visible()
    press_set_goal(page)
    assert not cell.asked(topics.TASK_REQUEST).goal.ends_only
