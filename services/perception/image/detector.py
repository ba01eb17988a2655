"""Centre lines in one picture, whatever took it: no camera, no cell, no rope model.

Long thin pieces that stand out, or have the given colour, are guesses; from each the colours of
rope and background are learnt. The guess whose ribbon is longest and differs most from what lies
on both of its sides is the rope; other ribbons that do not overlap it are ropes as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from services.perception.centerline.ridge import Ridge, ridge
from services.perception.centerline.segmentation import Color, Region
from services.perception.centerline.skeleton import strands
from services.perception.image.color_model import (
    LEAST_RATIO,
    Piece,
    Ribbon,
    contrasts,
    learnt,
    measured,
)
from services.perception.image.proposals import pieces, pieces_of, unlike

LEAST_SIZE = 48
"""Shorter side of a picture [pixels]."""
SMALL = 480
"""Longer side of the picture in which ropes are sought [pixels]."""
LARGE = 1600
"""Longer side in which they are measured, if they are wide enough there [pixels]."""
WIDE = 6.0
"""What is wide enough [pixels]."""
LEAST_CONTRAST = 6.0
"""Distance in Lab, as OpenCV scales it, by which a rope differs from both of its sides."""
SAME_COLOR, OTHER_COLOR = 12.0, 45.0
"""Distances in Lab from the given colour that light explains easily, and not at all."""
SHADOWED, DIM = 0.5, 0.2
"""Part of a guess that could be a shadow from which on it is worth less, and how much."""
STRIPED = 30.0
"""Percentile of those distances along a rope that must be near."""
MOST_CONTRAST = 60.0
"""More does not make a guess worthier."""
BRANCHING = 0.3
"""How much a junction shortens a piece: ropes cross themselves, grids are nothing else."""
TRIED = 10
"""Guesses that are looked at closely."""
SAME, OVERLAP = 0.7, 0.25
"""Part that guesses share from which on they are one, and that ropes share."""
FAINT = 0.4
"""Contrast of a piece that is kept, against the whole ribbon's."""
ALSO = 0.5
"""Worth of another rope, against the best."""
FEW = 6
"""Pieces that another rope is in at most."""
PART = 0.04
"""Length of a piece that is kept, against the longest."""
ROUNDS, ROUNDS_MORE = 3, 2
"""Of learning, in the small picture and in the large one."""
STEEP = 31.0
"""Brightness for a factor of e in likelihood."""


@dataclass(frozen=True)
class Photograph:
    """A rope in a picture."""

    color: Color
    """Of its middle, in this light."""
    width: float
    """[pixels]."""
    lines: list[Ridge]
    """Sub-pixel centre lines, longest first."""
    shadow: float
    """Part of it that could be a shadow, 0..1: of its surroundings' colour, only darker."""
    likeness: UInt8[np.ndarray, "h w"]
    """How much every pixel looks like this rope: 128 is as likely as not."""
    others: tuple[Photograph, ...] = ()
    """Ropes that stand out less."""


@dataclass(frozen=True)
class _Guess:
    worth: float
    ribbon: Ribbon
    shadow: float


def read(color: UInt8[np.ndarray, "h w 3"], rope_color: Color | None = None) -> Photograph:
    """The rope in a picture; the clearest where there are several.

    Args:
        color: Red, green, blue.
        rope_color: Of the rope; None: whatever stands out.

    Raises:
        ValueError: Nothing in the picture looks like rope.
    """
    if min(color.shape[:2]) < LEAST_SIZE:
        raise ValueError(
            f"the picture has {color.shape[1]} x {color.shape[0]} pixels, too few for a rope; give "
            f"at least {LEAST_SIZE} x {LEAST_SIZE}"
        )
    guesses = _guesses(_lab(_resized(color, SMALL)), rope_color)
    ropes = [rope for rope in (_measured(color, guess) for guess in guesses) if rope is not None]
    if ropes:
        # A pattern is many pieces: only the first guess may be one.
        others = (rope for rope in ropes[1:] if len(rope.lines) <= FEW)
        return replace(ropes[0], others=tuple(others))
    if rope_color is None:
        raise ValueError(
            "nothing in the picture is long, thin and unlike what lies on both of its sides; give "
            "the rope's colour, or a picture in which it is larger or differs more from the table"
        )
    raise ValueError(
        f"nothing of the colour {list(rope_color)} in the picture is long, thin and unlike what "
        "lies on both of its sides; take a colour from the picture itself, or no colour at all"
    )


def _resized(color: UInt8[np.ndarray, "h w 3"], longer: int) -> UInt8[np.ndarray, "h w 3"]:
    scale = min(1.0, longer / max(color.shape[:2]))
    if scale == 1.0:
        return color
    return cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _lab(color: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 3"]:
    return cv2.cvtColor(color, cv2.COLOR_RGB2LAB)


def _guesses(lab: UInt8[np.ndarray, "h w 3"], rope_color: Color | None) -> list[_Guess]:
    """Ribbons that do not overlap, the worthiest first."""
    wanted = None if rope_color is None else _lab(np.array([[rope_color]], np.uint8))[0, 0] * 1.0
    parts: list[_Guess] = []
    for part in pieces(lab) if wanted is None else pieces_of(lab, wanted):
        width, middle = measured(part)
        guess = _judged(lab, Ribbon(np.zeros(0, np.float32), part, middle, width), wanted)
        if guess is not None:
            parts.append(guess)
    found: list[_Guess] = []
    for guess in _apart(parts, SAME)[:TRIED]:
        ribbon = _followed(lab, guess.ribbon.mask, ROUNDS)
        judged = None if ribbon is None else _judged(lab, ribbon, wanted)
        if judged is not None:
            found.append(judged)
    kept = _apart(found, OVERLAP)
    if wanted is not None:
        return kept[:1]
    return kept[:1] + [
        g for g in kept[1:] if g.worth > ALSO * kept[0].worth and g.shadow <= SHADOWED
    ]


def _apart(guesses: list[_Guess], most: float) -> list[_Guess]:
    """Those that do not share a part with a worthier one."""
    kept: list[_Guess] = []
    for guess in sorted(guesses, key=lambda g: -g.worth):
        if all(_shared(guess.ribbon, k.ribbon) < most for k in kept):
            kept.append(guess)
    return kept


def _shared(one: Ribbon, other: Ribbon) -> float:
    """Part of the longer one's middle that lies in both."""
    near = cv2.dilate(other.mask, np.ones((5, 5), np.uint8))
    both = np.count_nonzero(near[one.middle])
    return both / max(np.count_nonzero(one.middle), np.count_nonzero(other.middle))


def _judged(
    lab: UInt8[np.ndarray, "h w 3"], ribbon: Ribbon, wanted: Float64[np.ndarray, "3"] | None
) -> _Guess | None:
    """A ribbon and what it is worth; None when it is not even a guess."""
    found = contrasts(lab, ribbon) if np.any(ribbon.middle) else []
    gap = _mean(found, [p.gap for p in found]) if found else 0.0
    if gap < LEAST_CONTRAST:
        return None
    # Grain and print are many pieces, a grid is one of many junctions: neither runs far.
    run = _mean(found, [p.length / (1.0 + BRANCHING * p.junctions) for p in found])
    steady = _mean(found, [p.steady for p in found])
    shadow = _mean(found, [p.shadow for p in found])
    worth = run * min(gap, MOST_CONTRAST) * steady**2
    if shadow > SHADOWED:
        worth *= DIM
    if wanted is not None:
        # Of a striped rope only a part has the colour.
        away = float(np.percentile(unlike(lab[ribbon.middle], wanted), STRIPED))
        if away > OTHER_COLOR:
            return None
        worth /= 1.0 + (away / SAME_COLOR) ** 2
    return _Guess(worth, ribbon, shadow)


def _measured(color: UInt8[np.ndarray, "h w 3"], guess: _Guess) -> Photograph | None:
    """A rope in as many pixels as it needs."""
    height, width = color.shape[:2]
    wide = guess.ribbon.width * width / guess.ribbon.mask.shape[1]
    longer = max(height, width)
    picture = _resized(color, max(LARGE, round(longer * min(1.0, WIDE / wide))))
    scale = width / picture.shape[1]
    size = (picture.shape[1], picture.shape[0])
    lab = _lab(picture)
    part = cv2.resize(guess.ribbon.mask, size, interpolation=cv2.INTER_NEAREST)
    ribbon = _followed(lab, part, ROUNDS_MORE)
    if ribbon is None:
        return None
    mask = ribbon.mask
    found = contrasts(lab, ribbon)
    shadow = _mean(found, [p.shadow for p in found])
    likeness = np.clip(128.0 + STEEP * (ribbon.likeness - LEAST_RATIO), 0.0, 255.0).astype(np.uint8)
    # Of what is not this rope only the edge that sub-pixel lines are weighed with.
    likeness *= cv2.dilate(mask, np.ones((5, 5), np.uint8))
    region, nothing = Region(likeness, mask, 0, 0), np.zeros(likeness.shape, np.uint16)
    lines = [ridge(s, region, nothing, ribbon.width) for s in strands(mask, ribbon.width)]
    # Shorter than three widths a piece has no direction that would make it rope.
    lines = [_scaled(line, scale) for line in lines if len(line.pixels) > 3.0 * ribbon.width]
    if not lines:
        return None
    red, green, blue = np.median(picture[ribbon.middle & (mask > 0)], axis=0)
    return Photograph(
        (int(red), int(green), int(blue)),
        ribbon.width * scale,
        lines,
        shadow,
        cv2.resize(likeness, (width, height), interpolation=cv2.INTER_LINEAR),
    )


def _followed(
    lab: UInt8[np.ndarray, "h w 3"], part: UInt8[np.ndarray, "h w"], rounds: int
) -> Ribbon | None:
    """The ribbon that a part belongs to, learnt again and again from what is surely like it."""
    ribbon = None
    for _ in range(rounds):
        ribbon = learnt(lab, part)
        if ribbon is None:
            return None
        ribbon = _without_faint(lab, ribbon)
        part = ribbon.mask
    return ribbon


def _without_faint(lab: UInt8[np.ndarray, "h w 3"], ribbon: Ribbon) -> Ribbon:
    """A ribbon without pieces that hardly differ from what lies beside them, or are shadows."""
    found = contrasts(lab, ribbon)
    longest = max(found, key=lambda p: p.length)
    kept = [longest.label] + [
        p.label
        for p in found
        if p.gap * p.steady > FAINT * longest.gap
        and p.length > PART * longest.length
        and (p.shadow <= SHADOWED or longest.shadow > SHADOWED)
    ]
    _, labels = cv2.connectedComponents(ribbon.mask, connectivity=8)
    mask = np.isin(labels, kept)
    return replace(ribbon, mask=mask.view(np.uint8), middle=ribbon.middle & mask)


def _mean(pieces: list[Piece], values: list[float]) -> float:
    """Weighed with the pieces' lengths."""
    return float(np.average(values, weights=[p.length for p in pieces]))


def _scaled(line: Ridge, scale: float) -> Ridge:
    # The middle of the first pixel is at zero in every size.
    return Ridge((line.pixels + 0.5) * scale - 0.5, line.normals, line.clear, line.depth)
