"""Values of a scenario that are allowed but plausible only by mistake, e.g. of a unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from lariat.scenario.scenario import Scenario
from lariat.scenario.sections import Rope

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
DENSITIES = (30.0, 12_000.0)
"""Densities of ropes and cables, from foam to lead [kg/m^3]."""
SLENDERNESS = (8.0, 10_000.0)
"""Length of a rope in diameters [-]."""
MAX_BUCKLING_FORCE = 300.0
"""Axial force that bends a rope between two clamps, above which arms of a laboratory do not [N]."""
MIN_BENDING_LENGTH = 1.0
"""Length (EI / w)^(1/3) over which a rope bends under its weight, in diameters [-]: a thread of
cotton has about 30, a chain 1."""
MAX_STRETCH_BY_WEIGHT = 0.02
"""Largest strain of a rope under its own weight [-]."""
CAMERA_DISTANCES = (0.1, 4.0)
"""Distances of a depth camera from the middle of the rope [m]."""
OBSTACLE_SIZES = (2e-3, 3.0)
"""Radii, heights and edge lengths of obstacles [m]."""
MAX_OBSTACLE_DISTANCE = 3.0
"""Distance of an obstacle from the rope, in lengths of the rope, above which it is of no effect."""
SPEEDS = (2e-3, 2.0)
"""Largest speeds of the grips [m/s]."""
MAX_TOLERANCE_SHARE = 0.1
"""Largest tolerance of a goal as a share of the rope's length [-]."""
FACTORS = (0.1, 10.0, 0.01, 100.0, 1e-3, 1e3)
"""Factors by which a wrong unit changes a value."""


def doubts(scenario: Scenario) -> tuple[str, ...]:
    """Return a line about each value that is plausible only by mistake, with a way out."""
    return (
        *_rope_doubts(scenario.rope, scenario.run.tolerance, _largest_span(scenario)),
        *_camera_doubts(scenario),
        *_obstacle_doubts(scenario),
        *_run_doubts(scenario),
    )


@dataclass(frozen=True)
class _Value:
    """Value whose effect is checked when it is scaled."""

    key: str
    value: float
    unit: str


def _rope_doubts(rope: Rope, tolerance: float, span: float) -> Iterator[str]:
    length = _Value("rope.length", rope.length, "m")
    diameter = _Value("rope.diameter", rope.diameter, "m")
    weight = _Value("rope.linear_density", rope.linear_density, "kg/m")
    modulus = _Value("rope.youngs_modulus", rope.youngs_modulus, "Pa")
    ratio = rope.length / rope.diameter
    if not _within(ratio, SLENDERNESS):
        remedy = _remedy(
            [(diameter, lambda s: ratio / s), (length, lambda s: ratio * s)], SLENDERNESS
        )
        yield f"rope.length is {ratio:.3g} times rope.diameter; {remedy}"
    density = rope.linear_density / (0.25 * math.pi * rope.diameter**2)
    if not _within(density, DENSITIES):
        cures = [(weight, lambda s: density * s), (diameter, lambda s: density / s**2)]
        remedy = _remedy(cures, DENSITIES)
        yield (
            f"rope.linear_density = {rope.linear_density:g} kg/m at rope.diameter = "
            f"{rope.diameter:g} m is a density of {density:.3g} kg/m^3; {remedy}"
        )
    stiffness = rope.youngs_modulus * math.pi * rope.diameter**4 / 64.0
    force = 4.0 * math.pi**2 * stiffness / rope.length**2
    if force > MAX_BUCKLING_FORCE:
        cures = [(modulus, lambda s: force * s), (diameter, lambda s: force * s**4)]
        yield (
            f"the bending stiffness EI = {stiffness:.3g} N m^2 takes a force of {force:.3g} N to "
            f"bend; {_remedy(cures, (0.0, MAX_BUCKLING_FORCE))}"
        )
    bends = (stiffness / (rope.linear_density * GRAVITY)) ** (1.0 / 3.0) / rope.diameter
    if bends < MIN_BENDING_LENGTH:
        cures = [
            (modulus, lambda s: bends * s ** (1 / 3)),
            (weight, lambda s: bends / s ** (1 / 3)),
        ]
        yield (
            f"at the bending stiffness EI = {stiffness:.3g} N m^2 the rope bends under its weight "
            f"within {bends:.2g} diameters; {_remedy(cures, (MIN_BENDING_LENGTH, math.inf))}"
        )
    strain = rope.linear_density * GRAVITY * rope.length / rope.stretch_stiffness
    if strain > MAX_STRETCH_BY_WEIGHT:
        stretch = _Value("rope.stretch_stiffness", rope.stretch_stiffness, "N")
        cures = [(stretch, lambda s: strain / s), (weight, lambda s: strain * s)]
        yield (
            f"the rope stretches by {100.0 * strain:.3g} % under its own weight; "
            f"{_remedy(cures, (0.0, MAX_STRETCH_BY_WEIGHT))}"
        )
    sag = math.sqrt(0.375 * span * max(rope.length - span, 0.0))
    tension = rope.linear_density * GRAVITY * span**2 / (8.0 * sag) if sag else 0.0
    largest = max(force, tension)
    change = largest * rope.length / rope.stretch_stiffness
    solid = rope.youngs_modulus * 0.25 * math.pi * rope.diameter**2
    if change > tolerance and solid > rope.stretch_stiffness:
        what = "bends the rope" if force > tension else "holds the rope between its grips"
        yield (
            f"the force that {what}, {largest:.3g} N, changes its length by {1e3 * change:.2g} mm "
            f"at rope.stretch_stiffness = {rope.stretch_stiffness:g} N; a solid rope of its "
            f"modulus has {solid:.3g} N, to be given there"
        )


def _largest_span(scenario: Scenario) -> float:
    """Largest distance of the grips in start and goal [m]."""
    pairs = (scenario.grips(shape) for shape in (scenario.start, scenario.goal))
    return max(float(np.linalg.norm(b.position - a.position)) for a, b in pairs)


def _camera_doubts(scenario: Scenario) -> Iterator[str]:
    if scenario.sensing.source != "camera":
        return
    for camera in scenario.camera_setups:
        distance = float(np.linalg.norm(camera.T_world_camera.position - _middle(scenario)))
        if not _within(distance, CAMERA_DISTANCES):
            yield (
                f"{camera.key}.position is {distance:.3g} m from the rope; a depth camera measures "
                f"from {CAMERA_DISTANCES[0]:g} to {CAMERA_DISTANCES[1]:g} m: check its unit, metres"
            )


def _obstacle_doubts(scenario: Scenario) -> Iterator[str]:
    middle = _middle(scenario)
    for body in scenario.obstacles:
        if body.shape == "half_space":
            continue
        sizes = [size for size in (body.radius, body.height, *(body.size or ())) if size]
        for size in sizes:
            if not _within(size, OBSTACLE_SIZES):
                yield (
                    f"obstacle {body.name or body.shape!r} is {size:g} m large; "
                    "check its unit, metres"
                )
                break
        reach = max(sizes, default=0.0)
        distance = float(np.linalg.norm(np.array(body.position) - middle)) - reach
        if distance > MAX_OBSTACLE_DISTANCE * scenario.rope.length:
            yield (
                f"obstacle {body.name or body.shape!r} is {distance:.3g} m away, out of the reach "
                "of the rope; check the unit of its position, metres"
            )


def _run_doubts(scenario: Scenario) -> Iterator[str]:
    speed = scenario.limits.speed
    if not _within(speed, SPEEDS):
        yield f"limits.speed = {speed:g} m/s; check its unit"
    tolerance, length = scenario.run.tolerance, scenario.rope.length
    if tolerance > MAX_TOLERANCE_SHARE * length:
        yield (
            f"run.tolerance = {tolerance:g} m is {100.0 * tolerance / length:.3g} % of the rope's "
            "length, so that nearly any shape is the goal; check its unit, metres"
        )


def _middle(scenario: Scenario) -> np.ndarray:
    left, right = scenario.grips(scenario.start)
    return (left.position + right.position) / 2.0


def _remedy(
    cures: list[tuple[_Value, Callable[[float], float]]], bounds: tuple[float, float]
) -> str:
    """Return the values that would be plausible and differ by a power of ten."""
    remedies = []
    for value, effect in cures:
        factor = next((f for f in FACTORS if _within(effect(f), bounds)), None)
        if factor is not None:
            remedies.append(f"{value.key} = {value.value * factor:g} {value.unit}")
    keys = " and ".join(value.key for value, _ in cures)
    return f"did you mean {' or '.join(remedies)}?" if remedies else f"check {keys}"


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]
