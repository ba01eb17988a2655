from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.safety.constraints.motion_constraints import CellBoundaries, MotionConstraints
from lariat.safety.constraints.slacks import first_broken
from tests.services.robot_gateway.cells import ALONG_X

BOUNDARIES = CellBoundaries(
    rope_length=0.6,
    workspace=((-0.5, -0.5, 0.01), (0.5, 0.5, 1.0)),
    bodies=gripper_bodies(0.048, 0.012),
    regions=(Obstacle("box", (0.0, 0.0, 0.3), size=(0.9, 0.6, 0.8), keep_in=True),),
)
BALL = Obstacle("sphere", (0.2, 0.2, 0.3), radius=0.05)
LEFT = (-0.2, 0.0, 0.3)


def rule(right: tuple[float, float, float], left: tuple = LEFT, driven: tuple = (1,)) -> str:
    """Name of the rule that a motion of the right grip from (0.2, 0, 0.3) breaks."""
    constraints = MotionConstraints(BOUNDARIES, driven)
    constraints.replace_obstacles([TABLE, BALL])
    positions = np.array([[left, (0.2, 0.0, 0.3)], [left, right]])
    orientations = np.tile(ALONG_X, (2, 2, 1))
    found = first_broken(constraints.slacks(positions, orientations))
    return found[0] if found else ""


@pytest.mark.parametrize(
    ("right", "broken"),
    [
        ((0.2, 0.05, 0.3), ""),
        ((0.2, -0.51, 0.3), "workspace"),
        ((0.2, -0.301, 0.3), "keep_in"),
        # The gripper is outside of the region, the grip is not.
        ((0.2, -0.299, 0.3), ""),
        ((0.2, 0.19, 0.3), "keep_out"),
        ((0.2, 0.0, 0.0115), "table"),
        ((-0.18, 0.0, 0.3), "spacing"),
        ((0.396, 0.0, 0.3), "overstretch"),
    ],
)
def test_each_boundary_is_named_by_its_rule(right: tuple, broken: str) -> None:
    assert rule(right) == broken


def test_fixed_end_may_be_outside_the_workspace() -> None:
    outside = (-0.51, 0.0, 0.3)
    assert rule((0.05, 0.0, 0.3), left=outside) == ""
    constraints = MotionConstraints(BOUNDARIES, [0, 1])
    positions = np.array([[outside, (0.05, 0.0, 0.3)]])
    slacks = constraints.slacks(positions, np.tile(ALONG_X, (1, 2, 1)))
    np.testing.assert_allclose(slacks["workspace"], [-0.01])


def test_scene_is_replaced_as_a_whole() -> None:
    constraints = MotionConstraints(BOUNDARIES, [1])
    constraints.replace_obstacles([TABLE, BALL])
    constraints.replace_obstacles([TABLE])
    assert constraints.obstacles == (TABLE,)


def test_gripper_reaches_outwards_from_its_grip() -> None:
    constraints = MotionConstraints(BOUNDARIES, [0, 1])
    spheres = constraints.gripper_spheres(1, np.zeros((1, 3)), ALONG_X[None])
    np.testing.assert_allclose(spheres.centres[0, 0], 0.0, atol=1e-15)
    np.testing.assert_allclose(spheres.centres[0, -1], [0.048, 0.0, 0.0], atol=1e-12)


def test_of_several_regions_the_grips_stay_in_all() -> None:
    boundaries = replace(
        BOUNDARIES,
        regions=(
            Obstacle("sphere", (0.0, 0.0, 0.3), radius=0.3, keep_in=True),
            Obstacle("cylinder", (0.1, 0.0, 0.3), radius=0.25, height=0.2, keep_in=True),
        ),
    )
    constraints = MotionConstraints(boundaries, [0, 1])
    right = np.array([(0.1, 0.0, 0.3), (0.1, 0.0, 0.41), (0.295, 0.0, 0.3), (0.32, 0.0, 0.3)])
    positions = np.stack([np.broadcast_to([-0.1, 0.0, 0.3], right.shape), right], axis=1)
    slacks = constraints.slacks(positions, np.tile(ALONG_X, (4, 2, 1)))
    np.testing.assert_allclose(slacks["keep_in"], [0.05, -0.01, 0.005, -0.02], atol=1e-12)
