"""Steps of the planner from messages to problems."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from services.planner.problem import Problem, WholePath
from services.planner.service import PlannerService
from services.planner.whole_path import stay
from shared import messages, topics
from shared.messages import ArmState, ArmStates, Estimate, Parameters, RodParameters, TaskState
from shared.scenario import Scenario, load
from shared.service import SECOND, Inbox, Received

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
    grips = scenario.grips(scenario.start)
    arms = ArmStates(
        stamp=SECOND,
        arms=[
            ArmState(arm=side, position=grip.position, orientation=grip.orientation)
            for side, grip in zip(("left", "right"), grips, strict=True)
        ],
    )
    held = [messages.Grip(position=g.position, orientation=g.orientation) for g in grips]
    goal = messages.Goal(positions=np.zeros(3 * scenario.rope.node_count), left=held[0])
    goal.right.CopyFrom(held[1])
    newest = {
        topics.TASK_STATE.key: TaskState(goal=goal, goal_revision=1, pace=pace),
        topics.SCENE_STATE.key: messages.Scene(
            revision=1, obstacles=[messages.obstacle_message(o) for o in scenario.bodies]
        ),
        topics.ARM_STATE.key: arms,
        topics.CONTROLLER_PARAMETERS.key: Parameters(rod=rod),
    }
    inbox = Inbox({k: Received(m, "sender", 0, SECOND) for k, m in newest.items()}, {})
    list(service.step(inbox, SECOND))
    (problem,) = service.problems
    return problem


def learnt(deviation: float) -> RodParameters:
    stiffness = 2e-4
    return RodParameters(
        bending_stiffness=Estimate(value=stiffness, standard_deviation=deviation * stiffness)
    )


@pytest.mark.parametrize(("asked", "pace"), [(0.2, 0.2), (0.0, 1.0)])
def test_pace_is_the_one_that_is_asked_for(asked: float, pace: float) -> None:
    assert problem_of(SCENARIO, RodParameters(), asked).pace == pace


def test_planner_knows_where_the_grippers_hold_the_ends() -> None:
    aside = [0.003, 0.0, 0.0, 0.0, -0.002, 0.0]
    rod = learnt(0.2)
    rod.grip_offset.extend(Estimate(value=v, standard_deviation=1e-3) for v in aside)
    rod.grip_rotation.extend(Estimate(value=0.0, standard_deviation=1e-2) for _ in range(6))
    problem = problem_of(SCENARIO, rod)
    ends = np.array([[grip.position for grip in problem.grips]])
    turns = np.array([[grip.orientation for grip in problem.grips]])
    grippers, _ = problem.grippers(ends, turns)
    believed = [grip.position for grip in SCENARIO.grips(SCENARIO.start)]
    assert np.linalg.norm(ends[0] - grippers[0], axis=1) == pytest.approx([0.003, 0.002])
    assert grippers[0] == pytest.approx(np.array(believed))
