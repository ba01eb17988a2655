"""Obstacle editor: additions, moves and removals, requested from perception."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import get_args

import numpy as np
import viser
from jaxtyping import Float64

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.outbox import Notification, Outbox
from lariat.geometry import poses
from lariat.geometry.cable_routes import ClipOpening, clip_openings, legs_of
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Scenario
from lariat.shapes import SHAPES, SolidName
from shared.messages import SceneRequest, obstacle_message

NO_SELECTION = "–"
"""Entry of the drop-down list while no obstacle is selected."""
SOLIDS: tuple[SolidName, ...] = get_args(SolidName)
"""Shapes that can be added; half spaces (walls) belong in the scenario."""
DUPLICATE_GAP = 0.02
"""Gap between an obstacle and its copy [m]."""
MAX_UNDONE = 50
"""Largest number of changes that can be taken back [-]."""
GIZMO_SCALE = 0.22
"""Size of the gizmo, relative to the rope's length [-]."""


_Position = tuple[float, float, float]
_Orientation = tuple[float, float, float, float]
_Undo = tuple[SceneRequest.Action, tuple[Obstacle, ...]]
"""Request that takes a change back."""


class ObstacleEditor:
    """Gizmo and field of the selected obstacle, and a form for a new one."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        notify: Callable[[Notification], None],
    ) -> None:
        self._outbox = outbox
        self._notify = notify
        self._actions = actions
        self._own = {o.name for o in scenario.bodies}
        """Obstacles of the scenario, which stay and keep their size."""
        self._obstacles: dict[str, Obstacle] = {}
        self._clips: dict[str, ClipOpening] = {}
        """Clips, whose legs are moved together."""
        self._selected = ""
        self._added = ""
        """Obstacle that this page has added, until the scene has it."""
        self._gizmo = server.scene.add_transform_controls(
            "/edit/obstacle",
            scale=GIZMO_SCALE * scenario.rope.length,
            line_width=3.0,
            depth_test=False,
            visible=False,
        )

        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None and event.phase in ("update", "end"):
                pose = tuple(event.target.position.tolist()), tuple(event.target.wxyz.tolist())
                ended = event.phase == "end"
                actions.put(lambda: self._take_drag(*pose, ended))

        gui = server.gui
        self._selection = gui.add_dropdown(
            "Selected", (NO_SELECTION,), hint="Or click an obstacle in the 3-D view"
        )
        actions.on_change(self._selection, self.select)
        self._centre_field = gui.add_vector3(
            "Centre [mm]", (0.0, 0.0, 0.0), step=1.0, visible=False
        )
        actions.on_change(self._centre_field, self._take_field)
        self._size_field = gui.add_vector3(
            "Size [mm]",
            (1.0, 1.0, 1.0),
            min=(1.0, 1.0, 1.0),
            step=1.0,
            visible=False,
            hint="Extents along its x, y, z; a round shape's diameter is its extent along x",
        )
        actions.on_change(self._size_field, self._take_size)
        self._remove = gui.add_button(
            "Remove", icon=viser.Icon.TRASH, color=palette.NEUTRAL, visible=False
        )
        self._remove.on_click(lambda _: actions.put(self._request_removal))
        self._duplicate = gui.add_button(
            "Duplicate", icon=viser.Icon.COPY, color=palette.NEUTRAL, visible=False
        )
        self._duplicate.on_click(lambda _: actions.put(self._request_duplicate))
        self._past: list[_Undo] = []
        self._undo = gui.add_button(
            "Undo obstacle",
            icon=viser.Icon.ARROW_BACK_UP,
            color=palette.NEUTRAL,
            visible=False,
            hint="Take back the last change that was made on this page",
        )
        self._undo.on_click(lambda _: actions.put(self._request_undo))
        with gui.add_folder("New obstacle", expand_by_default=False):
            self._new_shape = gui.add_dropdown("Shape", SOLIDS)
            self._new_size = gui.add_vector3(
                "Size [mm]",
                (60.0, 60.0, 100.0),
                min=(1.0, 1.0, 1.0),
                step=1.0,
                hint="Extents along x, y, z; the diameter of a round shape is its extent along x",
            )
            self._new_centre = gui.add_vector3("Centre [mm]", (0.0, -250.0, 50.0), step=1.0)
            self._new_support = gui.add_checkbox(
                "Rope may rest on it", False, hint="A support: no clearance is kept from it"
            )
            add = gui.add_button("Add", icon=viser.Icon.PLUS, color=palette.BRAND)
            add.on_click(lambda _: actions.put(self._request_addition))

    def queue_selection(self, name: str) -> None:
        """Queue the selection of an obstacle by name; may be called in any thread."""
        self._actions.put(lambda: self.select(name))

    def update(self, obstacles: Sequence[Obstacle]) -> None:
        """Take the obstacles of the scene; keep the selection, or select what was added."""
        self._obstacles = {o.name: o for o in obstacles if o.shape != "half_space"}
        self._clips = clip_openings(obstacles)
        legs = {leg for clip in self._clips for leg in legs_of(clip)}
        options = (NO_SELECTION, *(n for n in self._obstacles if n not in legs), *self._clips)
        if tuple(self._selection.options) != options:
            self._selection.options = options  # pyright: ignore[reportAttributeAccessIssue]
        if self._added in self._obstacles:
            self._selected, self._added = self._added, ""
        self.select(self._selected)

    def select(self, name: str) -> None:
        """Select an obstacle or a clip, also by a leg of it; deselect where there is none."""
        name = next((clip for clip in self._clips if name in legs_of(clip)), name)
        obstacle = self._obstacles.get(name)
        self._selected = name if obstacle is not None or name in self._clips else ""
        self._selection.value = self._selected or NO_SELECTION  # pyright: ignore[reportAttributeAccessIssue]
        for handle in (self._gizmo, self._centre_field):
            handle.visible = bool(self._selected)
        self._duplicate.visible = obstacle is not None
        for handle in (self._size_field, self._remove):
            handle.visible = obstacle is not None and name not in self._own
        if self._selected:
            position, orientation = self._pose
            self._gizmo.position, self._gizmo.wxyz = position, orientation
            self._centre_field.value = tuple(np.round(1e3 * np.array(position), 1).tolist())
        if obstacle is not None:
            self._size_field.value = tuple(np.round(1e3 * extents(obstacle), 1).tolist())

    @property
    def _pose(self) -> tuple[_Position, _Orientation]:
        """Pose of the selected obstacle or clip."""
        if (clip := self._clips.get(self._selected)) is None:
            obstacle = self._obstacles[self._selected]
            return obstacle.position, obstacle.orientation
        heading = np.arctan2(clip.along[1], clip.along[0])
        orientation = poses.exponential(np.array([0.0, 0.0, heading]))
        return tuple(clip.foot.tolist()), tuple(orientation.tolist())

    def _take_drag(
        self,
        position: _Position,
        orientation: _Orientation,
        ended: bool,
    ) -> None:
        self._centre_field.value = tuple(np.round(1e3 * np.array(position), 1).tolist())
        if ended:
            self._request_move(position, orientation)

    def _take_field(self, value: tuple[float, float, float]) -> None:
        position = tuple((np.array(value, float) / 1e3).tolist())
        if self._selected and np.all(np.isfinite(position)):
            self._gizmo.position = position
            self._request_move(position, self._pose[1])

    def _request_move(
        self,
        position: _Position,
        orientation: _Orientation,
    ) -> None:
        if not (name := self._selected):
            return
        if name not in self._clips:
            bodies = (self._obstacles[name],)
            moved = (bodies[0].moved(position, orientation),)
        else:
            # A clip stays upright: it is turned about the vertical alone.
            centre, former = (np.array(part) for part in self._pose)
            forward = poses.rotate(np.array(orientation), np.array([1.0, 0.0, 0.0]))
            yaw = np.array([0.0, 0.0, np.arctan2(forward[1], forward[0])])
            turn = poses.multiply(poses.exponential(yaw), poses.conjugate(former))
            bodies = tuple(self._obstacles[leg] for leg in legs_of(name))
            offsets = (poses.rotate(turn, np.array(leg.position) - centre) for leg in bodies)
            places = (tuple((np.array(position) + offset).tolist()) for offset in offsets)
            moved = tuple(leg.moved(at) for leg, at in zip(bodies, places, strict=True))
        self._request(SceneRequest.MOVE, moved, "Move", (SceneRequest.MOVE, bodies))

    def _take_size(self, value: tuple[float, float, float]) -> None:
        obstacle = self._obstacles.get(self._selected)
        size = np.array(value, float) / 1e3
        if obstacle is None or not (np.all(np.isfinite(size)) and np.all(size > 0.0)):
            return
        shaped = new_obstacle(obstacle.shape, size, obstacle.position)
        resized = replace(obstacle, radius=shaped.radius, height=shaped.height, size=shaped.size)
        self._request(SceneRequest.RESIZE, (resized,), "Resize", (SceneRequest.RESIZE, (obstacle,)))

    def _request_removal(self) -> None:
        obstacle = self._obstacles.get(self._selected)
        if obstacle is not None:
            undo = SceneRequest.ADD, (obstacle,)
            self._request(SceneRequest.REMOVE, (obstacle,), "Remove", undo)

    def _request_duplicate(self) -> None:
        obstacle = self._obstacles.get(self._selected)
        if obstacle is not None:
            copy = duplicate(obstacle, self._obstacles)
            self._request(SceneRequest.ADD, (copy,), "Add", (SceneRequest.REMOVE, (copy,)))

    def _request(
        self, action: SceneRequest.Action, bodies: tuple[Obstacle, ...], word: str, undo: _Undo
    ) -> None:
        for body in bodies:
            self._outbox.request_scene(action, obstacle_message(body), f"{word} {body.name}")
        self._added = bodies[0].name if action == SceneRequest.ADD else ""
        self._past = [*self._past, undo][-MAX_UNDONE:]
        self._undo.visible = True

    def _request_undo(self) -> None:
        if self._past:
            action, bodies = self._past.pop()
            for body in bodies:
                self._outbox.request_scene(action, obstacle_message(body), f"Undo {body.name}")
        self._undo.visible = bool(self._past)

    def _request_addition(self) -> None:
        size = np.array(self._new_size.value, float) / 1e3
        centre = np.array(self._new_centre.value, float) / 1e3
        if not (np.all(np.isfinite(size)) and np.all(size > 0.0) and np.all(np.isfinite(centre))):
            self._notify(
                Notification("Add: not sent", "The size must be positive, all numbers finite.")
            )
            return
        shape = self._new_shape.value
        obstacle = new_obstacle(shape, size, tuple(centre.tolist()), self._obstacles)
        obstacle = replace(obstacle, support=bool(self._new_support.value))
        self._request(SceneRequest.ADD, (obstacle,), "Add", (SceneRequest.REMOVE, (obstacle,)))


def duplicate(obstacle: Obstacle, names: Collection[str]) -> Obstacle:
    """Return a copy of an obstacle beside it along y, under a free name."""
    base = obstacle.name.partition("-copy-")[0]
    name = next(c for k in range(1, len(names) + 2) if (c := f"{base}-copy-{k}") not in names)
    width = extents(obstacle)[1]
    x, y, z = obstacle.position
    return replace(obstacle, name=name, position=(x, y - DUPLICATE_GAP - width, z))


def extents(obstacle: Obstacle) -> Float64[np.ndarray, "3"]:
    """Return the extents of an obstacle along its x, y and z [m], as `new_obstacle` takes them."""
    return 2.0 * obstacle.row.support(obstacle.packed_sizes, np.eye(3))


def new_obstacle(
    shape: str,
    size: np.ndarray,
    position: tuple[float, float, float],
    names: Collection[str] = (),
) -> Obstacle:
    """Create an obstacle that fills a box as well as its shape can, under a free name."""
    candidates = (f"{shape}-new-{k}" for k in range(1, len(names) + 2))
    name = next(c for c in candidates if c not in names)
    if shape not in SOLIDS:
        raise ValueError(f"shape must be one of {SOLIDS}, got {shape!r}")
    row = SHAPES[shape]
    fields = row.unpack(row.filling(*(float(s) for s in size)))
    return Obstacle(shape, position, name=name, **fields)
