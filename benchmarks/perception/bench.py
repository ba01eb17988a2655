"""Accuracy of the perceived rope: `lariat bench perception`.

MuJoCo's rope hangs between random grips, the simulated camera takes one image of it, and both
Lariat's and the paper's method estimate its nodes from this image alone. There are three kinds of
views: `easy` from above, as in a cell; `hidden`, with a ball in front of a third of the rope;
`hard`, from anywhere, of a slack rope between turned grips, with folds, loops and crossings.
"""

from __future__ import annotations

import math
import sys
import time
from typing import Any

import numpy as np

from benchmarks.perception.scenes import ROPES, STIFFNESS_ERROR, Kind, believed, views_of
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate, ShapePrior
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.tracking.paper_baseline import paper_nodes
from lariat.rod import Rod
from lariat.simulation.camera.rgbd_camera import RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise

LIVE_RESOLUTION, LARGE_RESOLUTION = (640, 480), (1280, 720)
"""Resolution of a cell's images, and a larger one [pixels]."""
TABLE_ROWS: tuple[tuple[str, Kind, tuple[int, int], float], ...] = (
    *((r, "easy", LIVE_RESOLUTION, s) for r in ROPES for s in (0.0, 0.0015, 0.003)),
    *((r, "easy", LARGE_RESOLUTION, s) for r in ROPES for s in (0.0015, 0.003)),
    *(
        (r, k, size, 0.0015)
        for k in ("hidden", "hard")
        for size in (LIVE_RESOLUTION, LARGE_RESOLUTION)
        for r in ROPES
    ),
)
"""Rope, kind of views, resolution [pixels] and depth noise [m] of every row."""
CERTAIN_SIGMA = 0.001
"""Standard deviation below which a node counts as certain [m]."""
SOLVED_ERROR = 0.003
"""Mean node error below which a view counts as solved [m]."""
WRONG_ERROR, WRONG_SIGMAS = 0.010, 3.0
"""Error [m] and error relative to sigma above which a node counts as confidently wrong."""
REST_SIGMA = 0.02
"""Standard deviation of the rest shape that perception expects [m]."""
WARM_UP_VIEWS = 2
"""Number of views that are not timed, because kernels are compiled."""


def run(
    views: int = 40,
    seed: int = 0,
    only: tuple[str, ...] = (),
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Measure the accuracy of the rope that is perceived in single images.

    Plant: MuJoCo's rope (n = 30) and cable (n = 40), at rest. Sensed: one image of the simulated
    camera for each view. The stiffness is believed twice as large as it is; nothing is adapted.

    Examples:
      lariat bench perception --views 10 --only rope easy
      lariat bench perception --only cable hidden 1280x720

    Args:
        views: Number of random views for each row.
        seed: Seed of the views.
        only: Rope, kind, resolution or noise of the rows to measure; all rows by default.
    """
    rows = []
    for setting in TABLE_ROWS:
        words = _words(*setting)
        if not set(only) <= set(words):
            continue
        print(f"{' '.join(words)} ...", file=sys.stderr)
        rows.append(measure(*setting, views=views, seed=seed))
    if not rows:
        names = sorted({w for setting in TABLE_ROWS for w in _words(*setting)})
        raise ConfigurationError(
            f"no row has all of {', '.join(only)}; there are {', '.join(names)}"
        )
    nodes = ", ".join(f"{name} n = {rope.node_count}" for name, rope in ROPES.items())
    caption = (
        f"Plant: MuJoCo ({nodes}), at rest; sensed: one image of the simulated camera a view; "
        f"believed / true stiffness {STIFFNESS_ERROR:g}, not adapting; {views} views a row. "
        "Errors of nodes. Shares of views: solved: mean error below 3 mm; confidently wrong: a "
        "node off by 10 mm and 3 sigma; lost. Of nodes: within 2 sigma, observed, found by the "
        "paper's method. Of observed nodes: certain: sigma below 1 mm. ms: processor time."
    )
    options.publish(Result("rows", rows, caption))
    return 0


def _words(rope: str, kind: str, resolution: tuple[int, int], sigma: float) -> tuple[str, ...]:
    """Words by which `--only` selects a row."""
    return rope, kind, f"{resolution[0]}x{resolution[1]}", f"{1e3 * sigma:g}mm"


def measure(
    rope: str, kind: Kind, resolution: tuple[int, int], sigma: float, views: int, seed: int
) -> dict[str, Any]:
    """Measure one row of the table."""
    truth = ROPES[rope]
    properties, model = believed(truth)
    rod = Rod(properties, truth.node_count)
    settings = CenterlineSettings(depth_sigma=sigma)
    noise = SensorNoise(depth_sigma=sigma)
    estimates: list[tuple[CenterlineEstimate, np.ndarray]] = []
    times, paper_errors, paper_found = [], [], []
    for frame, (camera, left, right, nodes, whole, bodies) in enumerate(
        views_of(truth, kind, resolution, views, seed)
    ):
        images = RgbdCamera(camera, noise, seed=seed).take(whole, model.radius, bodies, frame=frame)
        estimator = CenterlineEstimator(camera, model, settings)

        def at_rest(left: Pose = left, right: Pose = right) -> ShapePrior:
            rest = rod.rest(left, right)
            return ShapePrior(rest.state.positions, np.full(truth.node_count, REST_SIGMA))

        started = time.process_time()
        estimate = estimator.estimate(
            images.color, images.depth, left, right, fallback_prior=at_rest
        )
        times.append(1e3 * (time.process_time() - started))
        estimates.append((estimate, nodes))
        paper = paper_nodes(
            images.color, images.depth, camera, nodes[0], truth.length, truth.node_count
        )
        paper_errors.extend(np.linalg.norm(paper - nodes[: len(paper)], axis=1))
        paper_found.append(len(paper) / truth.node_count)
    return _row(rope, kind, resolution, sigma, estimates, times, paper_errors, paper_found)


def _row(
    rope: str,
    kind: Kind,
    resolution: tuple[int, int],
    sigma: float,
    estimates: list[tuple[CenterlineEstimate, np.ndarray]],
    times: list[float],
    paper_errors: list[float],
    paper_found: list[float],
) -> dict[str, Any]:
    seen = [(e, nodes) for e, nodes in estimates if not e.lost]
    errors = np.array([np.linalg.norm(e.positions - nodes, axis=1) for e, nodes in seen])
    sigmas = np.array([e.sigma for e, _ in seen])
    observed = np.array([e.observed for e, _ in seen])
    wrong = np.any((errors > WRONG_ERROR) & (errors > WRONG_SIGMAS * sigmas), axis=1)
    return {
        "rope": rope,
        "views": kind,
        "resolution": f"{resolution[0]}x{resolution[1]}",
        "depth_sigma_mm": 1e3 * sigma,
        "mean_error_mm": 1e3 * float(np.mean(errors)),
        "median_error_mm": 1e3 * float(np.median(errors)),
        "max_error_mm": 1e3 * float(np.max(errors)),
        "solved": float(np.sum(np.mean(errors, axis=1) < SOLVED_ERROR)) / len(estimates),
        "confidently_wrong": float(np.sum(wrong)) / len(estimates),
        "within_two_sigma": float(np.mean(errors < 2.0 * sigmas)),
        "observed": float(np.mean(observed)),
        "certain": float(np.mean(sigmas[observed] < CERTAIN_SIGMA)),
        "lost": 1.0 - len(seen) / len(estimates),
        "paper_mean_error_mm": 1e3 * float(np.mean(paper_errors)) if paper_errors else math.nan,
        "paper_found": float(np.mean(paper_found)),
        "ms_p50": float(np.median(times[WARM_UP_VIEWS:])),
        "ms_p99": float(np.percentile(times[WARM_UP_VIEWS:], 99)),
    }
