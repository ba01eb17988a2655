"""Solid behind the surface that a depth image shows.

What lies behind the visible surface is not seen and counts as solid, down to a depth and to a
floor. Columns behind tiles of the image contain it: each begins at the nearest depth of its pixels
and of those around it. Conventions are those of `lariat.geometry.cameras`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.cameras import Camera

MAX_TILES = 4000
"""Largest number of columns."""
TILES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Edge lengths of a tile that are tried [pixels]."""
MIN_DEPTH = 1e-3
"""Least depth of a column of the solid [m]."""
MAX_SURFACE_POINTS = 3000
"""Largest number of points of the solid's border to which distances are measured."""
CURTAIN_POINTS = 9
"""Points along each ray at the edge of what is seen."""
CHUNK = 512
"""Number of points whose distances are computed at once."""


@dataclass(frozen=True)
class SolidRange:
    """Part of the space behind the visible surface that counts as solid."""

    near: float = 0.05
    """Least depth of a measurement; a nearer one counts as none [m]."""
    far: float = 2.0
    """Depth at which the solid ends; a surface that is further away is left out [m]."""
    floor: float | None = None
    """Height in the world below which there is no solid, as the table is an obstacle itself [m]."""
    holes: int = 3
    """Distance from a measured pixel up to which one without a measurement gets its depth
    [pixels]; further inside of a hole nothing is known, and nothing is solid."""


@dataclass(frozen=True)
class Columns:
    """Columns that contain a solid; each is the hull of its corners."""

    corners: Float64[np.ndarray, "t 8 3"]
    """Corners in the world: four at the front, four at the back [m]."""
    places: Float64[np.ndarray, "t 2"]
    """Row and column of each tile in the image [tiles]."""
    depths: Float64[np.ndarray, "t"]
    """Depth at which each column begins [m]."""


class DepthSolid:
    """Solid behind the surface of a depth image."""

    def __init__(
        self, depth: Float64[np.ndarray, "h w"], camera: Camera, extent: SolidRange
    ) -> None:
        """Find the solid pixels.

        Args:
            depth: Depth of each pixel; zero or not finite without a measurement [m].
            camera: Camera that took the image.
            extent: Part of the space that counts.

        Raises:
            ValueError: No pixel shows a surface in this part.
        """
        self._camera, self._extent = camera, extent
        measured = np.isfinite(depth) & (depth >= extent.near)
        front = np.where(measured, depth, np.inf)
        self.unknown = 0.0
        """Share of the pixels of which nothing is known, and behind which nothing is solid [-]."""
        filled = np.where(measured, front, _least_around(front, extent.holes))
        self.unknown = float(np.mean(~np.isfinite(filled)))
        rows, columns = np.indices(depth.shape)
        pixels = np.stack([columns, rows], axis=-1).astype(float)
        self._front = np.where(filled < self._back(pixels), filled, np.inf)
        """Depth at which the solid of each pixel begins; infinite without one [m]."""
        if not np.any(np.isfinite(self._front)):
            raise ValueError(
                f"no pixel shows a surface between {extent.near:g} and {extent.far:g} m of depth"
                + ("" if extent.floor is None else f", higher than {extent.floor:g} m")
            )

    def columns(self, max_tiles: int = MAX_TILES) -> Columns:
        """Return columns that contain the visible surface, one behind each tile of the image.

        Args:
            max_tiles: Largest number of tiles; the finest tiles that keep it are taken.
        """
        # The surface reaches up to one pixel beyond the centre of the last pixel that shows it.
        # A ridge between pixels is nearer than both, by a pixel's width if its sides slope by two
        # to one.
        near = _least_around(self._front, 1)
        near = near * (1.0 - 1.0 / min(self._camera.intrinsics.fx, self._camera.intrinsics.fy))
        least, tile = near, TILES[0]
        for tile in TILES:
            least = _least_in_tiles(near, tile)
            if np.isfinite(least).sum() <= max_tiles:
                break
        places = np.argwhere(np.isfinite(least))
        front = least[places[:, 0], places[:, 1]]
        offsets = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
        pixels = (places[:, None] + offsets)[..., ::-1] * float(tile) - 0.5
        begin = np.broadcast_to(front[:, None], pixels.shape[:2])
        back = np.maximum(self._back(pixels), begin + MIN_DEPTH)
        ends = [self._camera.back_project(pixels, depth) for depth in (begin, back)]
        return Columns(np.concatenate(ends, axis=1), places.astype(float), front)

    def outside(self, points: Float64[np.ndarray, "p 3"]) -> Float64[np.ndarray, "p"]:
        """Return how far points in the seen, empty space are from the solid [m].

        Zero for points in the solid and for points that are not seen: out of view, behind the
        solid, or in a hole. The distance is that from points of the border, a little too large.

        Args:
            points: Points in the world [m].
        """
        pixels, depth = self._camera.project(points)
        size = np.array(self._front.shape)[::-1]
        index = np.round(np.nan_to_num(pixels, nan=-1.0)).astype(int)
        seen = (depth > self._extent.near) & np.all((index >= 0) & (index < size), axis=1)
        index = np.where(seen[:, None], index, 0)
        back = self._back(pixels)
        free = seen & (depth < np.minimum(self._front[index[:, 1], index[:, 0]], back))
        border = self._border()
        distances = np.zeros(len(points))
        which = np.flatnonzero(free)
        for k in range(0, len(which), CHUNK):
            rows = which[k : k + CHUNK]
            squares = np.sum((points[rows, None] - border) ** 2, axis=2)
            distances[rows] = np.sqrt(squares.min(axis=1))
        return distances

    def _back(self, pixels: Float64[np.ndarray, "*b 2"]) -> Float64[np.ndarray, "*b"]:
        """Depth at which the solid ends along the rays of pixels [m]."""
        if self._extent.floor is None:
            return np.full(pixels.shape[:-1], self._extent.far)
        slope = self._camera.rays(pixels)[..., 2]
        above = self._camera.T_world_camera.position[2] - self._extent.floor
        hits = np.where(slope < 0.0, above / np.maximum(-slope, 1e-12), np.inf)
        return np.minimum(self._extent.far, np.where(above > 0.0, hits, 0.0))

    def _border(self) -> Float64[np.ndarray, "b 3"]:
        """Points on the visible surface, and on the sides of what it hides [m]."""
        solid = np.isfinite(self._front)
        rows, columns = np.nonzero(solid)
        step = max(1, -(-len(rows) // MAX_SURFACE_POINTS))
        pixels = np.stack([columns, rows], axis=1)[::step].astype(float)
        surface = self._camera.back_project(pixels, self._front[solid][::step])
        # Beside a pixel whose neighbour begins later, the solid shows its side.
        later = _most_around(np.where(solid, self._front, self._extent.far), 1)
        jump = solid & (later - self._front > 0.01)
        rows, columns = np.nonzero(jump)
        step = max(1, -(-len(rows) * CURTAIN_POINTS // MAX_SURFACE_POINTS))
        pixels = np.stack([columns, rows], axis=1)[::step].astype(float)
        begin, end = self._front[jump][::step], self._back(pixels)
        share = np.linspace(0.0, 1.0, CURTAIN_POINTS)[:, None]
        depths = (1.0 - share) * begin + share * end
        sides = self._camera.back_project(np.broadcast_to(pixels, (*depths.shape, 2)), depths)
        return np.concatenate([surface, sides.reshape(-1, 3)])


def _least_around(depth: Float64[np.ndarray, "h w"], reach: int) -> Float64[np.ndarray, "h w"]:
    """Least depth within a number of pixels of each one, in a square [m]."""
    for axis in (0, 1):
        width = [(reach, reach) if k == axis else (0, 0) for k in (0, 1)]
        padded = np.pad(depth, width, constant_values=np.inf)
        count = depth.shape[axis]
        depth = np.min(
            [np.take(padded, np.arange(k, k + count), axis) for k in range(2 * reach + 1)], axis=0
        )
    return depth


def _most_around(depth: Float64[np.ndarray, "h w"], reach: int) -> Float64[np.ndarray, "h w"]:
    return -_least_around(-depth, reach)


def _least_in_tiles(depth: Float64[np.ndarray, "h w"], tile: int) -> Float64[np.ndarray, "r c"]:
    """Least depth in each tile [m]."""
    height, width = depth.shape
    padded = np.pad(depth, ((0, -height % tile), (0, -width % tile)), constant_values=np.inf)
    rows, columns = np.array(padded.shape) // tile
    return padded.reshape(rows, tile, columns, tile).min(axis=(1, 3))
