"""From measured motion to a rod's material."""

from __future__ import annotations

from shared.rod.identification.fit import Fit, identify, unknown_rope
from shared.rod.identification.motion import Motion, motion
from shared.rod.identification.prediction import Prediction, predict
from shared.rod.identification.statement import Finding, cannot_tell, findings

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
