"""Problems with closed-form solutions, and the rod's errors in them.

Every problem's function creates a rod of `node_count` nodes, brings it to rest and returns one
error, in the unit that `PROBLEMS` states. The rods are practically inextensible, like those of the
closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from benchmarks.physics.closed_forms import elastica, elliptic, heavy_elastica, root
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState
from lariat.rod.strains import curvatures, moments

ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip that holds the rod along x."""
STRETCH_STIFFNESS = 1e6
"""Stretch stiffness that makes a rod practically inextensible [N]."""

Shapes = tuple[Float64[np.ndarray, "m 2"], Float64[np.ndarray, "k 2"]]
"""Points of the rod and of the closed form, in lengths of the rod unless stated otherwise."""


@dataclass(frozen=True)
class Problem:
    """Problem with a closed-form solution."""

    error: Callable[[int], float]
    """Error of a rod, by its number of nodes."""
    unit: str
    """Unit of the error; L is the length of the rod."""
    node_counts: tuple[int, ...]
    """Numbers of nodes to measure."""
    bounds: tuple[float, ...]
    """Largest allowed error for each number of nodes; 1 where none is stated."""


def heavy_cantilever(node_count: int) -> float:
    """Largest node error of a clamped rod whose tip sinks by 0.27 L, against the elastica [L]."""
    return _largest_distance(*cantilever(node_count, 4e8))


def limp_cantilever(node_count: int) -> float:
    """Largest node error of a rod four times softer, whose tip sinks by 0.67 L [L]."""
    return _largest_distance(*cantilever(node_count, 1e8))


def cantilever(node_count: int, youngs_modulus: float, points: int | None = None) -> Shapes:
    """Nodes of a rod that is clamped at one end and bends under its weight, and the elastica.

    Args:
        node_count: Number of nodes.
        youngs_modulus: Young's modulus of the rod [Pa].
        points: Number of evenly spaced points of the elastica; at the nodes if None.
    """
    properties = RodProperties(
        0.5, 0.006, 0.05, youngs_modulus, stretch_stiffness=STRETCH_STIFFNESS
    )
    rod = Rod(properties, node_count, right="free", tolerance=1e-10)
    grip = Pose(np.zeros(3), ALONG_X)
    rest = rod.rest(grip, grip)
    length = properties.length
    load = properties.linear_density * 9.81 / properties.bending_stiffness
    s = np.linspace(0.0, length, points or node_count)
    exact = heavy_elastica(load, length, s)
    return rest.state.positions[:, [0, 2]] / length, exact / length


def catenary(node_count: int) -> float:
    """Largest node error of a limp rod hung by its ends, against the catenary [L]."""
    return _largest_distance(*hung(node_count))


def hung(node_count: int) -> Shapes:
    """Nodes of a limp rod that hangs by its ends, and the catenary at their arc lengths."""
    properties = RodProperties(0.6, 0.004, 0.05, 20.0, stretch_stiffness=STRETCH_STIFFNESS)
    rod = Rod(properties, node_count, "pinned", "pinned", tolerance=1e-10)
    span, length = 0.4, properties.length
    left = Pose(np.array([-span / 2.0, 0.0, 0.0]), ALONG_X)
    rest = rod.rest(left, Pose(np.array([span / 2.0, 0.0, 0.0]), ALONG_X))
    # The parameter a of y = a cosh(x / a) for which the curve is as long as the rod.
    a = root(lambda a: 2.0 * a * math.sinh(span / (2.0 * a)) - length, 10.0 * span, 0.05 * span)
    s = np.linspace(-length / 2.0, length / 2.0, node_count)
    exact = np.stack([a * np.arcsinh(s / a), np.sqrt(a**2 + s**2)], axis=1)
    exact[:, 1] -= exact[0, 1]
    return rest.state.positions[:, [0, 2]] / length, exact / length


def pinned_elastica(node_count: int) -> float:
    """Error of the rise of a weightless strut that is buckled between pins, against Euler [L]."""
    nodes, exact = strut(node_count)
    # An even number of nodes has none at the crown: a parabola through the highest three.
    return abs(_crown(-nodes[:, 1]) + exact[len(exact) // 2, 1])


def strut(node_count: int) -> Shapes:
    """Nodes of a weightless strut that has buckled between pins, and Euler's elastica."""
    properties = RodProperties(0.5, 0.006, 0.05, 2e6, stretch_stiffness=STRETCH_STIFFNESS)
    rod = Rod(properties, node_count, "pinned", "pinned", gravity=(0.0, 0.0, 0.0), tolerance=1e-10)
    k = math.sin(math.radians(70.0) / 2.0)
    first, second = elliptic(k)
    length = properties.length
    span = length * (2.0 * second / first - 1.0)
    s = np.linspace(0.0, 1.0, node_count)
    start = np.stack([span * s, 0.0 * s, -0.3 * length * np.sin(np.pi * s)], axis=1)
    guess = _framed(start)
    left = Pose(np.zeros(3), ALONG_X)
    rest = rod.rest(left, Pose(np.array([span, 0.0, 0.0]), ALONG_X), guess)
    # theta'' = -(2 K)^2 sin(theta), which is the moment of the pins' force.
    exact = elastica(math.radians(70.0), 0.0, lambda _, theta: -4.0 * first**2 * math.sin(theta))
    return rest.state.positions[:, [0, 2]] / length, exact[:, :2] * np.array([1.0, -1.0])


def twist_torque(node_count: int) -> float:
    """Largest relative error of the twisting moment along a straight rod turned by 5 rad [-]."""
    properties = RodProperties(0.5, 0.006, 0.05, 2e6)
    rod = Rod(properties, node_count, gravity=(0.0, 0.0, 0.0), tolerance=1e-10)
    # Stretched by 1 %: otherwise it would buckle under 5 rad of twist.
    actions = np.zeros((30, 2, 6))
    actions[:10, 1, 3] = 5.0
    actions[:10, 1, 0] = 0.005
    durations = np.concatenate([np.full(10, 0.1), 0.1 * 2.0 ** np.arange(20)])
    start = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    rollout, _ = rod.settle(start, actions, durations)
    torques = moments(rod, rollout.final)[:, 2]
    exact = properties.twisting_stiffness * 5.0 / properties.length
    return float(np.max(np.abs(torques / exact - 1.0)))


def michell_ring(node_count: int) -> float:
    """Relative error of the twist at which a closed ring leaves its plane [-].

    Michell 1889: 2 pi sqrt(3) EI / GJ. Both grips coincide.
    """
    properties = RodProperties(0.5, 0.004, 0.05, 2e6)
    rod = Rod(properties, node_count, gravity=(0.0, 0.0, 0.0), tolerance=1e-9)
    ratio = properties.bending_stiffness / properties.twisting_stiffness
    exact = 2.0 * math.pi * math.sqrt(3.0) * ratio
    low, high = 0.5 * exact, 1.5 * exact
    # The ring can turn freely about its grips; inertia makes this motion determinate.
    durations = np.full(3, 20.0)
    for _ in range(12):
        twist = 0.5 * (low + high)
        start = _ring(rod, twist)
        rollout, stable = rod.settle(start, np.zeros((3, 2, 6)), durations)
        moved = np.max(np.abs(rollout.positions[-1] - start.positions))
        if stable and moved < 0.01 * properties.length and rollout.converged.all():
            low = twist
        else:
            high = twist
    return abs(0.5 * (low + high) / exact - 1.0)


def helical_buckling(node_count: int) -> float:
    """RMS distance of a localised helix from its tanh^2 envelope [-].

    Van der Heijden & Thompson 2000, in the numbers of Bergou et al. 2008: EI = 1.345,
    GJ = 0.789, length 9.29, 27 turns, ends brought 0.3 together.
    """
    nodes, exact = buckled(node_count)
    return float(np.sqrt(np.mean((nodes[:, 1] - exact[:, 1]) ** 2)))


def buckled(node_count: int) -> Shapes:
    """Envelope of a localised helix over arc length, in units of its width, and tanh^2 of it."""
    bending, twisting, length, turns, slack = 1.345, 0.789, 9.29, 27.0, 0.3
    properties = RodProperties(
        length, 0.2, 1.0, 1e6, stretch_stiffness=STRETCH_STIFFNESS
    ).with_stiffness(bending, twisting)
    rod = Rod(properties, node_count, gravity=(0.0, 0.0, 0.0), tolerance=1e-8)
    start = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    angle = 2.0 * np.pi * turns
    places = np.concatenate([[0.0], rod.model.bend_lengths.cumsum()]) / length
    spins = angle * places[:, None] * np.array([0.0, 0.0, 1.0])
    s = np.linspace(0.0, 1.0, node_count)
    bump = 0.02 * length * np.exp(-(((s - 0.5) / 0.08) ** 2))
    positions = start.positions.copy()
    positions[:, 1] += bump * np.cos(60.0 * (s - 0.5))
    positions[:, 2] += bump * np.sin(60.0 * (s - 0.5))
    start = RodState(
        positions,
        poses.multiply(start.orientations, poses.exponential(spins)),
        start.velocities,
        start.angular_velocities,
    )
    durations = np.concatenate([np.full(60, 0.1), 0.1 * 1.6 ** np.arange(40)])
    actions = np.zeros((len(durations), 2, 6))
    actions[:60, 1, 0] = -slack / 6.0
    rollout, _ = rod.settle(start, actions, durations)
    tangents = poses.normalized(np.diff(rollout.positions[-1], axis=0))
    cosine = tangents[:, 0]
    least = _crown(-cosine)
    envelope = (cosine + least) / (1.0 + least)
    moment = float(np.mean(moments(rod, rollout.final)[:, 2]))
    width = 2.0 * bending / moment * math.sqrt((1.0 - least) / (1.0 + least))
    middle = rod.edge_length * (np.arange(node_count - 1) + 0.5)
    centre = float(np.sum(middle * (1.0 - envelope)) / np.sum(1.0 - envelope))
    away = (middle - centre) / width
    return np.stack([away, envelope], axis=1), np.stack([away, np.tanh(away) ** 2], axis=1)


def natural_helix(node_count: int) -> float:
    """Largest error of the curvature of a free rod whose rest shape is a helix [1/m]."""
    rest_curvature = (3.0, 0.0, 4.0)
    properties = RodProperties(0.5, 0.006, 0.05, 2e6, rest_curvature=(rest_curvature,))
    rod = Rod(properties, node_count, right="free", gravity=(0.0, 0.0, 0.0), tolerance=1e-10)
    grip = Pose(np.zeros(3), ALONG_X)
    rest = rod.rest(grip, grip)
    return float(np.max(np.abs(curvatures(rod, rest.state) - np.array(rest_curvature))))


def _largest_distance(
    nodes: Float64[np.ndarray, "m 2"], exact: Float64[np.ndarray, "m 2"]
) -> float:
    return float(np.max(np.linalg.norm(nodes - exact, axis=1)))


def _crown(values: Float64[np.ndarray, "m"]) -> float:
    """Largest value of the parabola through the largest sample and its neighbours."""
    k = int(np.clip(np.argmax(values), 1, len(values) - 2))
    before, at, after = values[k - 1 : k + 2]
    bend = before - 2.0 * at + after
    return float(at - (after - before) ** 2 / (8.0 * bend)) if bend < 0.0 else float(at)


def _framed(nodes: Float64[np.ndarray, "n 3"]) -> RodState:
    """State along nodes in the plane y = 0, without twist."""
    tangents = poses.normalized(np.diff(nodes, axis=0))
    turn = poses.rotation_between(np.array([1.0, 0.0, 0.0]), tangents)
    n = len(nodes)
    return RodState(nodes, poses.multiply(turn, ALONG_X), np.zeros((n, 3)), np.zeros((n - 1, 3)))


def _ring(rod: Rod, twist: float) -> RodState:
    """A regular polygon with both grips at one node, twisted by an angle from end to end."""
    n = rod.node_count
    places = np.concatenate([[0.0], rod.model.bend_lengths.cumsum()]) / rod.properties.length
    angles = 2.0 * np.pi * places
    tangents = np.stack([np.cos(angles), 0.0 * angles, np.sin(angles)], axis=1)[1:-1]
    nodes = np.concatenate([np.zeros((1, 3)), np.cumsum(tangents, axis=0)]) * rod.edge_length
    about = np.stack([0.0 * angles, -angles, 0.0 * angles], axis=1)
    spins = twist * places[:, None] * np.array([0.0, 0.0, 1.0])
    frames = poses.multiply(poses.exponential(about), ALONG_X)
    return RodState(
        nodes,
        poses.multiply(frames, poses.exponential(spins)),
        np.zeros((n, 3)),
        np.zeros_like(spins),
    )


PROBLEMS: dict[str, Problem] = {
    "heavy cantilever": Problem(heavy_cantilever, "L", (10, 20, 40, 80), (1, 1, 2e-4, 1)),
    "limp cantilever": Problem(limp_cantilever, "L", (10, 20, 40, 80), (1, 1, 1, 1)),
    "catenary": Problem(catenary, "L", (10, 20, 40, 80), (1, 1, 2e-4, 1)),
    "pinned elastica": Problem(pinned_elastica, "L", (10, 20, 40, 80), (1, 1, 2e-4, 1)),
    "twist torque": Problem(twist_torque, "-", (10, 40), (5e-3, 5e-3)),
    "Michell ring": Problem(michell_ring, "-", (40, 80), (0.015, 0.015)),
    "helical buckling": Problem(helical_buckling, "-", (80, 180), (0.03, 0.015)),
    "natural helix": Problem(natural_helix, "1/m", (10, 40), (1e-6, 1e-6)),
}
"""Problems by name."""
