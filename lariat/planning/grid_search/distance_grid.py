"""Grid of places for the middle of the grips, with the distance field of the obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import scene_distance, signed_distance
from lariat.planning.grid_search.carried_shapes import CarriedShape, middle_of
from lariat.planning.grid_search.settings import GridSearchSettings
from lariat.planning.grid_search.wavefront import Cell
from lariat.planning.problem import Problem

MIN_INTERPOLATION_WEIGHT = 1e-9
"""Weight below which a corner of a grid cell is left out of an interpolation."""


@dataclass(frozen=True)
class DistanceGrid:
    """Places for the middle of the grips, and the distance field around them."""

    origin: Float64[np.ndarray, "3"]
    """First place [m]; the start coincides with a place."""
    size: tuple[int, int, int]
    """Number of places along each axis."""
    spacing: float
    """Distance between places [m]."""
    pad: int
    """Cells by which the field exceeds the places on every side."""
    field: Float64[np.ndarray, "x y z"]
    """Distance to the nearest body [m]."""
    rope_field: Float64[np.ndarray, "x y z"]
    """Distance to the nearest body, or to the border of a region to keep in [m]."""

    @classmethod
    def around(
        cls, problem: Problem, shapes: Sequence[CarriedShape], settings: GridSearchSettings
    ) -> DistanceGrid:
        """Create the grid around start and goal; its distance field covers all carried shapes.

        Args:
            problem: Start, goal, obstacles and workspace.
            shapes: Carried shapes.
            settings: Spacing and extent.
        """
        scale = max(problem.rod.properties.length / settings.reference_length, 1.0)
        spacing = settings.spacing * scale
        ends = np.stack([middle_of(problem.grips), middle_of(problem.goal.grips)])
        extent = settings.extent * scale
        low, high = ends.min(axis=0) - extent, ends.max(axis=0) + extent
        tops = [o.position[2] + o.top for o in problem.solid if o.shape != "half_space"]
        sag = max(float(-s.nodes[:, 2].min()) for s in shapes[2:])
        ceiling = max([*tops, float(ends[:, 2].max())]) + sag + settings.ceiling_margin
        space = np.array(problem.limits.workspace)
        high[2] = min(max(high[2], ceiling), space[1][2])
        low, high = np.maximum(low, space[0]), np.minimum(high, space[1])
        before = np.ceil((ends[0] - low) / spacing)
        size = (before + np.ceil((high - ends[0]) / spacing)).astype(int) + 1
        reach = max(float(np.abs(np.vstack([s.nodes, s.gripper_points])).max()) for s in shapes)
        pad = int(np.ceil(reach / spacing)) + 2
        origin = ends[0] - before * spacing
        axes = [o + spacing * np.arange(-pad, n + pad) for o, n in zip(origin, size, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        field = np.full(points.shape[:-1], np.inf)
        for obstacle in problem.solid:
            field = np.minimum(field, signed_distance(points, obstacle))
        rope_field = np.minimum(field, scene_distance(points, problem.regions))
        nx, ny, nz = size.tolist()
        return cls(origin, (nx, ny, nz), spacing, pad, field, rope_field)

    def place(self, position: Float64[np.ndarray, "3"]) -> tuple[int, int, int]:
        """Return the index of the place nearest to a position [m]."""
        index = np.round((position - self.origin) / self.spacing).astype(int)
        x, y, z = np.clip(index, 0, np.array(self.size) - 1).tolist()
        return x, y, z

    def position(self, cell: Cell) -> Float64[np.ndarray, "3"]:
        """Return the position of a cell [m]."""
        return self.origin + self.spacing * np.array(cell[1:])

    @property
    def positions(self) -> Float64[np.ndarray, "x y z 3"]:
        """Positions of all places [m]."""
        axes = [self.origin[k] + self.spacing * np.arange(self.size[k]) for k in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

    def free_places(
        self, problem: Problem, shape: CarriedShape, clearance: float, max_nodes: int
    ) -> Bool[np.ndarray, "x y z"]:
        """Return the places at which a carried shape keeps its clearance.

        Args:
            problem: Limits of the grippers, and radius of the rope.
            shape: Carried shape.
            clearance: Clearance of the rope [m].
            max_nodes: Largest number of its nodes that are checked.
        """
        limits = problem.limits
        every = max(1, -(-len(shape.nodes) // max_nodes))
        body = max(clearance, limits.keep_out) + limits.gripper_radius
        parts = (
            (self.rope_field, shape.nodes[::every], clearance + problem.radius),
            (self.field, shape.gripper_points, body),
        )
        free = np.ones(self.size, dtype=bool)
        for field, points, margin in parts:
            for point in points:
                free &= self._distances(field, point) > margin
        low, high = np.array(limits.workspace)
        for axis in range(3):
            at = self.origin[axis] + self.spacing * np.arange(self.size[axis])
            inside = np.ones(len(at), dtype=bool)
            for grip in shape.grips:
                inside &= (at + grip[axis] >= low[axis]) & (at + grip[axis] <= high[axis])
            broadcast = [1, 1, 1]
            broadcast[axis] = -1
            free &= inside.reshape(broadcast)
        return free

    def _distances(
        self, field: Float64[np.ndarray, "a b c"], offset: Float64[np.ndarray, "3"]
    ) -> Float64[np.ndarray, "x y z"]:
        """A distance field at all places moved by an offset, trilinearly interpolated [m]."""
        steps = offset / self.spacing + self.pad
        first = np.floor(steps).astype(int)
        share = steps - first
        total = np.zeros(self.size)
        for corner in np.ndindex(2, 2, 2):
            weight = float(np.prod(np.where(corner, share, 1.0 - share)))
            if weight > MIN_INTERPOLATION_WEIGHT:
                slices = tuple(
                    slice(f + c, f + c + n)
                    for f, c, n in zip(first.tolist(), corner, self.size, strict=True)
                )
                total += weight * field[slices]
        return total
