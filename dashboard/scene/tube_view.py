"""A chain of nodes drawn as a tube."""

from __future__ import annotations

import numpy as np
import viser
from jaxtyping import Float64, UInt8

from dashboard.palette import Color
from dashboard.scene import meshes


class TubeView:
    """One rope in the scene: a cylinder for each segment and a sphere for each node.

    The handles are made at the first showing and then only assigned.
    """

    def __init__(
        self, scene: viser.SceneApi, name: str, radius: float, opacity: float | None = None
    ) -> None:
        """Args:
        radius: Drawn radius [m].
        opacity: Of the whole tube, None for a solid one.
        """
        self._scene = scene
        self._name = name
        self._radius = radius
        self._opacity = opacity
        self._count = 0
        self._segments: viser.BatchedMeshHandle | None = None
        self._joints: viser.BatchedMeshHandle | None = None
        self._visible = True

    @property
    def visible(self) -> bool:
        """Whether a person wants to see it."""
        return self._visible

    @visible.setter
    def visible(self, value: bool) -> None:
        self._visible = value
        for handle in (self._segments, self._joints):
            if handle is not None:
                handle.visible = value

    def show(
        self, nodes: Float64[np.ndarray, "n 3"], colors: Color | UInt8[np.ndarray, "n 3"]
    ) -> None:
        """Draws the chain [m], coloured as a whole or node by node."""
        colors = np.broadcast_to(np.array(colors, np.uint8), (len(nodes), 3))
        pieces = meshes.tube(nodes, self._radius)
        if self._segments is None or self._joints is None or self._count != len(nodes):
            self._create(nodes, pieces, colors)
            return
        self._segments.batched_positions = pieces.centres.astype(np.float32)
        self._segments.batched_wxyzs = pieces.orientations.astype(np.float32)
        self._segments.batched_scales = pieces.scales.astype(np.float32)
        self._joints.batched_positions = nodes.astype(np.float32)
        for handle, own in ((self._segments, _between(colors)), (self._joints, colors)):
            if not np.array_equal(handle.batched_colors, own):
                handle.batched_colors = own
            if handle.visible != self._visible:
                handle.visible = self._visible

    def hide(self) -> None:
        """Draws nothing until the next `show`."""
        for handle in (self._segments, self._joints):
            if handle is not None and handle.visible:
                handle.visible = False

    def _create(
        self, nodes: np.ndarray, pieces: meshes.Tube, colors: UInt8[np.ndarray, "n 3"]
    ) -> None:
        for handle in (self._segments, self._joints):
            if handle is not None:
                handle.remove()
        self._count = len(nodes)
        # Open at both ends: the spheres close it, and hidden caps would shine through a
        # translucent tube.
        wall = meshes.lathe(np.array([[1.0, -0.5], [1.0, 0.5]]), sides=16)
        ball = meshes.capsule(1.0, 0.0, sides=16)
        common = {"opacity": self._opacity, "lod": "off", "visible": self._visible}
        self._segments = self._scene.add_batched_meshes_simple(
            f"{self._name}/segments",
            wall.vertices,
            wall.faces,
            batched_wxyzs=pieces.orientations,
            batched_positions=pieces.centres,
            batched_scales=pieces.scales,
            batched_colors=_between(colors),
            **common,
        )
        self._joints = self._scene.add_batched_meshes_simple(
            f"{self._name}/joints",
            ball.vertices,
            ball.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(nodes), 1)),
            batched_positions=nodes,
            batched_scales=np.full((len(nodes), 3), self._radius),
            batched_colors=np.array(colors),
            **common,
        )


def _between(colors: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n-1 3"]:
    """Colours of the segments between coloured nodes."""
    return ((colors[:-1].astype(np.uint16) + colors[1:]) // 2).astype(np.uint8)
