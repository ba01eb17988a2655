"""Grippers in the scene."""

from __future__ import annotations

import numpy as np
import viser

from dashboard import palette
from dashboard.scene import meshes
from lariat.scenario import SIDES, Scenario, Side

JAW_GAP = 0.0025
"""Distance of the closed jaws' centres from the rope's surface [m]."""
JAW_STROKE = 0.012
"""Travel of each jaw between closed and open [m]."""
JAW_WIDTH, JAW_THICKNESS = 0.012, 0.005
"""Extents of a jaw across the rope [m]."""
MIN_JAW_LENGTH = 0.008
"""Least extent of a jaw along the rope [m]."""
LABEL_GAP = 0.03
"""Distance of the label from the far end of the gripper's axis [m]."""


class GripperView:
    """Gripper of one end: its collision capsule, and two jaws at the clamp."""

    def __init__(self, scene: viser.SceneApi, scenario: Scenario, side: Side) -> None:
        end, limits = scenario.end(side), scenario.limits
        away = -1.0 if side == "left" else 1.0
        fixed = end.driver == "fixed"
        color = palette.QUIET if fixed else palette.BRAND
        pose = scenario.grips(scenario.start)[SIDES.index(side)]
        self._frame = scene.add_frame(
            f"/grippers/{side}", show_axes=False, position=pose.position, wxyz=pose.orientation
        )
        capsule = meshes.of_shape("capsule", limits.gripper_radius, limits.gripper_height / 2.0)
        scene.add_mesh_simple(
            f"/grippers/{side}/body",
            *capsule,
            color=color,
            opacity=0.85,
            position=(0.0, 0.0, away * limits.gripper_height / 2.0),
        )
        rope = scenario.rope
        edge_length = rope.length / (rope.node_count - 1)
        self._closed_offset = rope.diameter / 2.0 + JAW_GAP
        self._jaws = [
            scene.add_box(
                f"/grippers/{side}/jaw{k}",
                color=palette.GRIPPER_JAW,
                dimensions=(JAW_WIDTH, JAW_THICKNESS, max(edge_length, MIN_JAW_LENGTH)),
                position=(0.0, sign * self._closed_offset, -away * edge_length / 2.0),
            )
            for k, sign in enumerate((-1.0, 1.0))
        ]
        self._closed = True
        self._pose: tuple[list[float], list[float]] = ([], [])
        scene.add_label(
            f"/grippers/{side}/name",
            f"{side} (fixed)" if fixed else f"{side} · {end.driver}",
            position=(0.0, 0.0, away * (limits.gripper_height + LABEL_GAP)),
            font_screen_scale=0.8,
            anchor="center-center",
        )

    def update(self, position: list[float], orientation: list[float], closed: bool) -> None:
        """Move the gripper and its jaws."""
        shown_position, shown_orientation = self._pose
        if position != shown_position:
            self._frame.position = np.array(position)
        if orientation != shown_orientation:
            self._frame.wxyz = np.array(orientation)
        self._pose = position, orientation
        if closed != self._closed:
            self._closed = closed
            for jaw, sign in zip(self._jaws, (-1.0, 1.0), strict=True):
                x, _, z = jaw.position
                stroke = 0.0 if closed else JAW_STROKE
                jaw.position = (x, sign * (self._closed_offset + stroke), z)
