"""MuJoCo model of a rope between two mocap grippers, as MJCF text.

The rope is a one-dimensional flex: a discrete elastic rod with bending and twist. Its shape in the
model is its rest shape, so a rope with rest curvature is written curved. The grip of an end is a
mocap body whose z axis lies along the rope, as in all of Lariat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle

TIMESTEP = 0.002
"""Time step of the engine [s]; at 5 ms the rope sinks 16 mm into a cylinder, at 2 ms 0.4 mm."""


@dataclass(frozen=True)
class MujocoRope:
    """Properties of the true rope, which the controller does not know."""

    length: float
    """Length [m]."""
    diameter: float
    """Diameter [m]."""
    node_count: int
    """Number of nodes; all edges have the length `length / (node_count - 1)`."""
    linear_density: float
    """Mass per length [kg/m]."""
    youngs_modulus: float
    """Young's modulus E [Pa]; the bending stiffness is EI = E pi d^4 / 64."""
    poisson_ratio: float = 0.3
    """Poisson's ratio [-]."""
    damping: float = 1.0
    """Damping force per velocity and mass [1/s]."""
    stiffness_profile: tuple[float, ...] = ()
    """Factors on bending and twisting stiffness, evenly spread from left to right [-]."""
    rest_curvature: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Two curvatures and a twist of the unloaded rope in its material frame [1/m]."""
    friction: float = 0.3
    """Coulomb friction coefficient against all obstacles [-]."""


def rest_shape(
    rope: MujocoRope,
) -> tuple[Float64[np.ndarray, "n 3"], Float64[np.ndarray, "n-1 4"]]:
    """Node positions [m] and edge orientations (wxyz) of the unloaded rope.

    The first node is at the origin, the first edge along z.
    """
    edge = rope.length / (rope.node_count - 1)
    turn = poses.exponential(edge * np.array(rope.rest_curvature))
    frames = [poses.IDENTITY]
    for _ in range(rope.node_count - 2):
        frames.append(poses.multiply(frames[-1], turn))
    steps = poses.rotate(np.array(frames), np.array([0.0, 0.0, edge]))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]), np.array(frames)


def mjcf(rope: MujocoRope, obstacles: Sequence[Obstacle]) -> str:
    """MJCF text of a rope among obstacles."""
    nodes, frames = rest_shape(rope)
    n = rope.node_count
    edge = rope.length / (n - 1)
    mass = rope.linear_density * edge
    # MuJoCo requires an inertia, although these bodies only slide.
    node_inertia = _row([max(mass * edge**2, 1e-9)] * 3)
    twist_inertia = _row([mass * rope.diameter**2 / 8.0] * 3)
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    inner_nodes = "".join(
        f'<body name="node{i}" pos="{_row(nodes[i])}">'
        f'<inertial pos="0 0 0" mass="{mass:.9g}" diaginertia="{node_inertia}"/>'
        f"{slides}</body>"
        for i in range(2, n - 2)
    )
    twists = "".join(
        f'<body name="rope_twist_{e}">'
        f'<inertial pos="0 0 0" mass="1e-9" diaginertia="{twist_inertia}"/>'
        f'<joint name="rope_twist_{e}" type="hinge" axis="1 0 0"/></body>'
        for e in range(1, n - 2)
    )
    grips = (
        f'<body name="left" mocap="true" pos="{_row(nodes[0])}" quat="{_row(frames[0])}"/>'
        f'<body name="right" mocap="true" pos="{_row(nodes[-1])}" quat="{_row(frames[-1])}"/>'
    )
    bodies = ["left", "left", *(f"node{i}" for i in range(2, n - 2)), "right", "right"]
    vertices = np.zeros((n, 3))
    vertices[1, 2], vertices[-2, 2] = edge, -edge
    geoms = "".join(_geom(o, rope.friction) for o in obstacles)
    return f"""<mujoco model="lab">
<compiler autolimits="true" angle="radian"/>
<option timestep="{TIMESTEP}" integrator="discrete" solver="Newton" iterations="50"
 tolerance="1e-8" cone="pyramidal"/>
<statistic extent="1" center="0 0 0.2"/>
<worldbody>{geoms}{grips}{inner_nodes}{twists}</worldbody>
<deformable><flex name="rope" dim="1" radius="{rope.diameter / 2.0:.9g}" body="{" ".join(bodies)}"
 vertex="{_row(vertices.ravel())}" element="{" ".join(f"{i} {i + 1}" for i in range(n - 1))}">
<elasticity young="{rope.youngs_modulus:.9g}" poisson="{rope.poisson_ratio:.9g}" damping="0"/>
<contact selfcollide="none" contype="1" conaffinity="1" solref="0.004 1" condim="3"
 friction="{rope.friction:.6g}"/></flex></deformable>
<equality><flex flex="rope" solref="0.001 1" solimp="0.999 0.9999 0.001"/></equality>
</mujoco>"""


def _geom(obstacle: Obstacle, friction: float) -> str:
    orientation = np.array(obstacle.orientation)
    half = obstacle.height / 2.0
    match obstacle.shape:
        case "sphere":
            kind, size = "sphere", (obstacle.radius,)
        case "capsule" | "cylinder":
            kind, size = obstacle.shape, (obstacle.radius, half)
        case "box":
            kind, size = "box", tuple(np.array(obstacle.size) / 2.0)
        case "half_space":
            kind, size = "plane", (0.0, 0.0, 1.0)
            normal = poses.normalized(np.array(obstacle.normal))
            up = np.array([0.0, 0.0, 1.0])
            orientation = poses.multiply(orientation, poses.rotation_between(up, normal))
    return (
        f'<geom type="{kind}" size="{_row(size)}" pos="{_row(obstacle.position)}" '
        f'quat="{_row(orientation)}" friction="{friction:.6g}" solref="0.004 1"/>'
    )


def _row(values: Sequence[float] | np.ndarray) -> str:
    return " ".join(f"{v:.12g}" for v in np.asarray(values, float).ravel())
