"""Random sequences in which a held rope moves beside other ropes, behind hands and out of view."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.scenario.goal_table import LEVEL_GRIP
from lariat.simulation.camera.rgbd_camera import RGB, Tube

Case = Literal[
    "alone",
    "crossing",
    "beside",
    "sweeping",
    "colored",
    "hand",
    "both",
    "leaving",
    "fast",
    "cables",
]
CASES: tuple[Case, ...] = get_args(Case)
"""Names of the cases, in the order of the table."""

COLORFUL: tuple[Case, ...] = ("cables",)
"""Cases in which the held rope's colour is given; in all others it is the brightest thing."""

DURATION = 3.0
"""Duration of a sequence [s]."""
ROPE_COLOR: RGB = (255, 255, 255)
"""Colour of the held rope and of all other ropes but those of `colored`."""
OTHER_COLORS: tuple[RGB, ...] = ((220, 60, 40), (60, 120, 220), (200, 200, 60))
"""Colours of the ropes of `colored`."""
SKIN_COLOR: RGB = (205, 150, 125)
"""Colour of a hand."""
ARM_RADIUS = 0.055
"""Radius of the forearm that hides the rope [m]."""
ARM_HEIGHT = 0.62
"""Height of its axis above the table [m]."""

GripPath = Callable[[float], tuple[Pose, Pose]]
TubePath = Callable[[float], list[Tube]]


@dataclass(frozen=True)
class Sequence:
    """Motion of the grips and of all that is not the held rope."""

    grips: GripPath
    """Left and right grip at a time [s]."""
    tubes: TubePath
    """Other ropes and hands at a time [s]."""


def sequence(case: Case, length: float, radius: float, seed: int) -> Sequence:
    """Return a random sequence.

    Args:
        case: Its kind.
        length: Length of the held rope [m].
        radius: Radius of the held rope [m].
        seed: Its seed.
    """
    random = np.random.default_rng([CASES.index(case), seed])
    grips = _grips(random, case, length)
    parts: list[TubePath] = []
    if case in ("crossing", "both", "colored"):
        parts.append(_crossing(random, case, grips, radius))
    if case == "beside":
        parts.append(_beside(random, grips, radius))
    if case == "sweeping":
        parts.append(_sweeping(random, grips, radius))
    if case == "cables":
        parts.append(_cables(random, grips))
    if case in ("hand", "both"):
        parts.append(_hand(random))
    return Sequence(grips, lambda t: [tube for part in parts for tube in part(t)])


def _grips(random: np.random.Generator, case: Case, length: float) -> GripPath:
    """Grips that sway, about 0.25 m/s; that leave the view; or that move at up to 2 m/s."""
    gap, yaw = random.uniform(0.62, 0.82) * length, random.uniform(-0.6, 0.6)
    half = 0.5 * gap * np.array([math.cos(yaw), math.sin(yaw), random.uniform(-0.15, 0.15)])
    centre = np.array([*random.uniform(-0.04, 0.04, 2), random.uniform(0.25, 0.33)])
    turns = []
    for _ in range(2):
        tilt = poses.exponential(random.normal(0.0, 0.15, 3))
        about_z = poses.exponential(np.array([0.0, 0.0, yaw]))
        turns.append(poses.multiply(tilt, poses.multiply(about_z, LEVEL_GRIP)))
    sway, phase = random.uniform(-0.03, 0.03, (2, 3)), random.uniform(0.0, math.pi, 2)
    direction = random.uniform(-math.pi, math.pi)
    swing = np.array([math.cos(direction), math.sin(direction), 0.0])
    exit_side = random.choice([-1.0, 1.0])

    def shift(t: float) -> Float64[np.ndarray, "3"]:
        if case == "fast":
            # 2 m/s at most: 0.16 m at 2 Hz, begun gently.
            return 0.16 * min(1.0, t) * math.sin(4.0 * math.pi * t) * swing
        if case == "leaving":
            # Out of the view for about a second, by a smooth step there and back.
            out = _smooth_step((t - 0.4) / 0.8) - _smooth_step((t - 1.8) / 0.8)
            return np.array([0.0, 0.75 * exit_side * out, 0.0])
        return np.zeros(3)

    def at(t: float) -> tuple[Pose, Pose]:
        both = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            swayed = sway[side] * math.sin(2.5 * t + phase[side])
            both.append(Pose(centre + sign * half + swayed + shift(t), turns[side]))
        return both[0], both[1]

    return at


def _smooth_step(s: float) -> float:
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


def _crossing(random: np.random.Generator, case: Case, grips: GripPath, radius: float) -> TubePath:
    """Rope at rest that crosses ours, over or under it, in contact or up to 40 mm away."""
    left, right = (g.position for g in grips(0.0))
    along = random.uniform(0.25, 0.75)
    place = left + along * (right - left)
    place[2] += random.uniform(-0.09, 0.03)
    heading = math.atan2(*(right - left)[1::-1]) + random.uniform(0.3, math.pi - 0.3)
    color = ROPE_COLOR if case != "colored" else OTHER_COLORS[random.integers(len(OTHER_COLORS))]
    nodes = place + _curve(random, heading)
    return lambda t: [Tube(nodes, radius, color)]


def _beside(random: np.random.Generator, grips: GripPath, radius: float) -> TubePath:
    """Rope at rest that runs along ours, 20 to 50 mm beside it."""
    left, right = (g.position for g in grips(0.0))
    heading = math.atan2(*(right - left)[1::-1])
    aside = random.choice([-1.0, 1.0]) * random.uniform(0.02, 0.05)
    offset = np.array([-math.sin(heading) * aside, math.cos(heading) * aside, -0.06])
    nodes = 0.5 * (left + right) + offset + _curve(random, heading, bend=0.25)
    return lambda t: [Tube(nodes, radius, ROPE_COLOR)]


def _sweeping(random: np.random.Generator, grips: GripPath, radius: float) -> TubePath:
    """Rope that passes over or under ours at 0.2 m/s, at any angle."""
    left, right = (g.position for g in grips(0.0))
    heading = math.atan2(*(right - left)[1::-1]) + random.uniform(-0.8, 0.8)
    across = np.array([-math.sin(heading), math.cos(heading), 0.0])
    place = 0.5 * (left + right) + np.array([0.0, 0.0, random.uniform(-0.12, 0.04)])
    nodes = place + _curve(random, heading)
    return lambda t: [Tube(nodes + 0.2 * (t - 1.5) * across, radius, ROPE_COLOR)]


def _cables(random: np.random.Generator, grips: GripPath) -> TubePath:
    """Three cables of any colour, 4 to 16 mm, at rest: one across below ours, two on the table."""
    left, right = (g.position for g in grips(0.0))
    place = 0.5 * (left + right)
    tubes = []
    for height in (place[2] - random.uniform(0.03, 0.1), None, None):
        radius = 0.5 * random.uniform(0.004, 0.016)
        r, g, b = random.integers(0, 256, 3).tolist()
        curve = _curve(random, random.uniform(-math.pi, math.pi))
        if height is None:
            height, curve[:, 2] = radius, 0.0
            curve[:, :2] += random.uniform(-0.12, 0.12, 2)
        tubes.append(Tube(np.array([*place[:2], height]) + curve, radius, (r, g, b)))
    return lambda t: tubes


def _hand(random: np.random.Generator) -> TubePath:
    """Forearms side by side between camera and rope, which hide all of it for about a second."""
    sign = random.choice([-1.0, 1.0])
    bend = random.uniform(-0.06, 0.06)

    def at(t: float) -> list[Tube]:
        # In from one side, at rest above the rope, out again.
        y = 0.75 * sign * (1.0 - _smooth_step((t - 0.5) / 0.7) + _smooth_step((t - 1.8) / 0.7))
        arms = []
        for row in (-1.0, 0.0, 1.0):
            aside = y + 1.7 * ARM_RADIUS * row
            axis = [[-0.3, aside - bend, ARM_HEIGHT], [0.3, aside + bend, ARM_HEIGHT]]
            arms.append(Tube(np.array(axis), ARM_RADIUS, SKIN_COLOR))
        return arms

    return at


def _curve(
    random: np.random.Generator, heading: float, bend: float = 0.6
) -> Float64[np.ndarray, "n 3"]:
    """Axis of another rope of 0.5 m about the origin, as it passes it along a heading [m]."""
    s = np.linspace(-1.0, 1.0, 400)
    yaw = heading + bend * sum(
        random.normal(0.0, 0.6 / k) * np.sin(k * s + random.uniform(-1.5, 1.5)) for k in (1, 2)
    )
    pitch = 0.25 * bend * random.normal() * s
    steps = np.stack(
        [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=1
    )
    path = 0.25 * (s[1] - s[0]) * np.cumsum(steps, axis=0)
    return polylines.resample(path - path[len(path) // 2], 50)
