"""Steps of the planner from messages to problems."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.grips import Grips
from lariat.planning.problem import Problem, WholePath
from lariat.planning.shorter_path import stay
from lariat.scenario import Scenario, load
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from services.planner.service import PlannerService
from shared import messages, topics
from shared.messages import (
    ArmSetpoints,
    ArmState,
    ArmStates,
    Estimate,
    Parameters,
    RodParameters,
    Setpoints,
    TaskState,
)
from shared.runtime.service import Inbox, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "over-a-bar.toml")


class CapturingPlanner(PlannerService):
    """Planner that keeps its problems, and stays where it is."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.problems: list[Problem] = []
        self._find = self._capture

    def _capture(self, problem: Problem) -> WholePath:
        self.problems.append(problem)
        return stay(problem, "")


def problem_of(scenario: Scenario, rod: RodParameters, pace: float = 1.0) -> Problem:
    """Problem that the planner of a scenario poses with learnt parameters."""
    service = CapturingPlanner(scenario)
    list(service.step(inbox(scenario, pace=pace, rod=rod), SECOND))
    (problem,) = service.problems
    return problem


def inbox(
    scenario: Scenario,
    goal_revision: int = 1,
    pace: float = 0.0,
    rod: RodParameters | None = None,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    setpoints: Setpoints | None = None,
) -> Inbox:
    """Newest messages of a running task whose grips are at the start."""
    grips = scenario.grips(scenario.start)
    arms = ArmStates(
        stamp=SECOND,
        arms=[
            ArmState(
                arm=side,
                position=grip.position,
                orientation=grip.orientation,
                linear_velocity=velocity,
            )
            for side, grip in zip(("left", "right"), grips, strict=True)
        ],
    )
    held = [messages.Grip(position=g.position, orientation=g.orientation) for g in grips]
    goal = messages.Goal(positions=np.zeros(3 * scenario.rope.node_count), left=held[0])
    goal.right.CopyFrom(held[1])
    newest = {
        topics.TASK_STATE.key: TaskState(
            stamp=SECOND,
            state=messages.RUNNING,
            goal=goal,
            goal_revision=goal_revision,
            pace=pace,
        ),
        topics.SCENE_STATE.key: messages.Scene(
            revision=1, obstacles=[messages.obstacle_message(o) for o in scenario.bodies]
        ),
        topics.ARM_STATE.key: arms,
        topics.CONTROLLER_PARAMETERS.key: Parameters(rod=rod),
    }
    if setpoints is not None:
        newest[topics.ARM_SETPOINTS.key] = setpoints
    return Inbox({k: Received(m, "sender", 0, SECOND) for k, m in newest.items()}, {})


def stopping(scenario: Scenario, shift: np.ndarray, **fields) -> Setpoints:
    """Setpoints that stop beside the start."""
    arms = [
        ArmSetpoints(
            arm=side,
            positions=np.concatenate([grip.position, grip.position + shift]),
            orientations=np.tile(grip.orientation, 2),
        )
        for side, grip in zip(("left", "right"), scenario.grips(scenario.start), strict=True)
    ]
    return Setpoints(**({"stamp": SECOND, "arms": arms} | fields))


def test_path_to_another_goal_begins_where_the_arms_will_stop() -> None:
    service = CapturingPlanner(SCENARIO)
    list(service.step(inbox(SCENARIO), SECOND))
    shift, speed = np.array([0.0, 0.02, 0.01]), (0.0, 0.2, 0.1)
    braking = stopping(SCENARIO, shift)
    list(service.step(inbox(SCENARIO, 2, velocity=speed, setpoints=braking), 2 * SECOND))
    start, ahead = (np.array([g.position for g in p.grips]) for p in service.problems)
    np.testing.assert_allclose(ahead, start + shift)
    np.testing.assert_allclose(service.problems[1].state.positions[[0, -1]], start + shift)


def test_path_from_where_arms_will_stop_begins_with_their_joints_there() -> None:
    scenario = load(find("two-arms"))
    service = CapturingPlanner(scenario)
    asked = inbox(scenario)
    list(service.step(asked, SECOND))
    (before,) = service.problems
    assert before.arms is not None
    shift = np.array([0.0, 0.02, 0.01])
    braking = inbox(scenario, 2, velocity=(0.0, 0.2, 0.1), setpoints=stopping(scenario, shift))
    list(service.step(braking, 2 * SECOND))
    assert len(service.problems) == 1  # Arms that do not tell their joints are seen at rest first.
    for k, arm in enumerate(braking.latest(topics.ARM_STATE).message.arms):
        arm.joints[:] = before.arms.joints[k]
    list(service.step(braking, 2 * SECOND))
    _, ahead = service.problems
    assert ahead.arms is not None
    for k, arm in ahead.arms.arms.items():
        grip = arm.grip(ahead.arms.joints[k])
        np.testing.assert_allclose(grip.position, before.grips[k].position + shift, atol=1e-6)
        assert np.max(np.abs(ahead.arms.joints[k] - before.arms.joints[k])) < 0.2


@pytest.mark.parametrize(
    ("goal_revision", "fields"),
    [
        (1, {}),  # The goal is the same: the arms follow their path.
        (2, {"hold": True}),
        (2, {"stamp": SECOND - 1}),  # Sent before the goal changed.
    ],
)
def test_no_path_is_planned_before_it_is_known_where_the_arms_stop(goal_revision, fields) -> None:
    service = CapturingPlanner(SCENARIO)
    list(service.step(inbox(SCENARIO), SECOND))
    moving = inbox(
        SCENARIO,
        goal_revision,
        velocity=(0.0, 0.2, 0.1),
        setpoints=stopping(SCENARIO, np.array([0.0, 0.02, 0.01]), **fields),
    )
    if goal_revision == 1:
        moving.latest(topics.SCENE_STATE).message.revision = 2
    list(service.step(moving, 2 * SECOND))
    assert len(service.problems) == 1


def learnt(deviation: float) -> RodParameters:
    stiffness = 2e-4
    return RodParameters(
        bending_stiffness=Estimate(value=stiffness, standard_deviation=deviation * stiffness)
    )


@pytest.mark.parametrize(("asked", "pace"), [(0.2, 0.2), (0.0, 1.0)])
def test_pace_is_the_one_that_is_asked_for(asked: float, pace: float) -> None:
    assert problem_of(SCENARIO, RodParameters(), asked).pace == pace


def test_clearance_is_the_one_that_people_have_set_meanwhile() -> None:
    service, read = CapturingPlanner(SCENARIO), inbox(SCENARIO)
    for clearance in ("0.012", "0.05"):
        read.latest(topics.TASK_STATE).message.settings["clearance"] = clearance
        read.latest(topics.TASK_STATE).message.replan_count += 1
        list(service.step(read, SECOND))
    first, second = (problem.clearance for problem in service.problems)
    assert second - first == pytest.approx(0.038)


def test_planner_knows_where_the_grippers_hold_the_ends() -> None:
    aside = [0.003, 0.0, 0.0, 0.0, -0.002, 0.0]
    rod = learnt(0.2)
    rod.grip_offset.extend(Estimate(value=v, standard_deviation=1e-3) for v in aside)
    rod.grip_rotation.extend(Estimate(value=0.0, standard_deviation=1e-2) for _ in range(6))
    problem = problem_of(SCENARIO, rod)
    ends = Grips.of(problem.grips)
    grippers = problem.grippers(ends).positions
    believed = [grip.position for grip in SCENARIO.grips(SCENARIO.start)]
    assert np.linalg.norm(ends.positions[0] - grippers[0], axis=1) == pytest.approx([0.003, 0.002])
    assert grippers[0] == pytest.approx(np.array(believed))


def test_goal_for_which_planning_fails_is_answered_with_the_reason() -> None:
    service = CapturingPlanner(SCENARIO)

    def fail(problem: Problem) -> WholePath:
        raise ZeroDivisionError("x")

    service._find = fail
    (published,) = service.step(inbox(SCENARIO), SECOND)
    path = published.message
    assert (path.reached, path.goal_revision) == (False, 1)
    assert path.reason.endswith("ZeroDivisionError: x")
    assert service.door.refused == 1
