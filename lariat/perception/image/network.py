"""Network that tells the pixels of ropes from all others.

A U-Net (Ronneberger et al. 2015) that OpenCV evaluates, trained on rendered pictures and a few
photographs by `python -m benchmarks.perception.network`.
"""

from __future__ import annotations

import hashlib
import threading
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

WEIGHTS = Path(__file__).with_name("ropes.onnx")
"""File with the network and its weights."""
WEIGHTS_SHA256 = "675b077acae63e766eadb016e698e8b32ffc3546a1bf3799498c4c9db82b8a97"
"""SHA-256 of that file."""
STRIDE = 16
"""Number of pixels of which the sides of the network's pictures are multiples."""

_evaluation = threading.Lock()


def rope_log_odds(color: UInt8[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "h w"]:
    """Return the logarithm of the odds that a pixel shows a rope.

    Ropes of 5 to 35 pixels in width are found best.

    Args:
        color: Red, green, blue.

    Raises:
        RuntimeError: The file of the weights is not the one that belongs to this version.
    """
    height, width = color.shape[:2]
    below, beside = -height % STRIDE, -width % STRIDE
    padded = cv2.copyMakeBorder(color, 0, below, 0, beside, cv2.BORDER_REFLECT_101)
    with _evaluation:
        network = loaded_network()
        network.setInput(cv2.dnn.blobFromImage(padded, 1.0 / 255.0))
        return np.asarray(network.forward()[0, 0, :height, :width], np.float32)


@cache
def loaded_network() -> cv2.dnn.Net:
    """Return the network, read once and checked.

    Raises:
        RuntimeError: The file of the weights is not the one that belongs to this version.
    """
    weights = WEIGHTS.read_bytes()
    if hashlib.sha256(weights).hexdigest() != WEIGHTS_SHA256:
        raise RuntimeError(
            f"{WEIGHTS} is not the network of this version: restore the file from the repository"
        )
    return cv2.dnn.readNetFromONNX(np.frombuffer(weights, np.uint8))
