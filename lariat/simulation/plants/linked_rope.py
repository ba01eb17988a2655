"""Rope as a chain of rigid links with springs in its joints, in joint coordinates.

The link in the middle moves freely; two branches of links go from it to the ends. A joint is three
hinges, two that bend and one that twists, each with the stiffness of the rope that it stands for.
At each end a small plug is welded to the grip; the joint between plug and last link stands for half
a link. Links neither stretch nor shear.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.simulation.plants.mujoco_rope import CONTACT_SOLREF, MujocoRope, row, scene

PLUG_MASS = 0.01
"""Mass of a plug, as a fraction of a link's [-]."""
WELD_SOLREF = "0.0005 0.1"
"""Time constant [s] and damping ratio [-] of a weld; with little damping, a plug does not lag
behind its moving grip."""
AXES = (("1 0 0", "0 1 0", "0 0 1"), ("0 1 0", "1 0 0", "0 0 1"))
"""Axes of the hinges of the joints at even and at odd nodes, in their order: two bend, the last
twists. Two bends a and b in succession also twist by about a b / 2, with the other sign in the
other order; with one order throughout, that would add up in a rope that leaves its plane."""


class LinkedRope:
    """Rope of rigid links; its unknowns are one pose and the angles of the joints."""

    relaxation_steps = 300
    """See `RopeModel`: the small links would whip out of the kinks of a curve that is laid."""

    def __init__(self, rope: MujocoRope) -> None:
        self._rope = rope
        self._middle = (rope.node_count - 1) // 2

    @property
    def rope(self) -> MujocoRope:
        """Properties of the rope."""
        return self._rope

    def mjcf(self, obstacles: Sequence[Obstacle]) -> str:
        """Return the MJCF text of the rope among obstacles; mocap bodies 0 and 1 are the grips."""
        n, middle = self.rope.node_count, self._middle
        # Body k hangs on body k + 1 left of the middle, on body k - 1 right of it.
        self._layers: list[str] = []
        leftwards = "".join(self._open(k, -1) for k in range(middle - 1, -2, -1))
        rightwards = "".join(self._open(k, 1) for k in range(middle + 1, n))
        chain = (
            f'<body name="link{middle}"><freejoint/>{self._link()}'
            f"{leftwards}{'</body>' * (middle + 1)}"
            f"{rightwards}{'</body>' * (n - 1 - middle)}</body>"
        )
        welds = "".join(
            f'<weld body1="{side}" body2="link{k}" relpose="0 0 0 1 0 0 0" '
            f'solref="{WELD_SOLREF}" solimp="0.9999 0.9999 0.001"/>'
            for side, k in (("left", -1), ("right", n - 1))
        )
        grips = '<body name="left" mocap="true"/><body name="right" mocap="true"/>'
        rest = f"<equality>{welds}</equality><tendon>{''.join(self._layers)}</tendon>"
        return scene(obstacles, self.rope.friction, f"{grips}{chain}", rest)

    def _open(self, k: int, direction: int) -> str:
        """Return the opening of body k, which hangs on its neighbour against `direction`."""
        rope = self.rope
        edge = rope.edge_length
        plug = k in (-1, rope.node_count - 1)
        node = k if direction > 0 else k + 1
        rest = direction * rope.spans[node] * np.array(rope.rest_curvature)
        (angles,) = _joint_angles(poses.exponential(rest[None]), np.array([node]))
        bending = rope.bending_stiffness * rope.stiffness_factors[node] / rope.spans[node]
        stiffness = (bending, bending, bending / (1.0 + rope.poisson_ratio))
        # The frame of a link is at its middle, that of a plug at the node.
        anchor = 0.0 if plug else -0.5 * direction * edge
        elastic = 1.0 - sum(share for share, _ in rope.layers)
        joints = "".join(
            f'<joint name="{k} {axis}" type="hinge" axis="{axis}" pos="0 0 {anchor:.12g}" '
            f'stiffness="{elastic * k_axis:.9g}" springref="{angle:.12g}" '
            f'damping="{rope.internal_damping * k_axis:.9g}"/>'
            for axis, k_axis, angle in zip(AXES[node % 2], stiffness, angles, strict=True)
        )
        for axis, k_axis, angle in zip(AXES[node % 2], stiffness, angles, strict=True):
            for share, limit in rope.layers:
                most = limit * rope.spans[node] * math.sqrt(bending / k_axis)
                self._layers.append(
                    f'<fixed stiffness="{share * k_axis:.9g}" springyield="{most:.12g}" '
                    f'springlength="{angle:.12g}"><joint joint="{k} {axis}" coef="1"/></fixed>'
                )
        offset = direction * (0.5 * edge if plug else edge)
        content = self._plug() if plug else self._link()
        return f'<body name="link{k}" pos="0 0 {offset:.12g}">{joints}{content}'

    def _link(self) -> str:
        rope = self.rope
        edge, radius = rope.edge_length, rope.diameter / 2.0
        mass = rope.linear_density * edge
        across = mass * (edge**2 / 12.0 + radius**2 / 4.0)
        return (
            f'<inertial pos="0 0 0" mass="{mass:.9g}" '
            f'diaginertia="{row([across, across, mass * radius**2 / 2.0])}"/>'
            f'<geom type="capsule" size="{row([radius, edge / 2.0])}" contype="1" conaffinity="0" '
            f'condim="3" friction="{rope.friction:.6g}" solref="{CONTACT_SOLREF}"/>'
        )

    def _plug(self) -> str:
        mass = PLUG_MASS * self.rope.linear_density * self.rope.edge_length
        inertia = row([mass * self.rope.diameter**2] * 3)
        return f'<inertial pos="0 0 0" mass="{mass:.9g}" diaginertia="{inertia}"/>'

    def configure(self, model: mujoco.MjModel) -> None:
        """Look up where the parts of the chain are in the state."""
        links = [model.body(f"link{k}") for k in range(self.rope.node_count - 1)]
        self._links = np.array([link.id for link in links])
        self._root = int(model.jnt_qposadr[model.body_jntadr[self._links[self._middle]]])
        # Hinges of the body that hangs on the joint at each node, left end first.
        hung = [k - 1 if k <= self._middle else k for k in range(self.rope.node_count)]
        first = np.array([model.body(f"link{k}").jntadr[0] for k in hung])
        self._hinges = model.jnt_qposadr[first][:, None] + np.arange(3)

    def nodes(self, state: mujoco.MjData) -> Float64[np.ndarray, "n 3"]:
        """Return the node positions, left end first [m]."""
        centres = state.xpos[self._links]
        halves = 0.5 * self.rope.edge_length * state.xmat[self._links].reshape(-1, 3, 3)[:, :, 2]
        return np.concatenate([centres - halves, centres[-1:] + halves[-1:]])

    def tensions(self, model: mujoco.MjModel, state: mujoco.MjData) -> Float64[np.ndarray, "n-1"]:
        """Return the force along each link at its joint towards the middle; see `RopeModel`.

        Damping counts as a part of it. The middle link, which hangs on nothing, has none.
        """
        mujoco.mj_rnePostConstraint(model, state)
        axes = state.xmat[self._links].reshape(-1, 3, 3)[:, :, 2]
        # Of the neighbour on the right, left of the middle; of the one on the left, right of it.
        along = np.sum(state.cfrc_int[self._links, 3:] * axes, axis=1)
        return np.where(np.arange(len(along)) < self._middle, along, -along)

    def add_air_drag(self, state: mujoco.MjData) -> None:
        """Apply the forces of the air at the middles of the links; see `RopeModel.add_air_drag`."""
        axes = state.xmat[self._links].reshape(-1, 3, 3)[:, :, 2]
        # Velocities are stated at the centre of mass of the whole chain.
        arms = state.xpos[self._links] - state.subtree_com[self._links[self._middle]]
        turning, moving = np.split(state.cvel[self._links], 2, axis=1)
        forces = self.rope.air_drag(axes, moving + np.cross(turning, arms))
        state.xfrc_applied[self._links, :3] = forces

    def release(self, state: mujoco.MjData, end: int) -> None:
        """Let go of an end: its weld to the grip ends; see `RopeModel.release`."""
        state.eq_active[end] = 0

    def place(
        self, state: mujoco.MjData, curve: Float64[np.ndarray, "n 3"], grips: Sequence[Pose]
    ) -> None:
        """Lay the links along a curve, with the least twist; see `RopeModel.place`."""
        frames = _frames_along(curve, *grips)
        middle = self._middle
        state.qpos[self._root : self._root + 3] = 0.5 * (curve[middle] + curve[middle + 1])
        state.qpos[self._root + 3 : self._root + 7] = frames[middle + 1]
        turns = poses.multiply(poses.conjugate(frames[:-1]), frames[1:])
        # Left of the middle, the body on the left is the one that turns.
        turns[: middle + 1] = poses.conjugate(turns[: middle + 1])
        state.qpos[self._hinges] = _joint_angles(turns, np.arange(len(turns)))


def _frames_along(
    curve: Float64[np.ndarray, "n 3"], left: Pose, right: Pose
) -> Float64[np.ndarray, "n+1 4"]:
    """Return orientations of left grip, edges and right grip, the twist spread evenly."""
    z = np.array([0.0, 0.0, 1.0])
    frames = [left.orientation]
    for direction in poses.normalized(np.diff(curve, axis=0)):
        bend = poses.rotation_between(poses.rotate(frames[-1], z), direction)
        frames.append(poses.multiply(bend, frames[-1]))
    bend = poses.rotation_between(poses.rotate(frames[-1], z), poses.rotate(right.orientation, z))
    last = poses.multiply(bend, frames[-1])
    twist = poses.logarithm(poses.multiply(poses.conjugate(last), right.orientation))
    shares = (np.arange(len(frames)) - 0.5).clip(0.0) / (len(frames) - 1)
    spread = poses.exponential(shares[:, None] * twist)
    return np.concatenate([poses.multiply(np.array(frames), spread), right.orientation[None]])


def _joint_angles(
    turns: Float64[np.ndarray, "k 4"], nodes: Int64[np.ndarray, "k"]
) -> Float64[np.ndarray, "k 3"]:
    """Return the angles of the hinges at given nodes that make given rotations [rad]."""
    m = poses.matrix(turns)
    x_first = np.stack(
        [
            np.arctan2(-m[:, 1, 2], m[:, 2, 2]),
            np.arcsin(np.clip(m[:, 0, 2], -1.0, 1.0)),
            np.arctan2(-m[:, 0, 1], m[:, 0, 0]),
        ],
        axis=1,
    )
    y_first = np.stack(
        [
            np.arctan2(m[:, 0, 2], m[:, 2, 2]),
            np.arcsin(np.clip(-m[:, 1, 2], -1.0, 1.0)),
            np.arctan2(m[:, 1, 0], m[:, 1, 1]),
        ],
        axis=1,
    )
    return np.where(nodes[:, None] % 2 == 0, x_first, y_first)
