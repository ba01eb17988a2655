"""Identification of a rod's material from measured motion."""

from __future__ import annotations

from lariat.identification.fit import Fit, ReportProgress, generic_rope, identify
from lariat.identification.motion import Grip, Motion, check_motion
from lariat.identification.prediction import Prediction, predict
from lariat.identification.summary import Finding, findings, undetermined

__all__ = [
    "Finding",
    "Fit",
    "Grip",
    "Motion",
    "Prediction",
    "ReportProgress",
    "check_motion",
    "findings",
    "generic_rope",
    "identify",
    "predict",
    "undetermined",
]
