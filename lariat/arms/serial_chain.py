"""Forward kinematics of an arm's joints at many poses at once.

Pinocchio computes one pose after the other; at the few poses of a path that is checked, calling it
and copying its results takes several times as long as the computation.
"""

from __future__ import annotations

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose

Path = Float64[np.ndarray, "m j"]
"""Joint angles at m poses [rad]."""


class SerialChain:
    """Revolute joints one after the other, from the root of an arm to its flange."""

    def __init__(self, model: pinocchio.Model, flange: int) -> None:
        """Read the joints of a model.

        Args:
            model: Model of j revolute joints in series.
            flange: Index of the flange's frame.
        """
        count = model.nq
        self._count = count
        placements = [model.jointPlacements[k + 1].homogeneous for k in range(count)]
        self._placements = np.array(placements).reshape(count, 4, 4)
        """Placement of each joint at angle zero in the one before it."""
        self._axes = np.array([_axis(model, k + 1) for k in range(count)]).reshape(count, 3)
        """Axis of each joint in its own frame."""
        x, y, z = self._axes.T
        zero = np.zeros(count)
        skew = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
        self._skew, self._skew_squared = skew, skew @ skew
        placement = model.frames[flange].placement
        self.flange = Pose(
            np.array(placement.translation), poses.from_matrix(np.array(placement.rotation))
        )
        """Pose of the flange in the last joint."""
        self._latest: tuple[Path, np.ndarray] | None = None
        """Copy of the path of the last placements, and these: a check asks for them twice."""

    @property
    def joints(self) -> tuple[Float64[np.ndarray, "j 4 4"], Float64[np.ndarray, "j 3"]]:
        """Placement of each joint at angle zero in the one before it, and its axis there."""
        return self._placements, self._axes

    def placements(self, path: Path) -> Float64[np.ndarray, "m j 4 4"]:
        """Return the placements of all joints in the root at each pose; not to be changed."""
        if self._latest is None or not np.array_equal(self._latest[0], path):
            self._latest = path.copy(), self._placements_along(path)
        return self._latest[1]

    def _placements_along(self, path: Path) -> Float64[np.ndarray, "m j 4 4"]:
        sine, cosine = np.sin(path)[..., None, None], np.cos(path)[..., None, None]
        turned = np.eye(3) + sine * self._skew + (1.0 - cosine) * self._skew_squared
        steps = np.empty((*path.shape, 4, 4))
        steps[..., :3] = self._placements[..., :3] @ turned
        steps[..., 3] = self._placements[..., 3]
        for k in range(1, self._count):
            steps[:, k] = steps[:, k - 1] @ steps[:, k]
        return steps

    def jacobians(self, path: Path) -> Float64[np.ndarray, "m 6 j"]:
        """Return the Jacobians of the flange's twist, linear over angular, along the root's axes.

        They are those of `UrdfKinematics.jacobian` [m/rad, -].
        """
        placements = self.placements(path)
        axes = (placements[..., :3, :3] @ self._axes[..., None])[..., 0]
        origins = placements[..., :3, 3]
        flange = placements[:, -1, :3, :3] @ self.flange.position + origins[:, -1]
        levers = flange[:, None] - origins
        linear = axes[..., [1, 2, 0]] * levers[..., [2, 0, 1]]
        linear -= axes[..., [2, 0, 1]] * levers[..., [1, 2, 0]]
        return np.swapaxes(np.concatenate([linear, axes], axis=-1), 1, 2)


def _axis(model: pinocchio.Model, joint: int) -> Float64[np.ndarray, "3"]:
    """Return the axis of a revolute joint in its own frame."""
    data = model.createData()
    angles = np.zeros(model.nq)
    pinocchio.computeJointJacobians(model, data, angles)
    jacobian = pinocchio.getJointJacobian(model, data, joint, pinocchio.ReferenceFrame.LOCAL)
    # The jacobian of a single joint has one dimension.
    return np.reshape(jacobian, (6, -1))[3:, joint - 1].copy()
