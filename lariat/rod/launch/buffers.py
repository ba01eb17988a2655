"""Arrays of one launch, cut into sections that are filled and read as views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from jaxtyping import Float64, Int32

from lariat.rod.launch.layout import OBSTACLE_WIDTH


class LaunchSizes(Protocol):
    """Sizes that every launch has."""

    @property
    def batch(self) -> int:
        """Number of rods."""
        ...

    @property
    def obstacles(self) -> int:
        """Number of obstacles."""
        ...


SizesT = TypeVar("SizesT", bound=LaunchSizes)


@dataclass(frozen=True)
class LaunchBuffers(Generic[SizesT]):
    """Arrays of a launch: integers, and doubles that are cut into sections."""

    sizes: SizesT
    """Sizes of the launch."""
    places: dict[int, slice]
    """Place of each section in the numbers of a rod."""
    integers: Int32[np.ndarray, "k"]
    """Integer array, as in `layout`."""
    doubles: Float64[np.ndarray, "m"]
    """Array of doubles, as in `layout`."""
    rods: Float64[np.ndarray, "B s"]
    """Numbers of each rod, as a view into the doubles."""

    def section(self, name: int) -> Float64[np.ndarray, "B k"]:
        """Return a section of every rod of the batch, as a view.

        Args:
            name: `Section` of the rod's layout.
        """
        return self.rods[:, self.places[name]]

    def obstacles(self) -> Float64[np.ndarray, "m 17"]:
        """Return the rows of the obstacles, as a view."""
        end = self.rods.size + OBSTACLE_WIDTH * self.sizes.obstacles
        return self.doubles[self.rods.size : end].reshape(-1, OBSTACLE_WIDTH)


def kernel_arrays(
    integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"]
) -> tuple[
    Int32[np.ndarray, "k"],
    Float64[np.ndarray, "m"],
    Float64[np.ndarray, "u 3 3"],
    Float64[np.ndarray, "v 3 6"],
]:
    """Return the arrays that the rod's kernel takes: the doubles are also passed as matrices."""
    as33 = doubles[: len(doubles) // 9 * 9].reshape(-1, 3, 3)
    as36 = doubles[: len(doubles) // 18 * 18].reshape(-1, 3, 6)
    return integers, doubles, as33, as36


class BufferPool:
    """Memory for the doubles of successive launches; it grows and never shrinks."""

    def __init__(self) -> None:
        self._doubles = np.zeros(0)

    def cut(
        self,
        sizes: SizesT,
        places: dict[int, slice],
        stride: int,
        integers: Int32[np.ndarray, "k"],
    ) -> LaunchBuffers[SizesT]:
        """Return buffers over this memory, which are valid until the next ones are cut.

        Args:
            sizes: Sizes of the launch.
            places: Place of each section in the numbers of a rod.
            stride: Count of numbers of a rod.
            integers: Integer array of the launch.
        """
        needed = stride * sizes.batch + OBSTACLE_WIDTH * sizes.obstacles
        if len(self._doubles) < needed:
            self._doubles = np.zeros(needed + needed // 4)
        rods = self._doubles[: stride * sizes.batch].reshape(sizes.batch, -1)
        return LaunchBuffers(sizes, places, integers, self._doubles, rods)
