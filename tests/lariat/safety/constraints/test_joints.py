from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.constraints.collision import CollisionConstraint
from lariat.safety.constraints.joints import (
    LEAST_SOLVED_POSES,
    MAX_SOLVED_STRIDE,
    JointConstraints,
    solved_poses_of_chunk,
    solved_poses_of_stop,
)
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.singularity import MIN_SINGULAR_VALUE, singularity_slack
from lariat.scenario.sections import Limits
from tests.lariat.safety.constraints.planar_arm import PlanarArm

ARM = PlanarArm()
LIMITS = Limits(joint_speed=1.0, joint_acceleration=5.0)
FREE = CollisionConstraint(0.005)


def constraints(joints: tuple[float, float] = (0.0, 1.2)) -> JointConstraints:
    made = JointConstraints(ARM, LIMITS)
    made.set_joints(joints)
    return made


def broken(
    rows: list[tuple[float, float]],
    begin: tuple[float, float] = (0.0, 1.2),
    collision: CollisionConstraint = FREE,
    dt: float | None = None,
) -> str:
    """Name of the rule that a path through these joints breaks."""
    grips = [ARM.grip(np.array(row)) for row in rows]
    found = constraints(begin).broken(
        np.array([g.position for g in grips]),
        np.array([g.orientation for g in grips]),
        list(range(len(rows))),
        collision,
        0.0,
        dt,
    )
    return found[0] if found else ""


def test_path_within_all_joint_rules_is_kept() -> None:
    assert broken([(0.0, 1.2), (0.1, 1.3), (0.2, 1.4)], dt=0.2) == ""


@pytest.mark.parametrize(("elbow", "rule"), [(2.4, ""), (2.499, ""), (2.51, "joint_limits")])
def test_joint_limits_hold_up_to_the_largest_angle(elbow: float, rule: str) -> None:
    assert broken([(0.0, elbow)]) == rule


def test_a_pose_is_solved_once_until_the_arm_reports_other_joints() -> None:
    class CountingArm(PlanarArm):
        solved = 0

        def solve(self, grip: Pose, near: np.ndarray) -> np.ndarray | None:
            self.solved += 1
            return super().solve(grip, near)

    arm = CountingArm()
    made = JointConstraints(arm, LIMITS)
    made.set_joints((0.0, 1.2))
    grip, still = ARM.grip(np.array([0.1, 1.3])), np.zeros((2, 3))
    assert not made.too_fast(grip, still)
    made.track(grip)
    assert arm.solved == 1
    assert made.joints is not None
    np.testing.assert_allclose(made.joints, (0.1, 1.3), atol=1e-6)
    made.track(ARM.grip(np.array([0.1, 1.3 + 1e-9])))
    assert arm.solved == 2
    # They may be on another branch.
    made.set_joints((0.1, 1.3 + 1e-9))
    made.track(ARM.grip(np.array([0.1, 1.3 + 1e-9])))
    assert arm.solved == 3


def test_joint_beyond_its_limit_may_come_back() -> None:
    assert broken([(0.0, 2.55)], begin=(0.0, 2.6)) == ""
    assert broken([(0.0, 2.65)], begin=(0.0, 2.6)) == "joint_limits"


@pytest.mark.parametrize(("step", "rule"), [(0.01, ""), (0.0199, ""), (0.021, "joint_speed")])
def test_joint_speed_of_a_chunk_is_bounded(step: float, rule: str) -> None:
    path = [(0.0, 1.2), (step, 1.2), (2.0 * step, 1.2)]
    assert broken(path, dt=0.02) == rule


@pytest.mark.parametrize(("change", "rule"), [(0.0029, ""), (0.0031, "joint_acceleration")])
def test_joint_acceleration_of_a_chunk_is_bounded(change: float, rule: str) -> None:
    path = [(0.0, 1.2), (0.01, 1.2), (0.02 + change, 1.2)]
    assert broken(path, dt=0.02) == rule


def test_joint_speed_is_not_taken_from_poses_that_are_not_even_in_time() -> None:
    assert broken([(0.0, 1.2), (0.5, 1.2)], dt=None) == ""


@pytest.mark.parametrize("share", [0.99, 1.01], ids=["kept", "broken"])
def test_twist_of_the_grip_is_too_fast_where_a_joint_is(share: float) -> None:
    made = constraints()
    turning = ARM.jacobian(np.array([0.0, 1.2])) @ np.array([share * LIMITS.joint_speed, 0.0])
    twist = np.array([[*turning, 0.0], [0.0, 0.0, 0.0]])
    assert made.too_fast(ARM.grip(np.array([0.0, 1.2])), twist) is (share > 1.0)


def test_pose_out_of_reach_is_too_fast_and_singular() -> None:
    far = Pose(np.array([1.2, 0.0, 0.5]), np.array([1.0, 0.0, 0.0, 0.0]))
    made = constraints()
    assert made.too_fast(far, np.zeros((2, 3)))
    found = made.broken(far.position[None], far.orientation[None], [0], FREE, 0.0)
    assert found == ("singularity", 0.0)


def test_nearly_stretched_arm_is_singular() -> None:
    assert broken([(0.0, 0.3)]) == ""
    assert broken([(0.0, 0.05)]) == "singularity"


def test_singularity_slack_is_zero_at_the_smallest_singular_value() -> None:
    bends = np.linspace(0.01, 1.0, 400)
    slack = singularity_slack(ARM, np.stack([np.zeros(400), bends], axis=1))
    assert slack[0] < 0.0 < slack[-1]
    at = int(np.argmin(np.abs(slack)))
    value = ARM.smallest_singular_values(np.array([[0.0, bends[at]]]))[0]
    assert np.isclose(value, MIN_SINGULAR_VALUE, atol=2e-3)


def test_link_keeps_its_distance_from_an_obstacle_that_the_grip_does_not_meet() -> None:
    collision = CollisionConstraint(0.005)
    collision.scene = ObstacleScene([Obstacle("sphere", (0.4, 0.35, 0.5), radius=0.05)])
    assert broken([(0.2, 1.2)], collision=collision) == ""
    assert broken([(0.7, 1.2)], collision=collision) == "keep_out"


def test_arm_that_has_not_been_heard_is_a_lost_link() -> None:
    made = JointConstraints(ARM, LIMITS)
    still = np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]])
    assert made.broken(*still, [0], FREE, 0.0) == ("lost_link", 0.0)
    assert made.too_fast(ARM.grip(np.array([0.0, 1.2])), np.zeros((2, 3)))


def test_tracked_joints_follow_the_grip_and_stay_where_it_is_out_of_reach() -> None:
    made = constraints()
    made.track(ARM.grip(np.array([0.3, 0.9])))
    np.testing.assert_allclose(made.joints, [0.3, 0.9])
    made.track(Pose(np.array([2.0, 0.0, 0.5]), np.array([1.0, 0.0, 0.0, 0.0])))
    np.testing.assert_allclose(made.joints, [0.3, 0.9])


def test_spheres_cover_links_and_base_along_the_path() -> None:
    made = constraints()
    grips = [ARM.grip(np.array([s, 1.2])) for s in (0.0, 0.1)]
    made.broken(
        np.array([g.position for g in grips]),
        np.array([g.orientation for g in grips]),
        [0, 1],
        FREE,
        0.0,
    )
    spheres = made.spheres()
    assert spheres.centres.shape == (3, 2, 3)  # the present pose and two of the path
    np.testing.assert_array_equal(spheres.radii, [0.05, 0.1])


def line(*steps: float) -> np.ndarray:
    positions = np.zeros((len(steps) + 1, 1, 3))
    positions[1:, 0, 0] = np.cumsum(steps)
    return positions


@pytest.mark.parametrize("speed", [1e-5, 2e-3, 0.03])
def test_solved_poses_of_a_chunk_are_dense_and_hold_both_ends(speed: float) -> None:
    positions = line(*[speed] * 100)
    solved = solved_poses_of_chunk(positions)
    assert (solved[0], solved[-1]) == (0, 100)
    assert len(solved) >= LEAST_SOLVED_POSES
    strides = np.diff(positions[solved, 0, 0])
    assert np.max(strides) <= max(MAX_SOLVED_STRIDE, speed) + 1e-12


def test_solved_poses_of_a_stop_are_its_ends_and_more_where_it_is_long() -> None:
    assert solved_poses_of_stop(line(*[1e-3] * 8)) == [0, 8]
    assert len(solved_poses_of_stop(line(*[0.01] * 8))) == 5
