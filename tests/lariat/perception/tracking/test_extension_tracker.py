"""Perception from outside: the class of the guide finds a rope, faulty ones lose it by name."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.perception.tracking.extension_tracker import ExtensionTracker
from lariat.scenario.extensions import Extension
from lariat.scenario.sections import PERCEPTION_METHODS
from tests.own_method_examples import write_examples

CAMERA = Camera(
    Intrinsics.symmetric(640, 480, math.radians(65.0)), looking_at((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
)
ROPE = RopeDimensions(0.4, 0.004, 21)
LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
LEFT, RIGHT = (Pose(np.array([x, 0.0, 0.2]), LEVEL) for x in (-0.2, 0.2))
FAULTY = """
class Faulty:
    def __init__(self, setup):
        pass

    def reset(self):
        raise OSError("no file")

    def locate(self, color, depth, grips, time):
        raise MemoryError("image too large")
"""


def tracker(name: str) -> ExtensionTracker:
    return ExtensionTracker(Extension("sensing.method", name, PERCEPTION_METHODS), CAMERA, ROPE)


def image_of_a_straight_rope() -> tuple[np.ndarray, np.ndarray]:
    ends = CAMERA.project(np.array([LEFT.position, RIGHT.position]))
    (u0, v), (u1, _) = np.round(ends[0] if isinstance(ends, tuple) else ends).astype(int)
    low, high = sorted((u0, u1))
    color = np.zeros((480, 640, 3), np.uint8)
    color[v - 3 : v + 4, low : high + 1] = 255
    return color, np.full((480, 640), 800, np.uint16)


def test_the_perception_of_the_guide_finds_a_straight_rope(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    write_examples(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    found = tracker("bright:Bright").track(*image_of_a_straight_rope(), LEFT, RIGHT, 0)
    assert not found.lost
    expected = np.linspace(LEFT.position, RIGHT.position, 21)
    assert np.max(np.linalg.norm(found.positions - expected, axis=1)) < 0.005


def test_a_perception_that_raises_loses_the_rope_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "faulty_vision.py").write_text(FAULTY)
    monkeypatch.syspath_prepend(str(tmp_path))
    faulty = tracker("faulty_vision:Faulty")
    lost = faulty.track(*image_of_a_straight_rope(), LEFT, RIGHT, 0).lost
    assert all(w in lost for w in ("faulty_vision:Faulty", "locate()", "MemoryError"))
    faulty.forget()
    lost = faulty.track(*image_of_a_straight_rope(), LEFT, RIGHT, 0).lost
    assert "reset()" in lost
    assert "OSError: no file" in lost
