"""`lariat identify`: properties of a rope from its measured motion."""

from __future__ import annotations

import json as jsons
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.table import Table

from cli.terminal import Terminal, progress_bar
from lariat.configuration import ConfigurationError, reason_of, refusing
from lariat.files.array_file import read_arrays
from lariat.files.file_kind import kind_of
from lariat.geometry import Obstacle, pack
from lariat.identification import (
    Fit,
    Grip,
    Motion,
    Prediction,
    ReportProgress,
    check_motion,
    findings,
    generic_rope,
    identify,
    predict,
    undetermined,
)
from lariat.identification.motion import Up, doubts, with_z_up
from lariat.rod import RodProperties
from lariat.suggestion import did_you_mean_file

MOTION_KEYS = ("vertices", "dt", "prescribed")
MAX_ARRAY_SIZE = 2**29
"""Largest array of a motion file [bytes]; an hour at 100 Hz of 50 vertices takes 0.4 GB."""

TABLE_FRICTION = 0.3
"""Coefficient of friction of a table, of which a factor is found [-]."""


def main(
    file: tyro.conf.Positional[Path],
    /,
    fit_seconds: float | None = None,
    train: Path | None = None,
    predictions: Path | None = None,
    plot: Path | None = None,
    bending_stiffness: float | None = None,
    linear_density: float | None = None,
    diameter: float = 0.008,
    drag_coefficient: float = 0.0,
    yield_curvature: float | None = None,
    table: float | None = None,
    grip: Grip = "clamped",
    scale: float = 1.0,
    up: Up = "z",
    dt: float | None = None,
    json: bool = False,
) -> int:
    """Fit a rope's properties to measured motion, and score the rod's open-loop prediction.

    FILE is a .npz with `vertices` (sequences, frames, vertices, 3) [m], z up, `dt` [s], and
    `prescribed`, the indices of the held vertices at the ends. The position of the innermost one
    and the direction of the rope there drive the rod; one held vertex alone is a pin.

    Examples:
      lariat identify rope.npz
      lariat identify rope.npz --fit-seconds 2 --json
      lariat identify other.npz --train rope.npz --predictions predicted.npz --plot plot.png

    Args:
        file: Measured motion.
        fit_seconds: Fit the first seconds of every sequence, and score the rest [s].
        train: Fit this file instead, and score FILE.
        predictions: Write the predicted vertices to this .npz.
        plot: Write a plot of prediction and measurement to this .png.
        bending_stiffness: Initial EI [N m^2]; by default found by a search over decades.
        linear_density: Mass per length [kg/m]; required for EI in N m^2.
        diameter: Diameter of the rope [m]; has little influence without drag.
        drag_coefficient: Initial drag coefficient across the rope, e.g. 1.1; 0 leaves drag out [-].
        yield_curvature: Initial yield curvature of a rope that keeps bends, straight at first, e.g.
            5 [1/m]; by default it springs back.
        table: Height of a table that the rope is drawn along, whose friction is found as a factor
            on a coefficient of 0.3 [m]; by default the rope touches nothing.
        grip: Direction where two or more vertices are held: `clamped` if they are on the gripper,
            along the innermost two; `measured` if they are on the rope, as the vertices there bend.
        scale: Size of the unit of `vertices` [m], e.g. 0.001 for millimetres.
        up: Axis of the vertices that points up; predictions are written in metres with z up.
        dt: Time between frames in place of the file's [s].
        json: Print one JSON object on standard output instead of a table.

    Returns:
        0 with a result; 2 when a file cannot be used.
    """
    if not (np.isfinite(scale) and scale > 0.0):
        raise ConfigurationError(f"--scale must be positive, got {scale}; millimetres are 0.001")
    measured = read(file, grip, scale, up, dt)
    source = read(train, grip, scale, up, dt) if train else measured
    for flag, path in (("--predictions", predictions), ("--plot", plot)):
        if path is not None and not path.parent.is_dir():
            raise ConfigurationError(f"{flag} {path}: there is no folder {path.parent}")
    messages = Terminal(stderr=True)
    for line in doubts(source):
        messages.print(f"note: {line}")
    try:
        start = _initial_properties(bending_stiffness, linear_density, diameter, drag_coefficient)
        if yield_curvature is not None:
            start = replace(start, yield_curvature=yield_curvature)
        if table is not None:
            measured, source = (_on_table(motion, table) for motion in (measured, source))
        with _progress(messages) as report:
            fit = identify(source, start, fit_seconds, report)
        first = 1
        if fit_seconds is not None and train is None:
            first = round(fit_seconds / measured.dt) - 1
            frames = measured.vertices.shape[1]
            if first >= frames - 1:
                raise ValueError(
                    f"--fit-seconds {fit_seconds} leaves none of {frames * measured.dt:g} s to "
                    "score; give fewer seconds"
                )
        predicted = predict(measured, fit.properties, fit.length_scale, first)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    if predictions is not None:
        np.savez_compressed(
            predictions,
            vertices=predicted.vertices,
            dt=measured.dt,
            prescribed=np.nonzero(~measured.free)[0],
            first_predicted=predicted.first,
        )
    if plot is not None:
        from cli.identification_plot import draw

        draw(predicted, str(file.stem), plot)
    answer = _answer(file, train, fit, predicted, linear_density)
    if json:
        print(jsons.dumps(answer))
    else:
        _show(answer, Terminal())
    return 0


def read(
    path: Path, grip: Grip = "clamped", scale: float = 1.0, up: Up = "z", dt: float | None = None
) -> Motion:
    """Read a motion file, in a unit [m] and with an axis up of its own, or at other times."""
    try:
        values = read_arrays(path, MOTION_KEYS, MAX_ARRAY_SIZE)
    except FileNotFoundError as error:
        meant = did_you_mean_file(path)
        hint = f";{meant}" if meant else ""
        raise ConfigurationError(f"{path}: there is no such file{hint}") from error
    except KeyError as error:
        missing, own = error.args
        raise ConfigurationError(
            f"{path} has no {missing!r}; a motion file holds {', '.join(MOTION_KEYS)}, "
            f"this one {', '.join(own) or 'nothing'}"
        ) from error
    except Exception as error:
        raise ConfigurationError(
            f"{path} is {kind_of(path)}, not a .npz of plain arrays ({reason_of(error)}); "
            "see docs/concepts/identification.md"
        ) from error
    with refusing(path):
        vertices, own_dt, prescribed = values
        if vertices.dtype.kind in "fiu" and vertices.ndim and vertices.shape[-1] == 3:
            vertices = with_z_up(scale * vertices, up)
        return check_motion(vertices, own_dt if dt is None else dt, prescribed, grip)


def _on_table(motion: Motion, height: float) -> Motion:
    table = Obstacle("half_space", (0.0, 0.0, height), friction=TABLE_FRICTION)
    return replace(motion, bodies=pack([table]))


def _initial_properties(
    bending_stiffness: float | None,
    linear_density: float | None,
    diameter: float,
    drag_coefficient: float,
) -> RodProperties:
    start = generic_rope()
    start = replace(
        start,
        diameter=diameter,
        linear_density=linear_density or start.linear_density,
        drag_coefficient=drag_coefficient,
    )
    if linear_density is not None and not linear_density > 0.0:
        raise ValueError(f"--linear-density must be positive, got {linear_density} kg/m")
    if bending_stiffness is None:
        # Keep the default ratio of stiffness to weight, whatever diameter and density are.
        return start.with_stiffness(generic_rope().bending_stiffness)
    if not (np.isfinite(bending_stiffness) and bending_stiffness > 0.0):
        raise ValueError(f"--bending-stiffness must be positive, got {bending_stiffness} N m^2")
    return start.with_stiffness(bending_stiffness)


def _answer(
    file: Path, train: Path | None, fit: Fit, predicted: Prediction, linear_density: float | None
) -> dict[str, Any]:
    measured = predicted.motion
    scores = 100.0 * predicted.scores
    frames = predicted.vertices.shape[1] - predicted.first
    answer: dict[str, Any] = {
        "file": str(file),
        "fitted_to": str(train or file),
        "fit_seconds": fit.seconds,
        "predicted_seconds": frames * measured.dt,
        "error_cm": float(np.mean(scores)),
        "error_cm_per_sequence": scores.tolist(),
        "parameters": {f.name: _without_name(asdict(f)) for f in findings(fit)},
        "cannot_tell": undetermined(fit, linear_density is not None),
    }
    if linear_density is not None:
        answer["bending_stiffness_N_m2"] = fit.properties.bending_stiffness
    return answer


def _without_name(finding: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in finding.items() if key != "name"}


def _show(answer: dict[str, Any], console: Terminal) -> None:
    table = Table("", "value", "± 1 sd", "unit", "known")
    for name, f in answer["parameters"].items():
        determined = "yes" if f["known"] else "no"
        table.add_row(
            name,
            f"{f['value']:.4g}",
            f"{f['standard_deviation']:.2g}",
            f["unit"],
            determined,
        )
    console.print(table)
    console.print("Not identifiable from this motion:")
    for line in answer["cannot_tell"]:
        console.print(f"  {line}")
    each = " ".join(f"{score:.2f}" for score in answer["error_cm_per_sequence"])
    console.print(
        f"Mean absolute error over {answer['predicted_seconds']:.2f} s open loop: "
        f"{answer['error_cm']:.3f} cm  ({each})"
    )


@contextmanager
def _progress(console: Terminal) -> Iterator[ReportProgress]:
    with progress_bar(console) as progress:
        bar = progress.add_task("", total=1.0)
        yield lambda what, share: progress.update(bar, description=what, completed=share)
