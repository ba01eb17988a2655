"""Colours of shadows, and how far others are from them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

SHADOW_BRIGHTNESS = (0.45, 0.93)
"""Range of a shadow's lightness, relative to that of the surface beside it."""
MAX_SHADOW_TINT = 7.0
"""Largest difference between the chroma of a shadow and of the surface beside it [Lab]."""


def could_be_shadow(
    here: Float[np.ndarray, "*k 3"], beside: Float[np.ndarray, "*k 3"]
) -> Bool[np.ndarray, "*k"]:
    """Return whether colours are darker shades of those beside them.

    Args:
        here: Colours in Lab.
        beside: Colours of the surface beside them in Lab.
    """
    ratio = here[..., 0] / np.maximum(beside[..., 0], 1.0)
    darkest, brightest = SHADOW_BRIGHTNESS
    tint, _ = tint_and_brightness(here, beside)
    return (ratio > darkest) & (ratio < brightest) & (tint < MAX_SHADOW_TINT)


def tint_and_brightness(
    here: Float[np.ndarray, "*k 3"], beside: Float[np.ndarray, "*k 3"]
) -> tuple[Float[np.ndarray, "*k"], Float[np.ndarray, "*k"]]:
    """Return the difference of chroma from a shade of the surface beside, and that of lightness.

    Args:
        here: Colours in Lab.
        beside: Colours of the surface beside them in Lab.
    """
    # Chroma shrinks with the light, if at all.
    ratio = here[..., :1] / np.maximum(beside[..., :1], 1.0)
    tint = here[..., 1:] - 128.0 - ratio * (beside[..., 1:] - 128.0)
    return np.linalg.norm(tint, axis=-1), here[..., 0] - beside[..., 0]
