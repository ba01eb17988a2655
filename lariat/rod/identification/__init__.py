"""From measured motion to a rod's material."""

from __future__ import annotations

from lariat.rod.identification.fit import Fit, identify, unknown_rope
from lariat.rod.identification.motion import Motion, motion
from lariat.rod.identification.prediction import Prediction, predict
from lariat.rod.identification.summary import Finding, cannot_tell, findings

__all__ = [
    "Finding",
    "Fit",
    "Motion",
    "Prediction",
    "cannot_tell",
    "findings",
    "identify",
    "motion",
    "predict",
    "unknown_rope",
]
