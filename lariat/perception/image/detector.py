"""Detection of ropes in a single image of any camera: no calibration, no cell, no rope model.

What a network sees is cut into fragments at its crossings, the fragments are joined to lines by the
least total bending, every line is measured along its axis, and a judge states the probability that
it is a rope, and that it is a whole one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from lariat.perception.image.assembly import AssembledRope, assemble
from lariat.perception.image.color_model import color_distance
from lariat.perception.image.contrast import could_be_shadow
from lariat.perception.image.flanks import center_between_flanks
from lariat.perception.image.foreground import Foreground, find_foregrounds
from lariat.perception.image.layers import Crossing, RopeBand, layer_ropes
from lariat.perception.image.p_wrong import (
    DOUBTFUL,
    ImageFeatures,
    RopeFeatures,
    ambiguity_of_margin,
    image_features,
    p_wrong,
    reported,
)
from lariat.perception.image.width import width_from_radii
from lariat.perception.lines.fragments import cut_fragments
from lariat.perception.lines.ridge import Ridge, extract_ridge
from lariat.perception.lines.segmentation import Color, Region
from lariat.perception.lines.skeleton import Strand

MIN_IMAGE_SIDE = 48
"""Least shorter side of an image [pixels]."""
LIKENESS_PER_LOG_RATIO = 31.0
"""Likeness per unit of the log likelihood ratio."""
MAX_FRAGMENT_COUNT = 160
"""Number of fragments that are joined to lines, the longest: it bounds the time."""
SURE_LOG_ODDS = 2.0
"""Log odds from which a rope is seen for sure [-]."""
SIDE_OFFSET = 3.0
"""Distance from a flank at which the side of a rope is sampled [pixels]."""
TIP_REACH_WIDTHS = 1.0
"""Length over which the direction of a tip is taken, and over which it may go on [rope widths]."""
BENT_TIP_WIDTHS = 0.5
"""Length of a skeleton at a tip, where it bends towards a corner of the mask [rope widths]."""
MIN_LENGTH_WIDTHS = 6.0
"""Least length of a rope [rope widths]."""
MAX_COLOR_DISTANCE = 34.0
"""Distance from the wanted colour up to which a pixel has it [Lab]."""
MIN_COLOR_SHARE = 0.35
"""Least share of a rope's axis that has the wanted colour [-]; a striped rope has it in parts."""
MIN_RELATIVE_LENGTH = 0.06
"""Least length of a rope, relative to the image's longer side."""


@dataclass(frozen=True)
class DetectedRope:
    """Rope in an image."""

    color: Color
    """Colour of its axis in the light of the image."""
    width: float
    """Width [pixels]."""
    lines: list[Ridge]
    """Sub-pixel centrelines, in order along the rope."""
    features: RopeFeatures
    """Evidence that `p_wrong` rests on."""

    @property
    def p_wrong(self) -> float:
        """Probability that this is not exactly one whole rope, 0..1."""
        return p_wrong(self.features)


@dataclass(frozen=True)
class Detection:
    """Ropes in an image."""

    ropes: list[DetectedRope]
    """Ropes, longest first; none where nothing looks like one."""
    crossings: list[Crossing]
    """Places where two of the ropes cross."""
    labels: UInt8[np.ndarray, "h w"]
    """0 at the background, k where rope k is seen, from 1."""
    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to a rope; 128 separates ropes and background."""
    features: ImageFeatures
    """Evidence that `p_wrong` rests on."""
    left_out: int
    """Number of pieces that were left out because there are too many; 0 where all were followed."""

    @property
    def p_wrong(self) -> float:
        """Probability that a rope is missing, too much, or wrong, 0..1."""
        # The answer is right only if each of its ropes is.
        return max(p_wrong(self.features), *(rope.p_wrong for rope in self.ropes), 0.0)

    @property
    def shadow(self) -> float:
        """Largest share of a rope that could be a shadow: the colours of its sides, darker."""
        return max((rope.features.shadow for rope in self.ropes), default=0.0)


@dataclass(frozen=True)
class Candidates:
    """All lines in a foreground, in the pixels of the foreground."""

    lines: list[DetectedRope]
    """Lines, longest first."""
    fragment_count: int
    """Number of fragments of the skeleton."""
    left_out: int
    """Number of fragments that were left out."""
    lab: Float32[np.ndarray, "h w 3"]
    """Slightly smoothed image in Lab."""
    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to a rope."""


def detect_ropes(color: UInt8[np.ndarray, "h w 3"], rope_color: Color | None = None) -> Detection:
    """Return the ropes in an image.

    Args:
        color: Red, green, blue.
        rope_color: Colour of the ropes; None: all that stand out.

    Raises:
        ValueError: The image has too few pixels.
    """
    if min(color.shape[:2]) < MIN_IMAGE_SIDE:
        raise ValueError(
            f"the image has {color.shape[1]} x {color.shape[0]} pixels, too few for a rope; give "
            f"at least {MIN_IMAGE_SIDE} x {MIN_IMAGE_SIDE}"
        )
    wanted = None if rope_color is None else _to_lab(rope_color)
    found = [
        judged(foreground, measure_candidates(foreground, wanted), color.shape[1::-1])
        for foreground in find_foregrounds(color, wanted)
    ]
    if not found:
        nothing = np.zeros(color.shape[:2], np.uint8)
        return Detection([], [], nothing, nothing, image_features([], [], 0, 0.0), 0)
    # A colour adds what the network does not see, or grounds of the same colour; half the size adds
    # what it sees there alone.
    told = wanted is not None
    return max(
        found, key=lambda d: (sum(r.p_wrong < DOUBTFUL for r in d.ropes), told and len(d.ropes) > 0)
    )


def measure_candidates(
    foreground: Foreground, wanted: Float64[np.ndarray, "3"] | None = None
) -> Candidates:
    """Return all lines in a foreground that are long enough for a rope.

    Args:
        foreground: Foreground of an image.
        wanted: Colour of the ropes in Lab; None: any.
    """
    mask, width = foreground.mask, foreground.width
    smooth = cv2.GaussianBlur(foreground.lab, (0, 0), max(0.5, 0.2 * width)).astype(np.float32)
    every = cut_fragments(foreground.skeleton, foreground.radii, smooth, width)
    fragments = sorted(every, key=lambda f: -len(f.points))[:MAX_FRAGMENT_COUNT]
    assembled = assemble(fragments, mask, foreground.ground, width)
    least = max(MIN_LENGTH_WIDTHS * width, MIN_RELATIVE_LENGTH * max(mask.shape))
    kept = [r for r in assembled if len(r.points) > least]
    if wanted is not None:
        kept = [r for r in kept if _has_color(r, foreground.lab, wanted)]
    likeness = 128.0 + LIKENESS_PER_LOG_RATIO * foreground.likelihood
    likeness = np.clip(likeness, 0.0, 255.0).astype(np.uint8)
    # Likeness outside the mask and its margin must not attract the sub-pixel lines.
    likeness *= cv2.dilate(mask, np.ones((5, 5), np.uint8))
    lab = cv2.GaussianBlur(foreground.lab, (0, 0), 0.7).astype(np.float32)
    lines = [_measured(foreground, lab, likeness, r) for r in kept]
    return Candidates(lines, len(fragments), len(every) - len(fragments), lab, likeness)


def judged(foreground: Foreground, found: Candidates, size: tuple[int, int]) -> Detection:
    """Return the ropes among the lines of a foreground, in the pixels of the whole image.

    Args:
        foreground: Foreground of the image.
        found: Its lines.
        size: Width and height of the whole image.
    """
    kept = reported([line.features for line in found.lines])
    ropes = [found.lines[k] for k in kept]
    others = [line.features for k, line in enumerate(found.lines) if k not in kept]
    labels, crossings = label_ropes(ropes, found.lab)
    missing = missing_area(foreground, labels)
    features = image_features([r.features for r in ropes], others, found.fragment_count, missing)
    scale = size[0] / labels.shape[1]
    return Detection(
        [_scaled(r, scale) for r in ropes],
        [replace(c, position=_scaled_position(c.position, scale)) for c in crossings],
        np.asarray(cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST), np.uint8),
        np.asarray(cv2.resize(found.likeness, size, interpolation=cv2.INTER_LINEAR), np.uint8),
        features,
        foreground.left_out + found.left_out,
    )


def missing_area(foreground: Foreground, labels: UInt8[np.ndarray, "h w"]) -> float:
    """Return the area that is surely seen beside the ropes [squared rope widths]."""
    beside = cv2.dilate(labels, np.ones((5, 5), np.uint8)) == 0
    area = np.count_nonzero(beside & (foreground.log_odds > SURE_LOG_ODDS))
    return area / foreground.width**2


def label_ropes(
    ropes: list[DetectedRope], lab: Float32[np.ndarray, "h w 3"]
) -> tuple[UInt8[np.ndarray, "h w"], list[Crossing]]:
    """Return the rope that each pixel shows, counted from 1, and the crossings.

    Args:
        ropes: Ropes.
        lab: Slightly smoothed image in Lab.
    """
    bands = [
        RopeBand(r.lines[0].pixels, r.lines[0].normals, r.width, _to_lab(r.color)) for r in ropes
    ]
    return layer_ropes(bands, lab)


def _rope_features(
    found: AssembledRope,
    lab: Float32[np.ndarray, "h w 3"],
    line: Ridge,
    width: float,
    radii: Float32[np.ndarray, "k"],
    log_odds: Float32[np.ndarray, "k"],
    usual_width: float,
) -> RopeFeatures:
    clear = line.clear if np.any(line.clear) else np.ones(len(line.clear), bool)
    pixels = line.pixels[clear]
    here = _sampled(lab, pixels)
    contrasts, shadows = [], []
    for sign in (-1.0, 1.0):
        beside = _sampled(lab, pixels + sign * (width / 2.0 + SIDE_OFFSET) * line.normals[clear])
        contrasts.append(float(np.median(np.linalg.norm(here - beside, axis=1))))
        shadows.append(float(np.mean(could_be_shadow(here, beside))))
    size = np.array(lab.shape[1::-1]) - 1.0
    at_border = np.minimum(line.pixels, size - line.pixels).min(axis=1) < width
    return RopeFeatures(
        length=float(np.log(len(found.points) / width)),
        unevenness=float(np.std(radii) / np.mean(radii)),
        ambiguity=ambiguity_of_margin(found.margin),
        loose_ends=float(found.loose_end_count),
        contrast=float(np.log(1.0 + min(contrasts))),
        hidden=1.0 - float(np.mean(found.clear)),
        shadow=max(shadows),
        unseen=-float(np.mean(log_odds)),
        at_border=float(np.mean(at_border)),
        cut_off=float(np.any(at_border[[0, -1]]) and np.mean(at_border) < 0.5),
        relative_width=float(np.log(width / usual_width)),
    )


def _sampled(
    lab: Float32[np.ndarray, "h w 3"], pixels: Float64[np.ndarray, "k 2"]
) -> Float32[np.ndarray, "k 3"]:
    """Colours at the nearest pixels of an image."""
    at = np.clip(np.rint(pixels).astype(int), 0, np.array(lab.shape[1::-1]) - 1)
    return lab[at[:, 1], at[:, 0]]


def _has_color(
    rope: AssembledRope, lab: UInt8[np.ndarray, "h w 3"], wanted: Float64[np.ndarray, "3"]
) -> bool:
    """Whether enough of a rope's axis has a colour; the rest may be stripes and highlights."""
    at = np.rint(rope.points[rope.clear]).astype(int)
    distance = color_distance(lab[at[:, 1], at[:, 0]], wanted)
    return float(np.mean(distance < MAX_COLOR_DISTANCE)) > MIN_COLOR_SHARE


def _measured(
    foreground: Foreground,
    smooth: Float32[np.ndarray, "h w 3"],
    likeness: UInt8[np.ndarray, "h w"],
    found: AssembledRope,
) -> DetectedRope:
    """Rope with its sub-pixel axis, width and colour."""
    seen = np.rint(found.points[found.clear]).astype(int)
    radii = foreground.radii[seen[:, 1], seen[:, 0]]
    width = width_from_radii(radii)
    points, clear = _to_tips(found, foreground.mask, width)
    region, no_depth = Region(likeness, foreground.mask, 0, 0), np.zeros((1, 1), np.uint16)
    line = extract_ridge(Strand(points, clear), region, no_depth, width)
    axis, width = center_between_flanks(
        smooth, foreground.evidence, line.pixels, line.normals, line.clear, width
    )
    line = replace(line, pixels=axis)
    red, green, blue = np.median(foreground.image[seen[:, 1], seen[:, 0]], axis=0)
    log_odds = foreground.log_odds[seen[:, 1], seen[:, 0]]
    features = _rope_features(found, smooth, line, width, radii, log_odds, foreground.width)
    return DetectedRope((int(red), int(green), int(blue)), width, [line], features)


def _to_tips(
    found: AssembledRope, mask: UInt8[np.ndarray, "h w"], width: float
) -> tuple[Float64[np.ndarray, "k 2"], np.ndarray]:
    """Axis up to both tips of the rope, which a skeleton does not reach."""
    points, clear = found.points, found.clear
    reach, bent = max(2, round(TIP_REACH_WIDTHS * width)), round(BENT_TIP_WIDTHS * width)
    for _ in range(2):
        if len(points) > 2 * reach + bent:
            points, clear = points[: len(points) - bent], clear[: len(clear) - bent]
        way = points[-1] - points[-min(reach, len(points))]
        way = way / max(float(np.linalg.norm(way)), 1e-9)
        ahead = points[-1] + np.arange(1, reach + bent + 1)[:, None] * way
        at = np.rint(ahead).astype(int)
        inside = (at >= 0).all(axis=1) & (at[:, 0] < mask.shape[1]) & (at[:, 1] < mask.shape[0])
        on = inside & (mask[at[:, 1] * inside, at[:, 0] * inside] > 0)
        count = int(np.argmin(on)) if not np.all(on) else len(on)
        points = np.concatenate([points, ahead[:count]])[::-1]
        clear = np.concatenate([clear, np.zeros(count, bool)])[::-1]
    return points, clear


def _to_lab(color: Color) -> Float64[np.ndarray, "3"]:
    return cv2.cvtColor(np.array([[color]], np.uint8), cv2.COLOR_RGB2LAB)[0, 0].astype(float)


def _scaled_position(position: tuple[float, float], scale: float) -> tuple[float, float]:
    # The centre of the first pixel is at zero in every size.
    return (position[0] + 0.5) * scale - 0.5, (position[1] + 0.5) * scale - 0.5


def _scaled(rope: DetectedRope, scale: float) -> DetectedRope:
    """Rope in an image that is larger by a factor."""
    # The centre of the first pixel is at zero in every size.
    lines = [
        Ridge((line.pixels + 0.5) * scale - 0.5, line.normals, line.clear, line.depth)
        for line in rope.lines
    ]
    return replace(rope, width=rope.width * scale, lines=lines)
