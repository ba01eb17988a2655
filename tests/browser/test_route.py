"""Route of a cable in a real browser: its stops are changed, and a clip is moved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from lariat.geometry.cable_routes import clip_openings, held_clips
from lariat.scenario import load
from shared import topics
from shared.messages import Scene, chain, obstacle_message
from tests.browser.cell import Cell, opened_cell
from tests.browser.chromium import NO_CHROMIUM, choose, comes, field, press_set_goal

pytestmark = NO_CHROMIUM

SCENARIO = load("harness-board")
LAYING_TIME = 180_000
"""Longest time until a cable is laid, kernels of its process included [ms]."""


@pytest.fixture(scope="module")
def board() -> Iterator[tuple[Cell, Page]]:
    with opened_cell(scenario=SCENARIO) as (cell, page):
        goal = cell.goal()
        goal.route[:] = ["low", "middle"]
        cell.set_goal(goal)
        yield cell, page


def expect_route(page: Page, *stops: str) -> None:
    """Expect the stops of the route, in their order."""
    expect(page.get_by_text("Route, from left to right").locator("li")).to_have_text(stops)


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def test_route_is_edited_laid_through_a_moved_clip_and_set(board: tuple[Cell, Page]) -> None:
    cell, page = board
    expect(page.get_by_text("0 of 2 clips laid, tension 0.00 of 2 N")).to_be_visible()
    expect_route(page, "low", "middle")
    press(page, "Edit goal")
    set_goal = page.get_by_role("button", name="Set goal")
    expect(page.get_by_text("Can be laid", exact=True)).to_be_visible(timeout=LAYING_TIME)
    expect(set_goal).to_be_enabled()
    # A clip that comes too late stands against the cable's direction.
    choose(page, "Stop", "1 low")
    press(page, "Down")
    expect_route(page, "middle", "low")
    expect(page.get_by_text("the route passes clip 'middle' against its heading")).to_be_visible()
    expect(set_goal).to_be_disabled()
    press(page, "Remove")
    expect_route(page, "middle")
    choose(page, "New stop", "right of far")
    press(page, "Add after the stop")
    choose(page, "New stop", "high")
    press(page, "Add after the stop")
    expect_route(page, "middle", "right of far", "high")
    expect(page.get_by_text("Can be laid", exact=True)).to_be_visible(timeout=LAYING_TIME)
    # Both legs of a clip are moved, and the cable is laid anew.
    page.get_by_text("Obstacles", exact=True).click()
    choose(page, "Selected", "middle")
    across = field(page, "Centre [mm]").locator("visible=true").nth(1)
    across.fill("-12")
    across.press("Tab")
    assert comes(page, lambda: len(cell.sent(topics.SCENE_REQUEST)) == 2)
    moved = {r.obstacle.name: r.obstacle.position for r in cell.sent(topics.SCENE_REQUEST)}
    scene = [replace(o, position=tuple(moved.get(o.name, o.position))) for o in SCENARIO.bodies]
    np.testing.assert_allclose(clip_openings(scene)["middle"].foot, [0.0, -0.012, 0.0], atol=1e-9)
    cell.scene = Scene(revision=2, obstacles=[obstacle_message(o) for o in scene])
    expect(set_goal).to_be_disabled()
    expect(set_goal).to_be_enabled(timeout=LAYING_TIME)
    press_set_goal(page)
    goal = cell.asked(topics.TASK_REQUEST).goal
    nodes = chain(goal.positions)
    assert list(goal.route) == ["middle", "right of far", "high"]
    assert held_clips(goal.route, scene, nodes) == ["middle", "high"]
    assert held_clips(goal.route, SCENARIO.bodies, nodes) == ["high"]
    assert not cell.sent(topics.TASK_GOAL_DRAFT)
    # The page shows what is laid of it.
    cell.set_goal(goal)
    cell.lying = nodes
    expect(page.get_by_text("2 of 2 clips laid")).to_be_visible()
    expect_route(page, "middle ✓ laid", "right of far", "high ✓ laid")
