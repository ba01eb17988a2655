"""Trial of the adaptation on a rope that is unlike its model: which numbers it states, and truth.

A true rope of another make, resolution and stiffness than the model's, whose length is off and
which the grips hold off their place, hangs between a few pairs of grips, one after the other. Its
nodes are seen with noise at 30 Hz, and the controller's adaptation learns from them, as it does
before and between the motions of a run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.adaptation import Adaptation, apply_material
from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.rod_plant import RodPlant
from lariat.trajectory import MotionState

PlantModel = Literal["rod", "mujoco", "links"]
"""Simulator of the true rope."""
LEVEL_ORIENTATION = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a grip that holds the rope along x."""
GIVEN_ROPES = {
    "rope": (RodProperties(0.45, 0.008, 0.044, 1e6), 30),
    "cable": (RodProperties(0.55, 0.005, 0.040, 3e7), 40),
}
"""Ropes as the controller is given them, with the number of nodes of its model."""
STIFFNESS_FACTOR = 4.0
"""Largest factor between the true and the given stiffness, either way [-]."""
LENGTH_ERROR = 0.01
"""Largest error of the given length [-]."""
PROFILE_DEVIATION = 0.15
"""Standard deviation of the logarithm of the stiffness at three places [-]."""
CURVATURE_DEVIATION = 0.25
"""Standard deviation of the components of the rest curvature times the length [rad]."""
GRIP_OFFSET, GRIP_ROTATION = 0.003, math.radians(2.0)
"""Distance [m] and angle [rad] by which each grip is off."""
PLANT_SHARES: dict[PlantModel, float] = {"rod": 0.6, "mujoco": 0.3, "links": 0.1}
"""Shares of the simulators among the trials; rigid links take by far the most time."""
MIN_NOISE, MAX_NOISE = 2e-4, 2e-3
"""Least and largest standard deviation of a coordinate of a seen node [m]."""
MAX_SIMULATION_ERROR = 0.001
"""Error of a simulated rope's length or ends above which a trial is left out [m]."""
SHAPE_COUNT = 4
"""Number of shapes that are seen."""
FRAMES, FRAME_PERIOD = 30, 33_000_000
"""Number of observations of one shape, and time between them [ns]."""
MOTION_TIME = 1_000_000_000
"""Time between the observations of two shapes [ns]."""


@dataclass(frozen=True)
class CoverageSpec:
    """True rope, and how it is seen."""

    number: int
    """Number of the trial, which seeds shapes and noise."""
    rope: str
    """Name of the given rope."""
    plant: PlantModel
    """Simulator of the true rope."""
    node_count: int
    """Number of nodes of the true rope."""
    stiffness_factor: float
    """True stiffness over the given one [-]."""
    length_factor: float
    """True length over the given one [-]."""
    profile: tuple[float, ...]
    """Factors on the true stiffness, from left to right [-]."""
    rest_curvature: tuple[float, float, float]
    """Rest curvature of the true rope [1/m]."""
    errors: GripErrors
    """True errors of the grips."""
    rotates: bool
    """Whether the grips have another orientation in each shape."""
    noise: float
    """Standard deviation of a coordinate of a seen node [m]."""


@dataclass(frozen=True)
class Stated:
    """Estimate of one number, and its true value."""

    group: str
    """Group of the number, e.g. `stiffness`."""
    error: float
    """Estimate minus truth: of the logarithm of the stiffness, else in SI units."""
    deviation: float
    """Stated standard deviation, in the same unit."""


def sample(number: int, seed: int) -> CoverageSpec:
    """Return the trial of a number."""
    random = np.random.default_rng((seed, number))
    directions = poses.normalized(random.normal(size=(2, 2, 3)))
    profile = PROFILE_DEVIATION * random.normal(size=3)
    name = str(random.choice(list(GIVEN_ROPES)))
    bent = CURVATURE_DEVIATION / GIVEN_ROPES[name][0].length * random.normal(size=2)
    return CoverageSpec(
        number,
        name,
        random.choice(list(PLANT_SHARES), p=list(PLANT_SHARES.values())),
        int(random.choice([120, 160])),
        float(STIFFNESS_FACTOR ** random.uniform(-1.0, 1.0)),
        1.0 + float(random.uniform(-LENGTH_ERROR, LENGTH_ERROR)),
        tuple(np.exp(profile - profile.mean()).tolist()),
        (float(bent[0]), float(bent[1]), 0.0),
        GripErrors(GRIP_OFFSET * directions[0], GRIP_ROTATION * directions[1]),
        bool(random.integers(2)),
        float(random.uniform(MIN_NOISE, MAX_NOISE)),
    )


def run_trial(task: tuple[CoverageSpec, int]) -> list[list[Stated]]:
    """Return the estimates after each shape; none where the true rope was not simulated well.

    Args:
        task: True rope and how it is seen, and the seed of shapes and noise.
    """
    spec, seed = task
    random = np.random.default_rng((seed, spec.number, 1))
    given, count = GIVEN_ROPES[spec.rope]
    plant = build_plant(spec, given)
    grips = sample_grips(random, given.length, spec.rotates)
    now = 1_000_000_000
    estimator = StateEstimator(Rod(given, count), MotionState.at_rest(*grips), now)
    adaptation = MaterialFilter(given)
    stated = []
    for _ in range(SHAPE_COUNT):
        now += MOTION_TIME
        estimator.restart(MotionState.at_rest(*grips), now)
        ends = held_grips(spec.errors, grips)
        plant.reset(*ends)
        if not is_sound(plant.nodes, spec.length_factor * given.length, ends):
            return []
        rope = polylines.resample_smooth(plant.nodes, count)
        for _ in range(FRAMES):
            now += FRAME_PERIOD
            nodes = rope + spec.noise * random.normal(size=rope.shape)
            observe(estimator, adaptation, now, nodes, spec.noise)
        stated.append(compare(adaptation, spec, given))
        grips = sample_grips(random, given.length, spec.rotates)
    return stated


def build_plant(spec: CoverageSpec, given: RodProperties) -> Plant:
    """Return the true rope of a trial."""
    true = replace(
        given,
        length=spec.length_factor * given.length,
        youngs_modulus=spec.stiffness_factor * given.youngs_modulus,
        stiffness_profile=spec.profile,
        rest_curvature=(spec.rest_curvature,),
    )
    if spec.plant == "rod":
        return RodPlant(true, spec.node_count)
    rope = MujocoRope(
        true.length,
        true.diameter,
        spec.node_count,
        true.linear_density,
        true.youngs_modulus,
        true.poisson_ratio,
        true.damping,
        stiffness_profile=spec.profile,
        rest_curvature=spec.rest_curvature,
    )
    return MujocoPlant(FlexRope(rope) if spec.plant == "mujoco" else LinkedRope(rope))


def sample_grips(random: np.random.Generator, length: float, rotates: bool) -> tuple[Pose, Pose]:
    """Return two grips between which a rope hangs."""
    span = length * random.uniform(0.45, 0.85)
    heading = random.uniform(-0.8, 0.8)
    rise = length * random.uniform(-0.15, 0.15)
    across = np.array([math.cos(heading), math.sin(heading), 0.0]) * span / 2.0
    centre = np.array([0.0, 0.0, 0.5])
    ends = []
    for sign in (-1.0, 1.0):
        turned = LEVEL_ORIENTATION
        if rotates:
            turn = poses.exponential(0.4 * random.uniform(-1.0, 1.0, size=3))
            turned = poses.multiply(turn, turned)
        ends.append(Pose(centre + sign * (across + np.array([0.0, 0.0, rise / 2.0])), turned))
    return ends[0], ends[1]


def held_grips(errors: GripErrors, grips: tuple[Pose, Pose]) -> tuple[Pose, Pose]:
    """Return the poses of the rope's ends."""
    left, right = errors.held(MotionState.at_rest(*grips)).grips
    return left, right


def is_sound(nodes: Float64[np.ndarray, "m 3"], length: float, ends: tuple[Pose, Pose]) -> bool:
    """Whether a simulated rope has its length, and its ends where they are held."""
    errors = [abs(polylines.length(nodes) - length)]
    errors += [
        float(np.linalg.norm(nodes[k] - end.position)) for k, end in zip((0, -1), ends, strict=True)
    ]
    # Not a number is no sound length either.
    return bool(np.all(np.array(errors) < MAX_SIMULATION_ERROR))


def observe(
    estimator: StateEstimator,
    adaptation: MaterialFilter,
    now: int,
    nodes: Float64[np.ndarray, "n 3"],
    noise: float,
) -> None:
    """Take in one observation, as the controller does while the grips stand."""
    sigma, observed = np.full(len(nodes), noise), np.ones(len(nodes), dtype=bool)
    estimator.advance(estimator.motion, now)
    estimator.observe(now, nodes, sigma, observed)
    change = adaptation.update(estimator, now, nodes, sigma, observed)
    if change is not None:
        apply_material(estimator, adaptation, change, moving=False)


def compare(adaptation: Adaptation, spec: CoverageSpec, given: RodProperties) -> list[Stated]:
    """Return what is stated of all numbers whose true value is known."""
    scalars, profiles = adaptation.scalars, adaptation.profiles
    stiffness, length = scalars["bending_stiffness"], scalars["length"]
    true_stiffness = spec.stiffness_factor * given.bending_stiffness
    found = [
        Stated(
            "stiffness",
            math.log(stiffness.value / true_stiffness),
            stiffness.standard_deviation / stiffness.value,
        ),
        Stated(
            "length", length.value - spec.length_factor * given.length, length.standard_deviation
        ),
    ]
    for group, truth in (
        ("grip_offset", spec.errors.offsets),
        ("grip_rotation", spec.errors.rotations),
    ):
        for estimate, value in zip(profiles.get(group, ()), np.ravel(truth), strict=False):
            found.append(Stated(group, estimate.value - value, estimate.standard_deviation))
    return found
