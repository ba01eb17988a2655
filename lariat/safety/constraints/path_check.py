"""Check of paths of the driven grippers against all constraints of a cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import (
    JointConstraints,
    solved_poses_of_chunk,
    solved_poses_of_stop,
)
from lariat.safety.constraints.motion_constraints import CellBoundaries, MotionConstraints
from lariat.safety.constraints.path_densification import densified
from lariat.safety.constraints.rule import Rule
from lariat.safety.constraints.slacks import Slacks, first_broken
from lariat.safety.constraints.spacing import body_spacing_slack
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.safety.motion_contract import CHUNK_BOUNDARY_MARGIN
from lariat.trajectory import MotionState

MEASURED_TOLERANCE = 0.002
"""Distance by which an arm may break a rule that its command keeps [m]: a real arm's geometry
differs from the nominal one by about as much."""
MEASURED_JOINT_TOLERANCE = 0.017
"""Angle by which a measured joint may exceed the limit of its command [rad]."""

Positions = Float64[np.ndarray, "m driven 3"]
Orientations = Float64[np.ndarray, "m driven 4"]


class PathCheck:
    """Constraints on grips, grippers and joints of all ends of a cell."""

    def __init__(
        self,
        boundaries: CellBoundaries,
        driven: Sequence[int],
        joint_constraints: Sequence[JointConstraints | None] = (),
    ) -> None:
        """Create the check of a cell without obstacles.

        Args:
            boundaries: Boundaries of the cell.
            driven: Indices of the ends that move.
            joint_constraints: Joint constraints of each driven end, None where it has none.
        """
        self.driven = list(driven)
        self.constraints = MotionConstraints(boundaries, self.driven)
        self.joint_constraints = [
            (k, joints) for k, joints in enumerate(joint_constraints) if joints is not None
        ]

    def place(self, grips: Sequence[Pose]) -> None:
        """Set the poses of all ends; those of the fixed ends stay."""
        self._positions = np.array([g.position for g in grips], dtype=float)
        self._orientations = np.array([g.orientation for g in grips], dtype=float)
        self._fixed_grippers = {
            end: self.constraints.gripper_spheres(
                end, self._positions[None, end], self._orientations[None, end]
            )
            for end in range(len(grips))
            if end not in self.driven
        }
        """Spheres that cover the grippers of the ends that do not move."""

    def track(self, state: MotionState) -> None:
        """Let the joints follow the commanded grips."""
        for k, joints in self.joint_constraints:
            joints.track(Pose(state.positions[k], state.orientations[k]))

    def chunk_broken_by_grippers(
        self, state: MotionState, positions: Positions, orientations: Orientations
    ) -> tuple[Rule, float] | None:
        """Return the rule that the grips and grippers break along a chunk, and by how much [m].

        A chunk keeps `CHUNK_BOUNDARY_MARGIN` more than the rules demand.

        Args:
            state: Present command.
            positions: Positions of the driven grips that are still to come [m].
            orientations: Their orientations, wxyz.
        """
        path = densified(positions, orientations)
        return self._broken_by_grippers(state, *path, CHUNK_BOUNDARY_MARGIN)

    def chunk_broken_by_arms(
        self, state: MotionState, positions: Positions, orientations: Orientations, dt: float
    ) -> tuple[Rule, float] | None:
        """Return the rule that joints and bodies of the arms break along a chunk, and by how much.

        The amount is in metres, radians or radians per second; the margin is that of the grippers.

        Args:
            state: Present command.
            positions: Positions of the driven grips that are still to come [m].
            orientations: Their orientations, wxyz.
            dt: Time between two poses [s].
        """
        if not self.driven:
            return None
        solved = solved_poses_of_chunk(positions)
        path = (
            np.concatenate([state.positions[None], positions]),
            np.concatenate([state.orientations[None], orientations]),
        )
        return self._broken_by_arms(*path, solved, CHUNK_BOUNDARY_MARGIN, dt)

    def broken_by_stop(
        self, state: MotionState, path: Float64[np.ndarray, "m driven 7"]
    ) -> Rule | None:
        """Return the rule that a state or the stop after it breaks.

        Args:
            state: State from which the stop begins.
            path: Positions and orientations of the driven grips: the present ones, which may only
                get better where they break a rule, then those along the stop.
        """
        positions, orientations = path[..., :3], path[..., 3:]
        solved = solved_poses_of_stop(positions[1:]) if self.driven else []
        rows = [1 + k for k in solved]
        checked = path[rows]
        for k, joints in self.joint_constraints:
            joints.follow(checked[:, k, :3], checked[:, k, 3:])
            grip = Pose(state.positions[k], state.orientations[k])
            if joints.too_fast(grip, state.twists[k]):
                return "joint_speed"
        breach = self.constraints.broken(*self._all_ends(positions, orientations))
        for _, joints in self.joint_constraints:
            breach = breach or joints.broken_on_path(self.constraints.collision, 0.0)
        if not breach and self.driven:
            breach = self._spacing_broken(self.constraints.centres[[0, *rows]], 0.0)
        return breach[0] if breach else None

    def broken_by_arms(
        self, command: MotionState, grips: Sequence[Pose], joints: Sequence[tuple[float, ...]]
    ) -> tuple[Rule, float] | None:
        """Return the rule that the arms break by more than their commands, and by how much.

        Args:
            command: Present command.
            grips: Measured poses of the driven grips.
            joints: Measured joints of the driven ends [rad], empty where there are none.
        """
        measured = [
            (constraints, row)
            for k, constraints in self.joint_constraints
            if len(row := np.array(joints[k])) and constraints.joints is not None
        ]
        for constraints, row in measured:
            breach = _worse(constraints.limit_slack(row), MEASURED_JOINT_TOLERANCE)
            if breach:
                return breach
        positions = np.array([command.positions, [g.position for g in grips]])
        orientations = np.array([command.orientations, [g.orientation for g in grips]])
        path = self._all_ends(positions, orientations)
        slacks, centres = self.constraints.slacks(*path), self.constraints.centres
        if self.constraints.rope_length.searching:
            # Judged as soon as it is known: a stop that a person acknowledges needs a finding.
            slacks.pop("overstretch", None)
        breach = _worse(slacks, MEASURED_TOLERANCE)
        for constraints, row in measured:
            breach = breach or _worse(
                constraints.link_slacks(row, self.constraints.collision), MEASURED_TOLERANCE
            )
        if breach or len(self._positions) != 2 or len(measured) < len(self.joint_constraints):
            return breach
        return _worse({"spacing": self._spacing_slack(centres)}, MEASURED_TOLERANCE)

    def _broken_by_grippers(
        self,
        present: MotionState,
        positions: Positions,
        orientations: Orientations,
        margin: float = 0.0,
    ) -> tuple[Rule, float] | None:
        """Return the rule that the grips and grippers break along a path, and by how much [m]."""
        path = self._from_present(present, positions, orientations)
        return self.constraints.broken(*path, margin)

    def _from_present(
        self, present: MotionState, positions: Positions, orientations: Orientations
    ) -> tuple[Float64[np.ndarray, "m ends 3"], Float64[np.ndarray, "m ends 4"]]:
        """Return the poses of all ends along a path, the present ones first."""
        return self._all_ends(
            np.concatenate([present.positions[None], positions]),
            np.concatenate([present.orientations[None], orientations]),
        )

    def _broken_by_arms(
        self,
        positions: Positions,
        orientations: Orientations,
        solved: list[int],
        margin: float,
        dt: float,
    ) -> tuple[Rule, float] | None:
        """Return the rule that the joints and bodies of the arms break along a path.

        Args:
            positions: Positions of the driven grips, the present ones first [m].
            orientations: Their orientations, wxyz.
            solved: Indices of the poses that are checked, counted after the present one.
            margin: Slack that is demanded beyond zero [m].
            dt: Time between two poses [s].
        """
        for k, joints in self.joint_constraints:
            path = positions[1:, k], orientations[1:, k]
            breach = joints.broken(*path, solved, self.constraints.collision, margin, dt)
            if breach:
                return breach
        rows = [0, *(1 + k for k in solved)]
        path = self._all_ends(positions[rows], orientations[rows])
        return self._spacing_broken(self.constraints.gripper_centres(*path), margin)

    def _spacing_broken(
        self, centres: Float64[np.ndarray, "m k 3"], margin: float
    ) -> tuple[Rule, float] | None:
        """Return whether the bodies of both ends come too close along a path, and by how much [m].

        Args:
            centres: Centres of the spheres that cover the driven grippers, at the poses for which
                joints have just been solved, the present ones first [m].
            margin: Slack that is demanded beyond zero [m].
        """
        if len(self._positions) != 2:
            return None
        return first_broken({"spacing": self._spacing_slack(centres)}, margin)

    def _spacing_slack(self, centres: Float64[np.ndarray, "m k 3"]) -> Float64[np.ndarray, "m"]:
        """Return the slack of the distance between all bodies of both ends [m]; as above."""
        left, right = (
            [self._fixed_grippers.get(end) or self.constraints.driven_spheres(end, centres)]
            for end in range(2)
        )
        for k, joints in self.joint_constraints:
            (left, right)[self.driven[k]].extend(joints.bodies())
        bodies = (
            Spheres.joined([p.repeated(len(centres)) if len(p.centres) == 1 else p for p in parts])
            for parts in (left, right)
        )
        return body_spacing_slack(*bodies, self.constraints.boundaries.keep_out)

    def _all_ends(
        self, positions: Positions, orientations: Orientations
    ) -> tuple[Float64[np.ndarray, "m ends 3"], Float64[np.ndarray, "m ends 4"]]:
        """Return the poses of all ends for poses of the driven ones."""
        if self.driven == list(range(len(self._positions))):
            return positions, orientations
        count = len(positions)
        all_positions = np.repeat(self._positions[None], count, axis=0)
        all_orientations = np.repeat(self._orientations[None], count, axis=0)
        all_positions[:, self.driven] = positions
        all_orientations[:, self.driven] = orientations
        return all_positions, all_orientations


def _worse(slacks: Slacks, tolerance: float) -> tuple[Rule, float] | None:
    """Return the rule that the second pose breaks by more than the first one, and by how much.

    Args:
        slacks: Slacks of command and measurement.
        tolerance: Amount that does not count [m, rad].
    """
    shifted: Slacks = {
        rule: np.array([min(float(command), 0.0), measured + tolerance])
        for rule, (command, measured) in slacks.items()
    }
    breach = first_broken(shifted)
    return (breach[0], breach[1] + tolerance) if breach else None
