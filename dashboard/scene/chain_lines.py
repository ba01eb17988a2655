"""Line segments along chains of nodes: predictions and paths."""

from __future__ import annotations

import numpy as np
import viser
from jaxtyping import Float64, UInt8

from dashboard import palette
from dashboard.palette import Color

DASH_LENGTH = 0.01
"""Length of a dash and of the gap after it [m]."""


class LinesView:
    """Set of coloured line segments, created when it first has some."""

    def __init__(self, scene: viser.SceneApi, name: str, thickness: float) -> None:
        self._scene = scene
        self._name = name
        self._thickness = thickness
        self._handle: viser.LineSegmentsHandle | None = None
        self._visible = True

    @property
    def visible(self) -> bool:
        """Whether the lines are drawn."""
        return self._visible

    @visible.setter
    def visible(self, value: bool) -> None:
        self._visible = value
        if self._handle is not None:
            self._handle.visible = value

    def show(
        self, points: Float64[np.ndarray, "m 2 3"], colors: UInt8[np.ndarray, "m 2 3"]
    ) -> None:
        """Replace the lines by segments from start to end."""
        if self._handle is None:
            self._handle = self._scene.add_line_segments(
                self._name, points, colors, thickness=self._thickness, thickness_units="screen"
            )
        else:
            self._handle.points = points.astype(np.float32)
            self._handle.colors = colors
        self._handle.visible = self._visible

    def hide(self) -> None:
        """Draw nothing until the next lines are shown."""
        if self._handle is not None:
            self._handle.visible = False


def chain_segments(
    chains: Float64[np.ndarray, "k n 3"], weights: Float64[np.ndarray, "k"], color: Color
) -> tuple[Float64[np.ndarray, "m 2 3"], UInt8[np.ndarray, "m 2 3"]]:
    """Return the segments of some chains and their colours: weight 0 is the colour of the table."""
    segments = np.stack([chains[:, :-1], chains[:, 1:]], axis=2)
    w = weights[:, None]
    faded = w * np.array(palette.linear(color)) + (1.0 - w) * np.array(
        palette.linear(palette.TABLE)
    )
    colors = np.broadcast_to(faded[:, None, None], segments.shape)
    return segments.reshape(-1, 2, 3), colors.reshape(-1, 2, 3).round().astype(np.uint8)


def dashed(points: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "m 2 3"]:
    """Return the segments of a dashed line, told apart from other lines without its colour."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    segments = np.stack([points[:-1], points[1:]], axis=1)
    return segments[(along[:-1] // DASH_LENGTH) % 2 == 0]
