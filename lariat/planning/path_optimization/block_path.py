"""Paths of the grips as displacements in blocks."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.planning.problem import Problem
from lariat.rod import EDGE_AXIS
from lariat.rod.so3 import left_jacobian

BLOCKS = 12
"""Number of blocks, in each of which both grips move by a constant displacement."""
BLOCK_LENGTH = 0.08
"""Motion of a grip above which a path has more blocks, one for each such length [m]."""
MAX_BLOCKS = 32
"""Largest number of blocks."""
STEPS_PER_BLOCK = 3
"""Number of implicit steps of the rod in a block."""
SETTLING_STEPS = 2
"""Number of steps without motion at the end."""
STEP_TIME = 0.4
"""Duration of a step [s], long against the swing's period, so that the rod follows at rest."""

BLOCK_TIME = STEPS_PER_BLOCK * STEP_TIME
"""Duration of a block [s]."""

ALL_STEPS = slice(None)
"""Every step of a path."""

BlockDisplacements = Float64[np.ndarray, "k 2 6"]
"""Translation [m] and rotation vector [rad] of both grips in each block."""


def blocks_of(length: float) -> int:
    """Return the number of blocks of a path along which a grip moves by a length [m]."""
    return min(max(BLOCKS, math.ceil(length / BLOCK_LENGTH)), MAX_BLOCKS)


class BlockPath:
    """Maps the displacements in blocks to poses of the grips and actions of the rod."""

    def __init__(self, problem: Problem, blocks: int = BLOCKS) -> None:
        self._problem, self._blocks = problem, blocks
        steps = STEPS_PER_BLOCK
        self.block_of_step = np.concatenate(
            [np.repeat(np.arange(blocks), steps), np.full(SETTLING_STEPS, blocks)]
        )
        """Block of each step of the rod; the last one is at rest."""
        block, step = np.divmod(np.arange(blocks * steps), steps)
        share = np.clip(block[:, None] - np.arange(blocks), 0, 1).astype(float)
        share[np.arange(len(block)), block] = (step + 1.0) / steps
        self.share: Float64[np.ndarray, "s k"] = share
        """Share of each block's displacement that is covered by the end of each step."""

    def actions(self, displacements: BlockDisplacements) -> Float64[np.ndarray, "k+1 2 6"]:
        """Return the velocities of the grips in each block, and zero for settling."""
        still = np.zeros((1, 2, 6))
        return np.concatenate([displacements / BLOCK_TIME, still])

    def grips(self, displacements: BlockDisplacements) -> Grips:
        """Return both grips at the start and after each step."""
        begin = Grips.of(self._problem.grips)
        moves = np.einsum("sk,kec->sec", self.share, displacements[..., :3])
        positions = np.concatenate([begin.positions, begin.positions + moves])
        if not displacements[..., 3:].any():
            return Grips(positions, np.repeat(begin.orientations, len(positions), axis=0))
        steps = STEPS_PER_BLOCK
        orientations = [begin.orientations[0]]
        for turn in poses.exponential(np.repeat(displacements[..., 3:] / steps, steps, axis=0)):
            orientations.append(poses.normalized(poses.multiply(turn, orientations[-1])))
        return Grips(positions, np.array(orientations))

    def twists(
        self, grips: Grips, displacements: BlockDisplacements, end: int, steps: slice = ALL_STEPS
    ) -> Float64[np.ndarray, "s 6 k 6"]:
        """Return the change of an end's pose after steps by the displacements of its blocks.

        Args:
            grips: Those of the displacements, from `grips`.
        """
        share, after_step = self.share[steps], grips.orientations[1:, end][steps]
        twists = np.zeros((len(share), 6, len(displacements), 6))
        twists[:, [0, 1, 2], :, [0, 1, 2]] = share[None]
        back = poses.conjugate(grips.orientations[STEPS_PER_BLOCK::STEPS_PER_BLOCK, end])
        change = left_jacobian(displacements[:, end, 3:], np.eye(3)[:, None, :])
        for twist, part, q in zip(twists, share, after_step, strict=True):
            # A rotation after block k rotates the change of that block with it.
            after = poses.multiply(q, back)
            after[part < 1.0] = poses.IDENTITY
            turned = poses.rotate(after[None], change) * part[None, :, None]
            twist[3:, :, 3:] = np.transpose(turned, (2, 1, 0))
        return twists

    def translation_to_goal(self) -> Float64[np.ndarray, "k 2 3"]:
        """Return the even translation to the goal's grips [m]."""
        problem, blocks = self._problem, self._blocks
        pairs = zip(problem.goal.grips, problem.grips, strict=True)
        whole = np.stack([b.position - a.position for b, a in pairs]) * problem.moves[:, :3]
        return np.tile(whole / blocks, (blocks, 1, 1))

    def rotation_to_goal(self, extra_turns: int) -> Float64[np.ndarray, "k 2 3"]:
        """Return the even rotation to the goal's orientations [rad].

        Args:
            extra_turns: Whole turns of twist to add; both ends share them where both rotate.
        """
        problem, blocks = self._problem, self._blocks
        rotations = np.zeros((blocks, 2, 3))
        rotates = problem.moves[:, 3:].any(axis=1)
        left = -int(np.fix(extra_turns / 2)) if rotates.all() else -extra_turns * int(rotates[0])
        shares = (left, extra_turns + left)
        s = np.linspace(0.0, 1.0, blocks + 1)[:, None]
        for end, (now, goal) in enumerate(zip(problem.grips, problem.goal.grips, strict=True)):
            if rotates[end]:
                whole = poses.rotation_from(now.orientation, goal.orientation)
                spun = poses.exponential(2.0 * np.pi * shares[end] * s * EDGE_AXIS)
                here = np.broadcast_to(now.orientation, spun.shape)
                path = poses.multiply(poses.multiply(poses.exponential(s * whole), here), spun)
                rotations[:, end] = poses.rotation_from(path[:-1], path[1:])
        return rotations
