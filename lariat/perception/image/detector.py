"""Detection of ropes in a single image of any camera: no calibration, no cell, no rope model.

The foreground is cut into fragments at its crossings, the fragments are joined to ropes by the
least total bending, and every rope is measured along its axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from lariat.perception.centerline.ridge import Ridge, extract_ridge
from lariat.perception.centerline.segmentation import Color, Region
from lariat.perception.centerline.skeleton import Strand
from lariat.perception.image.assembly import AssembledRope, assemble
from lariat.perception.image.color_model import ROPE_LOG_RATIO
from lariat.perception.image.contrast import could_be_shadow
from lariat.perception.image.flanks import center_between_flanks
from lariat.perception.image.foreground import Foreground, find_foregrounds
from lariat.perception.image.fragments import cut_fragments
from lariat.perception.image.layers import Crossing, RopeBand, layer_ropes
from lariat.perception.image.p_wrong import (
    ImageFeatures,
    RopeFeatures,
    ambiguity_of_margin,
    believed,
    image_features,
    p_wrong,
)
from lariat.perception.image.proposals import color_distance
from lariat.perception.image.width import width_from_radii

MIN_IMAGE_SIDE = 48
"""Least shorter side of an image [pixels]."""
LIKENESS_PER_LOG_RATIO = 31.0
"""Likeness per unit of the log likelihood ratio."""
HOPELESS_P_WRONG = 0.9
"""Doubt from which another way of finding the foreground is tried."""
SURE_LOG_ODDS = 1.0
"""Log odds of the network from which it sees a rope for sure [-]."""
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
MIN_COLOR_SHARE = 0.4
"""Least share of a rope's axis that has the wanted colour [-]; a striped rope has it in parts."""
MIN_RELATIVE_WIDTH = 0.35
"""Least width of a rope, relative to that of the rope that covers most of the image [-]."""
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
    """Ropes, longest first."""
    crossings: list[Crossing]
    """Places where two of the ropes cross."""
    labels: UInt8[np.ndarray, "h w"]
    """0 at the background, k where rope k is seen, from 1."""
    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to a rope; 128 separates ropes and background."""
    features: ImageFeatures
    """Evidence that `p_wrong` rests on."""

    @property
    def p_wrong(self) -> float:
        """Probability that a rope is missing, too much, or wrong, 0..1."""
        # The answer is right only if each of its ropes is.
        return max(p_wrong(self.features), *(rope.p_wrong for rope in self.ropes))

    @property
    def shadow(self) -> float:
        """Largest share of a rope that could be a shadow: the colours of its sides, darker."""
        return max(rope.features.shadow for rope in self.ropes)


@dataclass(frozen=True)
class RopeCandidates:
    """All that may be a rope in a foreground, in the pixels of the foreground."""

    ropes: list[DetectedRope]
    """Ropes, longest first."""
    shares: list[float]
    """Share of the skeleton that each of them explains, 0..1."""
    fragment_count: int
    """Number of fragments of the skeleton."""
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
        ValueError: Nothing in the image looks like a rope.
    """
    if min(color.shape[:2]) < MIN_IMAGE_SIDE:
        raise ValueError(
            f"the image has {color.shape[1]} x {color.shape[0]} pixels, too few for a rope; give "
            f"at least {MIN_IMAGE_SIDE} x {MIN_IMAGE_SIDE}"
        )
    wanted = None if rope_color is None else _to_lab(rope_color)
    best: Detection | None = None
    for foreground in find_foregrounds(color, rope_color):
        candidates = measure_candidates(foreground, wanted)
        if candidates is None:
            continue
        found = _detection((color.shape[1], color.shape[0]), candidates, foreground)
        if best is None or found.p_wrong < best.p_wrong:
            best = found
        if best.p_wrong < HOPELESS_P_WRONG:
            break
    if best is not None:
        return best
    if rope_color is None:
        raise ValueError(
            "nothing in the image is long, thin and distinct from both of its sides; give the "
            "rope's colour, or an image in which it is larger or contrasts more with the table"
        )
    raise ValueError(
        f"nothing of the colour {list(rope_color)} in the image is long, thin and distinct from "
        "both of its sides; take a colour from the image itself, or give none"
    )


def measure_candidates(
    foreground: Foreground, wanted: Float64[np.ndarray, "3"] | None = None
) -> RopeCandidates | None:
    """Return all that may be a rope in a foreground; None when everything is too short.

    Args:
        foreground: Foreground of an image.
        wanted: Colour of the ropes in Lab; None: any.
    """
    rope = foreground.rope
    smooth = cv2.GaussianBlur(foreground.lab, (0, 0), max(0.5, 0.2 * rope.width))
    smooth = smooth.astype(np.float32)
    fragments = cut_fragments(rope.skeleton, foreground.radii, smooth, rope.width)
    assembled = assemble(fragments, rope.mask, foreground.ground, rope.width)
    least = max(MIN_LENGTH_WIDTHS * rope.width, MIN_RELATIVE_LENGTH * max(rope.mask.shape))
    kept = [r for r in assembled if len(r.points) > least]
    if wanted is not None:
        kept = [r for r in kept if _has_color(r, foreground.lab, wanted)]
    if not kept:
        return None
    likeness = 128.0 + LIKENESS_PER_LOG_RATIO * (rope.likelihood - ROPE_LOG_RATIO)
    likeness = np.clip(likeness, 0.0, 255.0).astype(np.uint8)
    # Likeness outside the mask and its margin must not attract the sub-pixel lines.
    likeness *= cv2.dilate(rope.mask, np.ones((5, 5), np.uint8))
    lab = cv2.GaussianBlur(foreground.lab, (0, 0), 0.7).astype(np.float32)
    total = sum(len(r.points) for r in (kept if wanted is not None else assembled))
    ropes = [_measured(foreground, lab, likeness, r) for r in kept]
    # Joints of tiles and seams are as long as ropes, but not as wide.
    main = max(range(len(kept)), key=lambda k: len(kept[k].points) * ropes[k].width)
    wide = [k for k, r in enumerate(ropes) if r.width > MIN_RELATIVE_WIDTH * ropes[main].width]
    return RopeCandidates(
        [ropes[k] for k in wide],
        [len(kept[k].points) / total for k in wide],
        len(fragments),
        lab,
        likeness,
    )


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


def seen_shares(
    log_odds: Float32[np.ndarray, "h w"], labels: UInt8[np.ndarray, "h w"], count: int
) -> Float64[np.ndarray, "m"]:
    """Return the shares of what the network sees for sure: of no rope, and of each rope.

    Args:
        log_odds: The network's log odds of every pixel.
        labels: Rope that each pixel shows, counted from 1.
        count: Number of ropes.
    """
    near = cv2.dilate(labels, np.ones((5, 5), np.uint8))[log_odds > SURE_LOG_ODDS]
    return np.bincount(near, minlength=count + 1) / max(len(near), 1)


def _detection(
    size: tuple[int, int], candidates: RopeCandidates, foreground: Foreground
) -> Detection:
    """Credible ropes among candidates, in the pixels of the whole image."""
    credible = believed([r.features for r in candidates.ropes])
    ropes = [candidates.ropes[k] for k in credible]
    labels, crossings = label_ropes(ropes, candidates.lab)
    scale = size[0] / labels.shape[1]
    features = image_features(
        [r.features for r in ropes],
        sum(candidates.shares[k] for k in credible),
        candidates.fragment_count,
        foreground.by_color,
        float(seen_shares(foreground.log_odds, labels, len(ropes))[0]),
    )
    return Detection(
        [_scaled(r, scale) for r in ropes],
        [replace(c, position=_scaled_position(c.position, scale)) for c in crossings],
        cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST),
        cv2.resize(candidates.likeness, size, interpolation=cv2.INTER_LINEAR),
        features,
    )


def _rope_features(
    found: AssembledRope,
    lab: Float32[np.ndarray, "h w 3"],
    line: Ridge,
    width: float,
    radii: Float32[np.ndarray, "k"],
    log_odds: Float32[np.ndarray, "k"],
) -> RopeFeatures:
    here = _sampled(lab, line.pixels[line.clear])
    contrasts, shadows = [], []
    for sign in (-1.0, 1.0):
        offset = sign * (width / 2.0 + SIDE_OFFSET) * line.normals[line.clear]
        beside = _sampled(lab, line.pixels[line.clear] + offset)
        contrasts.append(float(np.median(np.linalg.norm(here - beside, axis=1))))
        shadows.append(float(np.mean(could_be_shadow(here, beside))))
    return RopeFeatures(
        length=float(np.log(len(found.points) / width)),
        unevenness=float(np.std(radii) / np.mean(radii)),
        worst_pair=found.worst_pair,
        ambiguity=ambiguity_of_margin(found.margin),
        loose_ends=float(found.loose_end_count),
        contrast=float(np.log(1.0 + min(contrasts))),
        hidden=1.0 - float(np.mean(found.clear)),
        shadow=max(shadows),
        unseen=-float(np.mean(log_odds)),
        narrowing=abs(float(np.log(width / width_from_radii(radii)))),
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
    points, clear = _to_tips(found, foreground.rope.mask, width)
    region, no_depth = Region(likeness, foreground.rope.mask, 0, 0), np.zeros((1, 1), np.uint16)
    line = extract_ridge(Strand(points, clear), region, no_depth, width)
    axis, width = center_between_flanks(
        smooth, foreground.evidence, line.pixels, line.normals, line.clear, width
    )
    line = replace(line, pixels=axis)
    red, green, blue = np.median(foreground.image[seen[:, 1], seen[:, 0]], axis=0)
    log_odds = foreground.log_odds[seen[:, 1], seen[:, 0]]
    features = _rope_features(found, smooth, line, width, radii, log_odds)
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
