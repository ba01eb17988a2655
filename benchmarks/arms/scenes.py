"""Seeded scenes for one or two CR5s: posts and boxes between and beside the arms.

The goal is the rest shape of the true rope between random grips, at which rope, grippers and arms
keep clear of everything. Whether a way leads there is not known beforehand.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lariat.geometry import poses
from lariat.geometry.grippers import gripper_points
from lariat.geometry.obstacles import chain_clearance, signed_distance
from lariat.geometry.poses import Pose
from lariat.planning.arms.arm_check import goal_fault, start_fault
from lariat.rod import Rod
from lariat.scenario import Scenario, Shape, load
from lariat.scenario.sections import Ends, Obstacle
from lariat.scenario.shipped import find
from lariat.simulation.plants.factory import build_plant, true_properties
from stack.planning import scenario_problem

BASES = {1: "fixed-end", 2: "two-arms"}
"""Scenario whose cell and rope a scene has, by its number of arms."""
MIN_CLEARANCE = 0.015
"""Least clearance of rope and grippers at start and goal [m]."""
OBSTACLE_COUNT = (2, 5)
"""Least and largest number of obstacles."""
AREA = np.array([[-0.32, -0.32], [0.36, 0.32]])
"""Area of the table in which obstacles stand: lowest and highest x, y [m]."""
MAX_HEIGHT = 0.55
"""Largest height of an obstacle [m]."""
SPREAD = (0.20, 0.30, 0.14)
"""Largest distance of a goal's grip from the cell's usual goal in x, y, z [m]."""
MAX_YAW = 0.7
"""Largest rotation of a goal's grip about the vertical, where the ends rotate [rad]."""
MIN_SAG_SHARE = (0.35, 0.93)
"""Least and largest distance of the goal's grips, relative to the rope's length [-]."""
MIN_GRIP_HEIGHT = 0.05
"""Least height of a grip above the table [m]."""
MAX_SAMPLES = 600
"""Number of samples from which a scene is taken."""


def sample_scene(arms: int, number: int, seed: int, folder: Path) -> Scenario:
    """Return a scene, always the same for the same arguments.

    Args:
        arms: Number of arms, 1 or 2.
        number: Number of the scene; in every second one the ends may rotate.
        seed: Seed of the scenes.
        folder: Folder for the file of the goal's nodes.

    Raises:
        ValueError: No scene was found.
    """
    random = np.random.default_rng([seed, arms, number])
    base = load(find(BASES[arms]))
    rotates = number % 2 == 1
    ends = [
        replace(e, rotates=rotates and e.driver != "fixed")
        for e in (base.ends.left, base.ends.right)
    ]
    base = replace(
        base,
        name=f"arms-{arms}-{number}",
        folder=folder,
        seed=seed + number,
        ends=Ends(*ends),
        obstacles=(),
        sensing=replace(base.sensing, source="truth"),
        run=replace(base.run, time_limit=25.0),
        events=(),
    )
    for _ in range(MAX_SAMPLES):
        scenario = replace(base, obstacles=_obstacles(random))
        if not _start_is_clear(scenario):
            continue
        found = _with_goal(scenario, random)
        if found is not None:
            return found
    raise ValueError(
        f"no scene {number} with {arms} arms was found in {MAX_SAMPLES} samples; try another seed"
    )


def _obstacles(random: np.random.Generator) -> tuple[Obstacle, ...]:
    found = []
    for k in range(random.integers(OBSTACLE_COUNT[0], OBSTACLE_COUNT[1] + 1)):
        x, y = random.uniform(*AREA)
        height = random.uniform(0.1, MAX_HEIGHT)
        if random.random() < 0.6:
            radius = random.uniform(0.015, 0.045)
            post = Obstacle(
                "cylinder", (x, y, height / 2.0), radius=radius, height=height, name=f"post-{k}"
            )
        else:
            a, b = random.uniform(0.02, 0.12, 2)
            post = Obstacle("box", (x, y, height / 2.0), size=(a, b, height), name=f"box-{k}")
        found.append(post)
    return tuple(found)


def _start_is_clear(scenario: Scenario) -> bool:
    left, right = scenario.grips(scenario.start)
    if not _grippers_are_clear(scenario, left, right):
        return False
    rod = Rod(true_properties(scenario), scenario.rope.node_count)
    return _rope_is_clear(scenario, rod.rest(left, right).state.positions)


def _with_goal(scenario: Scenario, random: np.random.Generator) -> Scenario | None:
    """Scenario with a goal that rope and arms can hold; None where the sample cannot be held."""
    usual = scenario.grips(scenario.goal)
    grips = []
    for end, grip in zip((scenario.ends.left, scenario.ends.right), usual, strict=True):
        if end.driver == "fixed":
            grips.append(grip)
            continue
        turn = random.uniform(-MAX_YAW, MAX_YAW) if end.rotates else 0.0
        yaw = poses.exponential(np.array([0.0, 0.0, turn]))
        away = random.uniform(-1.0, 1.0, 3) * np.array(SPREAD)
        grips.append(Pose(grip.position + away, poses.multiply(yaw, grip.orientation)))
    left, right = grips
    apart = np.linalg.norm(right.position - left.position) / scenario.rope.length
    high = min(left.position[2], right.position[2]) >= MIN_GRIP_HEIGHT
    low_corner, high_corner = np.array(scenario.limits.workspace)
    inside = all(
        np.all((g.position > low_corner + 0.01) & (g.position < high_corner - 0.01)) for g in grips
    )
    if not (MIN_SAG_SHARE[0] <= apart <= MIN_SAG_SHARE[1] and high and inside):
        return None
    if not _grippers_are_clear(scenario, left, right):
        return None
    rest = Rod(true_properties(scenario), scenario.rope.node_count).rest(left, right)
    if not (rest.converged and rest.stable and _rope_is_clear(scenario, rest.state.positions)):
        return None
    plant = build_plant(scenario)
    plant.reset(left, right, rest.state.positions)
    if not _rope_is_clear(scenario, plant.nodes):
        return None
    file = f"{scenario.name}-goal.csv"
    np.savetxt(scenario.folder / file, plant.nodes, delimiter=",")
    held = Shape(
        nodes=file,
        left_orientation=_quadruple(left),
        right_orientation=_quadruple(right),
    )
    found = replace(scenario, goal=held)
    problem = scenario_problem(found)
    held_by_arms = start_fault(problem) is None and goal_fault(problem) is None
    return found if held_by_arms else None


def _quadruple(grip: Pose) -> tuple[float, float, float, float]:
    w, x, y, z = (float(v) for v in grip.orientation)
    return w, x, y, z


def _grippers_are_clear(scenario: Scenario, left: Pose, right: Pose) -> bool:
    limits = scenario.limits
    bodies = gripper_points(left, right, limits.gripper_reach)
    least = min(float(np.min(signed_distance(bodies, o))) for o in scenario.bodies)
    return least > limits.gripper_radius + MIN_CLEARANCE


def _rope_is_clear(scenario: Scenario, nodes: np.ndarray) -> bool:
    return chain_clearance(nodes, scenario.rope.diameter / 2.0, scenario.bodies) > MIN_CLEARANCE
