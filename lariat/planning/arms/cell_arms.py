"""Arms of a cell: geometry, joints at the start of a path, and joints along it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lariat.arms.installation import kinematics_of
from lariat.arms.kinematics import Joints, UrdfKinematics
from lariat.geometry.grippers import GripperBody, gripper_bodies
from lariat.geometry.grips import Grips
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.scenario import SIDES, Scenario


@dataclass(frozen=True)
class CellArms:
    """All arms of a cell whose geometry is known, by the index of their end."""

    arms: Mapping[int, UrdfKinematics]
    """Their geometry; an end that is fixed, ideal, or held by an arm without a URDF has none."""
    grippers: tuple[GripperBody, GripperBody]
    """Bodies of both grippers."""
    joints: Mapping[int, Joints]
    """Joint angles from which a path begins [rad]."""

    @classmethod
    def of(cls, scenario: Scenario) -> CellArms | None:
        """Return the arms of a scenario at its start; None where it has none.

        An arm that cannot reach the start is left out: its gateway refuses to boot.
        """
        arms, start_joints = {}, {}
        for k, (side, start) in enumerate(zip(SIDES, scenario.grips(scenario.start), strict=True)):
            kinematics = kinematics_of(scenario, side)
            joints = kinematics.solve_anywhere(start) if kinematics is not None else None
            if kinematics is not None and joints is not None:
                kinematics.compile()
                arms[k], start_joints[k] = kinematics, joints
        if not arms:
            return None
        limits = scenario.limits
        bodies = gripper_bodies(limits.gripper_reach, limits.gripper_radius)
        return cls(arms, bodies, start_joints)

    def gripper_spheres(self, end: int, grips: Grips) -> Spheres:
        """Return the spheres that cover the gripper of one end at the poses of its grip."""
        cover = self.grippers[end].spheres
        return Spheres.of_gripper(cover, grips.positions[:, end], grips.orientations[:, end])
