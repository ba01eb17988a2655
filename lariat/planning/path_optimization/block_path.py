"""Paths of the grips as displacements in blocks."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.planning.path_optimization.settings import PathOptimizationSettings
from lariat.planning.problem import Problem
from lariat.rod import EDGE_AXIS

BlockDisplacements = Float64[np.ndarray, "k 2 6"]
"""Translation [m] and rotation vector [rad] of both grips in each block."""


class BlockPath:
    """Maps the displacements in blocks to poses of the grips and actions of the rod."""

    def __init__(self, problem: Problem, settings: PathOptimizationSettings) -> None:
        self._problem, self._settings = problem, settings
        blocks, steps = settings.blocks, settings.steps_per_block
        self.block_of_step = np.concatenate(
            [np.repeat(np.arange(blocks), steps), np.full(settings.settling_steps, blocks)]
        )
        """Block of each step of the rod; the last one is at rest."""
        block, step = np.divmod(np.arange(blocks * steps), steps)
        share = np.clip(block[:, None] - np.arange(blocks), 0, 1).astype(float)
        share[np.arange(len(block)), block] = (step + 1.0) / steps
        self.share: Float64[np.ndarray, "s k"] = share
        """Share of each block's displacement that is covered by the end of each step."""

    @property
    def block_time(self) -> float:
        """Duration of a block [s]."""
        return self._settings.steps_per_block * self._settings.step_time

    def actions(self, displacements: BlockDisplacements) -> Float64[np.ndarray, "k+1 2 6"]:
        """Return the velocities of the grips in each block, and zero for settling."""
        still = np.zeros((1, 2, 6))
        return np.concatenate([displacements / self.block_time, still])

    def grips(
        self, displacements: BlockDisplacements
    ) -> tuple[Float64[np.ndarray, "s 2 3"], Float64[np.ndarray, "s 2 4"]]:
        """Return positions [m] and orientations of both grips, at the start and after each step."""
        steps = self._settings.steps_per_block
        begin = np.stack([g.position for g in self._problem.grips])
        q = np.stack([g.orientation for g in self._problem.grips])
        positions = begin + np.einsum("sk,kec->sec", self.share, displacements[..., :3])
        if not displacements[..., 3:].any():
            still = np.repeat(q[None], len(positions) + 1, axis=0)
            return np.concatenate([begin[None], positions]), still
        turns = np.repeat(displacements[..., 3:] / steps, steps, axis=0)
        orientations = [q]
        for turn in turns:
            q = poses.normalized(poses.multiply(poses.exponential(turn), q))
            orientations.append(q)
        return np.concatenate([begin[None], positions]), np.array(orientations)

    def block_ends(
        self, orientations: Float64[np.ndarray, "s 2 4"]
    ) -> Float64[np.ndarray, "k 2 4"]:
        """Return the orientations after each block, out of those of `grips`."""
        return orientations[self._settings.steps_per_block :: self._settings.steps_per_block]

    def translation_to_goal(self) -> Float64[np.ndarray, "k 2 3"]:
        """Return the even translation to the goal's grips [m]."""
        problem, blocks = self._problem, self._settings.blocks
        pairs = zip(problem.goal.grips, problem.grips, strict=True)
        whole = np.stack([b.position - a.position for b, a in pairs]) * problem.moves[:, :3]
        return np.tile(whole / blocks, (blocks, 1, 1))

    def rotation_to_goal(self, extra_turns: int) -> Float64[np.ndarray, "k 2 3"]:
        """Return the even rotation to the goal's orientations [rad].

        Args:
            extra_turns: Whole turns of twist to add; both ends share them where both rotate.
        """
        problem, blocks = self._problem, self._settings.blocks
        rotations = np.zeros((blocks, 2, 3))
        rotates = problem.moves[:, 3:].any(axis=1)
        left = -int(np.fix(extra_turns / 2)) if rotates.all() else -extra_turns * int(rotates[0])
        shares = (left, extra_turns + left)
        s = np.linspace(0.0, 1.0, blocks + 1)[:, None]
        for end, (now, goal) in enumerate(zip(problem.grips, problem.goal.grips, strict=True)):
            if rotates[end]:
                whole = poses.logarithm(
                    poses.multiply(goal.orientation, poses.conjugate(now.orientation))
                )
                spun = poses.exponential(2.0 * np.pi * shares[end] * s * EDGE_AXIS)
                here = np.broadcast_to(now.orientation, spun.shape)
                path = poses.multiply(poses.multiply(poses.exponential(s * whole), here), spun)
                steps = poses.multiply(path[1:], poses.conjugate(path[:-1]))
                rotations[:, end] = poses.logarithm(steps)
        return rotations
