"""Your camera: the nodes of a rope from one colour image and one depth image."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import TABLE, Camera, Intrinsics, Pose, looking_at, polylines
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.rod import Rod, RodProperties
from lariat.simulation.camera.rgbd_camera import RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise

CAMERA = Camera(
    Intrinsics(width=640, height=480, fx=500.0, fy=500.0, cx=320.0, cy=240.0),
    looking_at((0.0, -0.3, 0.9), (0.0, 0.0, 0.2)),
)
"""Intrinsics from the calibration of your camera, and its pose in the world."""


LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a grip that points along x, wxyz."""
LEFT, RIGHT = (
    Pose(np.array([-0.15, 0.0, 0.3]), LEVEL),
    Pose(np.array([0.15, 0.05, 0.3]), LEVEL),
)
"""Grips that hold the rope; leave out those that you do not know."""


def photograph() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return colour (480 640 3), depth (480 640) [mm] and the true nodes; replace it by yours."""
    rod = Rod(RodProperties(0.45, 0.008, 0.044, youngs_modulus=1e6), 120)
    nodes = rod.rest(LEFT, RIGHT).state.positions
    frame = RgbdCamera(CAMERA, SensorNoise()).take(nodes, 0.004, (TABLE,), frame=0)
    return frame.color, frame.depth, nodes


def main() -> Figure:
    color, depth, truth = photograph()
    rope = RopeDimensions(length=0.45, radius=0.004, node_count=40)
    estimator = CenterlineEstimator(CAMERA, rope, CenterlineSettings())
    estimate = estimator.estimate(color, depth, LEFT, RIGHT)
    assert not estimate.lost, estimate.lost

    errors = np.linalg.norm(estimate.positions - polylines.resample_smooth(truth, 40), axis=1)
    print(
        f"mean error {1e3 * errors.mean():.2f} mm, {estimate.observed.mean():.0%} of nodes observed"
    )
    figure, axes = plt.subplots()
    axes.imshow(color)
    axes.plot(*CAMERA.project(estimate.positions)[0].T, "o", markersize=2, color="C3")
    axes.set_axis_off()
    return figure


if __name__ == "__main__":
    main().savefig("06_your_camera.png")
