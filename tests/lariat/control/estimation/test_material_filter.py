"""Accuracy of the learnt material, and of its stated deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.adaptation import apply_material
from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, state_along
from lariat.trajectory import MotionState
from tests.services.controller.cell import COUNT, LEVEL, PROPERTIES, STEP, Cell, grips

GOAL = grips((-0.14, 0.05, 0.27), (0.16, 0.02, 0.31))


def with_rope(cell: Cell, **changes: object) -> Cell:
    """Replace the true rope of a cell."""
    cell.plant = cell.model.with_properties(replace(cell.plant.properties, **changes))
    cell.rope = cell.plant.rest(*cell.start).state
    return cell


@pytest.mark.parametrize(("factor", "noise"), [(0.4, 0.0), (3.0, 1e-3)])
def test_stiffness_is_found_within_its_stated_deviation(factor: float, noise: float) -> None:
    cell = Cell(stiffness_factor=factor, noise=noise, adapts=True)
    goal = cell.plant.rest(*GOAL).state.positions
    cell.follow()
    cell.run(4.0, goal)
    true = factor * PROPERTIES.bending_stiffness
    found, deviation = cell.adaptation.bending_stiffness, cell.adaptation.standard_deviation
    assert deviation < 0.5 * found
    assert abs(found - true) < max(3.0 * deviation, 0.15 * true)
    assert cell.error(goal) < 4e-3


def test_model_with_the_found_stiffness_needs_no_offset() -> None:
    offsets = []
    for adapts in (False, True):
        cell = Cell(stiffness_factor=4.0, adapts=adapts)
        goal = cell.plant.rest(*GOAL).state.positions
        cell.follow()
        cell.run(3.0, goal)
        offsets.append(abs(cell.estimator.offset).mean())
    assert offsets[1] < 0.2 * offsets[0]


def test_uneven_stiffness_and_length_are_distinguished() -> None:
    cell = with_rope(Cell(adapts=True), stiffness_profile=(1.5, 1.0, 0.67), length=0.453)
    cell.follow()
    cell.run(3.0, cell.plant.rest(*GOAL).state.positions)
    found = cell.adaptation.profiles["stiffness_profile"]
    assert all(f.known for f in found)
    ratio = found[0].value / found[2].value
    assert ratio == pytest.approx(1.5 / 0.67, rel=0.2)
    length = cell.adaptation.scalars["length"]
    assert abs(length.value - 0.453) < 3.0 * length.standard_deviation < 5e-3


def test_unobserved_nodes_leave_the_given_properties() -> None:
    adaptation = MaterialFilter(PROPERTIES)
    cell = Cell()
    hidden = np.zeros(len(cell.rope.positions), dtype=bool)
    far = cell.rope.positions + 0.05
    change = adaptation.update(
        cell.estimator, RopeObservation(cell.now, far, np.zeros(len(far)), hidden)
    )
    assert change is None
    profiles = adaptation.profiles.values()
    estimates = [*adaptation.scalars.values(), *(e for row in profiles for e in row)]
    assert not any(e.known for e in estimates)
    assert adaptation.bending_stiffness == pytest.approx(PROPERTIES.bending_stiffness)
    assert adaptation.scalars["length"].value == pytest.approx(PROPERTIES.length)


@pytest.mark.parametrize(("given", "deviation"), [(0.0, 0.0), (1.1, 0.5 * 1.1)])
def test_drag_is_unknown_where_it_is_given(given: float, deviation: float) -> None:
    drag = MaterialFilter(replace(PROPERTIES, drag_coefficient=given)).scalars["drag_coefficient"]
    assert (drag.value, drag.known) == (given, False)
    assert drag.standard_deviation == pytest.approx(deviation)


def test_one_bad_image_changes_the_stiffness_little() -> None:
    cell = Cell()
    adaptation = MaterialFilter(PROPERTIES)
    seen = cell.estimator.state.positions
    sigma, observed = np.full(len(seen), 1e-3), np.ones(len(seen), dtype=bool)
    now = cell.now
    for _ in range(10):
        adaptation.update(cell.estimator, RopeObservation(now, seen, sigma, observed))
        now += 500_000_000
    before = adaptation.bending_stiffness
    bad = seen + np.linspace(0.0, 0.1, len(seen))[:, None]
    adaptation.update(cell.estimator, RopeObservation(now, bad, sigma, observed))
    assert abs(np.log(adaptation.bending_stiffness / before)) < 0.2


@pytest.mark.parametrize("factor", [0.5, 6.0])
def test_stiffness_of_a_hanging_rope_is_found_before_it_is_moved(factor: float) -> None:
    given = replace(PROPERTIES, youngs_modulus=1e6)
    model = Rod(given, COUNT)
    left, right = grips((-0.14, 0.0, 0.3), (0.14, 0.03, 0.32))
    tilted = poses.multiply(poses.exponential(np.array([0.4, -0.3, 0.5])), left.orientation)
    held = Pose(left.position, tilted), right
    plant = model.with_properties(replace(given, youngs_modulus=1e6 * factor))
    rope = plant.rest(*held).state.positions
    arm, now = MotionState.at_rest(*held), 1_000_000_000
    estimate, adaptation = StateEstimator(model, arm, now), MaterialFilter(given)
    random = np.random.default_rng(0)
    sigma, observed = np.full(COUNT, 2e-3), np.ones(COUNT, dtype=bool)
    for _ in range(40):
        now += 40_000_000
        estimate.advance(arm, now)
        seen = rope + sigma[:, None] * random.normal(size=rope.shape)
        estimate.observe(RopeObservation(now, seen, sigma, observed))
        change = adaptation.update(estimate, RopeObservation(now, seen, sigma, observed))
        if change is not None:
            apply_material(estimate, adaptation, change, moving=False)
    assert adaptation.settled
    assert abs(np.log(adaptation.bending_stiffness / plant.properties.bending_stiffness)) < 0.3
    assert np.linalg.norm(estimate.state.positions - rope, axis=1).mean() < 1e-3
    # A shape counts once, however long it is observed.
    before = adaptation.standard_deviation
    for _ in range(40):
        now += 100_000_000
        seen = rope + sigma[:, None] * random.normal(size=rope.shape)
        adaptation.update(estimate, RopeObservation(now, seen, sigma, observed))
    assert adaptation.standard_deviation > 0.9 * before


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_grips_that_hold_the_rope_off_their_place_do_not_bias_the_stiffness(factor: float) -> None:
    given = replace(PROPERTIES, youngs_modulus=1e6)
    true = replace(given, youngs_modulus=1e6 * factor, length=0.4525)
    errors = GripErrors(
        np.array([[0.002, -0.002, 0.001], [-0.001, 0.002, 0.002]]),
        np.array([[0.02, 0.025, 0.0], [-0.03, 0.015, 0.0]]),
    )
    plant = Rod(true, 4 * COUNT)
    estimate = StateEstimator(Rod(given, COUNT), MotionState.at_rest(*GOAL), 0)
    adaptation = MaterialFilter(given)
    random, now = np.random.default_rng(0), 1_000_000_000
    sigma, observed = np.full(COUNT, 5e-4), np.ones(COUNT, dtype=bool)
    for right in ((0.14, 0.03, 0.32), (0.08, 0.1, 0.3), (0.17, -0.05, 0.27)):
        held = MotionState.at_rest(*grips((-0.14, 0.0, 0.3), right))
        rope = plant.rest(*errors.held(held).grips).state.positions
        rope = polylines.resample_smooth(rope, COUNT)
        estimate.restart(held, now)
        for _ in range(15):
            now += 40_000_000
            seen = rope + sigma[:, None] * random.normal(size=rope.shape)
            estimate.advance(held, now)
            estimate.observe(RopeObservation(now, seen, sigma, observed))
            change = adaptation.update(estimate, RopeObservation(now, seen, sigma, observed))
            if change is not None:
                apply_material(estimate, adaptation, change, moving=False)
        now += 1_000_000_000
    found = adaptation.scalars["bending_stiffness"]
    assert abs(found.value / true.bending_stiffness - 1.0) < 0.1
    length = adaptation.scalars["length"]
    assert abs(length.value - true.length) < 3.0 * length.standard_deviation < 5e-3
    missed = adaptation.grip_errors.offsets - errors.offsets
    assert np.max(np.abs(missed)) < 2e-3


def test_rope_that_leans_on_a_support_tells_less_of_its_stiffness() -> None:
    deviations = []
    for distance in (0.05, 2e-4):
        cell = Cell(start=GOAL)
        nodes = cell.rope.positions
        lowest = nodes[np.argmin(nodes[:, 2])]
        radius = 0.02
        below = tuple(lowest - np.array([0.0, 0.0, radius + 0.004 + distance]))
        cell.estimator.supports = pack([Obstacle("sphere", below, radius=radius)])
        adaptation = MaterialFilter(PROPERTIES)
        sigma, observed = np.full(COUNT, 1e-4), np.ones(COUNT, dtype=bool)
        for k in range(4):
            adaptation.update(
                cell.estimator, RopeObservation(cell.now + 10 * k * STEP, nodes, sigma, observed)
            )
        deviations.append(adaptation.standard_deviation)
    assert deviations[1] > 1.5 * deviations[0], deviations


@pytest.mark.parametrize(("true", "given"), [(0.45, 1.0), (0.6, 1.5)])
def test_model_does_not_fall_out_of_the_shape_in_which_the_rope_stands(
    true: float, given: float
) -> None:
    # Between inclined grips, a rope stands up in an arch; a slightly softer one falls over.
    properties = replace(PROPERTIES, youngs_modulus=1e7)
    upright = [Pose(np.array([x, 0.0, 0.3]), _inclined(x)) for x in (-0.13, 0.13)]
    motion = MotionState.at_rest(upright[0], upright[1])
    askew = GripErrors(np.zeros((2, 3)), np.radians([[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]))
    held = askew.held(motion).grips
    rope = Rod(properties.with_stiffness(true * properties.bending_stiffness), 60)
    s = np.linspace(0.0, 1.0, 60)
    arch = np.stack([0.13 * (2 * s - 1), 0.0 * s, 0.3 + 0.15 * np.sin(np.pi * s)], axis=1)
    standing = rope.rest(*held, guess=state_along(arch, *(g.orientation for g in held))).state
    seen = polylines.resample_smooth(standing.positions, COUNT)
    assert seen[:, 2].max() > 0.45

    model = Rod(properties.with_stiffness(given * properties.bending_stiffness), COUNT)
    estimator = StateEstimator(model, motion, 0)
    estimator.restart(motion, 0, seen)
    adaptation = MaterialFilter(model.properties)
    random, sigma = np.random.default_rng(0), np.full(COUNT, 1e-3)
    observed = np.ones(COUNT, dtype=bool)
    observed[:3] = observed[-3:] = False
    for k in range(40):
        now = 100_000_000 * (k + 1)
        estimator.advance(motion, now)
        image = seen + random.normal(scale=1e-3, size=seen.shape)
        estimator.observe(RopeObservation(now, image, sigma, observed))
        change = adaptation.update(estimator, RopeObservation(now, image, sigma, observed))
        if change is not None:
            apply_material(estimator, adaptation, change, moving=False)
        assert polylines.mean_node_distance(estimator.state.positions, seen) < 0.01
    found = abs(adaptation.bending_stiffness - rope.properties.bending_stiffness)
    assert found < 2.0 * adaptation.standard_deviation


def _inclined(x: float) -> np.ndarray:
    """Orientation of a grip on one side, whose rope leaves upwards or arrives downwards."""
    turn = poses.exponential(np.array([0.0, np.copysign(0.6, x), 0.0]))
    return poses.multiply(turn, LEVEL)
