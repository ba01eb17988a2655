"""Set of bends: springback of wires, gradients, and histories."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from benchmarks.physics.set import (
    HISTORY,
    WIRE,
    bend_round,
    hang,
    history_error,
    middle_curvature,
    springback_error,
)
from lariat.geometry import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.parameters import with_parameters
from lariat.rod.properties import Section
from lariat.rod.state import StateDirections
from tests.lariat.rod.differences import assert_columns_agree, difference

PROPERTIES = RodProperties(
    0.3, 0.004, 0.03, 1e8, damping=3.0, internal_damping=0.02, yield_curvature=3.0
)
STRANDED = replace(PROPERTIES, inner_friction=0.3, slip_curvature=0.4, hardening=0.05)
STEP = 0.02
FLOOR = pack([Obstacle("half_space", (0.0, 0.0, -0.03))])
ROUGH = pack([Obstacle("half_space", (0.0, 0.0, -0.03), friction=0.3)])


def bent(rod: Rod) -> RodState:
    """A cable whose right end has been bent, twisted, and partly taken back."""
    start = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    actions = np.zeros((24, 2, 6))
    actions[:16, 1] = (-0.25, 0.05, 0.05, 1.5, -3.0, 0.5)
    actions[16:, 1, :3] = 0.05, -0.05, 0.0
    motion = rod.rollout(RolloutSpec(start, actions, STEP))
    assert motion.failure is None
    return motion.final


@pytest.mark.parametrize(
    ("scheme", "self_contact", "bodies", "properties"),
    [
        ("euler", False, ROUGH, STRANDED),
        ("sdirk2", False, FLOOR, PROPERTIES),
        ("euler", True, None, PROPERTIES),
    ],
)
def test_gradients_through_yield_and_unloading_match_differences(
    scheme: str, self_contact: bool, bodies: np.ndarray | None, properties: RodProperties
) -> None:
    of = replace(
        properties,
        stiffness_profile=(1.0, 1.3, 0.8),
        rest_curvature=((0.2, 0.1, 0.3), (0.5, -0.3, 0.1)),
    )
    rod = Rod(of, 14, tolerance=1e-12, scheme=scheme, self_contact=self_contact)
    state = bent(rod)
    kept = state.plastic_curvature
    assert kept is not None
    rng = np.random.default_rng(2)
    actions = rng.normal(0.0, 0.3, (5, 2, 6))
    cost = rng.standard_normal((5, 14, 3))
    steps = {
        "actions": 1e-6,
        "velocities": 1e-5,
        "plastic_curvature": 1e-4,
        "length": 1e-6,
        "bending_stiffness": 1e-7,
        "twisting_stiffness": 1e-7,
        "linear_density": 1e-6,
        "internal_damping": 1e-6,
        "yield_curvature": 1e-4,
        "rest_curvature_1": 1e-4,
        "rest_curvature_2": 1e-4,
        "rest_twist": 1e-4,
        "stiffness_profile[1]": 1e-4,
        "rest_curvature[1][2]": 1e-4,
    }
    names = tuple(name for name in steps if name not in ("actions", *vars(state)))

    def value(
        start: RodState = state, moved: np.ndarray = actions, of: RodProperties = of
    ) -> float:
        spec = RolloutSpec(start, moved, STEP, obstacles=bodies)
        motion = rod.with_properties(of).rollout(spec)
        assert motion.converged.all()
        return float(np.sum(cost * motion.positions))

    spec = RolloutSpec(state, actions, STEP, obstacles=bodies)
    found = rod.gradient(spec, cost, names)
    end = found.rollout.final.plastic_curvature
    assert end is not None
    yielding = np.any(np.abs(end - kept) > 1e-6, axis=-1)
    assert 0.05 < np.mean(yielding) < 0.98
    along = {"actions": rng.standard_normal(actions.shape)}
    for name in ("velocities", "plastic_curvature"):
        along[name] = rng.standard_normal(getattr(state, name).shape)
    along["velocities"][[0, -1]] = 0.0

    def changed(name: str, e: float) -> float:
        if name == "actions":
            return value(moved=actions + e * along[name])
        if name in along:
            return value(replace(state, **{name: getattr(state, name) + e * along[name]}))
        base = {"stiffness_profile[1]": 1.3, "rest_curvature[1][2]": 0.1}.get(name, 0.0)
        if not name.startswith("rest"):
            base = base or getattr(of, name)
        return value(of=with_parameters(of, {name: base + e}))

    for name, h in steps.items():
        if name in names:
            gradient = found.parameters[name]
        else:
            source = found.actions if name == "actions" else getattr(found.state, name)
            gradient = np.sum(source * along[name])
        wanted = difference(partial(changed, name), h)
        assert gradient == pytest.approx(wanted, rel=1e-6), name
    directions = {
        name: np.zeros((1, *getattr(state, field).shape[:-1], 3))
        for name, field in (
            ("positions", "positions"),
            ("rotations", "orientations"),
            ("velocities", "velocities"),
            ("angular_velocities", "angular_velocities"),
        )
    }
    whole = StateDirections(**directions, plastic_curvature=along["plastic_curvature"][None])
    forward = rod.linearize(spec, names, whole)
    assert_columns_agree(forward, found, cost, names, 1e-8)
    by_set = np.einsum("hnc,hncd->d", cost, forward.d_positions_d_state)
    by_kept = found.state.plastic_curvature
    assert by_kept is not None
    wanted = np.sum(by_kept * along["plastic_curvature"])
    assert by_set == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("section", ["round", "rectangular"])
@pytest.mark.parametrize("share", [0.2, 0.45, 0.9])
def test_a_bent_wire_keeps_the_share_of_its_section(share: float, section: Section) -> None:
    assert springback_error(share, section, 20) < 0.01


@pytest.mark.parametrize("reversals", [2, 4])
def test_a_wire_that_is_bent_back_follows_its_layers(reversals: int) -> None:
    assert history_error(40, HISTORY[:reversals]) < 0.001


def test_a_hung_wire_converges_with_the_square_of_the_edge_length() -> None:
    counts = np.array([11, 21, 41, 81])
    truth = hang(321)
    errors = np.linalg.norm(np.array([hang(n) for n in counts]) - truth, axis=2)
    orders = np.log(errors[0] / errors[-1]) / np.log(8.0)
    assert np.all(orders > 1.8)
    # Errors at the first counts alone are not yet asymptotic.
    assert np.all(errors[-1] < 3e-4)


def test_strands_that_slip_keep_what_their_friction_holds() -> None:
    cable = replace(WIRE, yield_curvature=np.inf, inner_friction=0.3, slip_curvature=0.5)
    assert history_error(20, (3.0,), cable) < 0.003
    assert history_error(20, (3.0, -1.0, 2.0), cable) < 0.003


def test_an_equilibrium_goes_straight_to_its_set_and_keeps_it() -> None:
    rod = Rod(WIRE, 20, gravity=(0.0, 0.0, 0.0), tolerance=1e-10)
    state = bend_round(WIRE, (6.0,), 20)
    left, right = (Pose(state.positions[k], state.orientations[k]) for k in (0, -1))
    found = rod.rest(left, right)
    assert found.converged
    assert np.allclose(found.state.positions, state.positions, atol=1e-6)
    assert np.allclose(found.state.plastic_curvature, state.plastic_curvature, atol=1e-4)
    again = rod.rest(left, right, found.state)
    assert np.allclose(again.state.plastic_curvature, found.state.plastic_curvature, atol=1e-6)
    # Half way back, it keeps what it kept; a wire that was never bent farther keeps less.
    half = bend_round(WIRE, (3.0,), 20)
    left, right = (Pose(half.positions[k], half.orientations[k]) for k in (0, -1))
    back, fresh = rod.rest(left, right, found.state), rod.rest(left, right)
    assert np.allclose(back.state.plastic_curvature, found.state.plastic_curvature, atol=1e-4)
    assert middle_curvature(fresh.state, 0.2) == pytest.approx(3.0, rel=0.01)
    assert np.max(np.abs(fresh.state.plastic_curvature)) < 0.5 * np.max(
        np.abs(back.state.plastic_curvature)
    )


def test_a_set_goes_on_from_one_roll_out_to_the_next() -> None:
    rod = Rod(PROPERTIES, 14)
    state = bent(rod)
    actions = np.full((4, 2, 6), 0.02)
    whole = rod.rollout(RolloutSpec(state, actions, STEP))
    first = rod.rollout(RolloutSpec(state, actions[:2], STEP))
    second = rod.rollout(RolloutSpec(first.final, actions[2:], STEP))
    assert np.allclose(second.positions, whole.positions[2:], atol=1e-9)
    forgotten = replace(first.final, plastic_curvature=None)
    other = rod.rollout(RolloutSpec(forgotten, actions[2:], STEP))
    assert np.max(np.abs(other.positions - second.positions)) > 1e-4


def test_values_that_make_no_wire_are_refused() -> None:
    for change, words in (
        ({"yield_curvature": 0.0}, "yield_curvature must be positive, got 0.0 1/m"),
        ({"hardening": 1.0}, "hardening must be at least 0 and below 1, got 1.0"),
        ({"inner_friction": -0.1}, "inner_friction must be at least 0 and below 1, got -0.1"),
        ({"slip_curvature": 0.0}, "slip_curvature must be a positive number, got 0.0"),
        ({"section": "oval"}, "section must be one of round, rectangular, got 'oval'"),
    ):
        with pytest.raises(ValueError, match=words):
            replace(PROPERTIES, **change)
    state = bent(Rod(PROPERTIES, 14))
    other = Rod(replace(PROPERTIES, yield_curvature=np.inf), 14)
    with pytest.raises(ValueError, match=r"plastic_curvature.*\(14, 0, 3\)"):
        other.rollout(RolloutSpec(state, np.zeros((1, 2, 6)), STEP))
