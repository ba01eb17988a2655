"""What the joints of an arm forbid: their ends, their speed, singular poses, and its links' way.

The command is followed in joint space on the branch that the arm is on; a way is tried from there.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.robot_gateway.constraints.motion_constraints import Rules, Slacks, broken
from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.constraints.sphere_distance import Spheres

LEAST_SINGULAR_VALUE = 0.03
"""Of the Jacobian in metres and radians; 0.21 at a CR5's usual pose, 0 where it is singular."""
TRIED = 8
"""Least number of poses of a way that are solved for, if it has so many."""
STRIDE = 0.025
"""Farthest that the grip moves between two of them [m]."""

Joints = Float64[np.ndarray, "j"]


class ArmKinematics(Protocol):
    """What the rules ask of an arm's geometry."""

    most: Joints
    """Largest angle of each joint, either way [rad]."""

    def solve(self, grip: Pose, near: Joints) -> Joints | None:
        """Joints for a grip pose in the world on the branch of `near`."""
        ...

    def least_singular_value(self, joints: Joints) -> float:
        """Of the Jacobian in metres and radians."""
        ...

    def joint_speed(self, joints: Joints, velocity: Float64[np.ndarray, "2 3"]) -> Joints:
        """Joint speeds for a velocity of the grip in the world [rad/s]."""
        ...

    base_spheres: tuple[Float64[np.ndarray, "k 3"], np.ndarray]
    """Centres in the world and radii of spheres that cover what does not move [m]."""

    def link_spheres(self, joints: Joints) -> tuple[Float64[np.ndarray, "k 3"], np.ndarray]:
        """Centres in the world and radii of spheres that cover the moving links [m]."""
        ...


def tried(positions: Float64[np.ndarray, "m ends 3"]) -> list[int]:
    """Which poses of a way are solved for: evenly, densely enough, the last one among them."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    longest = float(np.max(np.sum(steps, axis=0), initial=0.0))
    count = min(len(positions), max(TRIED, 1 + int(np.ceil(longest / STRIDE))))
    # Where the way is fast its poses are far apart: none of them is left out there.
    chosen, gone = [0], np.zeros(positions.shape[1])
    stride = max(1, (len(positions) - 1) // max(count - 1, 1))
    for k in range(1, len(positions)):
        gone = gone + steps[k - 1]
        far = k + 1 < len(positions) and np.max(gone + steps[k]) > STRIDE
        if far or k - chosen[-1] >= stride or k == len(positions) - 1:
            chosen.append(k)
            gone = np.zeros_like(gone)
    return chosen


class Posture:
    """The joints of one arm while its grip follows a command."""

    def __init__(self, kinematics: ArmKinematics, joint_speed: float) -> None:
        """Args: joint_speed: Limit of every joint [rad/s]."""
        self.kinematics = kinematics
        self.joint_speed = joint_speed
        self.joints: Joints | None = None
        """Of the commanded pose; None until the arm has been heard."""
        self.way: Float64[np.ndarray, "m j"] = np.zeros((0, 0))
        """Joints of the way that was judged last, those of now first."""

    def begin(self, joints: tuple[float, ...]) -> None:
        """Takes the branch that the arm is on, from its feedback."""
        self.joints = np.array(joints, dtype=float)

    def track(self, grip: Pose) -> None:
        """Follows the command."""
        if self.joints is not None:
            found = self.kinematics.solve(grip, self.joints)
            self.joints = self.joints if found is None else found

    def too_fast(self, grip: Pose, velocity: Float64[np.ndarray, "2 3"]) -> bool:
        """Whether a motion of the grip is too fast for a joint."""
        joints = None if self.joints is None else self.kinematics.solve(grip, self.joints)
        if joints is None:
            return True
        return bool(
            np.max(np.abs(self.kinematics.joint_speed(joints, velocity))) > self.joint_speed
        )

    def broken(
        self,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        chosen: list[int],
        rules: Rules,
        margin: float,
        dt: float | None = None,
    ) -> tuple[Rule, float] | None:
        """The first rule that a way from the command on breaks, and by how much [rad, m].

        Args:
            chosen: Poses of the way that are looked at.
            margin: Slack that the links keep from obstacles [m].
            dt: Between the poses, for the joints' speed; None when they are not even in time.
        """
        if self.joints is None:
            return "lost_link", 0.0
        row = [self.joints]
        for k in chosen:
            found = self.kinematics.solve(Pose(positions[k], orientations[k]), row[-1])
            if found is None:
                # Out of reach begins where the arm is stretched out.
                return "singularity", 0.0
            row.append(found)
        joints = self.way = np.array(row)
        if dt is not None:
            steps = np.diff(np.array(chosen)) * dt
            rates = np.abs(np.diff(joints[1:], axis=0)) / steps[:, None]
            excess = float(np.max(rates, initial=0.0)) - self.joint_speed
            if excess > 0.0:
                return "joint_speed", excess
        found = self._first_broken(joints[1:], None, rules, margin)
        if found is None:
            return None
        # What is broken where the arm stands is judged only when it matters.
        return self._first_broken(joints[1:], joints[:1], rules, margin)

    def spheres(self) -> Spheres:
        """What covers the arm along the way that was judged last."""
        links = [self.kinematics.link_spheres(q) for q in self.way]
        centres, radii = self.kinematics.base_spheres
        base = np.broadcast_to(centres, (len(links), *centres.shape))
        return Spheres.joined(
            [Spheres(np.array([c for c, _ in links]), links[0][1]), Spheres(base, radii)]
        )

    def _first_broken(
        self,
        way: Float64[np.ndarray, "m j"],
        present: Float64[np.ndarray, "1 j"] | None,
        rules: Rules,
        margin: float,
    ) -> tuple[Rule, float] | None:
        """The first rule that a way in joint space breaks.

        Args:
            present: Joints of now; None stands for ones that keep every rule well.
        """
        rows = way if present is None else np.concatenate([present, way])
        values = [self.kinematics.least_singular_value(q) for q in rows]
        spheres = [self.kinematics.link_spheres(q) for q in rows]
        links = rules.clearances(np.array([c for c, _ in spheres]), spheres[0][1])
        slacks: Slacks = {
            "joint_limits": np.min(self.kinematics.most - np.abs(rows), axis=1),
            "singularity": np.array(values) - LEAST_SINGULAR_VALUE,
        }
        if present is None:
            slacks = {rule: np.concatenate([[np.inf], row]) for rule, row in slacks.items()}
            links = {rule: np.concatenate([[np.inf], row]) for rule, row in links.items()}
        return broken(slacks) or broken(links, margin)
