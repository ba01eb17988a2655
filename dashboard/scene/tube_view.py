"""Tube along a chain of nodes."""

from __future__ import annotations

import numpy as np
import viser
from jaxtyping import Float32, Float64, UInt8

from dashboard.palette import Color
from dashboard.scene import meshes

MIN_SCALE_CHANGE = 2e-4
"""Change of a segment's radius or length below which no browser is told [m]: the balls at its ends
cover it."""


class TubeView:
    """Drawn rope: a cylinder for each segment and a sphere for each node.

    The scene's handles are created by the first `show` and reused afterwards.
    """

    def __init__(
        self, scene: viser.SceneApi, name: str, radius: float, opacity: float | None = None
    ) -> None:
        self._scene = scene
        self._name = name
        self._radius = radius
        self._opacity = opacity
        self._count = 0
        self.segments: viser.BatchedMeshHandle | None = None
        """Cylinders of the segments; None before the first nodes."""
        self._nodes: viser.BatchedMeshHandle | None = None
        self._visible = True

    @property
    def visible(self) -> bool:
        """Whether the tube is drawn while it has nodes."""
        return self._visible

    @visible.setter
    def visible(self, value: bool) -> None:
        self._visible = value
        for handle in (self.segments, self._nodes):
            if handle is not None:
                handle.visible = value

    def show(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        colors: Color | UInt8[np.ndarray, "n 3"],
        node_radii: Float64[np.ndarray, "n"] | None = None,
    ) -> None:
        """Draw the chain."""
        radii = np.full(len(nodes), self._radius) if node_radii is None else node_radii
        scales = np.repeat(radii[:, None], 3, axis=1).astype(np.float32)
        colors = np.broadcast_to(np.array(colors, np.uint8), (len(nodes), 3))
        tube = meshes.tube(nodes, self._radius)
        if self.segments is None or self._nodes is None or self._count != len(nodes):
            self._create(nodes, tube, colors, scales)
            return
        self.segments.batched_positions = tube.centres.astype(np.float32)
        self.segments.batched_wxyzs = tube.orientations.astype(np.float32)
        if np.max(np.abs(self.segments.batched_scales - tube.scales)) > MIN_SCALE_CHANGE:
            self.segments.batched_scales = tube.scales.astype(np.float32)
        self._nodes.batched_positions = nodes.astype(np.float32)
        self._nodes.batched_scales = scales
        self.segments.batched_colors = _segment_colors(colors)
        self._nodes.batched_colors = colors
        self.segments.visible = self._nodes.visible = self._visible

    def hide(self) -> None:
        """Draw nothing until the next `show`."""
        for handle in (self.segments, self._nodes):
            if handle is not None:
                handle.visible = False

    def _create(
        self,
        nodes: np.ndarray,
        tube: meshes.Tube,
        colors: UInt8[np.ndarray, "n 3"],
        scales: Float32[np.ndarray, "n 3"],
    ) -> None:
        for handle in (self.segments, self._nodes):
            if handle is not None:
                handle.remove()
        self._count = len(nodes)
        # Without caps: the spheres close the ends, and hidden caps would show through a
        # translucent tube.
        wall = meshes.tube_wall(sides=16)
        sphere = meshes.of_shape("sphere", 1.0, sides=16)
        common = {"opacity": self._opacity, "lod": "off", "visible": self._visible}
        self.segments = self._scene.add_batched_meshes_simple(
            f"{self._name}/segments",
            wall.vertices,
            wall.faces,
            batched_wxyzs=tube.orientations,
            batched_positions=tube.centres,
            batched_scales=tube.scales,
            batched_colors=_segment_colors(colors),
            **common,
        )
        self._nodes = self._scene.add_batched_meshes_simple(
            f"{self._name}/nodes",
            sphere.vertices,
            sphere.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(nodes), 1)),
            batched_positions=nodes,
            batched_scales=scales,
            batched_colors=np.array(colors),
            **common,
        )


def _segment_colors(colors: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n-1 3"]:
    """Mean colour of the two nodes of each segment."""
    return ((colors[:-1].astype(np.uint16) + colors[1:]) // 2).astype(np.uint8)
