"""Perception of ropes: node chains from RGB-D frames, ropes in pictures, obstacles by markers.

`CenterlineEstimator` finds a held rope in one RGB-D frame, `CenterlineTracker` follows it through
many; `camera_tracker` makes one from a scenario. `lariat.perception.image.detector` finds all ropes
in a picture without depth. Needs the extra `perception`.
"""

from __future__ import annotations

from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.fusion import fuse
from lariat.perception.scenario_trackers import camera_tracker, marker_obstacles, rope_dimensions
from lariat.perception.tracking.camera_tracker import CameraTracker
from lariat.perception.tracking.centerline_tracker import CenterlineTracker

__all__ = [
    "CameraTracker",
    "CenterlineEstimate",
    "CenterlineEstimator",
    "CenterlineSettings",
    "CenterlineTracker",
    "RopeDimensions",
    "camera_tracker",
    "fuse",
    "marker_obstacles",
    "rope_dimensions",
]
