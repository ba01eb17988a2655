"""True rope of MuJoCo's plants: its properties, its unloaded shape, and the scene around it.

A grip holds position and direction at the end of the rope: bending between the grip and the first
edge acts over half an edge, so that rest shapes converge to those of a clamped rod in second order
of the edge length.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties

PRIMITIVES = ("cylinder", "box", "sphere", "capsule")
"""Shapes that MuJoCo has too, under the same names."""
TIMESTEP = 0.002
"""Time step of the engine [s]; at 4 ms its error in motion is three times as large, 0.04 mm."""
CONTACT_SOLREF = "0.004 1"
"""Time constant [s] and damping ratio [-] of contacts."""


@dataclass(frozen=True)
class MujocoRope:
    """Properties of the true rope, which the controller does not know."""

    length: float
    """Length between the grips [m]."""
    diameter: float
    """Diameter [m]."""
    node_count: int
    """Number of nodes; all edges have the length `length / (node_count - 1)`."""
    linear_density: float
    """Mass per length [kg/m]."""
    youngs_modulus: float
    """Young's modulus E [Pa]; the bending stiffness is EI = E pi d^4 / 64."""
    poisson_ratio: float = 0.3
    """Poisson's ratio [-]; the twisting stiffness is GJ = EI / (1 + nu)."""
    damping: float = 1.0
    """Damping force per velocity and mass [1/s]."""
    internal_damping: float = 0.0
    """Viscous moment per rate of curvature, divided by EI [s]; for `LinkedRope` only."""
    drag_coefficient: float = 0.0
    """Drag coefficient of air that flows across the rope [-]."""
    stiffness_profile: tuple[float, ...] = ()
    """Factors on bending and twisting stiffness, evenly spread from left to right [-]."""
    rest_curvature: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Two curvatures and a twist of the unloaded rope in its material frame [1/m]."""
    layers: tuple[tuple[float, float], ...] = ()
    """Share of the stiffness, and curvature at which it yields [1/m], of each layer of the bends;
    for `LinkedRope` only, where each axis yields by itself."""
    friction: float = 0.3
    """Coulomb friction coefficient against all obstacles [-]."""

    @property
    def edge_length(self) -> float:
        """Distance of two nodes [m]."""
        return self.length / (self.node_count - 1)

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI where the profile is 1 [N m^2]."""
        return self.youngs_modulus * math.pi * self.diameter**4 / 64.0

    @property
    def spans(self) -> Float64[np.ndarray, "n"]:
        """Length of rope over which the bending at each node acts [m]; half an edge at a grip."""
        spans = np.full(self.node_count, self.edge_length)
        spans[[0, -1]] /= 2.0
        return spans

    @property
    def stiffness_factors(self) -> Float64[np.ndarray, "n"]:
        """Factor of `stiffness_profile` at each node [-]."""
        if not self.stiffness_profile:
            return np.ones(self.node_count)
        knots = np.array(self.stiffness_profile)
        at = np.linspace(0.0, len(knots) - 1.0, self.node_count)
        return np.interp(at, np.arange(len(knots)), knots)

    @property
    def in_air(self) -> bool:
        """Whether the air slows the rope."""
        return self.drag_coefficient > 0.0

    def air_drag(
        self, axes: Float64[np.ndarray, "k 3"], velocities: Float64[np.ndarray, "k 3"]
    ) -> Float64[np.ndarray, "k 3"]:
        """Forces of the air on pieces as long as an edge [N].

        Args:
            axes: Unit vectors along the pieces.
            velocities: Velocities of the pieces [m/s].
        """
        across = velocities - np.sum(velocities * axes, axis=1, keepdims=True) * axes
        speeds = np.linalg.norm(across, axis=1, keepdims=True)
        area = self.diameter * self.edge_length
        return -0.5 * self.drag_coefficient * RodProperties.air_density * area * speeds * across

    def rest_shape(self) -> tuple[Float64[np.ndarray, "n 3"], Float64[np.ndarray, "n+1 4"]]:
        """Nodes [m] and orientations (wxyz) of left grip, edges and right grip, unloaded.

        The first node is at the origin, the left grip along z.
        """
        turns = poses.exponential(self.spans[:, None] * np.array(self.rest_curvature))
        frames = [poses.IDENTITY]
        for turn in turns:
            frames.append(poses.multiply(frames[-1], turn))
        steps = poses.rotate(np.array(frames[1:-1]), np.array([0.0, 0.0, self.edge_length]))
        return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]), np.array(frames)


class RopeModel(Protocol):
    """Representation of the rope in MuJoCo, between two mocap bodies that are the grips."""

    relaxation_steps: int
    """Steps without momentum before the rope settles from a guess."""

    @property
    def rope(self) -> MujocoRope:
        """Properties of the rope."""
        ...

    def mjcf(self, obstacles: Sequence[Obstacle]) -> str:
        """Return the MJCF text of the rope among obstacles; mocap bodies 0 and 1 are the grips."""
        ...

    def configure(self, model: mujoco.MjModel) -> None:
        """Set what the text cannot express in the compiled model."""
        ...

    def nodes(self, state: mujoco.MjData) -> Float64[np.ndarray, "n 3"]:
        """Return the node positions, left end first [m]."""
        ...

    def tensions(self, model: mujoco.MjModel, state: mujoco.MjData) -> Float64[np.ndarray, "n-1"]:
        """Return the tension of each edge as the engine has it, positive where it is pulled [N]."""
        ...

    def add_air_drag(self, state: mujoco.MjData) -> None:
        """Add the forces of the air to those that are applied in the next step."""
        ...

    def release(self, state: mujoco.MjData, end: int) -> None:
        """Let go of an end, until the state is reset.

        Args:
            state: State to change.
            end: 0 for the left end, 1 for the right one.

        Raises:
            ValueError: The end is a part of its grip.
        """
        ...

    def place(
        self, state: mujoco.MjData, curve: Float64[np.ndarray, "n 3"], grips: Sequence[Pose]
    ) -> None:
        """Lay the rope along a curve of about its length.

        Args:
            state: State to change; the mocap bodies are at the grips.
            curve: Positions of the nodes, at equal distances [m].
            grips: Poses of the left and the right grip.
        """
        ...


def scene(obstacles: Sequence[Obstacle], friction: float, body: str, rest: str = "") -> str:
    """Return MJCF text of a rope among obstacles.

    Args:
        obstacles: Obstacles.
        friction: Friction coefficient of the obstacles [-].
        body: Elements of `worldbody`.
        rest: Elements beside `worldbody`.
    """
    geoms = "".join(_geom(o, friction) for o in obstacles)
    meshes = "".join(_mesh(o) for o in obstacles)
    # The rope is one island: the search for others takes a tenth of a step.
    return f"""<mujoco model="lab">
<compiler autolimits="true" angle="radian"/>
<option timestep="{TIMESTEP}" integrator="discrete" solver="Newton" iterations="50"
 tolerance="1e-8" cone="pyramidal">
<flag island="disable"/></option>
<statistic extent="1" center="0 0 0.2"/>
<asset>{meshes}</asset>
<worldbody>{geoms}{body}</worldbody>
{rest}
</mujoco>"""


def row(values: Sequence[float] | np.ndarray) -> str:
    """Return numbers as an attribute of MJCF."""
    return " ".join(f"{v:.12g}" for v in np.asarray(values, float).ravel())


def _mesh(obstacle: Obstacle) -> str:
    """Return the mesh of a body that is no primitive of MuJoCo; empty for the others."""
    if obstacle.shape in (*PRIMITIVES, "half_space"):
        return ""
    corners = obstacle.row.mesh(obstacle.packed_sizes).points
    return f'<mesh name="{_mesh_name(obstacle)}" vertex="{row(corners)}"/>'


def _mesh_name(obstacle: Obstacle) -> str:
    return f"{obstacle.shape} {obstacle.name} {row(obstacle.position)}"


def _geom(obstacle: Obstacle, friction: float) -> str:
    kind, size = obstacle.shape, obstacle.packed_sizes
    orientation = np.array(obstacle.orientation)
    if kind == "half_space":
        kind, size = "plane", np.array([0.0, 0.0, 1.0])
        up = np.array([0.0, 0.0, 1.0])
        turn = poses.rotation_between(up, obstacle.packed_sizes)
        orientation = poses.multiply(orientation, turn)
    form = f'type="{kind}" size="{row(size)}"'
    if kind not in (*PRIMITIVES, "plane"):
        form = f'type="mesh" mesh="{_mesh_name(obstacle)}"'
    return (
        f'<geom {form} pos="{row(obstacle.position)}" '
        f'quat="{row(orientation)}" friction="{friction:.6g}" solref="{CONTACT_SOLREF}"/>'
    )
