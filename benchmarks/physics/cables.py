"""Stiffness of real cables from hanging and twisting: `lariat bench physics cables FILE...`.

A file is a .npz with `hanging` (shapes, points, 2) [m], planar, y downwards, from one level clamp
to the other; `linear_density` [kg/m]; and `critical_twist_deg`, one for each time that the cable
was twisted until it buckled out of its plane. Each shape is predicted with the EI that is fitted to
the others, each critical twist with the GJ / EI of another one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.tables import Result, publish
from lariat.configuration import ConfigurationError
from lariat.identification.static_sag import (
    HangingShape,
    bending_stiffness,
    critical_twist,
    hang,
    shape_error,
    twist_ratio,
)

ARRAY_NAMES = ("hanging", "linear_density", "critical_twist_deg")
"""Names of the arrays in a file."""


def run(
    files: tyro.conf.Positional[tuple[Path, ...]],
    /,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Predict the shapes and critical twists of real cables by leave-one-out fits.

    There is no plant: the shapes were measured on real cables. Each shape is predicted with the EI
    that is fitted to the others, each critical twist with the GJ / EI of another one. A file is a
    .npz with `hanging` (shapes, points, 2) [m], planar, y downwards, from one level clamp to the
    other; `linear_density` [kg/m]; and `critical_twist_deg`.

    Examples:
      lariat bench physics cables white.npz black.npz

    Args:
        files: Measured cables, one .npz each.
        json: Print one JSON object instead of a table.
        output: Folder for the table as CSV.
    """
    if not files:
        raise ConfigurationError("name at least one .npz of a measured cable")
    rows = [{"cable": file.stem, **leave_one_out(*read(file))} for file in files]
    meaning = "plant: the real cables; EI_spread: largest less smallest EI of the fits, relative"
    publish([Result("cables", rows, meaning)], json, output)
    return 0


def read(path: Path) -> tuple[list[HangingShape], np.ndarray]:
    """Read shapes and critical twists [rad] of a cable.

    Raises:
        ConfigurationError: The file does not describe a cable.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            missing = [key for key in ARRAY_NAMES if key not in stored]
            if missing:
                raise ConfigurationError(
                    f"{path} has no {missing[0]!r}; see lariat bench physics cables -h"
                )
            hanging, density, twists = (np.asarray(stored[key], float) for key in ARRAY_NAMES)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}") from error
    if hanging.ndim != 3 or hanging.shape[2] != 2 or len(hanging) < 2 or density.size != 1:
        raise ConfigurationError(
            f"{path}: hanging must be (2 or more shapes, points, 2), got {hanging.shape}"
        )
    if twists.ndim != 1 or len(twists) < 2 or not np.all(twists > 0.0):
        raise ConfigurationError(f"{path}: critical_twist_deg must be 2 or more, got {twists}")
    if not (np.all(np.isfinite(hanging)) and float(density.reshape(())) > 0.0):
        raise ConfigurationError(f"{path}: hanging must be finite and linear_density positive")
    return [HangingShape(points, float(density.reshape(()))) for points in hanging], np.radians(
        twists
    )


def leave_one_out(shapes: list[HangingShape], twists: np.ndarray) -> dict[str, Any]:
    """Return the errors of each shape and each twist as predicted from the others."""
    length = float(np.mean([shape.arcs[-1] for shape in shapes]))
    stiffnesses, errors = [], []
    for k, shape in enumerate(shapes):
        stiffnesses.append(bending_stiffness([*shapes[:k], *shapes[k + 1 :]]))
        errors.append(shape_error(shape, stiffnesses[-1]))
    bending = float(np.mean(stiffnesses))
    ratios = [twist_ratio(s, bending, t) for s, t in zip(shapes, twists, strict=False)]
    twist_errors = [
        critical_twist(hang(shapes[j], bending, ratio)) / twists[j] - 1.0
        for k, ratio in enumerate(ratios)
        for j in range(len(ratios))
        if j != k
    ]
    return {
        "EI": bending,
        "EI_spread": float(np.ptp(stiffnesses)) / bending,
        "shape_error_mm": 1e3 * float(np.mean(errors)),
        "shape_error_L": float(np.mean(errors)) / length,
        "worst_shape_error_L": float(np.max(errors)) / length,
        "GJ_EI": float(np.mean(ratios)),
        "twist_error": float(np.mean(np.abs(twist_errors))),
        "worst_twist_error": float(np.max(np.abs(twist_errors))),
    }
