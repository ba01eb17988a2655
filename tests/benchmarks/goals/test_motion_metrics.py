"""Executed motion keeps its limits in every kind of scene."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.goals.bench import GoalSpec, run_trial
from benchmarks.goals.motion_metrics import MotionMetrics, gripper_clearance
from environments.scenes import Kind
from lariat.geometry import poses
from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.constraints.collision import EXACT_SLACK
from lariat.safety.constraints.motion_constraints import CellBoundaries, MotionConstraints
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates

BASE = load("three-cylinders")
KINDS: list[Kind] = ["hard", "boxes", "moving", "new-goal", "rotating"]


SETTINGS = ("rope.node_count=16", "sensing.source=truth", "run.time_limit=1.5")


@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.sampled_from(KINDS), st.integers(0, 1000))
def test_executed_motion_keeps_its_limits(kind: Kind, number: int) -> None:
    trial = run_trial(GoalSpec(kind, number, 7, SETTINGS))
    limits = BASE.limits
    assert trial["speed"] <= 1.0 + 1e-6
    assert trial["acceleration"] <= 1.02
    assert trial["grip_distance"] <= limits.overstretch + 1e-3
    assert trial["gripper_clearance_mm"] >= 1e3 * limits.keep_out - 0.5
    assert trial["score"]["length_error_mm"] < 2.0
    assert trial["score"]["contact_time_s"] == 0.0
    # It did move.
    assert trial["speed"] > 0.1


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 1000))
def test_a_gripper_is_judged_by_the_body_that_the_gateway_keeps_out(seed: int) -> None:
    random = np.random.default_rng(seed)
    left, right = (
        Pose(place, poses.normalized(random.normal(size=4)))
        for place in random.uniform(-0.1, 0.1, size=(2, 3))
    )
    post = Obstacle("capsule", (0.2, 0.1, 0.0), radius=0.02, height=0.1, name="post")
    limits = BASE.limits
    bodies = gripper_bodies(limits.gripper_reach, limits.gripper_radius)
    boundaries = CellBoundaries(0.45, limits.workspace, bodies, limits.keep_out)
    constraints = MotionConstraints(boundaries, [0, 1])
    constraints.replace_obstacles([post])
    rows = (
        np.stack([left.position, right.position]),
        np.stack([left.orientation, right.orientation]),
    )
    kept = constraints.slacks(rows[0][None], rows[1][None])["keep_out"][0] + limits.keep_out
    measured = gripper_clearance(left, right, [post], limits)
    # The gateway's spheres cover the capsule, and stand out by no more than 1.5 mm.
    assert kept <= measured + 1e-6
    assert measured < kept + 1.5e-3 or kept - limits.keep_out >= EXACT_SLACK


def test_a_stop_counts_from_motion_to_motion() -> None:
    metrics = MotionMetrics(BASE)
    # At rest before and after, and 0.3 s of standing still between two motions.
    for tick, speed in enumerate([0.0] * 20 + [0.1] * 5 + [0.001] * 14 + [0.1] * 3 + [0.0] * 40):
        arms = ArmStates(stamp=(tick + 1) * SECOND // 50)
        for side, x in (("left", -0.2), ("right", 0.2)):
            arm = arms.arms.add(arm=side, linear_velocity=[0.0, speed, 0.0])
            arm.angular_velocity.extend([0.0, 0.0, 0.0])
            arm.position.extend([x, 0.0, 0.3])
            arm.orientation.extend([1.0, 0.0, 0.0, 0.0])
        delivery = SimpleNamespace(key=topics.ARM_STATE.key, parse=lambda arms=arms: arms)
        metrics(delivery)
    assert metrics.longest_stop == pytest.approx(0.3)
