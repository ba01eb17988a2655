"""Arrays of one launch, cut into sections that are filled and read as views."""

from __future__ import annotations

import operator
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from jaxtyping import Float64, Int32

from lariat.rod.launch.layout import OBSTACLE_WIDTH

MAX_KEPT_BUFFERS = 8
"""Number of sizes whose buffers are kept for further launches."""


class LaunchSizes(Hashable, Protocol):
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
ValueT = TypeVar("ValueT")


@dataclass(frozen=True, eq=False)
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
    _made: dict[Callable[..., Any], Any] = field(default_factory=dict, repr=False)

    def once(self, make: Callable[[LaunchBuffers[SizesT]], ValueT]) -> ValueT:
        """Return `make(self)`, which is computed at the first call alone.

        To cut the views of a launch takes as long as to write or read them.
        """
        if make not in self._made:
            self._made[make] = make(self)
        return self._made[make]

    def section(self, name: int) -> Float64[np.ndarray, "B k"]:
        """Return a section of every rod of the batch, as a view.

        Args:
            name: `Section` of the rod's layout.
        """
        return self.rods[:, self.places[name]]

    def obstacles(self) -> Float64[np.ndarray, "m 18"]:
        """Return the rows of the obstacles, as a view."""
        end = self.rods.size + OBSTACLE_WIDTH * self.sizes.obstacles
        return self.doubles[self.rods.size : end].reshape(-1, OBSTACLE_WIDTH)


def kernel_arrays(
    integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"]
) -> tuple[
    Int32[np.ndarray, "k"],
    Float64[np.ndarray, "m"],
    Float64[np.ndarray, "u 3 3"],
]:
    """Return the arrays that the rod's kernel takes: the doubles are also passed as matrices."""
    as33 = doubles[: len(doubles) // 9 * 9].reshape(-1, 3, 3)
    return integers, doubles, as33


class BufferPool:
    """Memory for the doubles of successive launches; it grows and never shrinks."""

    def __init__(self) -> None:
        self._doubles = np.zeros(0)
        self._buffers: dict[Hashable, LaunchBuffers[Any]] = {}
        self._content: tuple[object, ...] = ()

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
            integers: Integer array of the launch, which is copied.
        """
        needed = stride * sizes.batch + OBSTACLE_WIDTH * sizes.obstacles
        if len(self._doubles) < needed:
            self._doubles = np.zeros(needed + needed // 4)
            self._buffers.clear()
        buffers = self._buffers.get(sizes)
        if buffers is None:
            if len(self._buffers) == MAX_KEPT_BUFFERS:
                self._buffers.clear()
            rods = self._doubles[: stride * sizes.batch].reshape(sizes.batch, -1)
            buffers = LaunchBuffers(sizes, places, np.empty_like(integers), self._doubles, rods)
            self._buffers[sizes] = buffers
        buffers.integers[:] = integers
        return buffers

    def keeps(self, buffers: LaunchBuffers[Any], *content: object) -> bool:
        """Return whether the last buffers were these, with the same objects as content.

        If they were not, the caller writes the content, which must not change afterwards.
        """
        content = (buffers, *content)
        if len(content) == len(self._content) and all(map(operator.is_, content, self._content)):
            return True
        self._content = content
        return False
