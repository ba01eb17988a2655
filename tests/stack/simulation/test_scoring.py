"""Measures of a run by the true rope."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.scenario import load
from lariat.scenario.distractors import Distractor
from lariat.scenario.sections import Obstacle
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RUNNING, Goal, NodeChain, TaskState
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import Delivery

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
LINE = np.stack([np.linspace(-0.225, 0.225, 4), np.zeros(4), np.full(4, 0.3)], axis=1)
RADIUS = SCENARIO.rope.diameter / 2.0


FAR = Obstacle(name="far", shape="sphere", position=(0.0, 0.9, 0.3), radius=0.01)


def arc(count: int, lift: float = 0.0) -> Float64[np.ndarray, "n 3"]:
    """Nodes at equal distances on an arc of 0.45 m [m]."""
    angle = np.linspace(-2.25, 2.25, count)
    return np.stack([0.1 * np.sin(angle), 0.0 * angle, 0.6 + lift - 0.1 * np.cos(angle)], axis=1)


def scored(
    *chains: np.ndarray,
    obstacle: Obstacle,
    goal: np.ndarray = LINE,
    distractors: tuple[Distractor, ...] = (),
) -> Scorer:
    """Score of a run in which the true rope is seen once in 0.1 s."""
    scorer = Scorer(replace(SCENARIO, obstacles=(obstacle,), distractors=distractors))

    def hear(topic: topics.Topic, message: NodeChain | TaskState) -> None:
        scorer(Delivery(topic, message.SerializeToString(), "sim", 0, message.stamp))

    hear(
        topics.TASK_STATE,
        TaskState(
            stamp=SECOND, run_started=SECOND, state=RUNNING, goal=Goal(positions=goal.ravel())
        ),
    )
    for k, nodes in enumerate(chains):
        stamp = SECOND + (k + 1) * SECOND // 10
        hear(topics.ROPE_TRUTH, NodeChain(stamp=stamp, positions=nodes.ravel()))
    return scorer


def test_clearance_and_contact_are_those_of_segments() -> None:
    # Between two nodes that are 75 mm away from its middle.
    pin = Obstacle(name="pin", shape="sphere", position=(0.0, 0.02, 0.3), radius=0.01)
    apart = scored(LINE, obstacle=pin)
    assert apart.min_clearance == pytest.approx(0.01 - RADIUS, abs=1e-6)
    assert apart.contact_time == 0.0
    touching = scored(LINE, LINE + np.array([0.0, 0.008, 0.0]), LINE, obstacle=pin)
    assert touching.min_clearance == pytest.approx(0.002 - RADIUS, abs=1e-6)
    assert touching.contact_time == pytest.approx(0.1)


def test_clearance_from_distractors_follows_their_motion() -> None:
    passing = Distractor(
        points=((0.0, -0.2, 0.32), (0.0, 0.2, 0.32)),
        diameter=0.01,
        times=(0.0, 0.2),
        shifts=((0.0, 0.0, 0.0), (0.0, 0.0, -0.005)),
    )
    scorer = scored(LINE, LINE, obstacle=FAR, distractors=(passing,))
    assert scorer.min_distractor_clearance == pytest.approx(0.015 - 0.005 - RADIUS, abs=2e-4)
    assert scorer.contact_time == 0.0


@pytest.mark.parametrize("count", [88, 100, 160])
def test_finer_rope_on_the_curve_of_the_goal_has_no_error(count: int) -> None:
    _, mean, largest = scored(arc(count), obstacle=FAR, goal=arc(30)).errors[-1]
    assert mean < 2e-6
    assert largest < 1e-5


def test_a_rope_that_is_shifted_along_itself_has_no_error_of_its_shape() -> None:
    along = LINE + np.array([0.003, 0.0, 0.0])
    shifted = scored(along, obstacle=FAR)
    assert shifted.final[0] == pytest.approx(0.003)
    assert shifted.final_shape_error < 1e-3  # what lies beyond the end of the rope
    across = scored(LINE + np.array([0.0, 0.003, 0.0]), obstacle=FAR)
    assert across.final_shape_error == pytest.approx(0.003, rel=1e-3)


def test_error_of_a_finer_rope_is_its_distance_by_arc_length() -> None:
    _, mean, largest = scored(arc(88, lift=0.002), obstacle=FAR, goal=arc(30)).errors[-1]
    assert (mean, largest) == pytest.approx((0.002, 0.002), abs=2e-5)


def test_a_run_along_a_route_is_judged_by_the_clips_that_hold() -> None:
    board = load("harness-board")
    laid, goal = board.laid_nodes(board.goal), board.goal
    # The score takes the goal that was set, whatever lies in the clips.
    message = Goal(positions=laid.ravel(), route=goal.route)
    for lifted, held in ((False, ["low", "middle", "high"]), (True, ["low", "middle"])):
        scorer = Scorer(board)
        task = TaskState(stamp=SECOND, run_started=SECOND, state=RUNNING, goal=message)
        scorer(Delivery(topics.TASK_STATE, task.SerializeToString(), "sim", 0, SECOND))
        nodes = laid + np.array([0.0, 0.0, 0.03]) * (lifted & (laid[:, :1] > 0.15))
        for k, tension in enumerate((0.3, 0.2), 2):
            rope = NodeChain(stamp=k * SECOND, positions=nodes.ravel(), tension=tension)
            scorer(Delivery(topics.ROPE_TRUTH, rope.SerializeToString(), "sim", 0, k * SECOND))
        assert scorer.max_tension == 0.3
        assert scorer.clips_held == held
        assert (scorer.reached_after is None) == lifted
