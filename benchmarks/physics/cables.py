"""Stiffness of real cables from hanging and twisting: `lariat bench physics cables FILE...`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError, refusing
from lariat.identification.static_sag import (
    HangingShape,
    bending_stiffness,
    critical_twist,
    hang,
    shape_error,
    twist_ratio,
)


def run(
    files: tyro.conf.Positional[tuple[Path, ...]],
    /,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Predict the shapes and critical twists of real cables by leave-one-out fits.

    There is no plant: the shapes were measured on real cables. Each shape is predicted with the EI
    that is fitted to the others, each critical twist with the GJ / EI of another one. A file is a
    .npz with `hanging` (shapes, points, 2) [m], planar, y downwards, from one level clamp to the
    other; `linear_density` [kg/m]; and `critical_twist_deg`, one for each time that the cable was
    twisted until it buckled out of its plane.

    Examples:
      lariat bench physics cables white.npz black.npz

    Args:
        files: Measured cables, one .npz each.
    """
    if not files:
        raise ConfigurationError("name at least one .npz of a measured cable")
    rows = [{"cable": file.stem, **leave_one_out(*read(file))} for file in files]
    meaning = "plant: the real cables; EI_spread: largest less smallest EI of the fits, relative"
    options.publish(Result("cables", rows, meaning))
    return 0


def read(path: Path) -> tuple[list[HangingShape], np.ndarray]:
    """Read shapes and critical twists [rad] of a cable."""
    names = ("hanging", "linear_density", "critical_twist_deg")
    with refusing(f"{path} cannot be read; see lariat bench physics cables -h"):
        with np.load(path, allow_pickle=False) as stored:
            hanging, density, twists = (np.asarray(stored[name], float) for name in names)
        for name, holds in (
            ("hanging", hanging.ndim == 3 and hanging.shape[2] == 2 and len(hanging) >= 2),
            ("hanging", np.all(np.isfinite(hanging))),
            ("linear_density", density.size == 1 and np.all(density > 0.0)),
            ("critical_twist_deg", twists.ndim == 1 and len(twists) >= 2 and np.all(twists > 0.0)),
        ):
            if not holds:
                raise ValueError(f"{name} is of a wrong shape or value")
    return [HangingShape(points, density.item()) for points in hanging], np.radians(twists)


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
