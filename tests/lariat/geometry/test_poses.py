"""Rotations obey their closed forms, for single ones and for large batches alike."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose

COUNT = 2 * poses.SMALL_BATCH
"""Rows of a batch that is not computed as one contraction."""


@pytest.fixture
def quaternions() -> np.ndarray:
    return poses.normalized(np.random.default_rng(0).normal(size=(2, COUNT, 4)))


def test_products_of_large_batches_equal_those_of_single_rows(quaternions: np.ndarray) -> None:
    a, b = quaternions
    whole = poses.multiply(a, b), poses.cross(a[:, 1:], b[:, 1:])
    rows = [(poses.multiply(p, q), poses.cross(p[1:], q[1:])) for p, q in zip(a, b, strict=True)]
    for k in range(2):
        np.testing.assert_allclose(whole[k], [row[k] for row in rows], atol=1e-15)
    np.testing.assert_allclose(whole[1], np.cross(a[:, 1:], b[:, 1:]), atol=1e-15)


def test_products_of_quaternions_are_products_of_matrices(quaternions: np.ndarray) -> None:
    a, b = quaternions
    product = poses.matrix(poses.multiply(a, b))
    np.testing.assert_allclose(product, poses.matrix(a) @ poses.matrix(b), atol=1e-14)


def test_a_quarter_turn_about_z_maps_x_to_y() -> None:
    q = poses.exponential(np.array([0.0, 0.0, 0.5 * np.pi]))
    np.testing.assert_allclose(poses.rotate(q, np.array([1.0, 0.0, 0.0])), [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.1])
def test_logarithm_undoes_exponential(angle: float) -> None:
    vector = angle * poses.normalized(np.array([1.0, -2.0, 0.5]))
    np.testing.assert_allclose(poses.logarithm(poses.exponential(vector)), vector, atol=1e-14)


def test_from_matrix_undoes_matrix(quaternions: np.ndarray) -> None:
    for q in quaternions[0]:
        found = poses.from_matrix(poses.matrix(q))
        np.testing.assert_allclose(found, np.sign(q[0]) * q, atol=1e-14)


def test_rotation_between_maps_one_vector_to_the_other_even_if_opposite() -> None:
    x, y = np.eye(3)[:2]
    for goal in (y, -x, x):
        found = poses.rotate(poses.rotation_between(x, goal), x)
        np.testing.assert_allclose(found, goal, atol=1e-15)


def test_slerp_at_one_half_is_half_the_rotation() -> None:
    full = poses.exponential(np.array([0.4, 0.2, -0.6]))
    half = poses.slerp(poses.IDENTITY, full, 0.5)
    np.testing.assert_allclose(poses.multiply(half, half), full, atol=1e-15)


def test_composition_with_the_inverse_is_the_identity() -> None:
    pose = Pose(np.array([0.1, -0.2, 0.3]), poses.exponential(np.array([0.4, 0.2, -0.6])))
    found = pose.inverse() @ pose
    np.testing.assert_allclose(found.position, 0.0, atol=1e-15)
    np.testing.assert_allclose(found.orientation, poses.IDENTITY, atol=1e-15)


def test_rotation_from_one_quaternion_to_another_turns_the_one_into_the_other(
    quaternions: np.ndarray,
) -> None:
    before, after = quaternions[:, :4]
    found = poses.turned(poses.rotation_from(before, after), before)
    signs = np.sign(np.sum(found * after, axis=-1, keepdims=True))
    np.testing.assert_allclose(found * signs, after, atol=1e-12)
    assert not poses.rotation_from(before, before).any()
    np.testing.assert_allclose(poses.turned(np.zeros((3, 4, 3)), before)[2], before, atol=1e-15)


@pytest.mark.parametrize(
    "angles", [(0.3, -0.5, 2.0), (0.0, np.pi / 2, 0.7), (1.0, -np.pi / 2, 0.0)]
)
def test_angles_of_a_rotation_give_it_back(angles):
    def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
        about = [
            poses.exponential(a * axis)
            for a, axis in zip((roll, pitch, yaw), np.eye(3), strict=True)
        ]
        return poses.matrix(poses.multiply(about[2], poses.multiply(about[1], about[0])))

    R = rotation(*angles)
    np.testing.assert_allclose(rotation(*poses.roll_pitch_yaw(R)), R, atol=1e-7)
