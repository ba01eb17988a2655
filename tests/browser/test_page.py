"""Page in a real browser, with messages from a stage: contents and requests."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from shared import topics
from shared.messages import (
    ArmCommand,
    RunList,
    RunListRequest,
    RunSummary,
    SceneRequest,
    TaskRequest,
    grip_pose,
)
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, comes, drag, on_screen, press_set_goal

pytestmark = NO_CHROMIUM


def test_page_shows_state_distance_and_clearance(cell: tuple[Cell, Page]) -> None:
    _, page = cell
    expect(page.get_by_text("Running:")).to_contain_text(" mm to go, clearance ")


def test_stop_is_requested_once_and_its_refusal_is_shown(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.refusal = "the controller says no"
    page.get_by_role("button", name="Stop").click()
    assert stage.asked(topics.TASK_REQUEST).action == TaskRequest.STOP
    expect(page.get_by_text("Stop: refused")).to_be_visible()
    expect(page.get_by_text("the controller says no")).to_be_visible()
    with pytest.raises(AssertionError, match="nothing on"):
        stage.asked(topics.TASK_REQUEST, timeout=0.5)
    stage.refusal = ""


def test_runs_are_compared_noted_and_deleted_after_a_question(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.forget()
    runs = [
        RunSummary(
            id=f"id-{k}",
            scenario="rope",
            run=f"run-{k}",
            started=k,
            over=True,
            reached=True,
            bytes=1000,
        )
        for k in (2, 1)
    ]
    stage.runs = RunList(stamp=1, runs=runs)
    page.get_by_role("tab", name="Runs").click()
    page.get_by_role("combobox").last.click()
    page.get_by_role("option", name="run-1").click()
    page.get_by_role("button", name="Compare", exact=True).click()
    request = stage.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, list(request.runs)) == (RunListRequest.SEND_CURVES, ["id-1"])
    note = page.get_by_role("textbox").last
    note.fill("stiff")
    request = stage.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, request.note, request.star) == (RunListRequest.ANNOTATE, "stiff", False)
    page.get_by_role("button", name="Delete …").click()
    delete = page.get_by_role("dialog").get_by_role("button", name="Delete")
    stage.forget()
    with pytest.raises(AssertionError, match="nothing on"):
        stage.asked(topics.RUN_LIST_REQUEST, timeout=0.5)
    delete.click()
    request = stage.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, list(request.runs)) == (RunListRequest.DELETE, ["id-1"])
    page.get_by_role("tab", name="Run", exact=True).click()


def test_checks_show_what_the_page_has_seen_of_the_cell(cell: tuple[Cell, Page]) -> None:
    _, page = cell
    page.get_by_role("tab", name="Health").click()
    expect(page.get_by_text("Stop in motion")).to_be_visible()
    expect(page.get_by_text("hold the arms in the middle of a run")).to_be_visible()
    page.get_by_role("tab", name="Run", exact=True).click()


def test_each_gripper_opens_and_closes_by_its_own_buttons(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.forget()
    page.get_by_text("Arms", exact=True).click()
    expect(page.get_by_text("Gripper left")).to_be_visible()
    page.get_by_role("button", name="Open", exact=True).nth(1).click()
    command = stage.asked(topics.ARM_COMMAND)
    assert (command.action, command.arm, command.close) == (ArmCommand.GRIPPER, "right", False)
    assert command.boot == "boot-1"


def test_dragged_end_is_drafted_previewed_and_set(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    before = SCENARIO.grips(SCENARIO.goal)[0].position
    page.get_by_role("button", name="Edit goal").click()
    first = stage.asked(topics.TASK_GOAL_DRAFT)
    np.testing.assert_allclose(grip_pose(first.left).position, before, atol=1e-9)
    expect(page.get_by_text("The present goal", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="Set goal")).to_be_disabled()
    arrow = before + np.array([0.0, 0.0, 0.75 * 0.25 * SCENARIO.rope.length])
    down = np.array([0.0, 0.0, -0.08])
    drag(page, on_screen(page, SCENARIO, arrow), on_screen(page, SCENARIO, arrow + down))
    press_set_goal(page)
    request = stage.asked(topics.TASK_REQUEST)
    assert request.action == TaskRequest.SET_GOAL
    moved = grip_pose(request.goal.left).position - before
    assert -0.1 < moved[2] < -0.06
    np.testing.assert_allclose(moved[:2], 0.0, atol=1e-6)
    assert request.goal.left == stage.newest(topics.TASK_GOAL_DRAFT).left


def test_goal_out_of_reach_cannot_be_set(cell: tuple[Cell, Page]) -> None:
    _, page = cell
    page.get_by_role("button", name="Edit goal").click()
    x = page.get_by_role("textbox").first
    x.fill("-600")
    x.press("Enter")
    expect(page.get_by_text("the ends are out of each other's reach")).to_be_visible()
    expect(page.get_by_role("button", name="Set goal")).to_be_disabled()
    page.get_by_role("button", name="Cancel").click()


def test_clicked_obstacle_is_selected(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    middle = next(b for b in SCENARIO.bodies if b.name == "middle")
    page.get_by_text("Obstacles", exact=True).click()
    page.mouse.click(*on_screen(page, SCENARIO, np.array(middle.position)))
    page.get_by_role("button", name="Duplicate").click()
    request = stage.asked(topics.SCENE_REQUEST)
    assert (request.action, request.obstacle.name) == (SceneRequest.ADD, "middle-copy-1")


def is_grey(page: Page, place: np.ndarray) -> bool:
    """Whether a place of the window [pixels] is bright and of no colour."""
    clip = {"x": place[0] - 1.0, "y": place[1] - 1.0, "width": 3.0, "height": 3.0}
    image = cv2.imdecode(np.frombuffer(page.screenshot(clip=clip), np.uint8), 1)
    assert image is not None
    color = image.reshape(-1, 3).astype(float).mean(axis=0)
    return bool(np.min(color) > 110.0 and np.ptp(color) < 40.0)


def test_opened_run_is_shown_at_any_time_and_saved(cell: tuple[Cell, Page], tmp_path: Path) -> None:
    stage, page = cell
    page.get_by_role("tab", name="Runs").click()
    page.get_by_role("button", name="Open run").click()
    expect(page.get_by_text("hold: as asked", exact=True)).to_be_visible()
    assert stage.asked(topics.RUN_LIST_REQUEST).action == RunListRequest.SEND_MOTION
    slider = page.get_by_role("slider").first
    stage.forget()
    slider.focus()
    # The view, which viser turns while an arrow key is down, stays.
    page.keyboard.down("ArrowRight")
    page.wait_for_timeout(1000)
    page.keyboard.up("ArrowRight")
    for step in range(2, 6):
        expect(slider).to_have_attribute("aria-valuenow", f"{0.02 * (step - 1):g}")
        slider.press("ArrowRight")
    save = page.get_by_role("button", name="Save picture (PNG)")
    expect(save).to_be_enabled()
    asked = [pytest.approx(0.1)]
    assert comes(page, lambda: [m.time for m in stage.sent(topics.RUN_LIST_REQUEST)][-1:] == asked)
    # It is drawn as the legend says: white, beside the live one.
    page.get_by_text("View", exact=True).click()
    line = page.get_by_text("rope of an opened run").locator("xpath=..").locator("span").first
    assert line.evaluate("e => getComputedStyle(e).backgroundColor") == "rgb(240, 240, 240)"
    page.get_by_text("View", exact=True).click()
    place = on_screen(page, SCENARIO, stage.rope(0.1 / 2.0)[8])
    assert comes(page, lambda: is_grey(page, place))
    with page.expect_download() as picture:
        save.click()
    picture.value.save_as(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    with page.expect_download() as scene:
        page.get_by_role("button", name="Save scene (HTML)").click()
    scene.value.save_as(tmp_path / "scene.html")
    text = (tmp_path / "scene.html").read_text()
    assert "<html" in text[:500]
    assert len(text) > 500_000
    page.get_by_role("button", name="Close", exact=True).last.click()
    expect(page.get_by_text("hold: as asked", exact=True)).to_be_hidden()
    page.get_by_role("tab", name="Run", exact=True).click()
