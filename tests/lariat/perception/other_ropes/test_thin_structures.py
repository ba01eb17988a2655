"""Cables of any colour beside the held rope are found by their depth, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera, looking_at
from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.other_ropes.foreground_mask import KnownScene
from lariat.perception.other_ropes.other_ropes import SeenLine
from lariat.perception.other_ropes.thin_structures import RgbdView, thin_structures
from lariat.simulation.camera.depth_faults import DepthFaults
from lariat.simulation.camera.rgbd_camera import RGB, RgbdCamera, Tube
from lariat.simulation.camera.sensor_noise import SensorNoise
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips

NODES = curve(3, bend=0.6)
SIGMA = SensorNoise().depth_sigma
WHITE: RGB = (255, 255, 255)
POST = Obstacle("cylinder", (0.1, -0.15, 0.08), radius=0.02, height=0.16)


def cable(height: float, diameter: float, color: RGB, bow: float = 0.04) -> Tube:
    """Bowed cable of 0.4 m that crosses the middle of the held rope in the image."""
    s = np.linspace(-1.0, 1.0, 40)
    x, y = bow * (1.0 - s * s), 0.2 * s
    return Tube(np.stack([x, y, np.full_like(s, height)], axis=1), 0.5 * diameter, color)


def found(
    *tubes: Tube,
    known: tuple[Obstacle, ...] = (),
    seed: int = 1,
    camera: Camera = CAMERA,
    faults: DepthFaults | None = None,
) -> list[SeenLine]:
    """Lines beside a held rope whose nodes are known."""
    grippers = gripper_capsules(*grips(NODES), 0.048, 0.012)
    bodies = [TABLE, POST, *grippers]
    source = RgbdCamera(camera, seed=seed, faults=faults)
    images = source.take(NODES, ROPE.radius, bodies, tubes=tubes)
    rope = CenterlineEstimate(NODES, np.full(len(NODES), 5e-4), np.ones(len(NODES), bool))
    view = RgbdView(lambda: images.color, images.depth, camera)
    return thin_structures(view, KnownScene(rope, ROPE.radius, [TABLE, *known], grippers), SIGMA)


def distances(line: SeenLine, tube: Tube) -> Float64[np.ndarray, "k"]:
    """Distance of each point of a line from a cable's axis [m]."""
    axis = polylines.resample(tube.nodes, 500)
    return np.min(polylines.point_distances(line.points, axis), axis=1)


@pytest.mark.parametrize("color", [(200, 40, 30), (20, 20, 25), (70, 74, 82)])
@pytest.mark.parametrize(("height", "diameter"), [(0.15, 0.005), (0.32, 0.012), (0.006, 0.012)])
def test_a_cable_of_another_colour_is_one_line(height: float, diameter: float, color: RGB) -> None:
    tube = cable(height, diameter, color)
    (line,) = found(tube, known=(POST,))
    assert np.median(distances(line, tube)) < 1.5e-3
    assert polylines.length(polylines.resample(line.points, 20)) > 0.35
    assert line.diameter == pytest.approx(diameter, rel=0.3)


@pytest.mark.parametrize("bleed", [0, 2])
def test_diameter_is_that_of_the_colours_where_depth_bleeds(bleed: int) -> None:
    tube = cable(0.15, 0.005, (200, 40, 30))
    (line,) = found(tube, known=(POST,), faults=DepthFaults(bleed=bleed))
    assert line.diameter == pytest.approx(tube.radius * 2.0, rel=0.1)


def test_two_cables_that_cross_are_two_lines() -> None:
    one, two = cable(0.15, 0.006, (200, 40, 30)), cable(0.1, 0.008, (30, 60, 200))
    turned = Tube(two.nodes[:, [1, 0, 2]] - [0.0, 0.12, 0.0], two.radius, two.color)
    lines = found(one, turned, known=(POST,))
    nearest = [int(np.argmin([np.median(distances(n, t)) for t in (one, turned)])) for n in lines]
    assert sorted(nearest) == [0, 1]


def test_a_slope_at_the_border_of_the_image_is_none() -> None:
    oblique = Camera(CAMERA.intrinsics, looking_at((0.1, -0.75, 0.6), (0.0, 0.0, 0.2)))
    assert not found(known=(POST,), camera=oblique)


@pytest.mark.parametrize("seed", range(4))
def test_the_held_rope_its_grippers_and_known_obstacles_are_none(seed: int) -> None:
    assert not found(known=(POST,), seed=seed)


def test_a_cable_of_the_held_ropes_colour_is_left_to_the_tracker() -> None:
    assert not found(cable(0.15, 0.008, WHITE), known=(POST,))


def test_a_beam_as_wide_as_an_arm_is_none() -> None:
    assert not found(cable(0.15, 0.07, (200, 40, 30)), known=(POST,))


def test_where_the_whole_rope_is_hidden_nothing_is_said() -> None:
    tube = cable(0.15, 0.006, (200, 40, 30))
    images = RgbdCamera(CAMERA, seed=1).take(NODES, ROPE.radius, [TABLE], tubes=[tube])
    unseen = CenterlineEstimate(NODES, np.full(len(NODES), 0.05), np.zeros(len(NODES), bool))
    view = RgbdView(lambda: images.color, images.depth, CAMERA)
    assert not thin_structures(view, KnownScene(unseen, ROPE.radius, [TABLE], []), SIGMA)
