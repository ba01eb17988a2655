"""The rod twin predicts a measured rope, and differentiates its prediction."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.identification import Grip, Motion, check_motion, predict
from lariat.identification.fit import generic_rope, linearize
from lariat.identification.material import Material
from lariat.identification.rod_twin import RodTwin
from tests.lariat.identification.ropes import STIFFNESS, TRUE_PROPERTIES, recorded


def mirrored(motion: Motion) -> Motion:
    return Motion(motion.vertices[:, :, ::-1], motion.dt, motion.right, motion.left)


def test_length_of_a_bent_rope_is_that_along_its_bend() -> None:
    gap, turn = 0.08, 0.5
    angles = turn * np.arange(7)
    arc = gap / turn * np.stack([np.sin(angles), 0.0 * angles, 1.0 - np.cos(angles)], axis=1)
    ahead = np.array([np.cos(angles[-1]), 0.0, np.sin(angles[-1])])
    held = arc[:1] - 0.05 * np.array([1.0, 0.0, 0.0]), arc[-1:] + 0.05 * ahead
    vertices = np.concatenate([held[0], arc, held[1]])
    noise = 1e-4 * np.random.default_rng(1).normal(size=(1, 200, *vertices.shape))
    twin = RodTwin(Motion(vertices + noise, 0.01, 2, 2))
    np.testing.assert_allclose(np.diff(twin.arcs), gap, atol=1e-4)


@pytest.mark.parametrize("right", ["clamped", "free"])
def test_true_material_predicts_the_motion(right: str) -> None:
    motion = recorded(frames=100, right=right)
    assert np.mean(predict(motion, TRUE_PROPERTIES, 1.0).scores) < 1e-3
    soft = TRUE_PROPERTIES.with_stiffness(TRUE_PROPERTIES.bending_stiffness / 5.0)
    assert np.mean(predict(motion, soft, 1.0).scores) > 3e-3


def test_mirrored_motion_has_the_mirrored_prediction() -> None:
    motion = recorded(sequences=1, frames=40, right="free")
    there = predict(motion, TRUE_PROPERTIES, 1.0).vertices
    back = predict(mirrored(motion), TRUE_PROPERTIES, 1.0).vertices[:, :, ::-1]
    np.testing.assert_allclose(back, there, atol=1e-9)
    measured = motion.vertices[:, :, ~motion.free]
    np.testing.assert_array_equal(there[:, :, ~motion.free], measured)


def test_a_gripper_that_does_not_roll_turns_a_stiff_rope_as_it_turns_itself() -> None:
    """The rope leaves it along z and bends away; the vertex of the rod is on the bend."""
    along = np.linspace(0.0, 0.6, 8)
    bent = np.stack([2.0 * along**2, along**3, along], axis=1)
    turns = poses.exponential(0.02 * np.arange(12)[:, None, None] * [1.0, 0.0, 0.0])
    vertices = poses.rotate(np.broadcast_to(turns, (12, 8, 4)), bent[None])
    motion = check_motion(vertices[None], 0.01, [0, 1], "measured")
    twin = RodTwin(motion)
    _, actions = twin.inputs(generic_rope(), twin.windows(10))
    np.testing.assert_allclose(actions[0, :, 0, 3:], np.tile([2.0, 0.0, 0.0], (10, 1)), atol=0.02)


@pytest.mark.parametrize("grip", get_args(Grip))
def test_jacobian_matches_finite_differences(grip: Grip, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lariat.identification.rod_twin.SOLVER_TOLERANCE", 1e-10)
    motion = recorded(sequences=1, frames=40, on_rope=grip == "measured")
    twin = RodTwin(replace(motion, grip=grip))
    mean = replace(generic_rope(), length=twin.length).with_stiffness(
        STIFFNESS * generic_rope().linear_density
    )
    material = Material(mean, profile_knots=3, curvature_knots=2)
    x = 0.1 * np.random.default_rng(1).normal(size=material.count)
    windows = twin.windows(30)
    free = np.ones(material.count, dtype=bool)
    _, jacobian = linearize(twin, material, x, windows, free)
    for name, place in material.groups.items():
        # The derivative with respect to the length is itself a one-sided difference.
        bound = 2e-2 if name == "length" else 1e-5
        for p in range(place.start, place.stop):
            there, back = (x + h * np.eye(material.count)[p] for h in (1e-5, -1e-5))
            ahead, behind = (twin.predict(material.properties(y), windows) for y in (there, back))
            difference = (ahead - behind) / 2e-5
            error = np.linalg.norm(jacobian[..., p] - difference) / np.linalg.norm(difference)
            assert error < bound, name


def test_the_duration_of_steps_hardly_matters() -> None:
    """Steps of first order damp the rod: they change the motion by ten times as much."""
    twin = RodTwin(recorded(sequences=1, frames=40))
    windows = twin.windows(38)
    usual, finer = (twin.refined(1, k).predict(TRUE_PROPERTIES, windows) for k in (1, 4))
    assert np.sqrt(np.mean((usual - finer) ** 2)) < 5e-5


def test_fewer_vertices_tell_less_of_the_rods_own_motion() -> None:
    motion = recorded(sequences=1, frames=60)
    count = motion.vertices.shape[2]
    errors, lengths = [], []
    for kept in (range(count), [0, 1, count // 2, count - 2, count - 1]):
        twin = RodTwin(replace(motion, vertices=motion.vertices[:, :, list(kept)]))
        rod = TRUE_PROPERTIES
        windows = twin.windows(60)
        own = twin.of_prediction(rod, windows)
        errors.append(np.abs(own.measured(windows) - own.predict(rod, windows)).mean())
        lengths.append(abs(np.log(own.length / rod.length)))
    assert errors[0] < 5e-4
    assert errors[1] > 2.0 * errors[0]
    assert lengths[1] > 3.0 * lengths[0]
