from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from jaxtyping import UInt8

from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.lines.segmentation import Color
from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera
from shared import topics
from shared.messages import chain
from tests.services.perception.cell import Cell, scenario
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips

GREY: Color = (120, 120, 125)
WOOD: Color = (170, 130, 90)
ORANGE: Color = (230, 110, 30)
BLACK: Color = (25, 25, 28)


def taken(rope: Color, table: Color, seed: int, hidden: bool = False) -> Frame:
    """Frame under uneven light, on a table with grain, compressed as JPEG."""
    nodes = curve(seed) - np.array([0.0, 0.0, 5.0 if hidden else 0.0])
    camera = RgbdCamera(CAMERA, seed=1, rope_color=rope)
    frame = camera.take(nodes, ROPE.radius, (TABLE,), [table], frame=seed)
    return Frame(compressed(lit(frame.color, seed)), frame.depth)


def lit(color: UInt8[np.ndarray, "h w 3"], seed: int) -> UInt8[np.ndarray, "h w 3"]:
    height, width = color.shape[:2]
    falling = np.linspace(0.0, 1.0, width) * np.linspace(0.5, 1.0, height)[:, None]
    noise = np.random.default_rng(seed).normal(size=(height, width))
    grain = 0.06 * np.sin(np.arange(height) / 3.0)[:, None] + cv2.GaussianBlur(noise, (0, 0), 3) / 6
    light = (0.8 + 0.4 * falling) * (1.0 + grain)
    return np.clip(color * light[..., None], 0, 255).astype(np.uint8)


def compressed(color: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    data = cv2.imencode(".jpg", color[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert image is not None
    return np.ascontiguousarray(image[..., ::-1])


@pytest.mark.parametrize(
    ("rope", "table"), [(ORANGE, GREY), ((200, 40, 40), WOOD), (BLACK, (215, 215, 210))]
)
def test_a_rope_is_segmented_by_its_colour(rope: Color, table: Color) -> None:
    for seed in range(4):
        frame = taken(rope, table, seed)
        nodes = curve(seed)
        settings = CenterlineSettings(rope_color=rope)
        found = CenterlineEstimator(CAMERA, ROPE, settings).estimate(
            frame.color, frame.depth, *grips(nodes)
        )
        assert np.mean(np.linalg.norm(found.positions - nodes, axis=1)) < 0.5e-3
        assert np.all(found.observed)


def test_an_inexact_colour_is_sufficient() -> None:
    nodes, frame = curve(2), taken(ORANGE, GREY, 2)
    settings = CenterlineSettings(rope_color=(205, 130, 55))
    found = CenterlineEstimator(CAMERA, ROPE, settings).estimate(
        frame.color, frame.depth, *grips(nodes)
    )
    assert np.mean(np.linalg.norm(found.positions - nodes, axis=1)) < 0.7e-3


def test_no_node_is_observed_on_a_table_without_a_rope() -> None:
    frame = taken(ORANGE, WOOD, 1, hidden=True)
    settings = CenterlineSettings(rope_color=ORANGE)
    found = CenterlineEstimator(CAMERA, ROPE, settings).estimate(
        frame.color, frame.depth, *grips(curve(1))
    )
    assert found.lost or not np.any(found.observed)


def test_a_dark_rope_on_a_bright_table_is_tracked_by_the_service() -> None:
    of = scenario("rope_color = [25, 25, 28]\n")
    plant = replace(of.plant, color=BLACK, table_color=(200, 195, 180))
    cell = Cell(replace(of, plant=plant))
    cell.run(0.6)
    truth, seen = cell.truth(), cell.chains(topics.ROPE_NODES)
    assert len(seen) > 10
    for stamp, nodes in seen.items():
        gap = chain(nodes.positions) - truth[stamp]
        assert np.mean(np.linalg.norm(gap, axis=1)) < 1.5e-3
