"""Scenario of a combination, in a folder: its goal is a rest shape of the true rope as truly held.

The goal's grips are those of the shipped scenario, or displaced from there at random. Where the
true rope, a gripper or an arm would come too near to an obstacle, an arm cannot reach, or the rope
would not lie on the support that there is, they are displaced until they fit.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from benchmarks.robustness.combinations import Combination
from lariat.configuration import ConfigurationError
from lariat.geometry import poses
from lariat.geometry.grippers import axis_clearance, gripper_points
from lariat.geometry.obstacles import chain_clearance, signed_distance
from lariat.geometry.poses import Pose
from lariat.planning.arms.arm_check import goal_fault
from lariat.planning.cell_problem import problem_of
from lariat.planning.rope_model import RopeModel
from lariat.scenario import SIDES, Goal, Scenario, load
from lariat.scenario.settings import load_with, to_toml
from lariat.simulation.plants.factory import build_plant
from lariat.simulation.rest_shape import goal_grips, rest_shape, write_nodes

MIN_CLEARANCE = 0.010
"""Least distance of the true rope from an obstacle that is no support, at start and goal [m]."""
MAX_SUPPORT_DISTANCE = 0.001
"""Largest distance of the true rope from a support, where there is one, at the goal [m]."""
GRIP_STEP = 0.03
"""Standard deviation of each coordinate of a seeded goal's grips from the shipped one [m]."""
GRIP_TURN = 10.0
"""Standard deviation of its rotation about each axis where it rotates [deg]."""
MAX_GRIP_DISTANCE = 0.95
"""Largest distance of the goal's grips, relative to the shorter of true and believed rope [-]."""
MAX_GOAL_SAMPLES = 200
"""Number of goals sampled before a combination is called impossible."""
GOAL_FILE, SCENARIO_FILE = "goal.csv", "scenario.toml"
"""Files of a combination in its folder."""


def build_scene(combination: Combination, folder: Path) -> Scenario:
    """Write the scenario of a combination and its goal to a folder, and load it from there."""
    base = load_with(Path(combination.scenario), combination.settings)
    _check_start(base)
    for left, right in _candidates(base, combination):
        if not _grips_are_clear(base, left, right):
            continue
        try:
            nodes = rest_shape(base, left, right)
        except ConfigurationError:
            continue
        if _is_clear(base, nodes) and _leans(base, nodes) and arms_reach(base, nodes, left, right):
            break
    else:
        raise ConfigurationError(
            f"combination {combination}: none of {MAX_GOAL_SAMPLES} goals keeps "
            f"{1e3 * MIN_CLEARANCE:g} mm from the obstacles; take another seed"
        )
    folder.mkdir(parents=True, exist_ok=True)
    write_nodes(
        folder / GOAL_FILE, nodes, f"Rest shape of the true rope of combination {combination}"
    )
    table = tomllib.loads(base.text)
    table["name"] = f"{base.name}-{combination.number}"
    table["goal"] = {
        "nodes": GOAL_FILE,
        "left_orientation": left.orientation.tolist(),
        "right_orientation": right.orientation.tolist(),
        "turns": base.goal.turns,
    }
    path = folder / SCENARIO_FILE
    path.write_text(to_toml(table))
    return load(path)


def _check_start(scenario: Scenario) -> None:
    plant = build_plant(scenario)
    plant.reset(*scenario.grips(scenario.start))
    if not _is_clear(scenario, plant.nodes):
        raise ConfigurationError(
            f"the true rope of {scenario.name} is within {1e3 * MIN_CLEARANCE:g} mm of an obstacle "
            "at the start; move the start of the scenario"
        )


def _candidates(scenario: Scenario, combination: Combination) -> Iterator[tuple[Pose, Pose]]:
    """Grips of goals to try."""
    random = combination.random
    own = goal_grips(scenario)
    if combination.goal == "shipped":
        yield own
    for _ in range(MAX_GOAL_SAMPLES):
        grips = []
        for side, grip in zip(SIDES, own, strict=True):
            end = scenario.end(side)
            step = random.normal(scale=GRIP_STEP, size=3)
            turn = np.radians(random.normal(scale=GRIP_TURN, size=3))
            position, orientation = grip.position, grip.orientation
            if end.driver != "fixed":
                position = position + step
            if end.rotates:
                orientation = poses.multiply(poses.exponential(turn), orientation)
            grips.append(Pose(position, orientation))
        yield grips[0], grips[1]


def _grips_are_clear(scenario: Scenario, left: Pose, right: Pose) -> bool:
    limits = scenario.limits
    low, high = np.array(limits.workspace)
    positions = np.stack([left.position, right.position])
    if np.any(positions < low) or np.any(positions > high):
        return False
    shorter = min(scenario.rope.length, scenario.plant_rope.length)
    if np.linalg.norm(positions[1] - positions[0]) > MAX_GRIP_DISTANCE * shorter:
        return False
    points = gripper_points(left, right, limits.gripper_reach)
    needed = axis_clearance(limits.gripper_radius, limits.keep_out)
    moving = np.repeat([scenario.end(side).driver != "fixed" for side in SIDES], 3)
    return all(np.min(signed_distance(points[moving], o)) >= needed for o in scenario.bodies)


def arms_reach(
    scenario: Scenario, goal: Float64[np.ndarray, "n 3"], left: Pose, right: Pose
) -> bool:
    """Return whether all arms can stand at the grips of a goal, as the planner judges it."""
    if all(scenario.end(side).driver in ("fixed", "ideal") for side in SIDES):
        return True
    grips = scenario.grips(scenario.start)
    rope = RopeModel(scenario.rope, scenario.moves)
    state = rope.rod.rest(*grips).state
    target = Goal(goal, left, right, True, True)
    problem = problem_of(scenario, rope, state, grips, target, scenario.bodies)
    return goal_fault(problem) is None


def _is_clear(scenario: Scenario, nodes: np.ndarray) -> bool:
    moved = dict(_true_positions(scenario))
    radius = scenario.plant_rope.diameter / 2.0
    for body in scenario.bodies:
        if body.support:
            continue
        places = [body, *(replace(body, position=at) for at in moved.get(body.name, ()))]
        if chain_clearance(nodes, radius, places) < MIN_CLEARANCE:
            return False
    return True


def _true_positions(scenario: Scenario) -> Iterator[tuple[str, list[tuple[float, float, float]]]]:
    """Places of obstacles other than those of the scenario: where they stand, and move to."""
    for k, obstacle in enumerate(scenario.obstacles):
        name = obstacle.body(k).name
        places = [obstacle.stands_at] if obstacle.stands_at else []
        places += [e.position for e in scenario.events if e.move_obstacle == name and e.position]
        if places:
            yield name, places


def _leans(scenario: Scenario, nodes: np.ndarray) -> bool:
    """Whether the rope lies on a support, where there are supports, and has not slid off it."""
    supports = [body for body in scenario.bodies if body.support]
    radius = scenario.plant_rope.diameter / 2.0
    return not supports or chain_clearance(nodes, radius, supports) < MAX_SUPPORT_DISTANCE
