"""`lariat see IMAGE`: the ropes in a single image of any camera."""

from __future__ import annotations

import json as jsons
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import tyro
from jaxtyping import Float64, UInt8, UInt16
from rich.table import Table
from scipy.ndimage import median_filter

from cli.terminal import Terminal
from lariat.configuration import ConfigurationError, refusing
from lariat.files.bounded_file import read_file
from lariat.files.image_file import decode_image
from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose

if TYPE_CHECKING:
    from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions
    from lariat.perception.image.detector import Detection
    from lariat.perception.rgbd.lens_distortion import Undistortion

LINE_COLORS = ((255, 0, 255), (0, 255, 255), (255, 255, 0), (0, 255, 0), (255, 128, 0))
"""Colours of drawn centrelines, one rope after the other."""
OBSERVED_COLOR, HIDDEN_COLOR = (0, 120, 255), (255, 160, 0)
"""Colours of observed and of hidden nodes."""
PIXELS_PER_THICKNESS = 640
"""Longer side of an image per pixel of a line's thickness [pixels]; lines have at least two."""
SHADOW_NOTE_SHARE = 0.5
"""Share of the ropes that could be a shadow, above which a note warns."""
MAX_PICTURE_PIXEL_COUNT = 2**27
"""Largest number of pixels of a picture; it takes 0.4 GB."""
MAX_PICTURE_FILE_SIZE = 2**28
"""Largest picture file [bytes]."""
MAX_INTRINSICS_SIZE = 2**16
"""Largest file of a camera's intrinsics [bytes]."""
MILLIMETRE = 1e-3
"""Unit of a depth image, unless the rope's length tells another [m]."""
OTHER_UNITS = (1e-4, 2.5e-4, 2e-4, 1.25e-4, 1e-5, 1e-2)
"""Units of other depth images: RealSense D405, L515 and SR300, TUM's data sets, rarer ones [m]."""
UNIT_TOLERANCE = 0.12
"""Difference of the rope's length from the told one up to which another unit is taken [-]."""
MAX_LENGTH, MAX_DIAMETER = 100.0, 0.5
"""Length and diameter from which on others than metres are told [m]."""
LENGTH_TOLERANCE = 0.25
"""Difference from the told length above which the nodes are no answer [-]."""
WIDTH_RATIO, MIN_WIDTH = 1.7, 4.0
"""Ratio of the seen and the told diameter above which a note warns [-], of ropes of so many
pixels."""
WHITE_PERCENTILE = 99.5
"""Percentile of an image of more than eight bits that becomes white [%]."""
SUBPIXEL_BITS = 4
"""Fractional bits of the fixed-point coordinates of drawn lines."""


def main(
    image: tyro.conf.Positional[Path],
    /,
    color: tuple[int, int, int] | None = None,
    depth: Path | None = None,
    camera: Path | None = None,
    length: float | None = None,
    diameter: float | None = None,
    depth_scale: float | None = None,
    nodes: int = 40,
    doubtful: float | None = None,
    output: Path | None = None,
    labels: Path | None = None,
    json: bool = False,
) -> int:
    """Find the ropes in an image: their centrelines, and with depth one rope's nodes in space.

    Prints a table, with --json one JSON object: `ropes`, longest first, each with `lines` (columns
    and rows in order along it, bridged where another rope covers it), `width`, `color`, `p_wrong`
    and whether that makes it `doubtful`; `crossings`, each with its place, the two ropes, the upper
    one first, and whether that is `known`; `p_wrong`, the probability that a rope is missing, too
    much or wrong; `notes` on what may be wrong. With depth, camera, length and diameter also
    `nodes` of the longest rope, in metres in the camera's optical frame (x right, y down, z
    forward), each with `sigma` and `observed`, and `node_p_wrong`. The exit code is 1 where no rope
    is found, or no nodes.

    Examples:
      lariat see cable.jpg --color 230 110 30 --output seen.png
      lariat see cable.png --depth depth.png --camera k.json --length 0.55 --diameter 0.005

    Args:
        image: Colour image, PNG or JPEG.
        color: Red, green and blue of the ropes to find; by default all ropes are found.
        depth: 16-bit depth image of the same pixels, 0 where nothing was measured.
        camera: Camera file of RealSense, Open3D, OpenCV or ROS, or JSON with fx, fy, cx and cy in
            pixels. Where it has a distortion, the answer is about the undistorted image.
        length: Length of the rope [m].
        diameter: Diameter of the rope [m].
        depth_scale: Metres of a unit of the depth image; by default 0.001, or the unit of another
            camera with which the rope is as long as it is.
        nodes: Number of nodes, evenly spaced along the rope.
        doubtful: Probability of being wrong above which an answer is doubtful; 0.3 by default.
        output: Image file to write, with the result drawn over the image.
        labels: Image file to write: 0 at the background, k where the k-th rope is seen.
        json: Answer with one JSON object on standard output.
    """
    from lariat.perception.centerline.estimate import RopeDimensions
    from lariat.perception.image import detector
    from lariat.perception.image.p_wrong import DOUBTFUL

    threshold = DOUBTFUL if doubtful is None else doubtful
    for option, number, most in (
        ("doubtful", doubtful, 1.0),
        ("depth-scale", depth_scale, 1.0),
        ("length", length, MAX_LENGTH),
        ("diameter", diameter, MAX_DIAMETER),
    ):
        if number is not None and not 0.0 < number < most:
            unit = " of metres" if most != 1.0 else ""
            raise ConfigurationError(
                f"--{option} is {number:g}; give a number between 0 and {most:g}{unit}"
            )
    picture = _read_image(image)
    ranges = intrinsics = rope = None
    if depth is not None:
        if camera is None or length is None or diameter is None:
            raise ConfigurationError(
                "--depth needs --camera, --length and --diameter: nodes are fitted in metres"
            )
        rope = RopeDimensions(length, diameter / 2.0, nodes)
        ranges = _read_depth(depth, picture)
        intrinsics, undistorted = _read_camera(camera, picture)
        picture, ranges = undistorted(picture, ranges)
    drawn = picture.copy()
    try:
        detection = detector.detect_ropes(picture, color)
    except ValueError as error:
        raise ConfigurationError(f"{image}: {error}") from error
    answer = _answer(detection, threshold)
    notes = _notes(detection, threshold, color)
    if labels is not None and not _write_image(labels, detection.labels):
        raise ConfigurationError(f"{labels}: cannot be written; use the ending .png")
    if ranges is None or intrinsics is None or rope is None:
        thick = max(2, round(max(picture.shape) / PIXELS_PER_THICKNESS))
        for k, seen in enumerate(detection.ropes):
            for line in seen.lines:
                _draw(drawn, line.pixels, LINE_COLORS[k % len(LINE_COLORS)], thick)
    elif detection.ropes:
        view = Camera(intrinsics, Pose(np.zeros(3), poses.IDENTITY))
        estimate, more = _nodes(detection, view, ranges, rope, depth_scale)
        notes += [note for note in (intrinsics.doubt, *more) if note]
        answer |= _node_answer(estimate)
        if not estimate.lost:
            _draw_nodes(drawn, view.project(estimate.positions)[0], estimate)
    answer["notes"] = notes
    for note in notes:
        print(f"lariat: {image}: {note}", file=sys.stderr)
    if output is not None and not _write_image(output, drawn):
        raise ConfigurationError(f"{output}: cannot be written; use the ending .png or .jpg")
    if json:
        print(jsons.dumps(answer))
    else:
        _show(answer, detection)
    return 1 if answer.get("lost") or not detection.ropes else 0


def _nodes(
    detection: Detection,
    view: Camera,
    ranges: UInt16[np.ndarray, "h w"],
    rope: RopeDimensions,
    scale: float | None,
) -> tuple[CenterlineEstimate, list[str]]:
    """Nodes of the longest rope, and notes on the unit of the depth image and the diameter."""
    from lariat.perception.centerline.estimate import CenterlineEstimate
    from lariat.perception.centerline.estimator import CenterlineEstimator
    from lariat.perception.centerline.settings import CenterlineSettings

    notes, unit = [], scale or MILLIMETRE
    along = _length_in_units(detection, view, ranges)
    if scale is None and not _agrees(along * unit, rope.length, LENGTH_TOLERANCE):
        fitting = [u for u in OTHER_UNITS if _agrees(along * u, rope.length, UNIT_TOLERANCE)]
        if len(fitting) == 1:
            unit = fitting[0]
            notes.append(
                f"in millimetres the rope would be {1e-3 * along:.2f} m long: the depth image is "
                f"read in units of {1e3 * unit:g} mm; --depth-scale gives another"
            )
    seen_width = detection.ropes[0].width
    length_in_pixels = polylines.length(detection.ropes[0].lines[0].pixels)
    width = seen_width * along * unit / max(length_in_pixels, 1.0)
    ratio = max(width, 1e-9) / (2.0 * rope.radius)
    if along and seen_width > MIN_WIDTH and not 1.0 / WIDTH_RATIO < ratio < WIDTH_RATIO:
        notes.append(
            f"the rope is {1e3 * width:.2g} mm wide, not {2e3 * rope.radius:g} mm; check "
            "--diameter, --depth-scale and --camera"
        )
    # The rope's pixels are known already: pass their likeness as brightness.
    own = cv2.dilate((detection.labels == 1).view(np.uint8), np.ones((5, 5), np.uint8))
    likeness = cv2.cvtColor(detection.likeness * own, cv2.COLOR_GRAY2RGB)
    millimetres = np.rint(ranges * (unit / MILLIMETRE))
    depth = np.where(millimetres < 2**16, millimetres, 0).astype(np.uint16)
    estimator = CenterlineEstimator(view, rope, CenterlineSettings())
    estimate = estimator.estimate(np.asarray(likeness, np.uint8), depth)
    if estimate.lost:
        return estimate, notes
    # A rope that is hidden in part is seen shorter than it is, never longer.
    seen, own_length = along * unit, polylines.length(estimate.positions)
    longer = max(seen, own_length)
    if longer > (1.0 + LENGTH_TOLERANCE) * rope.length:
        return CenterlineEstimate.failed(
            f"the depth image shows {longer:.2f} m of a rope of {rope.length:g} m; check "
            f"--depth-scale ({unit:g} m a unit here), --length and --camera"
        ), notes
    if own_length < (1.0 - LENGTH_TOLERANCE) * rope.length:
        return CenterlineEstimate.failed(
            f"the nodes are {own_length:.2f} m long, not {rope.length:g} m; check --depth-scale "
            f"({unit:g} m a unit here), --length and --camera"
        ), notes
    return estimate, notes


def _length_in_units(
    detection: Detection, view: Camera, ranges: UInt16[np.ndarray, "h w"]
) -> float:
    """Length of the longest rope in units of the depth image."""
    line = detection.ropes[0].lines[0].pixels
    at = np.clip(np.rint(line).astype(int), 0, np.array(ranges.shape[::-1]) - 1)
    depth = ranges[at[:, 1], at[:, 0]].astype(float)
    measured = np.flatnonzero(depth)
    if len(measured) < 2:
        return 0.0
    depth = median_filter(np.interp(np.arange(len(line)), measured, depth[measured]), 9)
    # Steps across the view alone: depth is noisier than it changes from pixel to pixel.
    steps = np.diff(line, axis=0) / [view.intrinsics.fx, view.intrinsics.fy]
    return float(np.sum(np.linalg.norm(steps, axis=1) * depth[1:]))


def _agrees(length: float, told: float, tolerance: float) -> bool:
    return abs(length - told) < tolerance * told


def _show(answer: dict[str, Any], detection: Detection) -> None:
    """Print the table of the ropes, and what else was found."""
    table = Table("rope", "colour", "width [px]", "length [px]", "P(wrong)", title="Ropes")
    for k, rope in enumerate(detection.ropes):
        length = sum(
            float(np.linalg.norm(np.diff(line.pixels, axis=0), axis=1).sum()) for line in rope.lines
        )
        color = " ".join(map(str, rope.color))
        table.add_row(str(k), color, f"{rope.width:.1f}", f"{length:.0f}", f"{rope.p_wrong:.2f}")
    console = Terminal()
    console.print(table)
    ordered = sum(crossing.known for crossing in detection.crossings)
    console.print(f"{len(detection.crossings)} crossings, {ordered} with a known order")
    console.print(f"The answer is wrong with a probability of {detection.p_wrong:.2f}.")
    if "lost" in answer:
        console.print(f"No nodes: {answer['lost']}")
    elif "nodes" in answer:
        sigma = 1e3 * float(np.median(answer["sigma"]))
        console.print(
            f"{len(answer['nodes'])} nodes, standard deviation {sigma:.2f} mm (median), wrong with "
            f"a probability of {answer['node_p_wrong']:.2f}; --json prints them"
        )


def _answer(detection: Detection, threshold: float) -> dict[str, object]:
    ropes = [
        {
            "color": list(rope.color),
            "width": round(rope.width, 2),
            "p_wrong": round(rope.p_wrong, 3),
            "doubtful": rope.p_wrong > threshold,
            "lines": [np.round(line.pixels, 2).tolist() for line in rope.lines],
        }
        for rope in detection.ropes
    ]
    crossings = [
        {"at": np.round(c.position, 1).tolist(), "ropes": list(c.ropes), "known": c.known}
        for c in detection.crossings
    ]
    return {"ropes": ropes, "crossings": crossings, "p_wrong": round(detection.p_wrong, 3)}


def _notes(detection: Detection, threshold: float, color: tuple[int, int, int] | None) -> list[str]:
    """Reasons why the result may be wrong."""
    notes = []
    advice = "give an image with a plainer ground, or in which the ropes are larger"
    if color is None:
        advice = f"give the ropes' --color, or {advice.removeprefix('give ')}"
    if not detection.ropes:
        what = "" if color is None else f" of the colour {' '.join(map(str, color))}"
        notes.append(f"no rope{what} found; {advice}")
    if detection.p_wrong > threshold:
        doubtful = [str(k) for k, rope in enumerate(detection.ropes) if rope.p_wrong > threshold]
        which = f", rope {' and '.join(doubtful)} above all" if doubtful else ""
        notes.append(
            f"the answer is wrong with a probability of {detection.p_wrong:.2f}{which}; {advice}"
        )
    if detection.left_out:
        notes.append(
            f"{detection.left_out} shorter pieces of what may be ropes were left out: there are "
            "too many; crop the image, or give one with a plainer ground"
        )
    if detection.shadow > SHADOW_NOTE_SHARE:
        notes.append(
            "the result has the colours of its surroundings, only darker: it may be a shadow"
            + ("; if so, give the rope's --color" if color is None else "")
        )
    return notes


def _write_image(path: Path, picture: UInt8[np.ndarray, "h w *c"]) -> bool:
    try:
        return cv2.imwrite(str(path), picture[..., ::-1] if picture.ndim == 3 else picture)
    except cv2.error:
        # OpenCV has no encoder for this file ending.
        return False


def _node_answer(estimate: CenterlineEstimate) -> dict[str, object]:
    if estimate.lost:
        return {"lost": estimate.lost}
    return {
        "nodes": np.round(estimate.positions, 5).tolist(),
        "sigma": np.round(estimate.sigma, 5).tolist(),
        "observed": estimate.observed.tolist(),
        "node_p_wrong": round(estimate.p_wrong, 3),
    }


def _read_image(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    # Rotated by its EXIF tag, and with its full bit depth.
    image = _decode(path, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    if image.dtype != np.uint8:
        # Sixteen-bit images seldom use more than twelve or fourteen bits.
        bright = float(np.percentile(image[::4, ::4], WHITE_PERCENTILE)) or 1.0
        image = np.clip(image * (255.0 / bright), 0.0, 255.0).astype(np.uint8)
    return np.ascontiguousarray(image[..., ::-1])


def _decode(path: Path, flags: int) -> np.ndarray:
    """Pixels of an image file."""
    try:
        content = read_file(path, MAX_PICTURE_FILE_SIZE)
        return decode_image(content, flags, MAX_PICTURE_PIXEL_COUNT)
    except OSError as error:
        raise ConfigurationError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}; give a PNG or a JPEG") from error


def _read_depth(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> UInt16[np.ndarray, "h w"]:
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise ConfigurationError(f"{path}: not a depth image; give a 16-bit PNG")
    _check_size(path, "depth image", image.shape[1::-1], picture)
    return np.asarray(image, np.uint16)


def _read_camera(
    path: Path, picture: UInt8[np.ndarray, "h w 3"]
) -> tuple[Intrinsics, Undistortion]:
    from lariat.perception.rgbd.camera_file import read_camera
    from lariat.perception.rgbd.lens_distortion import Undistortion

    height, width = picture.shape[:2]
    with refusing(f"{path}: not a camera file of RealSense, Open3D, OpenCV or ROS"):
        calibration = read_camera(read_file(path, MAX_INTRINSICS_SIZE))
    if calibration.size is not None:
        _check_size(path, "camera", calibration.size, picture)
    with refusing(f"{path}"):
        intrinsics = Intrinsics(width, height, *calibration.focal, *calibration.center)
        return intrinsics, Undistortion(intrinsics, calibration.distortion, calibration.model)


def _check_size(
    path: Path, what: str, size: tuple[int, ...], picture: UInt8[np.ndarray, "h w 3"]
) -> None:
    if tuple(size) != picture.shape[1::-1]:
        raise ConfigurationError(
            f"{path}: the {what} has {size[0]} x {size[1]} pixels and the colour image "
            f"{picture.shape[1]} x {picture.shape[0]}; align depth to colour, and give the colour "
            "camera's file"
        )


def _draw(
    picture: UInt8[np.ndarray, "h w 3"],
    pixels: Float64[np.ndarray, "k 2"],
    color: tuple[int, int, int],
    thick: int = 2,
) -> None:
    fixed = np.rint(pixels * 2**SUBPIXEL_BITS).astype(np.int32)
    cv2.polylines(picture, [fixed[:, None]], False, color, thick, cv2.LINE_AA, SUBPIXEL_BITS)


def _draw_nodes(
    picture: UInt8[np.ndarray, "h w 3"],
    pixels: Float64[np.ndarray, "n 2"],
    estimate: CenterlineEstimate,
) -> None:
    _draw(picture, pixels, LINE_COLORS[0])
    for pixel, seen in zip(np.rint(pixels).astype(int).tolist(), estimate.observed, strict=True):
        cv2.circle(
            picture, tuple(pixel), 3, OBSERVED_COLOR if seen else HIDDEN_COLOR, -1, cv2.LINE_AA
        )
