"""Compiled distances against those of NumPy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.safety.constraints.collision import EXACT_SLACK
from lariat.safety.constraints.motion_constraints import CellBoundaries, MotionConstraints
from lariat.safety.constraints.slacks import Slacks, first_broken
from lariat.safety.constraints.spacing import BodySpacing, body_spacing_slack
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.safety.constraints.sphere_kernels import SphereKernels

KERNELS = SphereKernels.compiled()
TURNED = (0.8, 0.0, 0.6, 0.0)
OBSTACLES = (
    Obstacle("cylinder", (0.1, 0.0, 0.1), TURNED, radius=0.05, height=0.2, name="cylinder"),
    Obstacle("box", (-0.1, 0.1, 0.1), TURNED, size=(0.1, 0.2, 0.05), name="box"),
    Obstacle("sphere", (0.0, -0.1, 0.2), radius=0.06, name="sphere"),
    Obstacle("capsule", (0.2, 0.2, 0.1), TURNED, radius=0.04, height=0.1, name="capsule"),
    Obstacle("box", (5.0, 0.1, 0.1), size=(0.1, 0.2, 0.05), name="far"),
    Obstacle("half_space", (0.0, 0.0, 0.0), (0.98, 0.2, 0.0, 0.0), name="slope"),
    TABLE,
)
REGIONS = (Obstacle("sphere", (0.0, 0.0, 0.0), radius=0.5, keep_in=True),)

pytestmark = pytest.mark.skipif(KERNELS is None, reason="needs an assembler")


def constraints(
    driven: Sequence[int],
    obstacles: Sequence[Obstacle],
    compiled: bool,
    regions: tuple[Obstacle, ...] = REGIONS,
) -> MotionConstraints:
    boundaries = CellBoundaries(
        rope_length=2.0,
        workspace=((-0.4, -0.4, -0.1), (0.4, 0.4, 0.5)),
        bodies=gripper_bodies(0.1, 0.02),
        regions=regions,
    )
    made = MotionConstraints(boundaries, driven)
    if compiled:
        made.compile()
    made.replace_obstacles(obstacles)
    return made


def path(rng: np.random.Generator, poses: int = 7) -> tuple[np.ndarray, np.ndarray]:
    centre, spread = rng.uniform(-0.3, 0.4, (1, 2, 3)), rng.uniform(0.001, 0.1)
    turns = rng.normal(size=(poses, 2, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    return centre + spread * rng.normal(size=(poses, 2, 3)), turns


def assert_same(found: Slacks, expected: Slacks) -> None:
    assert list(found) == list(expected)
    for rule, slack in expected.items():
        # From there on a slack is a lower bound.
        close = (slack < EXACT_SLACK) | (found[rule] < EXACT_SLACK)
        np.testing.assert_allclose(found[rule][close], slack[close], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("driven", [(0, 1), (0,), (1,)])
def test_slacks_of_grippers_are_those_of_numpy(driven: tuple[int, ...]) -> None:
    plain, compiled = (constraints(driven, OBSTACLES, on) for on in (False, True))
    rng = np.random.default_rng(0)
    for _ in range(100):
        poses = path(rng)
        assert_same(compiled.slacks(*poses), plain.slacks(*poses))


def test_a_scene_that_changes_counts_at_once() -> None:
    plain, compiled = (constraints((0, 1), (), on) for on in (False, True))
    rng = np.random.default_rng(1)
    for count in (2, 7, 1, 0):
        poses = path(rng)
        for made in (plain, compiled):
            made.replace_obstacles(OBSTACLES[:count])
        assert_same(compiled.slacks(*poses), plain.slacks(*poses))


def test_slacks_of_links_are_those_of_numpy() -> None:
    plain, compiled = (constraints((0,), OBSTACLES, on) for on in (False, True))
    rng = np.random.default_rng(2)
    for _ in range(100):
        centres = rng.uniform(-0.3, 0.4, 3) + 0.1 * rng.normal(size=(5, 21, 3))
        radii = rng.uniform(0.01, 0.06, 21)
        assert_same(
            compiled.collision.slacks(centres, radii), plain.collision.slacks(centres, radii)
        )


def test_numbers_that_are_not_finite_break_the_rules() -> None:
    compiled = constraints((0, 1), OBSTACLES, True)
    positions, turns = path(np.random.default_rng(3))
    positions[2, 0, 1] = np.nan
    slacks = compiled.slacks(positions, turns)
    for rule in ("workspace", "keep_out", "table"):
        assert np.isnan(np.min(slacks[rule]))
    centres = np.full((2, 3, 3), np.nan)
    assert np.isnan(compiled.collision.slacks(centres, np.ones(3))["keep_out"]).all()


def test_distance_between_bodies_is_that_of_numpy() -> None:
    rng = np.random.default_rng(4)
    spacing = BodySpacing(0.005)
    # More poses than there is room for, and another number of spheres.
    for poses, links in ((6, 9), (6, 9), (150, 9), (3, 5), (150, 5)):
        left, link, right = (
            Spheres(0.2 * rng.normal(size=(poses, k, 3)), rng.uniform(0.01, 0.08, k))
            for k in (4, links, 4)
        )
        base = Spheres(rng.normal(size=(1, 2, 3)), rng.uniform(0.01, 0.08, 2))
        both = Spheres.joined([left, link, base.repeated(poses)])
        found = spacing.slack((left, link, base), (right,), poses, KERNELS)
        expected = body_spacing_slack(both, right, 0.005)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_distance_between_bodies_that_are_no_numbers_breaks_the_rule() -> None:
    spacing = BodySpacing(0.005)
    left, right = (Spheres(np.full((3, 2, 3), far), np.ones(2)) for far in (0.0, 9.0))
    assert first_broken({"spacing": spacing.slack((left,), (right,), 3, KERNELS)}) is None
    left.centres[1, 0, 2] = np.nan
    slack = spacing.slack((left,), (right,), 3, KERNELS)
    assert first_broken({"spacing": slack}) is not None


def test_a_path_with_more_poses_than_there_was_room_for_is_judged_whole() -> None:
    plain, compiled = (constraints((0, 1), OBSTACLES, on) for on in (False, True))
    rng = np.random.default_rng(5)
    for poses in (3, 200, 7, 500):
        grips = path(rng, poses)
        assert_same(compiled.slacks(*grips), plain.slacks(*grips))


def test_rules_that_a_path_breaks_are_those_of_numpy() -> None:
    plain, compiled = (constraints((0, 1), OBSTACLES, on, ()) for on in (False, True))
    rng = np.random.default_rng(6)
    rules = set()
    for _ in range(500):
        positions, turns = path(rng)
        grips = 1.3 * positions, turns
        margin = rng.choice([0.0, 0.002])
        found, expected = (made.broken(*grips, margin) for made in (compiled, plain))
        rules.add(expected and expected[0])
        assert (found and found[0]) == (expected and expected[0])
        if found and expected:
            np.testing.assert_allclose(found[1], expected[1], rtol=0.0, atol=1e-12)
    assert rules >= {None, "workspace", "keep_out", "table", "overstretch"}, rules
