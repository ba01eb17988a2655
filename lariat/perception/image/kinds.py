"""Kinds of ropes in an image, found by their contrast to the ground and by their colours.

Proposals are taken up one after the other, the most distinct first. Each teaches the colours of a
kind of rope; what it explains is not taken up again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt8
from skimage.morphology import skeletonize

from lariat.perception.image.color_model import learn_rope_mask
from lariat.perception.image.contrast import (
    Component,
    RopeMask,
    component_contrasts,
    could_be_shadow,
    tint_and_brightness,
)
from lariat.perception.image.ground import StandingOut, thin_parts
from lariat.perception.image.proposals import color_distance, propose, propose_by_color
from lariat.perception.image.width import measure_width, ridge, width_of_most_area

MIN_CONTRAST = 6.0
"""Least distance of a rope from both of its sides [Lab, as OpenCV scales it]."""
MAX_CONTRAST = 60.0
"""Distance above which more contrast does not raise the score [Lab]."""
SAME_COLOR_DISTANCE = 12.0
"""Distance from the given colour that halves the score [Lab]."""
OTHER_COLOR_DISTANCE = 45.0
"""Distance from the given colour from which a proposal is dropped [Lab]."""
COLOR_PERCENTILE = 30.0
"""Percentile of the colour distances along a proposal that is compared with the limits [%]; low,
since only part of a striped rope has the colour."""
MAX_SHADOW_SHARE = 0.5
"""Share of a proposal that could be a shadow, above which it scores less."""
SHADOW_FACTOR = 0.2
"""Factor on the score of a proposal that could be a shadow."""
JUNCTION_PENALTY = 0.3
"""Weight of each junction in the divisor of a component's effective length [-]: a rope has few, a
grid many."""
MAX_SCORED = 14
"""Number of proposals that are scored."""
MAX_LEARNT = 5
"""Number of proposals whose colours are learnt."""
SAME_OVERLAP = 0.7
"""Share of a proposal's skeleton in another mask above which it is explained by it [-]."""
MIN_RELATIVE_CONTRAST = 0.4
"""Least contrast of a component, relative to the longest one's."""
MIN_RELATIVE_LENGTH = 0.04
"""Least length of a component, relative to the longest one's."""
MIN_PIECE_LENGTH = 0.05
"""Least extent of a piece that stands out, as a share of the image's longer side."""
MAX_HALF_WIDTH = 1.3
"""Half width above which what stands out is no rope and no crossing of two [rope widths]."""
SHADOW_REACH_WIDTHS = 1.6
"""Distance from a rope up to which a dark region is its shadow [rope widths]."""
MIN_ROPE_TINT = 12.0
"""Difference of chroma from that of the darkened ground that no shadow has [Lab]."""
MIN_ROPE_BRIGHTNESS = 10.0
"""Brightness above the ground's that no shadow has [Lab]."""
MIN_WIDTH_RATIO, MAX_WIDTH_RATIO = 0.3, 2.5
"""Range of a dark rope's width, relative to that of the lit ones [-]; only its core is found."""
MIN_DARK_LENGTH = 0.15
"""Least extent of a dark rope, as a share of the image's longer side: shorter ones are shadows."""
MIN_EDGE_SLOPE = 0.35
"""Slope of a dark rope's edges, relative to its darkness, below which it is a shadow [1/pixel]."""
MIN_RELATIVE_SCORE = 0.2
"""Least score of a further kind of rope, relative to the best one's."""


@dataclass(frozen=True)
class Kind:
    """Ropes of one colour."""

    score: float
    """Length times distinctness."""
    rope: RopeMask
    """Mask in the small image."""
    shadow: float
    """Share of it that could be a shadow, 0..1."""


def kinds_on_ground(lab: UInt8[np.ndarray, "h w 3"], out: StandingOut) -> list[Kind]:
    """Kinds of ropes on a ground that most of the image shows: lit ones, and dark ones."""
    smooth = cv2.GaussianBlur(lab, (0, 0), 0.7).astype(np.float32)
    shaded = could_be_shadow(smooth, out.ground) & (out.mask > 0)
    tint, brighter = tint_and_brightness(smooth, out.ground)
    certain = out.strong | (tint > MIN_ROPE_TINT) | (brighter > MIN_ROPE_BRIGHTNESS)
    lit = _thin_components(out, out.mask * ~shaded * certain, shaded, None)
    kinds = [] if lit is None else [lit]
    # A shadow lies beside what throws it, and its edges are soft; a dark rope lies anywhere.
    width = lit.rope.width if lit is not None else None
    if lit is not None:
        from_lit = cv2.distanceTransform(1 - lit.rope.mask, cv2.DIST_L2, 5)
        shaded &= from_lit > SHADOW_REACH_WIDTHS * lit.rope.width
    sharp = _sharp_components(lab, shaded.view(np.uint8), out)
    dark = _thin_components(out, sharp, shaded, width)
    if dark is not None and (lit is None or dark.score > MIN_RELATIVE_SCORE * lit.score):
        kinds.append(dark)
    return kinds


def _sharp_components(
    lab: UInt8[np.ndarray, "h w 3"], mask: UInt8[np.ndarray, "h w"], out: StandingOut
) -> UInt8[np.ndarray, "h w"]:
    """Long components of a mask whose edges are as sharp as those of a thing, not of a shadow."""
    mask = long_enough(mask, MIN_DARK_LENGTH * max(mask.shape))
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    light = cv2.GaussianBlur(lab[..., 0], (0, 0), 0.7).astype(np.float32)
    depth = out.ground[..., 0] - light
    across, down = cv2.Sobel(depth, -1, 1, 0), cv2.Sobel(depth, -1, 0, 1)
    slope = cv2.dilate(np.hypot(across, down) / 8.0, np.ones((3, 3), np.uint8)) * (mask > 0)
    kept = np.zeros_like(mask)
    for k in range(1, count):
        on = labels == k
        # The steepest slope near each pixel against the depth of the darkness.
        steep = float(np.percentile(slope[on], 70.0))
        if steep < MIN_EDGE_SLOPE * float(np.percentile(depth[on], 80.0)):
            continue
        # A dark rope is darker than its own shadow.
        levels = np.minimum(out.distance[on], 255.0).astype(np.uint8)
        core = on & (out.distance > cv2.threshold(levels, 0, 255, cv2.THRESH_OTSU)[0])
        # Its flanks are lighter than its middle, and as dark as its shadow.
        whole = cv2.dilate(_closed(core.view(np.uint8)), np.ones((3, 3), np.uint8))
        core = long_enough(whole, 0.5 * MIN_DARK_LENGTH * max(mask.shape))
        kept |= core if 2 * np.count_nonzero(core) > 0.5 * np.count_nonzero(on) else on
    return kept


def _thin_components(
    out: StandingOut,
    mask: UInt8[np.ndarray, "h w"],
    shaded: Bool[np.ndarray, "h w"],
    width: float | None,
) -> Kind | None:
    """Kind of rope made of the long thin components of a mask; None when there are none."""
    mask = _closed(mask)
    mask = long_enough(mask, MIN_PIECE_LENGTH * max(mask.shape))
    if not np.any(mask):
        return None
    own = usual_width(mask)
    mask = thin_parts(mask, own, MAX_HALF_WIDTH).view(np.uint8)
    mask = long_enough(mask, max(MIN_PIECE_LENGTH * max(mask.shape), 3.0 * own))
    if not np.any(mask):
        return None
    own, skeleton = usual_width(mask), skeletonize(mask.view(bool))
    if width is not None and not MIN_WIDTH_RATIO < own / width < MAX_WIDTH_RATIO:
        return None
    rope = RopeMask(np.zeros(0, np.float32), mask, skeleton, own)
    score = float(np.sum(np.minimum(out.distance[skeleton], MAX_CONTRAST)))
    return Kind(score, rope, float(np.mean(shaded[skeleton])))


def _closed(mask: UInt8[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w"]:
    """Mask whose small holes are closed."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    closed = cv2.morphologyEx(np.ascontiguousarray(mask), cv2.MORPH_CLOSE, kernel)
    return np.asarray(closed, np.uint8)


def usual_width(mask: UInt8[np.ndarray, "h w"]) -> float:
    """Width of most of a mask's area [pixels]."""
    radii = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    return width_of_most_area(radii[ridge(radii)])


def long_enough(mask: UInt8[np.ndarray, "h w"], least: float) -> UInt8[np.ndarray, "h w"]:
    """Mask without components of less than a given extent [pixels]."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    extent = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    kept = extent > least
    kept[0] = False
    return kept[labels].view(np.uint8)


def kinds_anywhere(
    lab: UInt8[np.ndarray, "h w 3"], wanted: Float64[np.ndarray, "3"] | None
) -> list[Kind]:
    """Kinds of ropes on any ground, learnt from one proposal after the other."""
    explained = np.zeros(lab.shape[:2], np.uint8)
    scored: list[Kind] = []
    for mask in propose(lab) if wanted is None else propose_by_color(lab, wanted):
        width, skeleton = measure_width(mask)
        if any(
            _covered(skeleton, k.rope) > 0.9 and _covered(k.rope.skeleton, mask) > 0.9
            for k in scored
        ):
            continue
        kind = _scored(lab, RopeMask(np.zeros(0, np.float32), mask, skeleton, width), wanted)
        if kind is not None:
            scored.append(kind)
    kinds: list[Kind] = []
    learnt = 0
    for proposal in sorted(scored, key=lambda k: -k.score)[:MAX_SCORED]:
        if _covered(proposal.rope.skeleton, explained) > SAME_OVERLAP:
            continue
        if kinds and proposal.score < 0.5 * MIN_RELATIVE_SCORE * kinds[0].score:
            break
        rope = _learn(lab, proposal.rope.mask)
        learnt += 1
        kind = None if rope is None else _scored(lab, rope, wanted)
        if kind is None or (kinds and kind.score < MIN_RELATIVE_SCORE * kinds[0].score):
            continue
        if kinds and kind.shadow > MAX_SHADOW_SHARE:
            continue
        kinds.append(kind)
        near = cv2.dilate(kind.rope.mask, np.ones((5, 5), np.uint8))
        explained = np.maximum(explained, near).astype(np.uint8)
        if learnt == MAX_LEARNT:
            break
    return sorted(kinds, key=lambda k: -k.score)


def _covered(skeleton: Bool[np.ndarray, "h w"], rope: RopeMask | UInt8[np.ndarray, "h w"]) -> float:
    """Share of a skeleton that lies in a mask."""
    mask = rope.mask if isinstance(rope, RopeMask) else rope
    return float(np.mean(mask[skeleton])) if np.any(skeleton) else 0.0


def _scored(
    lab: UInt8[np.ndarray, "h w 3"], rope: RopeMask, wanted: Float64[np.ndarray, "3"] | None
) -> Kind | None:
    """Mask with its score; None when it cannot be a rope."""
    found = component_contrasts(lab, rope) if np.any(rope.skeleton) else []
    contrast = _length_mean(found, [c.contrast for c in found]) if found else 0.0
    if contrast < MIN_CONTRAST:
        return None
    # Grain and print have many short components, a grid has one with many junctions.
    run = _length_mean(found, [c.length / (1.0 + JUNCTION_PENALTY * c.junctions) for c in found])
    steadiness = _length_mean(found, [c.steadiness for c in found])
    shadow = _length_mean(found, [c.shadow for c in found])
    score = run * min(contrast, MAX_CONTRAST) * steadiness**2
    if shadow > MAX_SHADOW_SHARE:
        score *= SHADOW_FACTOR
    if wanted is not None:
        distances = color_distance(lab[rope.skeleton], wanted)
        distance = float(np.percentile(distances, COLOR_PERCENTILE))
        if distance > OTHER_COLOR_DISTANCE:
            return None
        score /= 1.0 + (distance / SAME_COLOR_DISTANCE) ** 2
    return Kind(score, rope, shadow)


def _learn(lab: UInt8[np.ndarray, "h w 3"], piece: UInt8[np.ndarray, "h w"]) -> RopeMask | None:
    """Mask of the ropes that a piece belongs to, learnt again from their distinct components."""
    rope = None
    for _ in range(2):
        rope = learn_rope_mask(lab, piece)
        if rope is None:
            return None
        rope = _distinct_components(lab, rope)
        piece = rope.mask
    return rope


def _distinct_components(lab: UInt8[np.ndarray, "h w 3"], rope: RopeMask) -> RopeMask:
    """Mask without components that hardly differ from their sides, or that are shadows."""
    found = component_contrasts(lab, rope)
    longest = max(found, key=lambda c: c.length)
    kept = [longest.label] + [
        c.label
        for c in found
        if c.contrast * c.steadiness > MIN_RELATIVE_CONTRAST * longest.contrast
        and c.length > MIN_RELATIVE_LENGTH * longest.length
        and (c.shadow <= MAX_SHADOW_SHARE or longest.shadow > MAX_SHADOW_SHARE)
    ]
    _, labels = cv2.connectedComponents(rope.mask, connectivity=8)
    mask = np.isin(labels, kept)
    return replace(rope, mask=mask.view(np.uint8), skeleton=rope.skeleton & mask)


def _length_mean(components: list[Component], values: list[float]) -> float:
    """Mean of values, weighted with the components' lengths."""
    return float(np.average(values, weights=[c.length for c in components]))
