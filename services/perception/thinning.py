"""Skeletons of masks, by the compiled thinning of scikit-image without the package around it.

That package imports SciPy, which would take a third of the processor time of perception's start.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import cache
from importlib.machinery import PathFinder
from pathlib import Path

import numpy as np
from jaxtyping import Bool


def skeletonize(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return the skeleton of a mask, as `skimage.morphology.skeletonize` does."""
    return _thinning()(np.ascontiguousarray(mask, dtype=bool))


@cache
def _thinning() -> Callable[[np.ndarray], np.ndarray]:
    """Return the compiled function.

    Raises:
        ModuleNotFoundError: scikit-image is not installed.
        ImportError: It holds no such function.
    """
    package = importlib.util.find_spec("skimage")
    if package is None or package.origin is None:
        raise ModuleNotFoundError("No module named 'skimage'", name="skimage")
    folder = Path(package.origin).with_name("morphology")
    spec = PathFinder.find_spec("_skeletonize_various_cy", [str(folder)])
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} holds no thinning of scikit-image 0.26", name="skimage")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module._fast_skeletonize
