"""How well the rope is seen: `lariat bench perception`.

MuJoCo's elastic rod hangs between random grips, the simulated camera takes one frame of it, and
both methods say where its nodes are, without any frame before. Three kinds of views: `easy` ones
from above, as a cell has them; `hidden` ones with a ball in front of a third of the rope; `hard`
ones from anywhere of a slack rope between turned grips, with folds, loops and crossings.
"""

from __future__ import annotations

import json as encoder
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties
from services.perception.centerline.estimate import CenterlineEstimate, RopeModel, ShapePrior
from services.perception.centerline.estimator import CenterlineEstimator
from services.perception.centerline.settings import CenterlineSettings
from services.perception.tracking.paper_baseline import paper_nodes
from services.sim.camera.rgbd_camera import RgbdCamera
from services.sim.camera.sensor_noise import SensorNoise
from services.sim.gripper_body import gripper_body
from services.sim.plants.mujoco_model import MujocoRope
from services.sim.plants.mujoco_plant import MujocoPlant

Kind = Literal["easy", "hidden", "hard"]

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
ROPES = {
    "rope": MujocoRope(0.45, 0.008, 30, 0.044, 1.0e6, damping=2.0),
    "cable": MujocoRope(0.55, 0.005, 40, 0.040, 6.0e7, damping=2.0),
}
"""The paper's rope and cable, their stiffness estimated."""
MISTAKEN = 2.0
"""Factor on the stiffness that perception believes: nobody knows the true one."""
VIEW = math.radians(65.0)
NEAR = 0.65
"""Place of the ball that hides a part of the rope, between camera and rope [-]."""
GRIPPER = (0.012, 0.06)
"""Radius and height of a gripper [m]."""
LIVE, LARGE = (640, 480), (1280, 720)
CASES: tuple[tuple[str, Kind, tuple[int, int], float], ...] = (
    *((r, "easy", LIVE, s) for r in ROPES for s in (0.0, 0.0015, 0.003)),
    *((r, "easy", LARGE, s) for r in ROPES for s in (0.0015, 0.003)),
    *((r, k, size, 0.0015) for k in ("hidden", "hard") for size in (LIVE, LARGE) for r in ROPES),
)
SURE = 0.001
"""Sigma of a node that is well seen [m]."""


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    rope: str
    views: str
    resolution: str
    depth_sigma_mm: float
    mean_mm: float
    """Of all node errors."""
    median_mm: float
    worst_mm: float
    solved: float
    """Part of the views with a mean node error below 3 mm."""
    surely_wrong: float
    """Part of the views with a node that is off by more than 10 mm and 3 sigma."""
    within_two_sigma: float
    """Part of the nodes."""
    observed: float
    """Part of the nodes."""
    sure: float
    """Part of the observed nodes whose sigma is below a millimetre."""
    lost: float
    """Part of the views that perception gave up."""
    paper_mean_mm: float
    """Of the nodes that the paper's algorithm found."""
    paper_found: float
    """Part of the nodes that it found."""
    ms_p50: float
    """CPU time of a frame."""
    ms_p99: float


def run(views: int = 40, seed: int = 0, only: tuple[str, ...] = (), json: bool = False) -> int:
    """Prints the table.

    Args:
        views: Random views a row.
        seed: Of the views.
        only: Words that a row must have all of, e.g. cable hidden 1280x720; all rows without.
        json: One JSON object on standard output instead of a table.
    """
    rows = []
    for case in CASES:
        words = _words(*case)
        if not set(only) <= set(words):
            continue
        print(f"{' '.join(words)} ...", file=sys.stderr)
        rows.append(measured(*case, views=views, seed=seed))
    if not rows:
        names = sorted({w for case in CASES for w in _words(*case)})
        print(f"no row has all of {', '.join(only)}; there are {', '.join(names)}", file=sys.stderr)
        return 2
    if json:
        print(encoder.dumps({"views": views, "seed": seed, "rows": [vars(r) for r in rows]}))
        return 0
    names = list(vars(rows[0]))
    print("| " + " | ".join(n.replace("_", " ") for n in names) + " |")
    print("|" + "---|" * len(names))
    for row in rows:
        cells = [f"{v:.2f}" if isinstance(v, float) else str(v) for v in vars(row).values()]
        print("| " + " | ".join(cells) + " |")
    return 0


def _words(rope: str, kind: str, resolution: tuple[int, int], sigma: float) -> tuple[str, ...]:
    """What a row is called."""
    return rope, kind, f"{resolution[0]}x{resolution[1]}", f"{1e3 * sigma:g}mm"


def measured(
    rope: str, kind: Kind, resolution: tuple[int, int], sigma: float, views: int, seed: int
) -> Row:
    """One line of the table."""
    truth = ROPES[rope]
    believed = RodProperties(
        truth.length, truth.diameter, truth.linear_density, MISTAKEN * truth.youngs_modulus
    )
    rod = Rod(believed, truth.node_count)
    weight_over_stiffness = 9.81 * truth.linear_density / believed.bending_stiffness
    model = RopeModel(truth.length, truth.diameter / 2.0, truth.node_count, weight_over_stiffness)
    settings = CenterlineSettings(depth_sigma=sigma)
    noise = SensorNoise(depth_sigma=sigma)
    estimates: list[tuple[CenterlineEstimate, np.ndarray]] = []
    times, theirs, found = [], [], []
    for frame, (camera, left, right, nodes, bodies) in enumerate(
        _views(truth, kind, resolution, views, seed)
    ):
        picture = RgbdCamera(camera, noise, seed=seed).take(
            nodes, model.radius, bodies, frame=frame
        )
        estimator = CenterlineEstimator(camera, model, settings)

        def at_rest(left: Pose = left, right: Pose = right) -> ShapePrior:
            rest = rod.rest(left, right)
            return ShapePrior(rest.state.positions, np.full(truth.node_count, 0.02))

        began = time.process_time()
        estimate = estimator.estimate(
            picture.color, picture.depth, left, right, fallback_prior=at_rest
        )
        times.append(1e3 * (time.process_time() - began))
        estimates.append((estimate, nodes))
        paper = paper_nodes(
            picture.color, picture.depth, camera, nodes[0], truth.length, truth.node_count
        )
        theirs.extend(np.linalg.norm(paper - nodes[: len(paper)], axis=1))
        found.append(len(paper) / truth.node_count)
    return _row(rope, kind, resolution, sigma, estimates, times, theirs, found)


def _row(
    rope: str,
    kind: Kind,
    resolution: tuple[int, int],
    sigma: float,
    estimates: list[tuple[CenterlineEstimate, np.ndarray]],
    times: list[float],
    theirs: list[float],
    found: list[float],
) -> Row:
    seen = [(e, nodes) for e, nodes in estimates if not e.lost]
    errors = np.array([np.linalg.norm(e.positions - nodes, axis=1) for e, nodes in seen])
    sigmas = np.array([e.sigma for e, _ in seen])
    observed = np.array([e.observed for e, _ in seen])
    wrong = np.any((errors > 0.010) & (errors > 3.0 * sigmas), axis=1)
    return Row(
        rope=rope,
        views=kind,
        resolution=f"{resolution[0]}x{resolution[1]}",
        depth_sigma_mm=1e3 * sigma,
        mean_mm=1e3 * float(np.mean(errors)),
        median_mm=1e3 * float(np.median(errors)),
        worst_mm=1e3 * float(np.max(errors)),
        solved=float(np.sum(np.mean(errors, axis=1) < 0.003)) / len(estimates),
        surely_wrong=float(np.sum(wrong)) / len(estimates),
        within_two_sigma=float(np.mean(errors < 2.0 * sigmas)),
        observed=float(np.mean(observed)),
        sure=float(np.mean(sigmas[observed] < SURE)),
        lost=1.0 - len(seen) / len(estimates),
        paper_mean_mm=1e3 * float(np.mean(theirs)) if theirs else math.nan,
        paper_found=float(np.mean(found)),
        # The first frames compile.
        ms_p50=float(np.median(times[2:])),
        ms_p99=float(np.percentile(times[2:], 99)),
    )


def _views(
    truth: MujocoRope, kind: Kind, resolution: tuple[int, int], count: int, seed: int
) -> Iterator[tuple[Camera, Pose, Pose, Float64[np.ndarray, "n 3"], list[Obstacle]]]:
    """Camera, grips, true nodes and everything else in view."""
    random = np.random.default_rng(seed)
    plant = MujocoPlant(truth)
    intrinsics = Intrinsics.symmetric(*resolution, VIEW)
    made = 0
    while made < count:
        left, right = _grips(random, truth.length, kind)
        plant.reset(left, right)
        nodes = plant.nodes
        ends = np.array([left.position, right.position])
        slipped = float(np.max(np.linalg.norm(nodes[[0, -1]] - ends, axis=1)))
        if abs(polylines.length(nodes) - truth.length) > 0.003 or slipped > 0.001:
            # Jammed into itself, or bent out of its clamps: no rest that a rope would have.
            continue
        made += 1
        bodies = [
            Obstacle("half_space", (0.0, 0.0, -0.2)),
            gripper_body(left, -1.0, *GRIPPER),
            gripper_body(right, 1.0, *GRIPPER),
        ]
        middle = nodes.mean(axis=0)
        azimuth, elevation = random.uniform(-math.pi, math.pi), random.uniform(0.6, 1.5)
        toward = np.array([math.cos(azimuth), math.sin(azimuth), math.tan(elevation)])
        eye = middle + 0.75 * poses.normalized(toward)
        if kind != "hard":
            eye, middle = np.array([0.0, -0.05, 1.0]), np.array([0.0, 0.0, 0.2])
        camera = Camera(intrinsics, looking_at(tuple(eye), tuple(middle)))
        if kind == "hidden":
            bodies.append(_ball(random, camera, nodes))
        yield camera, left, right, nodes, bodies


def _grips(random: np.random.Generator, length: float, kind: Kind) -> tuple[Pose, Pose]:
    hard = kind == "hard"
    gap = random.uniform(0.1, 0.7) if hard else random.uniform(0.45, 0.93)
    yaw = random.uniform(-math.pi, math.pi) if hard else random.uniform(-0.8, 0.8)
    slope = random.uniform(-0.5, 0.5) if hard else random.uniform(-0.3, 0.3)
    half = gap * length / 2.0 * np.array([math.cos(yaw), math.sin(yaw), slope])
    place = np.array([*random.uniform(-0.05, 0.05, 2), random.uniform(0.22, 0.35)])
    turns = []
    for _ in range(2):
        extra = random.choice([0.0, 0.0, 1.5, -1.5, 3.0]) if hard else 0.0
        tilt = poses.exponential(random.normal(0.0, 0.9 if hard else 0.35, 3))
        about_z = poses.exponential(np.array([0.0, 0.0, yaw + extra]))
        turns.append(poses.multiply(tilt, poses.multiply(about_z, LEVEL)))
    return Pose(place - half, turns[0]), Pose(place + half, turns[1])


def _ball(
    random: np.random.Generator, camera: Camera, nodes: Float64[np.ndarray, "n 3"]
) -> Obstacle:
    """A ball between the camera and a third of the rope."""
    n = len(nodes)
    count = n // 3
    first = int(random.integers(n // 8, n - n // 8 - count))
    middle = nodes[first + count // 2]
    eye = camera.T_world_camera.position
    to_ball = NEAR * (middle - eye)
    to_nodes = poses.normalized(nodes - eye)
    # Of a ball in front of a ray, only the distance of its centre from the ray matters.
    beside = np.linalg.norm(np.cross(to_nodes, to_ball), axis=1)
    return Obstacle("sphere", tuple(eye + to_ball), radius=float(np.sort(beside)[count - 1]))
