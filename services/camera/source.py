"""Where frames come from: a device, or a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage


@dataclass(frozen=True)
class Shot:
    """One exposure: depth registered to the pixels of the colour image."""

    color: CompressedImage
    depth: RawImage
    calibration: CameraCalibration
    """Of the colour image."""
    exposed: int
    """By the source's own clock [ns]."""


class Source(Protocol):
    """Something that takes pictures."""

    def newest(self, now: int) -> Shot | None:
        """The newest exposure since the last call, without waiting for one.

        Args:
            now: By the cell's clock [ns].
        """
        ...

    def close(self) -> None:
        """Lets go of the device."""
        ...
