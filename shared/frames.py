"""Coordinate frames of the cell over time: arms' links, grippers and cameras."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from lariat.arms.description import arm_description
from lariat.arms.urdf import Joint, Urdf
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.placement import base_of
from shared.cell_description import GRIP, WORLD_FRAME, arm_urdf, frame_name
from shared.messages import ArmState, ArmStates, timestamp


class Frames:
    """Transforms and joint states from the arms' states."""

    def __init__(self, scenario: Scenario) -> None:
        self._arms: dict[Side, Urdf | None] = {side: arm_urdf(scenario, side) for side in SIDES}
        self._joints: dict[Side, tuple[Joint, ...]] = {
            side: arm.chain(description.flange)
            for side, arm in self._arms.items()
            if arm and (description := arm_description(scenario, side))
        }
        self._fixed = [(WORLD_FRAME, c.name, c.T_world_camera) for c in scenario.camera_setups]
        for side, arm in self._arms.items():
            if arm is not None:
                base = frame_name(side, arm.root)
                self._fixed.append((WORLD_FRAME, base, base_of(scenario.end(side))))

    @property
    def joint_names(self) -> dict[Side, list[str]]:
        """Names of the joints of each arm that has some, in its order."""
        return {
            side: [frame_name(side, joint.name) for joint in joints]
            for side, joints in self._joints.items()
        }

    def transforms(self, arms: ArmStates | None, now: int, fixed: bool) -> FrameTransforms:
        """Return the transforms of the arms' links and grips, stamped [ns].

        Args:
            arms: Newest state of the arms, if any.
            now: Stamp [ns].
            fixed: Whether to add the transforms that never change.
        """
        frames = list(self._fixed) if fixed else []
        for side, state in _states(arms):
            frames += self._of_arm(side, state)
        return FrameTransforms(
            transforms=[
                FrameTransform(
                    timestamp=timestamp(now),
                    parent_frame_id=parent,
                    child_frame_id=child,
                    translation=vector_message(pose.position),
                    rotation=quaternion_message(pose.orientation),
                )
                for parent, child, pose in frames
            ]
        )

    def joints(self, arms: ArmStates, now: int) -> JointStates:
        """Return the joint angles of the arms that have a URDF, stamped [ns]."""
        answer = JointStates(timestamp=timestamp(now))
        for side, state in _states(arms):
            joints = self._joints.get(side, ())
            if joints and len(state.joints) == len(joints):
                answer.joints.extend(
                    JointState(name=frame_name(side, joint.name), position=value)
                    for joint, value in zip(joints, state.joints, strict=True)
                )
        return answer

    def _of_arm(self, side: Side, state: ArmState) -> Iterator[tuple[str, str, Pose]]:
        if len(state.position) == 3 and len(state.orientation) == 4:
            grip = Pose(np.array(state.position), np.array(state.orientation))
            yield WORLD_FRAME, frame_name(side, GRIP), grip
        arm, joints = self._arms[side], self._joints.get(side, ())
        if arm is not None and len(state.joints) == len(joints):
            for parent, child, pose in arm.link_poses(joints, state.joints):
                yield frame_name(side, parent), frame_name(side, child), pose


def _states(arms: ArmStates | None) -> Iterator[tuple[Side, ArmState]]:
    for side in SIDES:
        for state in arms.arms if arms else ():
            if state.arm == side:
                yield side, state


def vector_message(vector: np.ndarray) -> Vector3:
    """Return the message of a vector."""
    x, y, z = vector.tolist()
    return Vector3(x=x, y=y, z=z)


def quaternion_message(orientation: np.ndarray) -> Quaternion:
    """Return the message of a quaternion wxyz."""
    w, x, y, z = orientation.tolist()
    return Quaternion(x=x, y=y, z=z, w=w)
