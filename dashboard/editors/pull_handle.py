"""Handle by which a person pulls the shape of a goal at one of its nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser
from jaxtyping import Float64

from dashboard.action_queue import ActionQueue
from lariat.scenario import Scenario

SCALE = 0.16
"""Size of the gizmo, relative to the rope's length [-]."""
ARRIVED = 0.001
"""Distance from its place below which the node has arrived [m]."""
PROGRESS = 0.0002
"""Least approach of the node between two answers for which the pull goes on [m]."""


class PullHandle:
    """Gizmo at a node of the previewed shape, and the slider that chooses the node.

    While it is dragged, each answer of the controller brings the node nearer to the gizmo;
    afterwards the gizmo goes to where the node has come.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: ActionQueue,
        when_pulled: Callable[[], None],
    ) -> None:
        count = scenario.rope.node_count
        self._when_pulled = when_pulled
        self._nodes: Float64[np.ndarray, "n 3"] = np.zeros((0, 3))
        self._target: Float64[np.ndarray, "3"] | None = None
        self._distance = np.inf
        self._dragged = self._visible = False
        self._gizmo = server.scene.add_transform_controls(
            "/edit/node",
            scale=SCALE * scenario.rope.length,
            line_width=3.0,
            disable_rotations=True,
            depth_test=False,
            visible=False,
        )
        self._slider = server.gui.add_slider(
            "Pull at node",
            1,
            count - 2,
            1,
            count // 2,
            visible=False,
            hint="Node of the shape at which the small handle pulls; the ends give way",
        )
        actions.on_change(self._slider, self._take_node)

        # A coroutine, because threads of a pool could reorder the events of a drag.
        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is None:
                return
            position, phase = np.array(event.target.position), event.phase
            if phase == "update":
                actions.put(lambda: self._take_drag(position))
            else:
                actions.put(lambda: self._set_dragged(phase == "start"))

    @property
    def visible(self) -> bool:
        """Whether slider and gizmo are shown."""
        return self._visible

    @property
    def pull(self) -> tuple[int, Float64[np.ndarray, "3"]] | None:
        """Node and place to which it is pulled [m]; None while it is not."""
        return None if self._target is None else (int(self._slider.value), self._target)

    @property
    def distance(self) -> float:
        """Distance of the node from where it is pulled [m]; 0 while it is not."""
        return 0.0 if self._target is None else self._distance

    def show(self, visible: bool) -> None:
        """Show the slider, and the gizmo with the next shape; or hide both."""
        self._visible = self._slider.visible = visible
        self._gizmo.visible = False
        self._dragged, self._nodes = False, np.zeros((0, 3))
        self.release()

    def release(self) -> None:
        """End the pull, as another change of the goal does."""
        self._target, self._distance = None, np.inf

    def take_shape(self, nodes: Float64[np.ndarray, "n 3"]) -> bool:
        """Take a shape; return whether another answer may bring its node nearer to the pull."""
        self._nodes = nodes
        nearer = False
        if self._target is not None and len(nodes):
            distance = float(np.linalg.norm(nodes[int(self._slider.value)] - self._target))
            nearer = distance > ARRIVED and distance < self._distance - PROGRESS
            self._distance = distance
        if not self._dragged and not nearer:
            self._place()
        return nearer

    def _place(self) -> None:
        """Put the gizmo to its node."""
        self._gizmo.visible = self._visible and len(self._nodes) > 0
        if len(self._nodes):
            self._gizmo.position = self._nodes[int(self._slider.value)]

    def _take_node(self, node: int) -> None:
        del node
        self.release()
        self._place()

    def _take_drag(self, position: Float64[np.ndarray, "3"]) -> None:
        if self._visible:
            self._target, self._distance = position, np.inf
            self._when_pulled()

    def _set_dragged(self, dragged: bool) -> None:
        self._dragged = dragged
        if not dragged and self._target is not None and self._distance <= ARRIVED:
            self._place()
