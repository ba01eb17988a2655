"""Obstacles in the scene, and regions that the rope is kept in, with their names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
import viser

from dashboard import palette
from dashboard.scene import meshes
from lariat.geometry import poses
from lariat.geometry.cable_routes import clip_openings, legs_of, peg_of
from lariat.geometry.obstacles import Obstacle

HALF_SPACE_SIDE = 1.6
"""Side of the square drawn for a half space [m]."""
LABEL_GAP = 0.015
"""Height of an obstacle's name above its top [m]."""


class ObstacleView:
    """Drawn obstacles by name; only those that changed are drawn anew."""

    def __init__(self, scene: viser.SceneApi, on_click: Callable[[str], None]) -> None:
        self._scene = scene
        self._on_click = on_click
        self._drawn: dict[str, tuple[Obstacle, list[viser.SceneNodeHandle]]] = {}
        self._names_visible = True
        self._clips: dict[str, str] = {}
        """Names of clips by those of their legs."""
        self._marks: tuple[Sequence[str], Collection[str]] = (), ()
        """Route, and clips that hold the cable."""

    def show(self, obstacles: Sequence[Obstacle]) -> None:
        """Draw these obstacles and remove all others."""
        names = {o.name for o in obstacles}
        self._clips = {leg: clip for clip in clip_openings(obstacles) for leg in legs_of(clip)}
        for name in [n for n in self._drawn if n not in names]:
            self._erase(name)
        for obstacle in obstacles:
            drawn = self._drawn.get(obstacle.name)
            if drawn is not None and drawn[0].moved(obstacle.position) == obstacle:
                self._move(drawn[1], drawn[0].position, obstacle)
                self._drawn[obstacle.name] = (obstacle, drawn[1])
            elif drawn is None or drawn[0] != obstacle:
                self._erase(obstacle.name)
                self._drawn[obstacle.name] = (obstacle, self._draw(obstacle))
        self.mark(*self._marks)

    def mark(self, route: Sequence[str], held: Collection[str]) -> None:
        """Number what a route names, and mark the clips that hold the cable."""
        self._marks = route, held
        numbers = {peg_of(entry)[0]: f"{k} " for k, entry in enumerate(route, 1)}
        for name, (obstacle, handles) in self._drawn.items():
            clip = self._clips.get(name, name)
            text = f"{numbers.get(clip, '')}{clip}{' ✓' * (clip in held)}"
            # A clip has the label of its left leg.
            text *= name not in self._clips or name == legs_of(clip)[0]
            color = palette.GOOD if clip in held else _color(obstacle)
            for handle in handles:
                if isinstance(handle, viser.LabelHandle) and handle.text != text:
                    handle.text = text
                elif isinstance(handle, viser.MeshHandle) and tuple(handle.color) != color:
                    handle.color = color

    def show_names(self, visible: bool) -> None:
        """Show or hide the names."""
        self._names_visible = visible
        for _, handles in self._drawn.values():
            for handle in handles:
                if isinstance(handle, viser.LabelHandle):
                    handle.visible = visible

    @staticmethod
    def _move(
        handles: Sequence[viser.SceneNodeHandle],
        former: tuple[float, float, float],
        obstacle: Obstacle,
    ) -> None:
        """Move what is drawn of an obstacle from its former place."""
        if former != obstacle.position:
            for handle in handles:
                handle.position = np.asarray(handle.position) + np.subtract(
                    obstacle.position, former
                )

    def _erase(self, name: str) -> None:
        for handle in self._drawn.pop(name, (None, []))[1]:
            handle.remove()

    def _draw(self, obstacle: Obstacle) -> list[viser.SceneNodeHandle]:
        path = f"/obstacles/{obstacle.name}"
        if obstacle.shape == "half_space":
            return [self._draw_half_space(path, obstacle)]
        place: dict[str, Any] = {"position": obstacle.position, "wxyz": obstacle.orientation}
        if obstacle.keep_in:
            # Seen through, so that it hides nothing of the scene.
            place |= {"wireframe": True, "cast_shadow": False}
        mesh = meshes.of_shape(obstacle.shape, *obstacle.packed_sizes)
        body = self._scene.add_mesh_simple(path, *mesh, color=_color(obstacle), **place)
        name = obstacle.name
        if not obstacle.keep_in:
            body.on_click(lambda _: self._on_click(name))
        label = self._scene.add_label(
            f"/labels/{name}",
            name,
            position=np.add(obstacle.position, (0.0, 0.0, obstacle.top + LABEL_GAP)),
            font_screen_scale=0.8,
            anchor="bottom-center",
            visible=self._names_visible,
        )
        return [body, label]

    def _draw_half_space(self, path: str, obstacle: Obstacle) -> viser.SceneNodeHandle:
        normal = poses.rotate(
            np.array(obstacle.orientation), poses.normalized(np.array(obstacle.normal))
        )
        return self._scene.add_grid(
            path,
            width=HALF_SPACE_SIDE,
            height=HALF_SPACE_SIDE,
            cell_size=0.05,
            section_size=0.25,
            cell_color=palette.GRID,
            section_color=palette.GRID_SECTION,
            plane_color=palette.TABLE,
            plane_opacity=0.85,
            shadow_opacity=0.35,
            position=obstacle.position,
            wxyz=poses.rotation_between(np.array([0.0, 0.0, 1.0]), normal),
        )


def _color(obstacle: Obstacle) -> palette.Color:
    if obstacle.keep_in:
        return palette.REGION
    return palette.SUPPORT if obstacle.support else palette.OBSTACLE
