"""Stated intervals of `lariat identify` on seeded twins: `lariat bench physics twins`.

The plant is a chain of links of MuJoCo, finer than the identified rod and built otherwise. Both
grips swing and tilt. Of a clamped twin, the outermost two markers of each end are on its gripper;
of a measured one, all markers are evenly spread over the rope, and its grips bend it between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.tables import Flat, Result
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.identification import Grip, check_motion, findings, identify
from lariat.identification.initial_state import parallel_transport
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope

NODE_COUNT = 81
MAX_TIMESTEP = 5e-4
"""Longest time step of the plant [s]; longer ones would add to its internal damping."""
LINEAR_DENSITY, DIAMETER = 0.05, 0.008
"""Linear density [kg/m] and diameter [m] of the rope."""
SEQUENCES, DURATION = 2, 1.5
"""Number of sequences, and duration of each [s]."""
MARKER_DISTANCE = 0.03
"""Distance of the two markers on a gripper [m]."""
QUANTILE = 1.645
"""Half width of a 90 % interval, in standard deviations [-]."""


@dataclass(frozen=True)
class TwinSpec:
    """Twin of one seed, and the kind of its boundary motion, which `identify` is told."""

    grip: Grip
    seed: int


def run(count: int = 20, seed: int = 0, options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS) -> int:
    """Identify seeded twins, and count the true values in the stated 90 % intervals.

    Plant: MuJoCo's links, 81 nodes; sensed: 8 to 31 markers at 50 to 120 Hz with 0 to 2 mm of
    noise, two sequences of 1.5 s; identified with the kind of its grips told.

    Examples:
      lariat bench physics twins --workers 2
      lariat bench physics twins --count 2 --seed 7

    Args:
        count: Twins of either kind.
        seed: Seed of the first one.
    """
    specs = [TwinSpec(grip, seed + k) for k in range(count) for grip in get_args(Grip)]
    trials = options.trials(run_trial, specs)
    rows = []
    for (grip,), of_kind in groups(trials, "grip").items():
        for name in of_kind[0]["errors"]:
            errors = np.array([trial["errors"][name] for trial in of_kind])
            deviations = np.array([trial["deviations"][name] for trial in of_kind])
            inside = np.sum(np.abs(errors) < QUANTILE * deviations)
            rows.append(
                {
                    "grips": grip,
                    "parameter": name.replace("_", " "),
                    "in 90 % interval": f"{inside} of {len(of_kind)}",
                    "rms error / stated": float(np.sqrt(np.mean((errors / deviations) ** 2))),
                    "median error %": 100.0 * float(np.median(np.abs(errors))),
                    "median stated %": 100.0 * float(np.median(deviations)),
                }
            )
    options.publish(Result("twins", rows, "plant: MuJoCo links, n = 81; model: n = 20 to 60"))
    return 0


def run_trial(spec: TwinSpec) -> Trial:
    """Identify one twin: logarithms of found over true values, and their stated deviations [-]."""
    random = np.random.default_rng(spec.seed)
    markers = int(random.integers(8, 32))
    rate, noise = random.uniform(50.0, 120.0), random.uniform(0.0, 2e-3)
    stiffness = LINEAR_DENSITY * math.exp(random.uniform(math.log(0.006), math.log(0.04)))
    rope = MujocoRope(
        random.uniform(0.5, 0.9),
        DIAMETER,
        NODE_COUNT,
        LINEAR_DENSITY,
        stiffness * 64.0 / (math.pi * DIAMETER**4),
        damping=random.uniform(0.3, 1.5),
        internal_damping=random.uniform(0.01, 0.04),
    )
    clamped = spec.grip == "clamped"
    arcs = np.linspace(0.0, 1.0, markers - 2 if clamped else markers)
    # Steps that end at the frames: else the free markers lag behind the grips by up to one.
    step = 1.0 / (rate * math.ceil(1.0 / (rate * MAX_TIMESTEP)))
    plant = MujocoPlant(LinkedRope(rope), timestep=step)
    vertices = np.array(
        [_record(plant, rope.length, arcs, clamped, rate, random) for _ in range(SEQUENCES)]
    )
    vertices = vertices + noise * random.normal(size=vertices.shape)
    motion = check_motion(vertices, 1.0 / rate, [0, 1, -2, -1])
    identified = {f.name: f for f in findings(identify(replace(motion, grip=spec.grip)))}
    true = {
        "stiffness": rope.bending_stiffness / LINEAR_DENSITY,
        "twist_ratio": 1.0 / (1.0 + rope.poisson_ratio),
        "damping": rope.damping,
        "internal_damping": rope.internal_damping,
        "length": (1.0 if clamped else (markers - 3) / (markers - 1)) * rope.length,
    }
    return {
        "markers": markers,
        "rate": rate,
        "noise": noise,
        "errors": {n: math.log(identified[n].value / value) for n, value in true.items()},
        "deviations": {n: identified[n].standard_deviation / identified[n].value for n in true},
    }


def _record(
    plant: MujocoPlant,
    length: float,
    marker_arcs: Float64[np.ndarray, "k"],
    clamped: bool,
    rate: float,
    random: np.random.Generator,
) -> Float64[np.ndarray, "T V 3"]:
    """Return markers of a rope whose grips swing and tilt, without roll [m]."""
    frames, dt = round(DURATION * rate), 1.0 / rate
    t = dt * np.arange(frames)[:, None, None, None]
    pace, phase = random.uniform(3.0, 9.0, (3, 2, 6)), random.uniform(0.0, 2 * np.pi, (3, 2, 6))
    size = np.array([0.035, 0.035, 0.035, 0.12, 0.12, 0.12])
    # Motion begins smoothly.
    moves = np.minimum(1.0, t[:, 0] / 0.3) ** 2 * np.sum(
        size * (np.sin(pace * t + phase) - np.sin(phase)), axis=1
    )
    rest = np.array([[0.3, 0.1, -1.0], [0.2, -0.1, 1.0]])
    places = np.array([[0.0, 0.0, 0.5], [0.4 * length, 0.0, 0.5]]) + moves[..., :3]
    axes = poses.normalized(rest + moves[..., 3:])
    z = np.tile([0.0, 0.0, 1.0], (1, 1))
    turned = [
        parallel_transport(poses.rotation_between(z, axes[:1, end]), axes[None, :, end])[0]
        for end in (0, 1)
    ]
    velocity = np.gradient(places, dt, axis=0)
    recorded = []
    for k in range(frames):
        left, right = (
            EndMotion(Pose(places[k, end], q[k]), velocity[k, end], _spin(q, k, dt))
            for end, q in enumerate(turned)
        )
        if k == 0:
            plant.reset(left.pose, right.pose)
        else:
            plant.step(left, right, dt)
        nodes = plant.nodes
        # Markers on chords would make the rope shorter.
        points = CubicSpline(np.linspace(0.0, 1.0, len(nodes)), nodes)(marker_arcs)
        if clamped:
            back = MARKER_DISTANCE * axes[k] * np.array([[-1.0], [1.0]])
            points = np.vstack([places[k, 0] + back[0], points, places[k, 1] + back[1]])
        recorded.append(points)
    return np.array(recorded)


def _spin(turned: Float64[np.ndarray, "T 4"], k: int, dt: float) -> Float64[np.ndarray, "3"]:
    """Return the angular velocity at a frame, by central differences [rad/s]."""
    before, after = max(k - 1, 0), min(k + 1, len(turned) - 1)
    turn = poses.multiply(turned[after], poses.conjugate(turned[before]))
    return poses.logarithm(turn) / ((after - before) * dt)
