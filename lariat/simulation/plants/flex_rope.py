"""Rope as MuJoCo's one-dimensional flex: a discrete elastic rod with bending and twist.

Its shape in the model is its rest shape, so a rope with rest curvature is written curved. Each grip
holds the end node and one more vertex behind it, on the grip's axis: the edge between the two gives
the direction of the clamp.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.simulation.plants.mujoco_rope import CONTACT_SOLREF, MujocoRope, row, scene

EDGE_SOLREF = "0.001 0.1"
"""Time constant [s] and damping ratio [-] of the constraint that keeps the edges' lengths."""


class FlexRope:
    """Rope of one flex; its unknowns are the positions of the nodes and the twists of the edges."""

    relaxation_steps = 0
    """See `RopeModel`."""

    def __init__(self, rope: MujocoRope) -> None:
        self._rope = rope

    @property
    def rope(self) -> MujocoRope:
        """Properties of the rope."""
        return self._rope

    def mjcf(self, obstacles: Sequence[Obstacle]) -> str:
        """Return the MJCF text of the rope among obstacles; mocap bodies 0 and 1 are the grips."""
        rope = self.rope
        nodes, frames = rope.rest_shape()
        n, edge = rope.node_count, rope.edge_length
        mass = rope.linear_density * edge
        # MuJoCo requires an inertia, although these bodies only slide.
        node_inertia = row([max(mass * edge**2, 1e-9)] * 3)
        twist_inertia = row([mass * rope.diameter**2 / 8.0] * 3)
        slides = "".join(
            f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")
        )
        inner_nodes = "".join(
            f'<body name="node{i}" pos="{row(nodes[i])}">'
            f'<inertial pos="0 0 0" mass="{mass:.9g}" diaginertia="{node_inertia}"/>'
            f"{slides}</body>"
            for i in range(1, n - 1)
        )
        # The flex has an edge in each grip, before the rope's first and after its last.
        twists = "".join(
            f'<body name="rope_twist_{e}">'
            f'<inertial pos="0 0 0" mass="1e-9" diaginertia="{twist_inertia}"/>'
            f'<joint name="rope_twist_{e}" type="hinge" axis="1 0 0"/></body>'
            for e in range(1, n)
        )
        grips = (
            f'<body name="left" mocap="true" pos="{row(nodes[0])}" quat="{row(frames[0])}"/>'
            f'<body name="right" mocap="true" pos="{row(nodes[-1])}" quat="{row(frames[-1])}"/>'
        )
        bodies = ["left", "left", *(f"node{i}" for i in range(1, n - 1)), "right", "right"]
        vertices = np.zeros((n + 2, 3))
        vertices[0, 2], vertices[-1, 2] = -edge, edge
        edges = " ".join(f"{i} {i + 1}" for i in range(n + 1))
        return scene(
            obstacles,
            rope.friction,
            f"{grips}{inner_nodes}{twists}",
            f"""<deformable><flex name="rope" dim="1" radius="{rope.diameter / 2.0:.9g}"
 body="{" ".join(bodies)}" vertex="{row(vertices)}" element="{edges}">
<elasticity young="{rope.youngs_modulus:.9g}" poisson="{rope.poisson_ratio:.9g}" damping="0"/>
<contact selfcollide="none" contype="1" conaffinity="1" solref="{CONTACT_SOLREF}" condim="3"
 friction="{rope.friction:.6g}"/></flex></deformable>
<equality><flex flex="rope" solref="{EDGE_SOLREF}" solimp="0.9999 0.9999 0.001"/></equality>""",
        )

    def configure(self, model: mujoco.MjModel) -> None:
        """Set the stiffness at each node, which MJCF takes to be the same everywhere."""
        rope = self.rope
        # Layout of `flex_bending`: a count, then ten numbers for every pair of neighbouring edges,
        # the fifth of them its bending and the ninth its twisting stiffness.
        joints = int(model.flex_bending[0])
        rows = model.flex_bending[1 : 1 + 10 * joints].reshape(joints, 10)
        factors = rope.stiffness_factors * rope.edge_length / rope.spans
        rows[:, (4, 8)] *= factors[:, None]
        slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        self._slides = model.jnt_qposadr[slides]
        self._slide_dofs = model.jnt_dofadr[slides]
        self._origins = model.body_pos[model.jnt_bodyid[slides][::3]].copy()

    def nodes(self, state: mujoco.MjData) -> Float64[np.ndarray, "n 3"]:
        """Return the node positions, left end first [m]."""
        return state.flexvert_xpos[1:-1].copy()

    def tensions(self, model: mujoco.MjModel, state: mujoco.MjData) -> Float64[np.ndarray, "n-1"]:
        """Return the force that keeps the length of each edge; see `RopeModel`."""
        del model
        return -state.efc_force[state.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)]

    def add_air_drag(self, state: mujoco.MjData) -> None:
        """Add the forces of the air on the free nodes; see `RopeModel.add_air_drag`."""
        axes = poses.normalized(np.gradient(self.nodes(state), axis=0)[1:-1])
        forces = self.rope.air_drag(axes, state.qvel[self._slide_dofs].reshape(-1, 3))
        state.qfrc_applied[self._slide_dofs] += forces.ravel()

    def release(self, state: mujoco.MjData, end: int) -> None:
        """Refuse to let go of an end.

        Raises:
            ValueError: The end vertices are parts of the grips.
        """
        del state
        raise ValueError(f"end {end} of a flex is a part of its grip; use plant.model = 'links'")

    def place(
        self, state: mujoco.MjData, curve: Float64[np.ndarray, "n 3"], grips: Sequence[Pose]
    ) -> None:
        """Put the nodes on a curve; see `RopeModel.place`."""
        state.qpos[self._slides] = (curve[1:-1] - self._origins).ravel()
