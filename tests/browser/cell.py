"""Cell of a stage that answers a page in a real browser."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Page

from dashboard.options import DashboardOptions
from dashboard.service import build
from lariat.scenario import Scenario, load
from shared import topics
from shared.messages import (
    ArmCommand,
    ArmStates,
    CampaignState,
    Goal,
    GoalDraft,
    GoalList,
    GoalListRequest,
    GoalPreview,
    Message,
    NodeChain,
    RunCurves,
    RunList,
    RunListRequest,
    RunMotion,
    RunPicture,
    RunVideo,
    SavedGoal,
    Scene,
    StackRequest,
    StackState,
    TaskRequest,
    TaskState,
    grip_pose,
)
from shared.runtime.free_port import free_port
from shared.topics import Topic
from tests.browser.chromium import opened
from tests.dashboard.stage import Stage, hanging

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
        self.address = ""
        """Address of the page."""
        self.dead = False
        """Whether nothing is played any more."""
        self.runs: RunList | None = None
        """List of the recorder."""
        self.stack: StackState | None = None
        """State of whoever runs the stack."""
        self.goals = GoalList()
        """Goals that the recorder keeps."""
        self.campaign: CampaignState | None = None
        """State of the campaign that runs beside the cell."""
        self.scene: Scene | None = None
        """Obstacles in the place of the scenario's."""
        self.video: RunVideo | None = None
        """Video that the recorder makes."""
        self.lying: np.ndarray | None = None
        """Nodes of a rope that lies still, in the place of the moving one [m]."""
        self.deaf = False
        """Whether commands to the arms are not answered."""
        self._arms: dict = {"mode": ArmStates.MOVING}

    def run(self) -> None:
        while not self._ended.wait(1.0 / 15.0):
            if self.dead:
                self._stage.step(1.0 / 15.0)
                continue
            self._stage.play(0.3)
            with self._news:
                arms = self._stage.arms(self._stage.nodes(0.3), **self._arms)
                self._stage.send(topics.ARM_STATE, arms)
                if self.lying is not None:
                    rope = NodeChain(stamp=self._stage.now, positions=self.lying.ravel())
                    self._stage.send(topics.ROPE_NODES, rope)
                if self.scene is not None:
                    self._stage.send(topics.SCENE_STATE, self.scene)
                if self.runs is not None:
                    self._stage.send(topics.RUN_LIST, self.runs)
                if self.stack is not None:
                    self._stage.send(topics.STACK_STATE, self.stack)
                self.goals.stamp = self._stage.now
                self._stage.send(topics.GOAL_LIST, self.goals)
                if self.video is not None:
                    self._stage.send(topics.RUN_VIDEO, self.video)
                if self.campaign is not None:
                    self._stage.send(topics.CAMPAIGN_STATE, self.campaign)
                for topic, message in self._stage.step(1.0 / 15.0):
                    self._sent.append((topic, message))
                    self._answer(message)
                self._news.notify_all()

    def _answer(self, message: Message) -> None:
        if isinstance(message, GoalDraft):
            self._stage.send(topics.TASK_GOAL_PREVIEW, preview(message))
        if isinstance(message, ArmCommand) and not self.deaf:
            self._arms = {**self._arms, "last_command": message.id}
        if isinstance(message, RunListRequest):
            if self.runs is not None:
                self.runs.last_request = message.id
            self._show_run(message)
        if isinstance(message, GoalListRequest):
            self._keep_goal(message)
        if isinstance(message, StackRequest) and self.stack is not None:
            self.stack.last_request = message.id
        if isinstance(message, TaskRequest):
            answer = TaskState(stamp=self._stage.now, last_request=message.id, refusal=self.refusal)
            self._stage.send(topics.TASK_STATE, answer)
            self._stage.step(0.01)

    def rope(self, fraction: float = 0.3) -> np.ndarray:
        """Nodes of the rope that is played, or at another moment of its way [m]."""
        return self._stage.nodes(fraction)

    def goal(self) -> Goal:
        """Goal of the controller that is played."""
        return self._stage.goal()

    def _keep_goal(self, request: GoalListRequest) -> None:
        """Answer as a recorder that keeps a single goal does."""
        kept = request.action == GoalListRequest.SAVE
        saved = SavedGoal(name=request.name, scenario=SCENARIO.name, goal=request.goal)
        self.goals = GoalList(goals=[saved] * kept, last_request=request.id)

    def _show_run(self, request: RunListRequest) -> None:
        """Answer as a recorder with a run of 2 s does."""
        run = request.runs[0]
        if request.action == RunListRequest.SEND_CURVES:
            time = np.arange(0.0, 2.01, 0.2)
            for k, id in enumerate(request.runs):
                error = 0.15 * np.exp(-2.0 * time) + 0.001 * k
                curves = RunCurves(run=id, time=time, error=error, clearance=0.02 + 0.01 * time)
                self._stage.send(topics.RUN_CURVES, curves)
        if request.action == RunListRequest.SEND_MOTION:
            shapes = [self._stage.nodes(f) for f in np.linspace(0.0, 1.0, 21)]
            motion = RunMotion(run=run, node_count=len(shapes[0]), time=np.linspace(0.0, 2.0, 21))
            motion.nodes.extend(np.concatenate(shapes).ravel())
            motion.goal.extend(shapes[-1].ravel())
            for time, text in ((0.0, "start"), (1.0, "hold: as asked"), (2.0, "reached: settled")):
                motion.marks.add(time=time, text=text)
            self._stage.send(topics.RUN_MOTION, motion)
        if request.action == RunListRequest.SEND_PICTURE:
            image = cv2.imencode(".jpg", np.full((48, 64, 3), 90, np.uint8))[1].tobytes()
            picture = RunPicture(run=run, time=request.time, data=image)
            self._stage.send(topics.RUN_PICTURE, picture)

    def asked(self, topic: Topic, timeout: float = 60.0) -> Any:
        """The next message of a topic that the page has sent or will send."""
        with self._news:
            found = self._news.wait_for(
                lambda: next((m for t, m in self._sent if t == topic), None), timeout
            )
            assert found is not None, f"nothing on {topic.key} for {timeout} s"
            self._sent = [(t, m) for t, m in self._sent if m is not found]
            return found

    def sent(self, topic: Topic) -> list[Any]:
        """All messages of a topic that the page has sent since the last `forget`."""
        with self._news:
            return [m for t, m in self._sent if t == topic]

    def say(self, topic: Topic, message: Message) -> None:
        """Let a service publish one message."""
        with self._news:
            self._stage.send(topic, message)

    def set_goal(self, goal: Goal) -> None:
        """Let the controller have another goal."""
        with self._news:
            self._stage.set_goal(goal)

    def show_arms(self, **fields: object) -> None:
        """Change the state of the gateway that is played."""
        with self._news:
            self._arms = fields

    def forget(self) -> None:
        """Drop what the page has sent so far."""
        with self._news:
            self._sent.clear()

    def actions(self) -> set[int]:
        """Actions of the commands to the arms since the last `forget`."""
        with self._news:
            return {m.action for _, m in self._sent if isinstance(m, ArmCommand)}

    def newest(self, topic: Topic) -> Any:
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
    if draft.pull:
        # Nobody bends: the whole shape goes where its node is pulled.
        present = hanging(left, right, length, SCENARIO.rope.node_count)
        shift = np.array(draft.pull) - present[draft.node]
        left, right = left + shift, right + shift
    answer = GoalPreview(draft=draft.id, reachable=bool(np.linalg.norm(right - left) < length))
    if answer.reachable:
        answer.goal.positions.extend(hanging(left, right, length, SCENARIO.rope.node_count).ravel())
        answer.goal.left.CopyFrom(draft.left)
        answer.goal.right.CopyFrom(draft.right)
        answer.goal.left.position[:] = left
        answer.goal.right.position[:] = right
    else:
        answer.reason = "the ends are out of each other's reach"
    return answer


@contextmanager
def started_cell(*, dead: bool = False, scenario: Scenario = SCENARIO) -> Iterator[Cell]:
    """Start a cell with its page, and end it afterwards.

    Args:
        dead: Whether nothing is started yet.
        scenario: Scenario of the cell.
    """
    service = build(scenario, "dashboard-ab", DashboardOptions(port=free_port()))
    service.warm_up()
    cell = Cell(Stage(service, scenario))
    cell.address = service.address
    cell.dead = dead
    cell.start()
    try:
        yield cell
    finally:
        cell.end()
        service.close()


@contextmanager
def opened_cell(
    *, dead: bool = False, size: tuple[int, int] = (1280, 800), scenario: Scenario = SCENARIO
) -> Iterator[tuple[Cell, Page]]:
    """Open the page of a cell in a browser, and end both afterwards.

    Args:
        dead: As for `started_cell`.
        size: Width and height of the window [pixels].
        scenario: Scenario of the cell.
    """
    with started_cell(dead=dead, scenario=scenario) as cell, opened(cell.address, *size) as page:
        yield cell, page
