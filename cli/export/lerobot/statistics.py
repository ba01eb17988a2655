"""Statistics of the features of a data set, by which a policy normalizes them."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from cli.export.lerobot.episode import IMAGE, Frame

IMAGE_PERIOD = 10
"""Number of frames for each image that is counted."""
PIXEL_PERIOD = 4
"""Number of rows, and of columns, for each one that is counted."""


class Statistics:
    """Least, largest and mean value and standard deviation of each feature."""

    def __init__(self) -> None:
        self._values: dict[str, list[np.ndarray]] = {}

    def add(self, frames: list[Frame]) -> None:
        """Count the frames of an episode; of its images the channels, from 0 to 1."""
        for k, frame in enumerate(frames):
            for name, value in frame.items():
                if name != IMAGE:
                    self._values.setdefault(name, []).append(np.asarray(value, float)[None])
                elif k % IMAGE_PERIOD == 0:
                    self._values.setdefault(name, []).append(_pixels(value))

    def summary(self) -> dict[str, dict[str, Any]]:
        """Return the statistics by the name of the feature, as `stats.json` has them."""
        return {name: _summary(parts, name == IMAGE) for name, parts in self._values.items()}


def _pixels(image: bytes) -> np.ndarray:
    decoded = cv2.imdecode(np.frombuffer(image, np.uint8), cv2.IMREAD_COLOR)
    if decoded is None:
        raise ValueError(f"an image of {len(image)} bytes cannot be decoded")
    return decoded[::PIXEL_PERIOD, ::PIXEL_PERIOD, ::-1].reshape(-1, 3) / 255.0


def _summary(parts: list[np.ndarray], is_image: bool) -> dict[str, Any]:
    values = np.concatenate(parts)
    measures = {
        "min": values.min(0),
        "max": values.max(0),
        "mean": values.mean(0),
        "std": values.std(0),
    }
    shape = (3, 1, 1) if is_image else (-1,)
    summary = {name: np.reshape(of, shape).tolist() for name, of in measures.items()}
    return summary | {"count": [len(parts)]}
