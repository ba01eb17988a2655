"""Trial of the identification on a rope that is swung by its ends, with errors that persist.

The rope is simulated finer than the model of the identification. Its markers are seen with noise,
and with errors that persist for some time, as those of a camera that loses and regains a marker.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from benchmarks.coverage.trial import Stated
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.identification import Motion, check_motion, findings, identify
from lariat.rod import Rod, RodProperties, RolloutSpec

ROPE = RodProperties(0.7, 0.008, 0.05, 1e7, damping=0.5, internal_damping=0.02)
"""Rope of which stiffness and dampings are changed."""
STIFFNESS = 0.02
"""Middle of the true stiffnesses, EI per linear density [m^4/s^2]."""
STIFFNESS_FACTOR, DAMPING_FACTOR = 4.0, 2.0
"""Largest factors between a true value and the middle one, either way [-]."""
CURVATURE_DEVIATION = 0.3
"""Standard deviation of the components of the rest curvature [1/m]."""
NODES, NODES_PER_MARKER = 73, 8
"""Number of nodes of the true rope, and from marker to marker."""
FRAME_PERIOD, STEPS_PER_FRAME = 0.01, 4
"""Time between two frames [s], and steps of the simulation in between."""
SEQUENCES, FRAMES = 3, 120
"""Number of motions, and of frames in each."""
NOISE, PERSISTENT_ERROR, PERSISTENCE = 2e-4, 5e-4, 0.2
"""Standard deviations of noise and of persistent errors [m], and the time constant of these [s]."""
RAMP_TIME = 0.2
"""Time in which the motion begins [s]."""


@dataclass(frozen=True)
class SwungRope:
    """True rope of a trial."""

    number: int
    """Number of the trial, which seeds its motion and errors."""
    properties: RodProperties
    """True properties."""


def sample(number: int, seed: int) -> SwungRope:
    """Return the trial of a number."""
    random = np.random.default_rng((seed, number))
    stiffness = STIFFNESS * STIFFNESS_FACTOR ** random.uniform(-1.0, 1.0)
    damping, internal = DAMPING_FACTOR ** random.uniform(-1.0, 1.0, size=2)
    bent = CURVATURE_DEVIATION * random.normal(size=2)
    properties = replace(
        ROPE,
        damping=damping * ROPE.damping,
        internal_damping=internal * ROPE.internal_damping,
        rest_curvature=((float(bent[0]), float(bent[1]), 0.0),),
    )
    return SwungRope(number, properties.with_stiffness(stiffness * ROPE.linear_density))


def run_trial(task: tuple[SwungRope, int]) -> list[list[Stated]]:
    """Return what the identification states, and the errors of it.

    Args:
        task: True rope, and the seed of its motion and errors.
    """
    rope, seed = task
    true = rope.properties
    stated = {f.name: f for f in findings(identify(measured_motion(rope, seed)))}
    found = [
        Stated(
            name,
            math.log(stated[name].value / value),
            stated[name].standard_deviation / stated[name].value,
        )
        for name, value in (
            ("stiffness", true.bending_stiffness / true.linear_density),
            ("damping", true.damping),
            # An implicit step damps like an internal damping of half its duration.
            ("internal_damping", true.internal_damping + 0.5 * FRAME_PERIOD / STEPS_PER_FRAME),
        )
    ]
    length = stated["length"]
    # The clamps act at the innermost held vertices.
    found.append(Stated("length", length.value - true.length, length.standard_deviation))
    return [found]


def measured_motion(rope: SwungRope, seed: int) -> Motion:
    """Return the motion of a rope swung by its ends, as it is measured at its markers."""
    random = np.random.default_rng((seed, rope.number, 1))
    rod = Rod(rope.properties, NODES, tolerance=1e-8)
    z = np.array([0.0, 0.0, 1.0])
    down = poses.normalized(np.array([0.3, 0.1, -1.0]))
    left = Pose(np.zeros(3), poses.rotation_between(z, down))
    right = Pose(np.array([0.3, 0.0, 0.0]), poses.rotation_between(z, z))
    start = rod.rest(left, right).state
    sequences = []
    for _ in range(SEQUENCES):
        actions = _actions(random)
        spec = RolloutSpec(start, actions, FRAME_PERIOD, substeps=STEPS_PER_FRAME)
        rolled = rod.rollout(spec)
        sequences.append(_markers(rolled.positions, left, right, actions))
    vertices = np.array(sequences)
    vertices += NOISE * random.normal(size=vertices.shape)
    vertices += PERSISTENT_ERROR * _persistent(random, vertices.shape)
    count = vertices.shape[2]
    return check_motion(vertices, FRAME_PERIOD, np.array([0, 1, count - 2, count - 1]))


def _actions(random: np.random.Generator) -> Float64[np.ndarray, "t 2 6"]:
    """Velocities of both ends: three random oscillations, which begin smoothly."""
    t = FRAME_PERIOD * np.arange(FRAMES)[:, None, None, None]
    phase, pace = random.uniform(0.0, 2.0 * np.pi, (3, 2, 6)), random.uniform(3.0, 9.0, (3, 2, 6))
    size = np.array([0.35, 0.35, 0.35, 0.6, 0.6, 0.0])
    actions = np.sum(size / 2.0 * np.sin(pace * t + phase), axis=1)
    return actions * np.minimum(1.0, t[:, 0] / RAMP_TIME)


def _markers(
    nodes: Float64[np.ndarray, "t n 3"],
    left: Pose,
    right: Pose,
    actions: Float64[np.ndarray, "t 2 6"],
) -> Float64[np.ndarray, "t m 3"]:
    """Markers on the rope, and one on the gripper behind each end."""
    z = np.array([0.0, 0.0, 1.0])
    behind = []
    for end, (grip, sign) in enumerate(((left, -1.0), (right, 1.0))):
        orientation, places = grip.orientation, []
        for step, action in enumerate(actions):
            turn = poses.exponential(FRAME_PERIOD * action[end, 3:])
            orientation = poses.normalized(poses.multiply(turn, orientation))
            away = 0.04 * sign * poses.rotate(orientation, z)
            places.append(nodes[step, -1 if end else 0] + away)
        behind.append(np.array(places))
    inner = nodes[:, ::NODES_PER_MARKER]
    return np.concatenate([behind[0][:, None], inner, behind[1][:, None]], axis=1)


def _persistent(
    random: np.random.Generator, shape: tuple[int, ...]
) -> Float64[np.ndarray, "s t m 3"]:
    """Errors of unit variance that persist for `PERSISTENCE`."""
    errors = random.normal(size=shape)
    kept = math.exp(-FRAME_PERIOD / PERSISTENCE)
    for k in range(1, shape[1]):
        errors[:, k] = kept * errors[:, k - 1] + math.sqrt(1.0 - kept**2) * errors[:, k]
    return errors
