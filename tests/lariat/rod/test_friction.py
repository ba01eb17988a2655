"""Friction of the rod on bodies: Coulomb's law, its gradients, and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from benchmarks.physics.friction import (
    bar_motion,
    post_exponent,
    post_truth,
    slope_motion,
)
from lariat.geometry import Obstacle, pack
from lariat.geometry.obstacles import FRICTION_COLUMN
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.friction import ContactSlips, carried_slips
from lariat.rod.integration_schemes import Scheme
from lariat.rod.parameters import with_parameters
from tests.lariat.rod.differences import assert_columns_agree, difference

PROPERTIES = RodProperties(0.3, 0.0081, 0.044, 1e6)
STEP = 0.02


def scene(table: float = 0.3, bar: float = 0.4) -> np.ndarray:
    across = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    return pack(
        [
            Obstacle("half_space", (0.0, 0.0, 0.0), friction=table),
            Obstacle("cylinder", (0.1, 0.0, -0.02), across, radius=0.03, height=1.0, friction=bar),
        ]
    )


@pytest.fixture(scope="module")
def rod() -> Rod:
    return Rod(PROPERTIES, 16, right="free", tolerance=1e-9)


@pytest.fixture(scope="module")
def dragged(rod: Rod) -> RodState:
    """A rope on a bar and a table, which slides along one part of it and sticks along another."""
    start = rod.straight((0.0, 0.0, 0.05), (1.0, 0.0, 0.05))
    actions = np.zeros((60, 2, 6))
    actions[:30, 0, 2] = -0.03
    actions[40:, 0, 1], actions[40:, 0, 5] = 0.02, 0.3
    motion = rod.rollout(RolloutSpec(start, actions, STEP, obstacles=scene()))
    assert motion.failure is None
    return motion.final


def test_a_rope_along_a_slope_stays_below_the_angle_of_friction_and_slides_above() -> None:
    assert slope_motion(0.97, seconds=60.0, dt=0.02) < 1e-6
    g, angle = 9.81, math.atan(1.05 * 0.3)
    slid = slope_motion(1.05, seconds=0.5, dt=0.005, damping=0.0)
    assert slid == pytest.approx(0.125 * g * (math.sin(angle) - 0.3 * math.cos(angle)), rel=0.03)


def test_a_rope_across_a_slope_rolls_as_a_solid_cylinder() -> None:
    rolled = slope_motion(0.5, seconds=0.3, dt=0.002, damping=0.0, across=True)
    assert rolled == pytest.approx(0.045 * 9.81 * math.sin(math.atan(0.15)) * 2 / 3, rel=0.03)


@pytest.mark.parametrize("radius", [0.0005, 0.004])
def test_tension_round_a_post_grows_as_that_of_a_rope_of_its_thickness(radius: float) -> None:
    assert post_exponent(radius) == pytest.approx(post_truth(radius), rel=0.01)
    assert post_truth(0.004) < 0.85 * 0.3


def test_a_hanging_rope_slides_where_its_end_is_too_heavy() -> None:
    assert bar_motion(0.98) < 2e-3 < 1e-2 < bar_motion(1.03)


def test_an_equilibrium_keeps_the_friction_of_its_history() -> None:
    angle = math.atan(0.25)
    gravity = (9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle))
    rod = Rod(PROPERTIES, 16, "free", "free", gravity)
    start = rod.straight((0.0, 0.0, 0.00453), (1.0, 0.0, 0.00453))
    motion, stable = rod.settle(
        start, np.zeros((30, 2, 6)), 0.02 * 1.7 ** np.arange(30), scene()[:1]
    )
    assert stable
    assert motion.converged.all()
    assert np.max(np.abs(motion.positions[-1, :, :2] - start.positions[:, :2])) < 1e-6


def test_a_body_that_moves_carries_the_rope_along() -> None:
    rod = Rod(PROPERTIES, 16, "free", "free")
    state = rod.straight((0.0, 0.0, 0.00453), (1.0, 0.0, 0.00453))
    table = Obstacle("half_space", (0.0, 0.0, 0.0), friction=0.5)
    for k in range(50):
        bodies = pack([table.moved((0.0004 * k, 0.0, 0.0))])
        spec = RolloutSpec(state, np.zeros((1, 2, 6)), STEP, obstacles=bodies)
        state = rod.rollout(spec).final
    assert state.positions[0, 0] == pytest.approx(49 * 0.0004, abs=1e-8)


def test_anchors_turn_with_their_body() -> None:
    nodes = np.linspace([0.0, 0.0, 0.004], [0.4, 0.0, 0.004], 5)
    table = Obstacle("half_space", (0.05, 0.0, 0.0), friction=0.5)
    slips = np.zeros((1, 4, 1, 3))
    slips[0, 0, 0] = 1e-6, 0.0, 0.0
    quarter = table.moved(table.position, (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    found = carried_slips(ContactSlips(slips, pack([table])), nodes, 0.004, pack([quarter]), 1)
    assert np.allclose(found[0, 0, 0], (0.0, 1e-6, 0.0), atol=1e-15)
    assert not np.any(found[0, 1:])


@pytest.mark.parametrize("scheme", ["euler", "sdirk2"])
def test_gradients_through_sticking_and_sliding_match_differences(
    scheme: Scheme, dragged: RodState
) -> None:
    rod = Rod(PROPERTIES, 16, right="free", tolerance=1e-11, scheme=scheme)
    rng = np.random.default_rng(0)
    actions = rng.normal(0.0, 0.03, (5, 2, 6))
    cost = rng.standard_normal((5, 16, 3))
    contact = dragged.contact
    assert contact is not None
    sizes = {
        "actions": actions,
        "positions": dragged.positions,
        "velocities": dragged.velocities,
        "slips": contact.slips,
    }
    steps = {
        "actions": 1e-6,
        "positions": 1e-8,
        "velocities": 1e-5,
        "slips": 1e-9,
        "length": 1e-7,
        "bending_stiffness": 1e-9,
        "linear_density": 1e-6,
        "friction[0]": 1e-5,
        "friction[1]": 1e-5,
        "friction_factor": 1e-5,
    }
    names = tuple(name for name in steps if name not in sizes)
    touching = np.any(contact.slips != 0.0, axis=-1)

    def value(
        state: RodState = dragged,
        moved: np.ndarray = actions,
        bodies: np.ndarray | None = None,
        properties: RodProperties = PROPERTIES,
    ) -> float:
        spec = RolloutSpec(state, moved, STEP, obstacles=scene() if bodies is None else bodies)
        motion = rod.with_properties(properties).rollout(spec)
        assert motion.converged.all()
        return float(np.sum(cost * motion.positions))

    found = rod.gradient(RolloutSpec(dragged, actions, STEP, obstacles=scene()), cost, names)
    end = found.rollout.final.contact
    assert end is not None
    share = np.linalg.norm(end.slips[touching], axis=-1)
    assert np.ptp(share[share > 0.0]) > 0.1 * share.max()
    along = {name: rng.standard_normal(np.shape(of)) for name, of in sizes.items()}
    along["positions"][:2], along["velocities"][:2] = 0.0, 0.0
    along["slips"] *= touching[..., None]

    def changed(name: str, e: float) -> float:
        if name == "actions":
            return value(moved=actions + e * along[name])
        if name == "slips":
            slips = replace(contact, slips=contact.slips + e * along[name])
            return value(replace(dragged, contact=slips))
        if name in sizes:
            return value(replace(dragged, **{name: getattr(dragged, name) + e * along[name]}))
        if name.startswith("friction["):
            bodies = scene()
            bodies[int(name[9]), FRICTION_COLUMN] += e
            return value(bodies=bodies)
        return value(properties=with_parameters(PROPERTIES, {name: getattr(PROPERTIES, name) + e}))

    for name, h in steps.items():
        if name in names:
            gradient = found.parameters[name]
        else:
            of = found.actions if name == "actions" else getattr(found.state, name)
            gradient = np.sum(of * along[name])
        # Of changes as small as slips, rounding leaves fewer digits.
        rel = 1e-5 if name == "slips" else 1e-6
        assert gradient == pytest.approx(difference(partial(changed, name), h), rel=rel), name
    forward = rod.linearize(RolloutSpec(dragged, actions, STEP, obstacles=scene()), names)
    assert_columns_agree(forward, found, cost, names, 1e-9)


def test_slips_go_on_from_one_roll_out_to_the_next(rod: Rod, dragged: RodState) -> None:
    actions = np.full((4, 2, 6), 0.01)
    whole = rod.rollout(RolloutSpec(dragged, actions, STEP, obstacles=scene()))
    first = rod.rollout(RolloutSpec(dragged, actions[:2], STEP, obstacles=scene()))
    second = rod.rollout(RolloutSpec(first.final, actions[2:], STEP, obstacles=scene()))
    assert np.allclose(second.positions, whole.positions[2:], atol=1e-9)
    forgotten = replace(first.final, contact=None)
    other = rod.rollout(RolloutSpec(forgotten, actions[2:], STEP, obstacles=scene()))
    assert np.max(np.abs(other.positions - second.positions)) > 1e-8


def test_friction_out_of_its_range_is_refused(rod: Rod, dragged: RodState) -> None:
    spec = RolloutSpec(dragged, np.zeros((1, 2, 6)), STEP, obstacles=scene())
    with pytest.raises(ValueError, match=r"friction of 'half_space' must be zero or more, got -1"):
        scene(table=-1.0)
    with pytest.raises(ValueError, match=r"there are 2 obstacles, got 'friction\[2\]'"):
        rod.gradient(spec, np.zeros((1, 16, 3)), ("friction[2]",))
    with pytest.raises(ValueError, match="belongs to an obstacle"):
        with_parameters(PROPERTIES, {"friction[0]": 0.2})


def test_slips_of_another_body_are_dropped(rod: Rod, dragged: RodState) -> None:
    contact = dragged.contact
    assert contact is not None
    swapped = replace(dragged, contact=ContactSlips(contact.slips, contact.bodies[::-1]))
    actions = np.zeros((1, 2, 6))
    a = rod.rollout(RolloutSpec(swapped, actions, STEP, obstacles=scene()))
    b = rod.rollout(RolloutSpec(replace(dragged, contact=None), actions, STEP, obstacles=scene()))
    assert np.array_equal(a.positions, b.positions)
