"""Scene requests and the scene state as messages."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.perception.scene import SceneChangeRefused, SceneOwner
from shared import topics
from shared.door import Door
from shared.messages import Scene, SceneRequest, obstacle_message, scene_obstacles


class SceneRequests:
    """Applies requests to a scene, and creates its message with the answer to the last request."""

    def __init__(self, scene: SceneOwner, door: Door) -> None:
        self._scene, self._door = scene, door
        self._last_request = ""
        self._refusal = ""

    def handle(self, request: SceneRequest, rope: Float64[np.ndarray, "n 3"] | None) -> None:
        """Apply a request, or keep why it is refused; obstacles must not overlap a known rope."""
        with self._door.guard(topics.SCENE_REQUEST.key) as outcome:
            self._apply(request, rope)
        self._last_request, self._refusal = request.id, outcome.refusal

    def state(self, now: int) -> Scene:
        """Return the message of the scene at a time [ns]."""
        return Scene(
            stamp=now,
            revision=self._scene.revision,
            obstacles=[obstacle_message(o) for o in self._scene.obstacles],
            last_request=self._last_request,
            refusal=self._refusal,
        )

    def _apply(self, request: SceneRequest, rope: Float64[np.ndarray, "n 3"] | None) -> None:
        match request.action:
            case SceneRequest.ADD:
                (obstacle,) = scene_obstacles(Scene(obstacles=[request.obstacle]))
                self._scene.add(obstacle, rope)
            case SceneRequest.MOVE:
                o = request.obstacle
                if len(o.position) != 3 or len(o.orientation) not in (0, 4):
                    raise SceneChangeRefused(
                        f"moving {o.name!r} takes a position of 3 numbers and an orientation "
                        f"of 4 or none, got {list(o.position)} and {list(o.orientation)}"
                    )
                self._scene.move(o.name, o.position, o.orientation, rope)
            case SceneRequest.RESIZE:
                (obstacle,) = scene_obstacles(Scene(obstacles=[request.obstacle]))
                self._scene.resize(obstacle, rope)
            case SceneRequest.REMOVE:
                self._scene.remove(request.obstacle.name)
            case unknown:
                actions = "ADD, MOVE, RESIZE or REMOVE"
                raise SceneChangeRefused(f"there is no action {unknown}; use {actions}")
