"""Page in a real browser, with messages from a stage: contents and requests."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared import topics
from shared.messages import (
    ArmCommand,
    GoalDraft,
    GoalPreview,
    Message,
    SceneRequest,
    TaskRequest,
    TaskState,
    grip_pose,
)
from shared.scenario import load
from shared.topics import Topic
from tests.browser.chromium import NO_CHROMIUM, drag, on_screen, opened
from tests.dashboard.stage import Stage, hanging

pytestmark = NO_CHROMIUM

SCENARIO = load("scenarios/three-cylinders.toml")


class Cell(threading.Thread):
    """A stage that plays one moment again and again and keeps the page's requests."""

    def __init__(self, stage: Stage) -> None:
        super().__init__(daemon=True)
        self._stage = stage
        self._sent: list[tuple[Topic, Message]] = []
        self._news = threading.Condition()
        self._ended = threading.Event()
        self.refusal = ""
        """Answer to every task request; empty accepts it."""

    def run(self) -> None:
        while not self._ended.wait(1.0 / 15.0):
            self._stage.play(0.3)
            with self._news:
                for topic, message in self._stage.step(1.0 / 15.0):
                    self._sent.append((topic, message))
                    self._answer(message)
                self._news.notify_all()

    def _answer(self, message: Message) -> None:
        if isinstance(message, GoalDraft):
            self._stage.send(topics.TASK_GOAL_PREVIEW, preview(message))
        if isinstance(message, TaskRequest):
            answer = TaskState(stamp=self._stage.now, last_request=message.id, refusal=self.refusal)
            self._stage.send(topics.TASK_STATE, answer)
            self._stage.step(0.01)

    def asked(self, topic: Topic, timeout: float = 10.0) -> Message:
        """The next message of a topic that the page has sent or will send."""
        with self._news:
            found = self._news.wait_for(
                lambda: next((m for t, m in self._sent if t == topic), None), timeout
            )
            assert found is not None, f"nothing on {topic.key} for {timeout} s"
            self._sent = [(t, m) for t, m in self._sent if m is not found]
            return found

    def newest(self, topic: Topic) -> Message:
        """The last message of a topic that the page has sent."""
        with self._news:
            return [m for t, m in self._sent if t == topic][-1]

    def end(self) -> None:
        self._ended.set()
        self.join()


def preview(draft: GoalDraft) -> GoalPreview:
    """Answer of a controller, with a parabola for the rod."""
    left, right = grip_pose(draft.left).position, grip_pose(draft.right).position
    length = SCENARIO.rope.length
    answer = GoalPreview(draft=draft.id, reachable=bool(np.linalg.norm(right - left) < length))
    if answer.reachable:
        answer.goal.positions.extend(hanging(left, right, length, 40).ravel())
        answer.goal.left.CopyFrom(draft.left)
        answer.goal.right.CopyFrom(draft.right)
    else:
        answer.reason = "the ends are out of each other's reach"
    return answer


@pytest.fixture(scope="module")
def cell() -> Iterator[tuple[Cell, Page]]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=port))
    cell = Cell(Stage(service, SCENARIO))
    cell.start()
    try:
        with opened(service.address) as page:
            page.get_by_role("button", name="Edit goal").wait_for()
            yield cell, page
    finally:
        cell.end()
        service.close()


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


def test_hold_is_meant_for_this_start_of_the_gateway_only(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    page.get_by_role("button", name="Hold").click()
    command = stage.asked(topics.ARM_COMMAND)
    assert (command.action, command.boot) == (ArmCommand.HOLD, "boot-1")
    assert command.answers > 0


def test_each_gripper_opens_and_closes_by_its_own_buttons(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
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
    expect(page.get_by_text("Reachable", exact=True)).to_be_visible()
    arrow = before + np.array([0.0, 0.0, 0.75 * 0.25 * SCENARIO.rope.length])
    up = np.array([0.0, 0.0, 0.08])
    drag(page, on_screen(page, SCENARIO, arrow), on_screen(page, SCENARIO, arrow + up))
    page.get_by_role("button", name="Set goal").click()
    request = stage.asked(topics.TASK_REQUEST)
    assert request.action == TaskRequest.SET_GOAL
    moved = grip_pose(request.goal.left).position - before
    assert 0.06 < moved[2] < 0.1
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


def test_clicked_obstacle_can_be_removed(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    middle = next(b for b in SCENARIO.bodies if b.name == "middle")
    page.get_by_text("Obstacles", exact=True).click()
    page.mouse.click(*on_screen(page, SCENARIO, np.array(middle.position)))
    page.get_by_role("button", name="Remove").click()
    request = stage.asked(topics.SCENE_REQUEST)
    assert (request.action, request.obstacle.name) == (SceneRequest.REMOVE, "middle")
