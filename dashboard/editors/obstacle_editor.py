"""Adding, moving and removing obstacles; perception decides and answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import viser

from dashboard import palette
from dashboard.action_queue import Actions
from dashboard.outbox import Complaint, Outbox
from lariat.geometry.obstacles import Obstacle
from shared.messages import SceneRequest, obstacle_message
from shared.scenario import Scenario

NOTHING = "–"
SHAPES = ("cylinder", "box", "sphere", "capsule")
"""What can be added here; a half space is a wall, and walls belong into the scenario."""


class ObstacleEditor:
    """One selected body with a gizmo, and a form for a new one."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: Actions,
        outbox: Outbox,
        complain: Callable[[Complaint], None],
    ) -> None:
        self._outbox = outbox
        self._complain = complain
        self._actions = actions
        self._bodies: dict[str, Obstacle] = {}
        self._selected = ""
        self._gizmo = server.scene.add_transform_controls(
            "/edit/obstacle",
            scale=0.22 * scenario.rope.length,
            line_width=3.0,
            depth_test=False,
            visible=False,
        )

        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None and event.phase in ("update", "end"):
                place = tuple(event.target.position.tolist()), tuple(event.target.wxyz.tolist())
                ended = event.phase == "end"
                actions.put(lambda: self._dragged(*place, ended))

        gui = server.gui
        self._choice = gui.add_dropdown(
            "Selected", (NOTHING,), hint="Or click an obstacle in the 3-D view"
        )
        self._choice.on_update(
            lambda event: (
                event.client is not None
                and actions.put(lambda name=event.target.value: self.select(name))
            )
        )
        self._position = gui.add_vector3("Centre [mm]", (0.0, 0.0, 0.0), step=1.0, visible=False)
        self._position.on_update(
            lambda event: (
                event.client is not None
                and actions.put(lambda value=event.target.value: self._typed(value))
            )
        )
        self._remove = gui.add_button(
            "Remove", icon=viser.Icon.TRASH, color=palette.NEUTRAL, visible=False
        )
        self._remove.on_click(lambda _: actions.put(self._send_remove))
        with gui.add_folder("New obstacle", expand_by_default=False):
            self._shape = gui.add_dropdown("Shape", SHAPES)
            self._size = gui.add_vector3(
                "Size [mm]",
                (60.0, 60.0, 100.0),
                min=(1.0, 1.0, 1.0),
                step=1.0,
                hint="Extents along x, y, z; round bodies take their diameter from x",
            )
            self._center = gui.add_vector3("At [mm]", (0.0, -250.0, 50.0), step=1.0)
            self._support = gui.add_checkbox(
                "Rope may lean on it", False, hint="A support is no obstacle to keep away from"
            )
            add = gui.add_button("Add", icon=viser.Icon.PLUS, color=palette.BRAND)
            add.on_click(lambda _: actions.put(self._send_add))

    def clicked(self, name: str) -> None:
        """A body was clicked in the scene; called in a thread of the server."""
        self._actions.put(lambda: self.select(name))

    def update(self, obstacles: Sequence[Obstacle]) -> None:
        """Takes the scene as perception publishes it."""
        self._bodies = {o.name: o for o in obstacles if o.shape != "half_space"}
        options = (NOTHING, *self._bodies)
        if tuple(self._choice.options) != options:
            self._choice.options = options
        self.select(self._selected if self._selected in self._bodies else NOTHING)

    def select(self, name: str) -> None:
        """Puts the gizmo to a body, or away."""
        body = self._bodies.get(name)
        self._selected = name if body is not None else ""
        self._choice.value = self._selected or NOTHING
        for handle in (self._gizmo, self._position, self._remove):
            handle.visible = body is not None
        if body is not None:
            self._gizmo.position, self._gizmo.wxyz = body.position, body.orientation
            self._position.value = tuple(np.round(1e3 * np.array(body.position), 1).tolist())

    def _dragged(
        self,
        position: tuple[float, float, float],
        orientation: tuple[float, float, float, float],
        ended: bool,
    ) -> None:
        self._position.value = tuple(np.round(1e3 * np.array(position), 1).tolist())
        if ended:
            self._send_move(position, orientation)

    def _typed(self, value: tuple[float, float, float]) -> None:
        body = self._bodies.get(self._selected)
        position = tuple((np.array(value, float) / 1e3).tolist())
        if body is not None and np.all(np.isfinite(position)):
            self._gizmo.position = position
            self._send_move(position, body.orientation)

    def _send_move(
        self,
        position: tuple[float, float, float],
        orientation: tuple[float, float, float, float],
    ) -> None:
        body = self._bodies.get(self._selected)
        if body is not None:
            message = obstacle_message(body.moved(position, orientation))
            self._outbox.scene(SceneRequest.MOVE, message, f"Move {body.name}")

    def _send_remove(self) -> None:
        body = self._bodies.get(self._selected)
        if body is not None:
            message = obstacle_message(body)
            self._outbox.scene(SceneRequest.REMOVE, message, f"Remove {body.name}")

    def _send_add(self) -> None:
        size = np.array(self._size.value, float) / 1e3
        center = np.array(self._center.value, float) / 1e3
        if not (np.all(np.isfinite(size)) and np.all(size > 0.0) and np.all(np.isfinite(center))):
            self._complain(Complaint("Add: not sent", "Sizes must be positive numbers."))
            return
        shape = self._shape.value
        body = new_obstacle(shape, size, tuple(center.tolist()), self._bodies)
        body = Obstacle(**{**vars(body), "support": bool(self._support.value)})
        self._outbox.scene(SceneRequest.ADD, obstacle_message(body), f"Add {body.name}")


def new_obstacle(
    shape: str,
    size: np.ndarray,
    position: tuple[float, float, float],
    names: Sequence[str] | dict[str, Obstacle] = (),
) -> Obstacle:
    """A body that fills a box of extents `size` [m] as well as its shape can.

    Args:
        names: Taken already.
    """
    number = next(k for k in range(1, len(names) + 2) if f"{shape}-new-{k}" not in names)
    name = f"{shape}-new-{number}"
    x, y, z = (float(s) for s in size)
    match shape:
        case "box":
            return Obstacle("box", position, size=(x, y, z), name=name)
        case "sphere":
            return Obstacle("sphere", position, radius=x / 2.0, name=name)
        case "cylinder":
            return Obstacle("cylinder", position, radius=x / 2.0, height=z, name=name)
        case "capsule":
            # The height of a capsule lies between the centres of its caps.
            return Obstacle("capsule", position, radius=x / 2.0, height=max(z - x, 1e-3), name=name)
    raise ValueError(f"shape must be one of {SHAPES}, got {shape!r}")
