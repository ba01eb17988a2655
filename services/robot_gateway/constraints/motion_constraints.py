"""Where grippers may be: every rule as a slack, positive where it is kept.

A rule that is already broken, because an obstacle came or the rope was laid out too tight, does not
freeze the arm: motion is then permitted that nowhere makes it worse.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import GripperBody
from lariat.geometry.obstacles import Obstacle, signed_distance
from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.constraints.shortest_path import taut_length
from services.robot_gateway.constraints.sphere_distance import Spheres

ANCHORS = 32
"""Ways round obstacles that are remembered."""
FAR = 0.05
"""Slack from which on nobody asks how much it is exactly [m]."""

Slacks = dict[Rule, Float64[np.ndarray, "m"]]
"""By rule, for every pose of a row [m, or rad for joints]."""


@dataclass(frozen=True)
class Boundaries:
    """What the cell's rules measure against."""

    rope_length: float
    """[m]"""
    workspace: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Lowest and highest corner of the box for the grips [m]."""
    bodies: tuple[GripperBody, ...]
    """Of all ends, left first."""
    keep_out: float = 0.005
    """Least distance of a body to an obstacle [m]."""
    spacing: float = 0.03
    """Least distance between two grips [m]."""
    overstretch: float = 0.99
    """Longest way between the grips as a fraction of the rope's length."""


class Rules:
    """The rules of one cell for its present obstacles."""

    def __init__(self, boundaries: Boundaries, driven: Sequence[int]) -> None:
        """Args: driven: Ends that move; a fixed one is where it is."""
        self.boundaries = boundaries
        self.driven = list(driven)
        spheres = [boundaries.bodies[k].spheres for k in self.driven]
        self._owner = np.repeat(self.driven, [len(centres) for centres, _ in spheres])
        self._centres = np.concatenate([np.zeros((0, 3)), *(centres for centres, _ in spheres)])
        self._radii = np.array([r for centres, r in spheres for _ in centres])
        self._bodies_of_ends = [body.spheres for body in boundaries.bodies]
        self.replace_obstacles(())

    def replace_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Takes a new scene."""
        self.obstacles = tuple(obstacles)
        self._planes = [o for o in self.obstacles if o.shape == "half_space"]
        # A half space is convex and both grips are outside, so it blocks no straight way.
        self._blocks = [o for o in self.obstacles if o.shape != "half_space"]
        self._block_centres = np.array([o.position for o in self._blocks]).reshape(-1, 3)
        self._block_radii = np.array([_reach(o) for o in self._blocks])
        self._anchors: deque[tuple[np.ndarray, float]] = deque(maxlen=ANCHORS)

    def slacks(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        """Slack of every rule for a row of poses of all ends [m]."""
        b = self.boundaries
        grips = positions[:, self.driven]
        low, high = np.array(b.workspace)
        result: Slacks = {
            "workspace": np.min(np.minimum(grips - low, high - grips), axis=(1, 2)),
            **self._bodies(positions, orientations),
        }
        if positions.shape[1] == 2:
            between = positions[:, 1] - positions[:, 0]
            distance = np.linalg.norm(between, axis=1)
            result["spacing"] = distance - b.spacing
            result["overstretch"] = b.overstretch * b.rope_length - self._taut(positions, distance)
        return result

    def _bodies(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        points = positions[:, self._owner] + poses.rotate(
            orientations[:, self._owner], self._centres
        )
        return self.clearances(points, self._radii)

    def body(
        self,
        end: int,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
    ) -> Spheres:
        """The body of one end's gripper along a row of its poses."""
        centres, radius = self._bodies_of_ends[end]
        points = positions[:, None] + poses.rotate(orientations[:, None], centres[None])
        return Spheres(points, np.full(len(centres), radius))

    def clearances(
        self, centres: Float64[np.ndarray, "m k 3"], radii: Float64[np.ndarray, "k"]
    ) -> Slacks:
        """Slack of the rules on obstacles for spheres; beyond `FAR` at least that much [m]."""
        if not len(radii):
            free = np.full(len(centres), np.inf)
            return {"keep_out": free, "table": free}
        table = [np.min(signed_distance(centres, o) - radii, axis=1) for o in self._planes]
        apart = np.linalg.norm(centres[:, :, None] - self._block_centres, axis=-1)
        clear = np.min(apart - radii[:, None], axis=1) - self._block_radii
        clear -= self.boundaries.keep_out
        for k in np.flatnonzero(np.any(clear < FAR, axis=0)):
            distances = signed_distance(centres, self._blocks[k]) - radii
            clear[:, k] = np.min(distances, axis=1) - self.boundaries.keep_out
        return {
            "keep_out": np.min(clear, axis=1, initial=np.inf),
            "table": np.min(table, axis=0) if table else np.full(len(centres), np.inf),
        }

    def _taut(
        self, positions: Float64[np.ndarray, "m 2 3"], distance: Float64[np.ndarray, "m"]
    ) -> Float64[np.ndarray, "m"]:
        """Shortest ways round the obstacles between the grips, never too short [m]."""
        if not self._may_block(positions):
            return distance
        limit = self.boundaries.overstretch * self.boundaries.rope_length
        ways = self._bound(positions)
        for _ in range(len(positions)):
            worst = int(np.argmax(ways))
            if ways[worst] <= limit:
                break
            # A way grows by no more than its ends move, so one that is known serves many poses.
            at = positions[worst]
            found = taut_length(at[0], at[1], self.obstacles)
            self._anchors.append((at, found))
            if found > limit and worst > 0:
                ways[worst] = found
                break
            ways = self._bound(positions)
        return np.maximum(ways, distance)

    def _bound(self, positions: Float64[np.ndarray, "m 2 3"]) -> Float64[np.ndarray, "m"]:
        """Ways that are no longer than this, from those that were found before [m]."""
        if not self._anchors:
            return np.full(len(positions), np.inf)
        places = np.array([at for at, _ in self._anchors])
        lengths = np.array([length for _, length in self._anchors])
        moved = np.linalg.norm(positions[:, None] - places, axis=-1).sum(axis=-1)
        return np.min(lengths + moved, axis=1)

    def _may_block(self, positions: Float64[np.ndarray, "m 2 3"]) -> bool:
        """Whether the sphere round any obstacle touches a straight line between grips."""
        if not len(self._block_radii):
            return False
        start = positions[:, 0, None]
        way = positions[:, 1, None] - start
        offset = self._block_centres - start
        along = np.sum(offset * way, axis=-1) / np.maximum(np.sum(way * way, axis=-1), 1e-12)
        nearest = offset - np.clip(along, 0.0, 1.0)[..., None] * way
        return bool(np.any(np.sum(nearest * nearest, axis=-1) < self._block_radii**2))


def broken(slacks: Slacks, margin: float = 0.0) -> tuple[Rule, float] | None:
    """The first rule that a way breaks, and by how much [m].

    Args:
        slacks: Of a row of poses, the first of which is where the arms are now.
        margin: Slack asked for beyond zero [m].
    """
    for rule, row in slacks.items():
        worst = float(np.min(row[1:], initial=np.inf))
        if worst < min(margin, float(row[0])) - 1e-6:
            return rule, margin - worst
    return None


def _reach(obstacle: Obstacle) -> float:
    """Radius of the sphere round an obstacle's centre that holds it [m]."""
    match obstacle.shape:
        case "box":
            return float(np.linalg.norm(obstacle.size)) / 2.0
        case "cylinder":
            return float(np.hypot(obstacle.radius, obstacle.height / 2.0))
        case _:
            return obstacle.radius + obstacle.height / 2.0
