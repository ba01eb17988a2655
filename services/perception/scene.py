"""What surrounds the rope: the scenario's bodies and every change that was allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from shared.scenario import Event

FARTHEST = 20.0
"""Obstacles live within this distance of the origin, along each axis [m]."""
LARGEST = 20.0
"""[m]."""
NEEDED = {
    "cylinder": ("radius", "height"),
    "capsule": ("radius", "height"),
    "sphere": ("radius",),
    "box": ("size",),
    "half_space": (),
}


class Refused(ValueError):
    """A change that cannot be; its text says why and what would be allowed."""


class Surroundings:
    """Owns the obstacles; its revision grows with every change."""

    def __init__(self, bodies: Sequence[Obstacle], events: Sequence[Event], radius: float) -> None:
        """
        Args:
            bodies: At the start.
            events: Timed changes of a run.
            radius: Of the rope [m].
        """
        self._start = tuple(bodies)
        self._events = [e for e in events if e.goal is None]
        self._radius = radius
        self._happened: set[int] = set()
        self._run_started = 0
        self.obstacles: tuple[Obstacle, ...] = self._start
        self.revision = 1

    def reset(self) -> None:
        """Back to the start."""
        self._happened.clear()
        self._set(self._start)

    def add(self, obstacle: Obstacle, rope: Float64[np.ndarray, "n 3"] | None = None) -> None:
        """One more; refused when it is no body, or lies on the rope."""
        self._check_body(obstacle)
        if any(o.name == obstacle.name for o in self.obstacles):
            raise Refused(f"there is an obstacle {obstacle.name!r} already; choose another name")
        self._check_rope(obstacle, rope)
        self._set((*self.obstacles, obstacle))

    def move(
        self,
        name: str,
        position: Sequence[float],
        orientation: Sequence[float] = (),
        rope: Float64[np.ndarray, "n 3"] | None = None,
    ) -> None:
        """The same body elsewhere; without an orientation it keeps its own."""
        old = self._named(name)
        moved = replace(
            old,
            position=tuple(position),
            orientation=tuple(orientation) if len(orientation) else old.orientation,
        )
        self._check_body(moved)
        self._check_rope(moved, rope)
        self._set(tuple(moved if o.name == name else o for o in self.obstacles))

    def remove(self, name: str) -> None:
        """One less."""
        old = self._named(name)
        self._set(tuple(o for o in self.obstacles if o is not old))

    def follow_run(self, run_started: int, now: int) -> list[str]:
        """Lets the events happen that are due; what was refused comes back in words.

        Args:
            run_started: Start of the current run [ns]; 0 before the first.
            now: [ns].
        """
        if run_started != self._run_started:
            self._run_started = run_started
            self._happened.clear()
        refused = []
        for index, event in enumerate(self._events):
            due = run_started > 0 and (now - run_started) / 1e9 >= event.time
            if due and index not in self._happened:
                self._happened.add(index)
                try:
                    self._happen(event, index)
                except Refused as refusal:
                    refused.append(f"event at {event.time} s: {refusal}")
        return refused

    def _happen(self, event: Event, index: int) -> None:
        if event.add_obstacle is not None:
            # Numbered on from the scenario's own.
            self.add(event.add_obstacle.body(len(self._start) + index))
        elif event.move_obstacle and event.position is not None:
            self.move(event.move_obstacle, event.position)
        else:
            self.remove(event.remove_obstacle)

    def _set(self, obstacles: tuple[Obstacle, ...]) -> None:
        self.obstacles = obstacles
        self.revision += 1

    def _named(self, name: str) -> Obstacle:
        for obstacle in self.obstacles:
            if obstacle.name == name:
                return obstacle
        known = ", ".join(sorted(o.name for o in self.obstacles)) or "none"
        raise Refused(f"there is no obstacle {name!r}; there are: {known}")

    def _check_body(self, o: Obstacle) -> None:
        if not o.name:
            raise Refused("an obstacle needs a name; give it one")
        if o.shape not in NEEDED:
            raise Refused(f"{o.name!r} has shape {o.shape!r}; use one of {', '.join(NEEDED)}")
        numbers = (*o.position, *o.orientation, *o.size, *o.normal, o.radius, o.height)
        if not all(map(math.isfinite, numbers)):
            raise Refused(f"{o.name!r} holds a number that is not finite")
        if max(map(abs, o.position)) > FARTHEST:
            raise Refused(
                f"{o.name!r} is at {list(o.position)} m, more than {FARTHEST} m away; "
                "positions are in metres"
            )
        for key in NEEDED[o.shape]:
            value = getattr(o, key)
            sizes = value if isinstance(value, tuple) else (value,)
            if min(sizes) <= 0.0 or max(sizes) > LARGEST:
                raise Refused(
                    f"{o.name!r} has {key} = {value}; a {o.shape} takes 0 < {key} <= {LARGEST} m"
                )
        for key in ("orientation", "normal"):
            if np.linalg.norm(getattr(o, key)) < 1e-6:
                raise Refused(f"{o.name!r} has {key} = {getattr(o, key)}; it must not be zero")
        if abs(np.linalg.norm(o.orientation) - 1.0) > 1e-3:
            unit = poses.normalized(np.array(o.orientation)).round(4).tolist()
            raise Refused(
                f"{o.name!r} has orientation {o.orientation}, which is no unit quaternion; "
                f"try {unit}"
            )

    def _check_rope(self, o: Obstacle, rope: Float64[np.ndarray, "n 3"] | None) -> None:
        if rope is None or len(rope) < 2:
            return
        overlap = -geometry.chain_clearance(rope, self._radius, [o])
        # Two millimetres: what an estimate of a touching rope may be off.
        if overlap > 0.002:
            raise Refused(
                f"{o.name!r} would overlap the rope by {1e3 * overlap:.1f} mm; place it elsewhere"
            )
