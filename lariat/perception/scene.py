"""Obstacles around the rope: those of the scenario and every accepted change."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry.obstacle_checks import check_obstacle
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Event

MAX_ROPE_OVERLAP = 0.002
"""Overlap with the rope up to which an obstacle is accepted [m]; a touching rope may overlap it by
the error of its estimate."""


class SceneChangeRefused(ValueError):
    """A change of the scene is invalid; the message says why and what would be accepted."""


class SceneOwner:
    """Owner of the obstacles; its revision grows with every change."""

    def __init__(
        self,
        bodies: Sequence[Obstacle],
        events: Sequence[Event],
        radius: float,
        moving: Collection[str] = (),
    ) -> None:
        """
        Args:
            bodies: Obstacles at the start.
            events: Timed changes of a run; those of the goal are ignored.
            radius: Radius of the rope [m].
            moving: Names of the obstacles that move along paths of their own.
        """
        self._moving = moving
        self._start = tuple(bodies)
        self._events = [e for e in events if e.goal is None]
        self._radius = radius
        self._applied: set[int] = set()
        self._run_started = 0
        self._requested: tuple[Obstacle, ...] = self._start
        """Obstacles without the changes that events have made."""
        self.obstacles: tuple[Obstacle, ...] = self._start
        self.revision = 1

    def reset(self) -> None:
        """Undo the changes that events have made; those that people asked for remain."""
        self._applied.clear()
        self._set(self._requested)

    def restore(self) -> None:
        """Restore the obstacles of the start."""
        self._requested = self._start
        self.reset()

    def add(self, obstacle: Obstacle, rope: Float64[np.ndarray, "n 3"] | None = None) -> None:
        """Add an obstacle.

        Args:
            obstacle: The new obstacle.
            rope: Nodes of the rope, which it must not overlap [m]; None when they are unknown.

        Raises:
            SceneChangeRefused: The obstacle is invalid, its name is taken, or it overlaps the rope.
        """
        self._check_new(obstacle)
        self._check_rope(obstacle, rope)
        self._set((*self.obstacles, obstacle))
        self._requested = (*self._requested, obstacle)

    def move(
        self,
        name: str,
        position: Sequence[float],
        orientation: Sequence[float] = (),
        rope: Float64[np.ndarray, "n 3"] | None = None,
    ) -> None:
        """Move an obstacle; without an orientation it keeps its own.

        Raises:
            SceneChangeRefused: There is no such obstacle, its new pose is invalid, or it would
                overlap the rope.
        """
        moved = self._moved(name, position, orientation)
        self._check_rope(moved, rope)
        self._set(_replaced(self.obstacles, moved))
        self._requested = _replaced(self._requested, moved)

    def remove(self, name: str) -> None:
        """Remove an obstacle that a request has added.

        Raises:
            SceneChangeRefused: There is no such obstacle, or it belongs to the scenario.
        """
        if any(body.name == name for body in self._start):
            raise SceneChangeRefused(
                f"{name!r} belongs to the scenario and stays; move it, or remove it from the file"
            )
        old = self._named(name)
        self._set(tuple(o for o in self.obstacles if o is not old))
        self._requested = tuple(o for o in self._requested if o.name != name)

    def resize(self, request: Obstacle, rope: Float64[np.ndarray, "n 3"] | None = None) -> None:
        """Give an obstacle that a request has added another size, at its place.

        Args:
            request: Obstacle of the same name, of which radius, height and size count.
            rope: Nodes of the rope, which it must not overlap [m]; None when they are unknown.

        Raises:
            SceneChangeRefused: There is no such obstacle, it belongs to the scenario, its new size
                is invalid, or it would overlap the rope.
        """
        old = self._named(request.name)
        if any(body.name == request.name for body in self._start):
            raise SceneChangeRefused(
                f"{request.name!r} belongs to the scenario and keeps its size; add another "
                "obstacle, or change the file"
            )
        resized = replace(old, radius=request.radius, height=request.height, size=request.size)
        _check(resized)
        self._check_rope(resized, rope)
        self._set(_replaced(self.obstacles, resized))
        self._requested = _replaced(self._requested, resized)

    def follow_run(self, run_started: int, now: int) -> list[str]:
        """Apply the events that are due and return the reasons of those that were refused.

        Args:
            run_started: Start of the current run [ns]; 0 before the first.
            now: Current time [ns].
        """
        if run_started != self._run_started:
            self._run_started = run_started
            self._applied.clear()
        refused = []
        for index, event in enumerate(self._events):
            due = run_started > 0 and (now - run_started) / 1e9 >= event.time
            if due and index not in self._applied:
                self._applied.add(index)
                try:
                    self._apply_event(event, index)
                except SceneChangeRefused as refusal:
                    refused.append(f"event at {event.time} s: {refusal}")
        return refused

    def _apply_event(self, event: Event, index: int) -> None:
        if event.add_obstacle is not None:
            # Default names continue the numbering of the scenario's obstacles.
            added = event.add_obstacle.body(len(self._start) + index)
            self._check_new(added)
            self._set((*self.obstacles, added))
        elif event.move_obstacle and event.position is not None:
            self._set(_replaced(self.obstacles, self._moved(event.move_obstacle, event.position)))
        else:
            removed = self._named(event.remove_obstacle)
            self._set(tuple(o for o in self.obstacles if o is not removed))

    def _set(self, obstacles: tuple[Obstacle, ...]) -> None:
        self.obstacles = obstacles
        self.revision += 1

    def _check_new(self, obstacle: Obstacle) -> None:
        _check(obstacle)
        if any(o.name == obstacle.name for o in self.obstacles):
            raise SceneChangeRefused(
                f"there already is an obstacle {obstacle.name!r}; choose another name"
            )

    def _moved(
        self, name: str, position: Sequence[float], orientation: Sequence[float] = ()
    ) -> Obstacle:
        old = self._named(name)
        if name in self._moving:
            raise SceneChangeRefused(
                f"{name!r} moves along its path; change `path` in the scenario, or move another"
            )
        turned = tuple(orientation) if len(orientation) else old.orientation
        moved = replace(old, position=tuple(position), orientation=turned)
        _check(moved)
        return moved

    def _named(self, name: str) -> Obstacle:
        for obstacle in self.obstacles:
            if obstacle.name == name:
                return obstacle
        names = ", ".join(sorted(o.name for o in self.obstacles)) or "none"
        raise SceneChangeRefused(f"there is no obstacle {name!r}; there are: {names}")

    def _check_rope(self, o: Obstacle, rope: Float64[np.ndarray, "n 3"] | None) -> None:
        if rope is None or len(rope) < 2:
            return
        overlap = -geometry.chain_clearance(rope, self._radius, [o])
        if overlap > MAX_ROPE_OVERLAP:
            raise SceneChangeRefused(
                f"{o.name!r} would overlap the rope by {1e3 * overlap:.1f} mm; place it elsewhere"
            )


def _replaced(obstacles: tuple[Obstacle, ...], moved: Obstacle) -> tuple[Obstacle, ...]:
    return tuple(moved if o.name == moved.name else o for o in obstacles)


def _check(obstacle: Obstacle) -> None:
    try:
        check_obstacle(obstacle)
    except ValueError as error:
        raise SceneChangeRefused(str(error)) from error
