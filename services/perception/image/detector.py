"""Detection of ropes in a single image of any camera: no calibration, no cell, no rope model.

Long thin regions that stand out, or that have the given colour, are proposals; from each, the
colours of rope and background are learnt. The proposal whose mask is longest and differs most from
both of its sides is the rope; further masks that do not overlap it are ropes as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from services.perception.centerline.ridge import Ridge, extract_ridge
from services.perception.centerline.segmentation import Color, Region
from services.perception.centerline.skeleton import trace_strands
from services.perception.image.color_model import ROPE_LOG_RATIO, learn_rope_mask
from services.perception.image.contrast import Component, RopeMask, component_contrasts
from services.perception.image.proposals import color_distance, propose, propose_by_color
from services.perception.image.width import measure_width

MIN_IMAGE_SIDE = 48
"""Least shorter side of an image [pixels]."""
SEARCH_SIDE = 480
"""Longer side of the image in which ropes are searched [pixels]."""
MEASUREMENT_SIDE = 1600
"""Longer side of the image in which ropes are measured, if they are wide enough there [pixels]."""
MEASUREMENT_WIDTH = 6.0
"""Width of a rope that is sufficient for its measurement [pixels]."""
MIN_CONTRAST = 6.0
"""Least distance of a rope from both of its sides [Lab, as OpenCV scales it]."""
MAX_CONTRAST = 60.0
"""Distance above which more contrast does not raise the score [Lab]."""
SAME_COLOR_DISTANCE = 12.0
"""Distance from the given colour that halves the score [Lab]."""
OTHER_COLOR_DISTANCE = 45.0
"""Distance from the given colour from which a proposal is dropped [Lab]."""
COLOR_PERCENTILE = 30.0
"""Percentile of the colour distances along a rope that is compared with the limits [%]; low, since
only part of a striped rope has the colour."""
MAX_SHADOW_SHARE = 0.5
"""Share of a proposal that could be a shadow, above which it scores less."""
SHADOW_FACTOR = 0.2
"""Factor on the score of a proposal that could be a shadow."""
JUNCTION_PENALTY = 0.3
"""Weight of each junction in the divisor of a component's effective length [-]: a rope has few, a
grid many."""
MAX_CANDIDATES = 10
"""Number of proposals whose colours are learnt."""
SAME_OVERLAP, ROPE_OVERLAP = 0.7, 0.25
"""Overlap of two skeletons above which two proposals, or two ropes, are the same [-]."""
MIN_RELATIVE_CONTRAST = 0.4
"""Least contrast of a component, relative to the longest one's."""
MIN_RELATIVE_LENGTH = 0.04
"""Least length of a component, relative to the longest one's."""
MIN_RELATIVE_SCORE = 0.5
"""Least score of a further rope, relative to the best one's."""
MAX_FURTHER_PIECES = 6
"""Largest number of pieces of a further rope."""
SEARCH_ROUNDS, MEASUREMENT_ROUNDS = 3, 2
"""Rounds of learning in the small and in the large image."""
LIKENESS_PER_LOG_RATIO = 31.0
"""Likeness per unit of the log likelihood ratio."""
MIN_LINE_WIDTHS = 3.0
"""Length above which a piece is kept, since it has a direction [rope widths]."""


@dataclass(frozen=True)
class DetectedRope:
    """Rope in an image."""

    color: Color
    """Colour of its axis in the light of the image."""
    width: float
    """Width [pixels]."""
    lines: list[Ridge]
    """Sub-pixel centrelines of its pieces, longest first."""
    shadow: float
    """Share of it that could be a shadow, 0..1: the colours of its sides, only darker."""
    likeness: UInt8[np.ndarray, "h w"]
    """Likeness of every pixel to this rope; 128 separates rope and background."""
    others: tuple[DetectedRope, ...] = ()
    """Further ropes, which stand out less."""


@dataclass(frozen=True)
class _Candidate:
    """Mask that may be a rope."""

    score: float
    rope: RopeMask
    shadow: float


def detect_rope(color: UInt8[np.ndarray, "h w 3"], rope_color: Color | None = None) -> DetectedRope:
    """Return the rope in an image, the most distinct one where there are several.

    Args:
        color: Red, green, blue.
        rope_color: Colour of the rope; None: the rope that stands out most.

    Raises:
        ValueError: Nothing in the image looks like a rope.
    """
    if min(color.shape[:2]) < MIN_IMAGE_SIDE:
        raise ValueError(
            f"the image has {color.shape[1]} x {color.shape[0]} pixels, too few for a rope; give "
            f"at least {MIN_IMAGE_SIDE} x {MIN_IMAGE_SIDE}"
        )
    candidates = _candidates(_to_lab(_shrunk(color, SEARCH_SIDE)), rope_color)
    ropes = [rope for rope in (_measure(color, c) for c in candidates) if rope is not None]
    if ropes:
        # Patterns have many pieces: further candidates with many are rejected.
        others = (rope for rope in ropes[1:] if len(rope.lines) <= MAX_FURTHER_PIECES)
        return replace(ropes[0], others=tuple(others))
    if rope_color is None:
        raise ValueError(
            "nothing in the image is long, thin and distinct from both of its sides; give the "
            "rope's colour, or an image in which it is larger or contrasts more with the table"
        )
    raise ValueError(
        f"nothing of the colour {list(rope_color)} in the image is long, thin and distinct from "
        "both of its sides; take a colour from the image itself, or give none"
    )


def _shrunk(color: UInt8[np.ndarray, "h w 3"], longer: int) -> UInt8[np.ndarray, "h w 3"]:
    """Image with at most a given longer side [pixels]."""
    scale = min(1.0, longer / max(color.shape[:2]))
    if scale == 1.0:
        return color
    return cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _to_lab(color: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    return cv2.cvtColor(color, cv2.COLOR_RGB2LAB)


def _candidates(lab: UInt8[np.ndarray, "h w 3"], rope_color: Color | None) -> list[_Candidate]:
    """Candidates that do not overlap, best first."""
    wanted = None if rope_color is None else _to_lab(np.array([[rope_color]], np.uint8))[0, 0] * 1.0
    proposals: list[_Candidate] = []
    for mask in propose(lab) if wanted is None else propose_by_color(lab, wanted):
        width, skeleton = measure_width(mask)
        proposal = _scored(lab, RopeMask(np.zeros(0, np.float32), mask, skeleton, width), wanted)
        if proposal is not None:
            proposals.append(proposal)
    found: list[_Candidate] = []
    for proposal in _without_overlap(proposals, SAME_OVERLAP)[:MAX_CANDIDATES]:
        rope = _learn(lab, proposal.rope.mask, SEARCH_ROUNDS)
        candidate = None if rope is None else _scored(lab, rope, wanted)
        if candidate is not None:
            found.append(candidate)
    kept = _without_overlap(found, ROPE_OVERLAP)
    if wanted is not None:
        return kept[:1]
    return kept[:1] + [
        c
        for c in kept[1:]
        if c.score > MIN_RELATIVE_SCORE * kept[0].score and c.shadow <= MAX_SHADOW_SHARE
    ]


def _without_overlap(candidates: list[_Candidate], most: float) -> list[_Candidate]:
    """Candidates that share less than a given share with a better one, best first."""
    kept: list[_Candidate] = []
    for candidate in sorted(candidates, key=lambda c: -c.score):
        if all(_overlap(candidate.rope, k.rope) < most for k in kept):
            kept.append(candidate)
    return kept


def _overlap(one: RopeMask, other: RopeMask) -> float:
    """Share of the longer skeleton that lies in both masks."""
    near = cv2.dilate(other.mask, np.ones((5, 5), np.uint8))
    both = np.count_nonzero(near[one.skeleton])
    return both / max(np.count_nonzero(one.skeleton), np.count_nonzero(other.skeleton))


def _scored(
    lab: UInt8[np.ndarray, "h w 3"], rope: RopeMask, wanted: Float64[np.ndarray, "3"] | None
) -> _Candidate | None:
    """Mask with its score; None when it cannot be a rope.

    Args:
        lab: Image in Lab.
        rope: Mask of the same size.
        wanted: Colour of the rope in Lab.
    """
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
    return _Candidate(score, rope, shadow)


def _measure(color: UInt8[np.ndarray, "h w 3"], candidate: _Candidate) -> DetectedRope | None:
    """Rope of a candidate, measured in an image of sufficient resolution."""
    height, width = color.shape[:2]
    rope_width = candidate.rope.width * width / candidate.rope.mask.shape[1]
    longer = max(height, width)
    enough = round(longer * min(1.0, MEASUREMENT_WIDTH / rope_width))
    image = _shrunk(color, max(MEASUREMENT_SIDE, enough))
    scale = width / image.shape[1]
    size = (image.shape[1], image.shape[0])
    lab = _to_lab(image)
    piece = cv2.resize(candidate.rope.mask, size, interpolation=cv2.INTER_NEAREST)
    rope = _learn(lab, piece, MEASUREMENT_ROUNDS)
    if rope is None:
        return None
    mask = rope.mask
    found = component_contrasts(lab, rope)
    shadow = _length_mean(found, [c.shadow for c in found])
    likeness = 128.0 + LIKENESS_PER_LOG_RATIO * (rope.likelihood - ROPE_LOG_RATIO)
    likeness = np.clip(likeness, 0.0, 255.0).astype(np.uint8)
    # Likeness outside the mask and its margin must not attract the sub-pixel lines.
    likeness *= cv2.dilate(mask, np.ones((5, 5), np.uint8))
    region, no_depth = Region(likeness, mask, 0, 0), np.zeros(likeness.shape, np.uint16)
    lines = [
        extract_ridge(s, region, no_depth, rope.width) for s in trace_strands(mask, rope.width)
    ]
    lines = [_scaled(r, scale) for r in lines if len(r.pixels) > MIN_LINE_WIDTHS * rope.width]
    if not lines:
        return None
    red, green, blue = np.median(image[rope.skeleton & (mask > 0)], axis=0)
    return DetectedRope(
        (int(red), int(green), int(blue)),
        rope.width * scale,
        lines,
        shadow,
        cv2.resize(likeness, (width, height), interpolation=cv2.INTER_LINEAR),
    )


def _learn(
    lab: UInt8[np.ndarray, "h w 3"], piece: UInt8[np.ndarray, "h w"], rounds: int
) -> RopeMask | None:
    """Mask of the rope that a piece belongs to, learnt repeatedly from its distinct components."""
    rope = None
    for _ in range(rounds):
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


def _scaled(line: Ridge, scale: float) -> Ridge:
    """Ridge in an image that is larger by a factor."""
    # The centre of the first pixel is at zero in every size.
    return Ridge((line.pixels + 0.5) * scale - 0.5, line.normals, line.clear, line.depth)
