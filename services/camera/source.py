"""Interface of a source of exposures: a device, or a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage


@dataclass(frozen=True)
class Exposure:
    """Colour and depth image, registered to the pixels of the colour image."""

    color: CompressedImage
    """Colour image."""
    depth: RawImage
    """Depth image."""
    calibration: CameraCalibration
    """Calibration of the colour image."""
    time: int
    """Time of the exposure by the source's own clock [ns]."""


class CameraSource(Protocol):
    """Source of exposures."""

    def newest(self, now: int) -> Exposure | None:
        """Return the newest exposure since the last call; None if there is none. Never waits.

        Args:
            now: Present time by the cell's clock [ns].
        """
        ...

    def close(self) -> None:
        """Release the device or the file."""
        ...
