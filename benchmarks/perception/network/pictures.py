"""Pictures for the training of the network: everything about them is random, within wide bounds.

They share the renderer with the pictures of the benches, but no curve, colour, light, ground or
camera: neither generator of `benchmarks.perception.pictures.generators` is used for training.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from benchmarks.perception.pictures import grounds
from benchmarks.perception.pictures.renderer import Cable, Lighting, as_photograph, paint_cables
from lariat.perception.lines.segmentation import Color

PICTURE_SIZE = (640, 480)
"""Width and height of a rendered picture [pixels]."""
CROP_SIDE = 192
"""Side of the squares that are cut out of it [pixels]."""
CROPS_PER_PICTURE = 8
"""Number of squares from one picture [-]."""
SCALES = (0.7, 2.0)
"""Range of the enlargement of a square [-]."""
UNLABELLED = 2
"""Value of a mask where it is not known whether a pixel shows a cable."""
TURNED_SHARE = 0.5
"""Share of the squares that are turned: seams and edges are not along the picture alone [-]."""
WIDTHS = (5.0, 26.0)
"""Range of the widths of cables before the enlargement [pixels]."""
MIN_CONTRAST = 20.0
"""Least distance of a cable's colour from the ground's [Lab, as OpenCV scales it]."""
MAX_CABLES = 4
"""Largest number of cables [-]."""
HARD_SHADOW_SHARE = 0.4
"""Share of the pictures in strong light of one direction: dark shadows with a sharp edge [-]."""
FLAT_SHARE = 0.4
"""Share of the pictures in light from all sides: cables without light and shade [-]."""
STRAIGHT_SHARE = 0.2
"""Share of the cables that are nearly straight, half of them along a side of the picture [-]."""
DARK_SHARE = 0.15
"""Share of the cables that are nearly black, as shadows are [-]."""
MAX_DARK_TRIALS = 8
"""Largest number of colours of one kind that are drawn for a cable."""
CLUTTER_SHARE = 0.7
"""Share of the pictures with things, lines and shadows of things outside [-]."""
GROUNDS = {"plain": 0.25, "blotched": 0.1, "wood": 0.1, "cloth": 0.1, "boards": 0.25, "print": 0.2}
"""Kinds of grounds, and their shares [-]."""
EDGE_SHARE = 0.4
"""Share of the pictures in which the ground ends at a sheet's or a table's edge [-]."""
FERRULE_SHARE = 0.4
"""Share of the cables with sleeves and pins at their ends, which are no cable [-]."""
SHARPENED_SHARE = 0.4
"""Share of the pictures that the camera has sharpened [-]."""


def training_crops(
    seed: int,
) -> Iterator[tuple[UInt8[np.ndarray, "s s 3"], UInt8[np.ndarray, "s s"]]]:
    """Yield squares of one picture (red, green, blue), and 1 where they show a cable."""
    random = np.random.default_rng((3, seed))
    picture = _picture(random)
    for _ in range(CROPS_PER_PICTURE):
        yield random_crop(random, *picture)


def random_crop(
    random: np.random.Generator, color: UInt8[np.ndarray, "h w 3"], mask: UInt8[np.ndarray, "h w"]
) -> tuple[UInt8[np.ndarray, "s s 3"], UInt8[np.ndarray, "s s"]]:
    """Return a square of a picture, enlarged, turned and mirrored at random, and its mask.

    Args:
        random: Source of the choices.
        color: Red, green, blue.
        mask: 1 at cables, `UNLABELLED` where nobody knows, else 0.
    """
    height, width = mask.shape
    scale = float(np.exp(random.uniform(*np.log(SCALES))))
    side = min(CROP_SIDE / scale, height - 1.0)
    middle = random.uniform((side / 2.0, side / 2.0), (width - side / 2.0, height - side / 2.0))
    to_crop = CROP_SIDE / side
    angle = random.uniform(-45.0, 45.0) if random.random() < TURNED_SHARE else 0.0
    transform = cv2.getRotationMatrix2D(middle.tolist(), angle, to_crop)
    transform[:, 2] += CROP_SIDE / 2.0 - middle
    blend = cv2.INTER_AREA if to_crop < 1.0 else cv2.INTER_LINEAR
    layers = [color, *(255 * (mask == k).view(np.uint8) for k in (1, UNLABELLED))]
    crop, soft, unknown = (
        cv2.warpAffine(
            a, transform, (CROP_SIDE, CROP_SIDE), flags=blend, borderMode=cv2.BORDER_REFLECT_101
        )
        for a in layers
    )
    labels = np.where(unknown > 127, UNLABELLED, soft > 127).astype(np.uint8)
    turns, mirrored = int(random.integers(4)), random.random() < 0.5
    pair = [np.rot90(a, turns)[:, :: -1 if mirrored else 1] for a in (crop, labels)]
    return np.ascontiguousarray(pair[0]), np.ascontiguousarray(pair[1])


def _picture(
    random: np.random.Generator,
) -> tuple[UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w"]]:
    surface, base = _ground(random)
    count = int(random.choice(MAX_CABLES + 1, p=[0.06, 0.24, 0.3, 0.25, 0.15]))
    width = float(np.exp(random.uniform(*np.log(WIDTHS))))
    common = _sheath(random, base)
    same = random.random() < 0.4
    cables = []
    for k in range(count):
        axis = _axis(random)
        s = np.arange(len(axis)) / (random.uniform(4.0, 12.0) * width)
        height = 1.0 + k * random.uniform(0.0, 1.2) + 0.7 * np.sin(s + random.uniform(0.0, 6.28))
        own = width * random.uniform(0.7, 1.4)
        color = common if same else _sheath(random, base)
        stripes, lay = _stripes(random, color)
        cables.append(Cable(axis, np.maximum(height, 0.0), own, color, stripes, lay))
    ends = [e for c in cables if random.random() < FERRULE_SHARE for e in _ferrules(random, c)]
    lighting = _lighting(random)
    picture, labels = surface, np.zeros(surface.shape[:2], np.uint8)
    if cables:
        picture, labels = paint_cables(surface, [*cables, *ends], lighting)
        labels[labels > len(cables)] = 0
    gains = random.uniform(0.7, 1.25) * random.uniform(0.88, 1.12, 3)
    picture = 255.0 * (np.clip(picture * gains, 0.0, 255.0) / 255.0) ** random.uniform(0.7, 1.4)
    picture = picture.astype(np.float32)
    if random.random() < SHARPENED_SHARE:
        soft = cv2.GaussianBlur(picture, (0, 0), random.uniform(0.8, 2.0))
        picture = picture + random.uniform(0.3, 1.5) * (picture - soft)
    color = as_photograph(
        picture,
        random,
        random.uniform(0.3, 2.0),
        random.choice([0.0, random.uniform(0.0, 4.0)]),
        random.uniform(0.0, 10.0),
        int(random.integers(35, 98)),
    )
    return color, (labels > 0).view(np.uint8)


def _lighting(random: np.random.Generator) -> Lighting:
    azimuth = random.uniform(0.0, 6.28)
    toward = np.array([np.cos(azimuth), np.sin(azimuth), random.uniform(0.4, 3.0)])
    x, y, z = (toward / np.linalg.norm(toward)).tolist()
    hard = random.random() < HARD_SHADOW_SHARE
    flat = random.random() < FLAT_SHARE
    gloss = 0.0 if flat and random.random() < 0.8 else random.uniform(0.0, 200.0)
    weak = random.choice([0.0, random.uniform(0.05, 0.65)], p=[0.2, 0.8])
    blurs = (0.03, 0.4) if hard else (0.05, 1.2)
    return Lighting(
        (x, y, z),
        ambient=random.uniform(0.8, 1.0) if flat else random.uniform(0.1, 0.8),
        gloss=random.choice([0.0, gloss]),
        gloss_exponent=float(np.exp(random.uniform(np.log(6.0), np.log(150.0)))),
        shadow=random.uniform(0.2, 0.7) if hard else weak,
        shadow_blur=float(np.exp(random.uniform(*np.log(blurs)))),
    )


def _ground(random: np.random.Generator) -> tuple[Float32[np.ndarray, "h w 3"], Color]:
    """Ground, and the colour of most of it."""
    base = _any_color(random)
    kind = random.choice(list(GROUNDS), p=list(GROUNDS.values()))
    if kind in ("plain", "blotched"):
        surface = grounds.plain_ground(random, PICTURE_SIZE, base, random.uniform(0.0, 0.08))
    else:
        makers = {"wood": grounds.wood, "cloth": grounds.cloth, "boards": grounds.boards}
        surface = makers.get(kind, grounds.printed)(random, PICTURE_SIZE, base)
    if kind == "blotched":
        second = np.array(_any_color(random), np.float32)
        share = 1.0 / (1.0 + np.exp(-random.uniform(0.5, 6.0) * _blotches(random)))
        surface += share[..., None] * random.uniform(0.1, 1.0) * (second - surface)
    if random.random() < CLUTTER_SHARE:
        if random.random() < 0.8:
            grounds.add_things(random, surface, int(random.integers(1, 9)))
        if random.random() < 0.3:
            _draw_joints(random, surface)
        if random.random() < 0.45:
            _cast_shadows(random, surface)
    if random.random() < EDGE_SHARE:
        grounds.add_edges(random, surface)
    return surface, base


def _stripes(random: np.random.Generator, color: Color) -> tuple[Color | None, float]:
    """Second colour of a sheath and the length of its turns, or a rope's strands."""
    kind = random.random()
    if kind < 0.1:
        return _any_color(random), random.uniform(2.0, 6.0)
    if kind < 0.22:
        return _any_color(random), random.uniform(40.0, 300.0)
    if kind < 0.34:
        red, green, blue = (int(c * random.uniform(0.5, 0.8)) for c in color)
        return (red, green, blue), random.uniform(0.8, 1.6)
    return None, 3.0


def _ferrules(random: np.random.Generator, cable: Cable) -> list[Cable]:
    """Sleeve and pin at both ends of a cable."""
    parts = []
    for axis, height in ((cable.axis, cable.height), (cable.axis[::-1], cable.height[::-1])):
        ahead = axis[-1] - axis[-4]
        ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
        start = axis[-1]
        metal: Color = (200, 196, 188) if random.random() < 0.7 else (190, 110, 70)
        for wide, color in ((1.25, _any_color(random)), (random.uniform(0.4, 0.7), metal)):
            count = max(3, int(random.uniform(1.0, 3.0) * cable.width))
            way = start + np.arange(count)[:, None] * ahead
            parts.append(Cable(way, np.full(count, height[-1]), wide * cable.width, color))
            start = way[-1]
    return parts


def _blotches(random: np.random.Generator) -> Float64[np.ndarray, "h w"]:
    """Smooth noise of standard deviation one."""
    cells = random.integers(3, 24)
    noise = random.standard_normal((int(cells), int(cells)))
    smooth = cv2.resize(noise, PICTURE_SIZE, interpolation=cv2.INTER_CUBIC)
    return smooth / max(float(smooth.std()), 1e-9)


def _draw_joints(random: np.random.Generator, surface: Float32[np.ndarray, "h w 3"]) -> None:
    """Draw straight lines as between tiles and boards, in place."""
    ink = np.zeros(surface.shape[:2], np.float32)
    angle, distance = random.uniform(0.0, np.pi), random.uniform(40.0, 200.0)
    ahead, across = _turned(angle), _turned(angle + np.pi / 2.0)
    for direction, other in ((ahead, across), (across, ahead))[: int(random.integers(1, 3))]:
        for k in range(-12, 13):
            middle = np.array(PICTURE_SIZE) / 2.0 + k * distance * other
            ends = np.rint([middle - 900.0 * direction, middle + 900.0 * direction]).astype(int)
            thickness = int(random.integers(1, 4))
            cv2.line(ink, ends[0].tolist(), ends[1].tolist(), 1.0, thickness, cv2.LINE_AA)
    color = np.array(_any_color(random), np.float32)
    surface += random.uniform(0.2, 1.0) * ink[..., None] * (color - surface)


def _cast_shadows(random: np.random.Generator, surface: Float32[np.ndarray, "h w 3"]) -> None:
    """Darken bands of the ground, as things above the picture do, in place."""
    for _ in range(int(random.integers(1, 4))):
        shade = np.zeros(surface.shape[:2], np.float32)
        points = np.rint(8.0 * _axis(random)).astype(np.int32)[:, None]
        thickness = int(random.integers(6, 60))
        cv2.polylines(shade, [points], False, 1.0, thickness, cv2.LINE_AA, 3)
        blur = float(np.exp(random.uniform(np.log(0.03), np.log(0.6)))) * thickness
        shade = cv2.GaussianBlur(shade, (0, 0), max(0.5, blur))
        surface *= 1.0 - random.uniform(0.1, 0.65) * shade[..., None]


def _turned(angle: float) -> Float64[np.ndarray, "2"]:
    return np.array([np.cos(angle), np.sin(angle)])


def _axis(random: np.random.Generator) -> Float64[np.ndarray, "k 2"]:
    """Axis of random curvature that passes near the middle of the picture, a pixel a step."""
    length = int(random.uniform(250.0, 1400.0))
    smoothness = random.uniform(25.0, 160.0)
    curvature = cv2.GaussianBlur(random.standard_normal((1, length)), (0, 0), smoothness)[0]
    bend = random.uniform(0.0, 1.0) / random.uniform(25.0, 90.0)
    heading = random.uniform(0.0, 6.28)
    if random.random() < STRAIGHT_SHARE:
        bend *= 0.1
        if random.random() < 0.5:
            heading = random.integers(4) * np.pi / 2.0 + random.normal(0.0, 0.05)
    curvature *= bend / max(float(np.std(curvature)), 1e-9)
    heading += np.cumsum(curvature + random.normal(0.0, 0.002))
    path = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    middle = random.uniform((0.1, 0.1), (0.9, 0.9)) * np.array(PICTURE_SIZE)
    return path - path[int(random.integers(length))] + middle


def _any_color(random: np.random.Generator) -> Color:
    """Colour of any hue; grey, white and black more often than by chance."""
    value = random.uniform(10.0, 255.0)
    saturation = random.choice([random.uniform(0.0, 0.12), random.uniform(0.0, 1.0)])
    hsv = np.array([[[random.integers(180), 255.0 * saturation, value]]]).astype(np.uint8)
    red, green, blue = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0, 0].tolist()
    return red, green, blue


def _sheath(random: np.random.Generator, ground: Color) -> Color:
    """Colour of a cable that differs from the ground's: any, or nearly black."""
    draw = _nearly_black if random.random() < DARK_SHARE else _any_color
    for _ in range(MAX_DARK_TRIALS):
        color = draw(random)
        if _contrast(color, ground) > MIN_CONTRAST:
            return color
    # The ground is dark as well.
    while True:
        color = _any_color(random)
        if _contrast(color, ground) > MIN_CONTRAST:
            return color


def _nearly_black(random: np.random.Generator) -> Color:
    red, green, blue = (random.uniform(8.0, 60.0) + random.uniform(-4.0, 4.0, 3)).tolist()
    return int(red), int(green), int(blue)


def _contrast(color: Color, ground: Color) -> float:
    """Distance of two colours [Lab]."""
    pair = cv2.cvtColor(np.array([[color, ground]], np.uint8), cv2.COLOR_RGB2LAB)[0]
    return float(np.linalg.norm(pair[0].astype(float) - pair[1]))
