"""Samples towards which the trees grow: anywhere around the scene, and through narrow passages."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import scene_distance
from lariat.planning.problem import Problem
from lariat.planning.tree_search.grip_motion import Chords, GripMotion
from lariat.planning.tree_search.passage_traversals import find_threads
from lariat.planning.tree_search.passages import find_passages
from lariat.planning.tree_search.sag import SagTable
from lariat.rod import EDGE_AXIS

TAUT_SHARE = 0.5
"""Share of the samples with a taut rope [-]."""
TAUT_RANGE = (0.9, 0.995)
"""Range of the grip distance of taut samples, relative to the longest permitted one."""
SLACK_RANGE = (0.2, 0.97)
"""Range of the grip distance of other samples, relative to the longest permitted one."""
PASSAGE_SHARE = 0.4
"""Share of the samples that lie in narrow passages, where there are any [-]."""
PASSING_RANGE = 0.65
"""Largest distance of the rope's middle from a passage along the rope, in grip distances; ends
before and behind it count as passing [-]."""
TILT_SHARE = 0.4
"""Share of the samples in which ends that rotate are tilted against the chord [-]."""
TILT_SIGMA = 0.5
"""Standard deviation of such a tilt about each axis [rad]."""
MARGIN_AROUND = 0.15
"""Distance around start, goal and obstacles in which samples lie [m]."""


class GripSampler:
    """Random places of both grips, always the same for the same seed."""

    def __init__(
        self,
        problem: Problem,
        motion: GripMotion,
        sag: SagTable,
        clearance: float,
        seed: int,
        step: float,
    ) -> None:
        """Find the narrow passages of the scene.

        Args:
            clearance: Clearance of the rope on the way [m].
            step: Longest motion from place to place on a thread [m].
        """
        self._problem, self._motion, self._sag = problem, motion, sag
        self._random = np.random.default_rng([problem.seed, seed, 2])
        length = problem.rod.properties.length
        nodes = np.concatenate([problem.state.positions, problem.goal.nodes])
        near = [
            o
            for o in problem.solid
            if o.shape != "half_space" and scene_distance(nodes, [o]).min() < length
        ]
        centres = np.array([o.position for o in near]).reshape(-1, 3)
        centres = np.clip(centres, nodes.min(axis=0) - length, nodes.max(axis=0) + length)
        around = np.concatenate([nodes, centres])
        low, high = np.array(problem.limits.workspace)
        low = np.maximum(around.min(axis=0) - MARGIN_AROUND, low)
        high = np.minimum(around.max(axis=0) + MARGIN_AROUND + 0.5 * length, high)
        self._low, self._high = low, high
        margin = clearance + problem.radius
        self._passages = find_passages(problem, low, high, margin, self._random)
        self.threads = find_threads(problem, self._passages, sag, margin, step)
        """Motions lengthwise through the narrow passages of the scene."""

    def sample(self, count: int) -> tuple[Chords, Bool[np.ndarray, "k"]]:
        """Return random places of the grips, and which of them lie in narrow passages."""
        random = self._random
        middles = random.uniform(self._low, self._high, (count, 3))
        directions = poses.normalized(random.normal(size=(count, 3)) * np.array([1.0, 1.0, 0.6]))
        taut = random.random(count) < TAUT_SHARE
        passing = random.random(count) < PASSAGE_SHARE * (len(self._passages) > 0)
        which = random.integers(0, max(len(self._passages), 1), count)[passing]
        sign = random.choice([-1.0, 1.0], (len(which), 1))
        directions[passing] = sign * self._passages.directions[which]
        taut[passing] = True
        shares = np.where(
            taut, random.uniform(*TAUT_RANGE, count), random.uniform(*SLACK_RANGE, count)
        )
        chords = (shares * self._problem.longest_grip_distance)[:, None] * directions
        offset = random.uniform(-PASSING_RANGE, PASSING_RANGE, (len(which), 1))
        places = self._passages.places[which] + offset * chords[passing]
        # The rope, not the line between its grips, passes through the middle of the passage.
        sags = self._sag.below(chords[passing], 0.5 - offset[:, 0])
        middles[passing] = places + sags[:, None] * np.array([0.0, 0.0, 1.0])
        return Chords(middles, chords), passing

    def grips(self, samples: Chords, passing: Bool[np.ndarray, "k"], like: Grips) -> Grips:
        """Return the grips of samples, which hold the rope like given ones.

        Some of them are tilted; in a narrow passage they point along the rope.

        Args:
            passing: Whether each sample lies in a narrow passage.
            like: Grips from which a tree grows towards each sample.
        """
        random, count = self._random, len(samples)
        placed = self._motion.placed(samples, like)
        rotates = self._motion.moves[:, 3:].any(axis=1)[None, :, None]
        tilts = random.normal(scale=TILT_SIGMA, size=(count, 2, 3))
        tilts *= (random.random((count, 1, 1)) < TILT_SHARE) & rotates
        turned = poses.multiply(poses.exponential(tilts), placed.orientations)
        axes = poses.rotate(placed.orientations, np.broadcast_to(EDGE_AXIS, (count, 2, 3)))
        along = np.broadcast_to(poses.normalized(samples.chords)[:, None], axes.shape)
        aligned = poses.multiply(poses.rotation_between(axes, along), placed.orientations)
        aligned = np.where(rotates, aligned, placed.orientations)
        return Grips(placed.positions, np.where(passing[:, None, None], aligned, turned))
