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
from rich.console import Console
from rich.table import Table

from lariat.configuration import ConfigurationError, refusing
from lariat.files.bounded_file import read_file
from lariat.files.image_header import check_image
from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose

if TYPE_CHECKING:
    from lariat.perception.centerline.estimate import CenterlineEstimate
    from lariat.perception.image.detector import Detection

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
    nodes: int = 40,
    output: Path | None = None,
    labels: Path | None = None,
    json: bool = False,
) -> int:
    """Find the ropes in an image: their centrelines, and with depth one rope's nodes in space.

    Prints a table, with --json one JSON object: `ropes`, longest first, each with `lines` (columns
    and rows in order along it, bridged where another rope covers it), `width`, `color` and
    `p_wrong`; `crossings`, each with its place, the two ropes, the upper one first, and whether
    that is `known`; `p_wrong`, the probability that a rope is missing, too much or wrong; `notes`
    on what may be wrong. With depth, camera, length and diameter also `nodes` of the longest rope,
    in metres in the camera's optical frame (x right, y down, z forward), each with `sigma` and
    `observed`, and `node_p_wrong`.

    Examples:
      lariat see cable.jpg --color 230 110 30 --output seen.png
      lariat see cable.png --depth depth.png --camera k.json --length 0.55 --diameter 0.005

    Args:
        image: Colour image, PNG or JPEG.
        color: Red, green and blue of the ropes to find; by default all ropes are found.
        depth: 16-bit depth image of the same pixels [mm], 0 where nothing was measured.
        camera: JSON file with fx, fy, cx and cy in pixels.
        length: Length of the rope [m].
        diameter: Diameter of the rope [m].
        nodes: Number of nodes, evenly spaced along the rope.
        output: Image file to write, with the result drawn over the image.
        labels: Image file to write: 0 at the background, k where the k-th rope is seen.
        json: Answer with one JSON object on standard output.
    """
    from lariat.perception.centerline.estimate import RopeDimensions
    from lariat.perception.centerline.estimator import CenterlineEstimator
    from lariat.perception.centerline.settings import CenterlineSettings
    from lariat.perception.image import detector

    measured = None
    if depth is not None:
        if camera is None or length is None or diameter is None:
            raise ConfigurationError(
                "--depth needs --camera, --length and --diameter: nodes are fitted in metres"
            )
        measured = _read_depth(depth), camera, RopeDimensions(length, diameter / 2.0, nodes)
    picture = _read_image(image)
    drawn = picture.copy()
    try:
        detection = detector.detect_ropes(picture, color)
    except ValueError as error:
        raise ConfigurationError(f"{image}: {error}") from error
    answer = _answer(detection)
    answer["notes"] = notes = _notes(detection)
    for note in notes:
        print(f"lariat: {image}: {note}", file=sys.stderr)
    if labels is not None and not _write_image(labels, detection.labels):
        raise ConfigurationError(f"{labels}: cannot be written; use the ending .png")
    if measured is None:
        thick = max(2, round(max(picture.shape) / PIXELS_PER_THICKNESS))
        for k, rope in enumerate(detection.ropes):
            for line in rope.lines:
                _draw(drawn, line.pixels, LINE_COLORS[k % len(LINE_COLORS)], thick)
    else:
        ranges, known, model = measured
        view = Camera(_read_intrinsics(known, picture), Pose(np.zeros(3), poses.IDENTITY))
        # The rope's pixels are known already: pass their likeness as brightness.
        own = cv2.dilate((detection.labels == 1).view(np.uint8), np.ones((5, 5), np.uint8))
        likeness = cv2.cvtColor(detection.likeness * own, cv2.COLOR_GRAY2RGB)
        estimator = CenterlineEstimator(view, model, CenterlineSettings())
        found = estimator.estimate(np.asarray(likeness, np.uint8), ranges)
        answer |= _node_answer(found)
        if not found.lost:
            _draw_nodes(drawn, view.project(found.positions)[0], found)
    if output is not None and not _write_image(output, drawn):
        raise ConfigurationError(f"{output}: cannot be written; use the ending .png or .jpg")
    if json:
        print(jsons.dumps(answer))
    else:
        _show(answer, detection)
    return 1 if answer.get("lost") else 0


def _show(answer: dict[str, Any], detection: Detection) -> None:
    """Print the table of the ropes, and what else was found."""
    table = Table("rope", "colour", r"width \[px]", r"length \[px]", "P(wrong)", title="Ropes")
    for k, rope in enumerate(detection.ropes):
        length = sum(
            float(np.linalg.norm(np.diff(line.pixels, axis=0), axis=1).sum()) for line in rope.lines
        )
        color = " ".join(map(str, rope.color))
        table.add_row(str(k), color, f"{rope.width:.1f}", f"{length:.0f}", f"{rope.p_wrong:.2f}")
    console = Console()
    console.print(table)
    known = sum(crossing.known for crossing in detection.crossings)
    console.print(f"{len(detection.crossings)} crossings, {known} with a known order")
    console.print(f"The answer is wrong with a probability of {detection.p_wrong:.2f}.")
    if "lost" in answer:
        console.print(f"No nodes: {answer['lost']}", markup=False)
    elif "nodes" in answer:
        sigma = 1e3 * float(np.median(answer["sigma"]))
        console.print(
            f"{len(answer['nodes'])} nodes, standard deviation {sigma:.2f} mm (median), wrong with "
            f"a probability of {answer['node_p_wrong']:.2f}; --json prints them"
        )


def _answer(detection: Detection) -> dict[str, object]:
    ropes = [
        {
            "color": list(rope.color),
            "width": round(rope.width, 2),
            "p_wrong": round(rope.p_wrong, 3),
            "lines": [np.round(line.pixels, 2).tolist() for line in rope.lines],
        }
        for rope in detection.ropes
    ]
    crossings = [
        {"at": np.round(c.position, 1).tolist(), "ropes": list(c.ropes), "known": c.known}
        for c in detection.crossings
    ]
    return {"ropes": ropes, "crossings": crossings, "p_wrong": round(detection.p_wrong, 3)}


def _notes(detection: Detection) -> list[str]:
    """Reasons why the result may be wrong."""
    from lariat.perception.image.p_wrong import DOUBTFUL

    notes = []
    if detection.p_wrong > DOUBTFUL:
        doubtful = [str(k) for k, rope in enumerate(detection.ropes) if rope.p_wrong > DOUBTFUL]
        which = f", rope {' and '.join(doubtful)} above all" if doubtful else ""
        notes.append(
            f"the answer is wrong with a probability of {detection.p_wrong:.2f}{which}; give the "
            "ropes' --color, or an image with a plainer ground"
        )
    if detection.shadow > SHADOW_NOTE_SHARE:
        notes.append(
            "the result has the colours of its surroundings, only darker: it may be a shadow; if "
            "so, give the rope's --color"
        )
    return notes


def _write_image(path: Path, picture: UInt8[np.ndarray, "h w *c"]) -> bool:
    try:
        return cv2.imwrite(str(path), picture[..., ::-1] if picture.ndim == 3 else picture)
    except cv2.error:
        # OpenCV has no encoder for this file ending.
        return False


def _node_answer(found: CenterlineEstimate) -> dict[str, object]:
    if found.lost:
        return {"lost": found.lost}
    return {
        "nodes": np.round(found.positions, 5).tolist(),
        "sigma": np.round(found.sigma, 5).tolist(),
        "observed": found.observed.tolist(),
        "node_p_wrong": round(found.p_wrong, 3),
    }


def _read_image(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    # Rotated by its EXIF tag, and with its full bit depth.
    image = _decode(path, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    if image is None:
        raise ConfigurationError(f"{path}: not a readable image; give a PNG or a JPEG")
    if image.dtype != np.uint8:
        # Sixteen-bit images seldom use more than twelve or fourteen bits.
        bright = float(np.percentile(image[::4, ::4], WHITE_PERCENTILE)) or 1.0
        image = np.clip(image * (255.0 / bright), 0.0, 255.0).astype(np.uint8)
    return np.ascontiguousarray(image[..., ::-1])


def _decode(path: Path, flags: int) -> np.ndarray | None:
    """Pixels of an image file; None if it is damaged."""
    try:
        content = read_file(path, MAX_PICTURE_FILE_SIZE)
        check_image(content, MAX_PICTURE_PIXEL_COUNT)
    except OSError as error:
        raise ConfigurationError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}; give a PNG or a JPEG") from error
    return cv2.imdecode(np.frombuffer(content, np.uint8), flags)


def _read_depth(path: Path) -> UInt16[np.ndarray, "h w"]:
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise ConfigurationError(f"{path}: not a depth image; give a 16-bit PNG in millimetres")
    return np.asarray(image, np.uint16)


def _read_intrinsics(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> Intrinsics:
    height, width = picture.shape[:2]
    with refusing(f"{path}: give a JSON object with fx, fy, cx and cy in pixels"):
        known = jsons.loads(read_file(path, MAX_INTRINSICS_SIZE))
        return Intrinsics(width, height, *(float(known[k]) for k in ("fx", "fy", "cx", "cy")))


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
    found: CenterlineEstimate,
) -> None:
    _draw(picture, pixels, LINE_COLORS[0])
    for pixel, seen in zip(np.rint(pixels).astype(int).tolist(), found.observed, strict=True):
        cv2.circle(
            picture, tuple(pixel), 3, OBSERVED_COLOR if seen else HIDDEN_COLOR, -1, cv2.LINE_AA
        )
