"""`lariat see IMAGE`: the rope in one picture, from any camera, without a cell."""

from __future__ import annotations

import json as jsons
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import tyro
from jaxtyping import Float64, UInt8, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose
from shared.configuration import ConfigurationError

if TYPE_CHECKING:
    from services.perception.centerline.estimate import CenterlineEstimate
    from services.perception.image.detector import DetectedRope

LINE = (255, 0, 255)
"""Colour that centre lines are drawn in."""
SEEN, BRIDGED = (0, 120, 255), (255, 160, 0)
"""Colours of nodes that were seen, and of others."""
FINE = 640
"""Longer side of a picture per pixel of a line's thickness, from two on."""
SHADOW = 0.5
"""Part of a rope that could be a shadow from which on that is said."""
MANY = 12
"""Pieces of a rope from which on that is said."""
BRIGHT = 99.5
"""Percentile of a picture of more than eight bits that becomes white."""
SUBPIXEL = 4
"""Bits of the fixed-point coordinates that lines are drawn with."""


def main(
    image: tyro.conf.Positional[Path],
    /,
    color: tuple[int, int, int] | None = None,
    depth: Path | None = None,
    camera: Path | None = None,
    length: float | None = None,
    diameter: float | None = None,
    nodes: int = 40,
    out: Path | None = None,
) -> int:
    """Find the rope in a picture: its centre lines, and its nodes where there is depth as well.

    Answers with one JSON object: `lines`, columns and rows of the pixels along each piece of the
    rope that stands out most, `color` and `width` of it, `others` where more ropes stand out, and
    `notes` on what may be wrong.
    With depth, camera, length and diameter also `nodes`, in metres in the camera's optical frame
    (x right, y down, z forward), each with `sigma` and `observed`.

    Examples:
      lariat see cable.jpg --color 230 110 30 --out seen.png
      lariat see cable.png --depth depth.png --camera k.json --length 0.55 --diameter 0.005

    Args:
        image: The picture.
        color: Red, green and blue of the rope; found in the picture without it.
        depth: 16-bit image of the same pixels in millimetres, 0 where nothing was measured.
        camera: JSON file with fx, fy, cx and cy in pixels.
        length: Of the rope [m].
        diameter: Of the rope [m].
        nodes: At equal distances along the rope.
        out: File for the picture with what was found drawn over it.
    """
    from services.perception.centerline.estimate import RopeModel
    from services.perception.centerline.estimator import CenterlineEstimator
    from services.perception.centerline.settings import CenterlineSettings
    from services.perception.image import detector

    measured = None
    if depth is not None:
        if camera is None or length is None or diameter is None:
            raise ConfigurationError(
                "--depth needs --camera, --length and --diameter: nodes are fitted in metres"
            )
        measured = _depth(depth), camera, RopeModel(length, diameter / 2.0, nodes)
    picture = _picture(image)
    drawn = picture.copy()
    try:
        rope = detector.detect_rope(picture, color)
    except ValueError as error:
        raise ConfigurationError(f"{image}: {error}") from error
    answer = _lines(rope)
    answer["notes"] = notes = _notes(rope)
    for note in notes:
        print(f"lariat: {image}: {note}", file=sys.stderr)
    if measured is None:
        answer["others"] = [_lines(other) for other in rope.others]
        thick = max(2, round(max(picture.shape) / FINE))
        for line in [line for found in (rope, *rope.others) for line in found.lines]:
            _draw(drawn, line.pixels, LINE, thick)
    else:
        ranges, known, model = measured
        view = Camera(_intrinsics(known, picture), Pose(np.zeros(3), poses.IDENTITY))
        # What is rope is known already: brightness says it.
        likeness = cv2.cvtColor(rope.likeness, cv2.COLOR_GRAY2RGB)
        estimator = CenterlineEstimator(view, model, CenterlineSettings())
        found = estimator.estimate(np.asarray(likeness, np.uint8), ranges)
        answer |= _words(found)
        if not found.lost:
            _draw_nodes(drawn, view.project(found.positions)[0], found)
    if out is not None and not _written(out, drawn):
        raise ConfigurationError(f"{out} cannot be written; end its name in .png or .jpg")
    print(jsons.dumps(answer))
    return 1 if answer.get("lost") else 0


def _lines(rope: DetectedRope) -> dict[str, object]:
    return {
        "color": list(rope.color),
        "width": round(rope.width, 2),
        "shadow": round(rope.shadow, 2),
        "lines": [np.round(line.pixels, 2).tolist() for line in rope.lines],
    }


def _notes(rope: DetectedRope) -> list[str]:
    """Why it may be no rope."""
    notes = []
    if rope.shadow > SHADOW:
        notes.append(
            "what was found has the colours of what lies around it, only darker: it may be a "
            "shadow; if it is, give the rope's --color"
        )
    if len(rope.lines) > MANY:
        notes.append(
            f"what was found is in {len(rope.lines)} pieces: it may be a pattern and no rope; if "
            "it is, give the rope's --color"
        )
    return notes


def _written(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> bool:
    try:
        return cv2.imwrite(str(path), picture[..., ::-1])
    except cv2.error:
        # No encoder is known for the name's ending.
        return False


def _words(found: CenterlineEstimate) -> dict[str, object]:
    if found.lost:
        return {"lost": found.lost}
    return {
        "nodes": np.round(found.positions, 5).tolist(),
        "sigma": np.round(found.sigma, 5).tolist(),
        "observed": found.observed.tolist(),
        "doubt": round(found.doubt, 3),
    }


def _picture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    # As the camera was held, and with all the bits that it has.
    image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    if image is None:
        raise ConfigurationError(f"{path} is no picture that can be read; give a PNG or a JPEG")
    if image.dtype != np.uint8:
        # Sixteen bits seldom hold more than twelve or fourteen.
        bright = float(np.percentile(image[::4, ::4], BRIGHT)) or 1.0
        image = np.clip(image * (255.0 / bright), 0.0, 255.0).astype(np.uint8)
    return np.ascontiguousarray(image[..., ::-1])


def _depth(path: Path) -> UInt16[np.ndarray, "h w"]:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise ConfigurationError(f"{path} is no depth image; give a 16-bit PNG in millimetres")
    return np.asarray(image, np.uint16)


def _intrinsics(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> Intrinsics:
    height, width = picture.shape[:2]
    try:
        known = jsons.loads(path.read_text())
        return Intrinsics(width, height, *(float(known[k]) for k in ("fx", "fy", "cx", "cy")))
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise ConfigurationError(
            f"{path}: {error!r}; give a JSON object with fx, fy, cx and cy in pixels"
        ) from error


def _draw(
    picture: UInt8[np.ndarray, "h w 3"],
    pixels: Float64[np.ndarray, "k 2"],
    color: tuple[int, int, int],
    thick: int = 2,
) -> None:
    fixed = np.rint(pixels * 2**SUBPIXEL).astype(np.int32)
    cv2.polylines(picture, [fixed[:, None]], False, color, thick, cv2.LINE_AA, SUBPIXEL)


def _draw_nodes(
    picture: UInt8[np.ndarray, "h w 3"],
    pixels: Float64[np.ndarray, "n 2"],
    found: CenterlineEstimate,
) -> None:
    _draw(picture, pixels, LINE)
    for pixel, seen in zip(np.rint(pixels).astype(int).tolist(), found.observed, strict=True):
        cv2.circle(picture, tuple(pixel), 3, SEEN if seen else BRIDGED, -1, cv2.LINE_AA)
