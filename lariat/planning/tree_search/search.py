"""Bidirectional tree search for a path of both grips.

Two trees of shapes grow towards random places of the grips, one from the start and one from the
goal, and towards each other (RRT-Connect: Kuffner & LaValle, ICRA 2000). Between two nodes the
grips turn and move at once and a coarse rod follows at rest, so that every shape sags, bends and is
wound as the rope is. The number of iterations is limited, not the time: the result depends on the
problem and its seed alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from lariat.geometry import polylines, poses
from lariat.geometry.grips import Grips
from lariat.geometry.poses import Pose
from lariat.planning.problem import Problem
from lariat.planning.tree_search.grip_motion import Chords, GripMotion
from lariat.planning.tree_search.sag import SagTable
from lariat.planning.tree_search.sampling import GripSampler
from lariat.planning.tree_search.shape_check import ShapeCheck
from lariat.planning.tree_search.tree import ShapeTree
from lariat.rod import (
    Rod,
    RodState,
    Rollout,
    RolloutSpec,
    add_turns,
    count_turns,
    state_along,
)

STEP_TIME = 0.4
"""Duration of a step of the coarse rod [s], long against its swing, so that it follows at rest."""
EDGE_LENGTH = 0.03
"""Length of an edge of the coarse rope [m], as far as its number of nodes permits."""
NODE_COUNTS = (16, 40)
"""Least and largest number of nodes of the coarse rope."""
STEP = 0.025
"""Motion of a grip in one step of the rod, rotation included by its lever arm [m]."""
STEPS_PER_EXTENSION = 5
"""Number of steps by which a tree grows towards a sample."""
BATCH_SIZE = 16
"""Number of samples of an iteration, which are rolled out in one launch."""
CONNECTION_COUNT = 4
"""Number of new nodes of an iteration that the other tree tries to reach."""
MAX_CONNECTION_EXTENSIONS = 10
"""Largest number of extensions in a row towards a node of the other tree."""
MAX_JUMP = 4.0
"""Motion of a rope's node in a step, in steps of the grips, above which the rope snaps over to
another shape and the tree does not grow [-]."""
SAME_SHAPE_DISTANCE = 0.02
"""Mean node distance below which two shapes between the same grips are the same [m]."""
SHORTCUT_ROUNDS = 14
"""Number of rounds in which shortcuts are tried."""
SHORTCUT_BATCH = 12
"""Number of shortcuts of a round."""
THREADS_PER_ITERATION = 4
"""Number of threads whose mouths a tree seeks in an iteration; all of them in its first."""
ROD_TOLERANCE = 1e-5
"""Tolerance of the coarse rod's solver [m]."""


@dataclass(frozen=True)
class TreePath:
    """Path found by the trees."""

    reaches_goal: bool
    """Whether it leads to the goal."""
    grips: Grips
    """Places of both grips from the start to the goal, or to the nearest shape that was reached."""
    step_lengths: Float64[np.ndarray, "w-1"]
    """Motion of the grips from place to place, rotation included [m]."""

    def displacements(self, blocks: int) -> Float64[np.ndarray, "k 2 6"]:
        """Return translation [m] and rotation [rad] in blocks of equal length."""
        at = np.concatenate([[0.0], np.cumsum(np.maximum(self.step_lengths, 1e-9))])
        block_ends = np.linspace(0.0, at[-1], blocks + 1)
        before = np.searchsorted(at, block_ends, side="right") - 1
        before = np.clip(before, 0, len(self.step_lengths) - 1)
        share = ((block_ends - at[before]) / (at[before + 1] - at[before]))[:, None, None]
        positions, q = self.grips.positions, self.grips.orientations
        places = (1.0 - share) * positions[before] + share * positions[before + 1]
        turn = poses.rotation_from(q[before], q[before + 1])
        turned = poses.multiply(poses.exponential(share * turn), q[before])
        return Grips(places, turned).steps()


class TreeSearch:
    """Search of one problem."""

    def __init__(
        self,
        problem: Problem,
        clearance: float,
        seed: int = 0,
    ) -> None:
        """Prepare both trees.

        Args:
            clearance: Clearance on the way, near start and goal excepted [m].

        Raises:
            ValueError: The rope has no shape at rest at the goal.
        """
        self._problem = problem
        properties = problem.rod.properties
        least, most = NODE_COUNTS
        node_count = 1 + round(properties.length / EDGE_LENGTH)
        count = min(int(np.clip(node_count, least, most)), problem.rod.node_count)
        self._rod = Rod(properties, count, tolerance=ROD_TOLERANCE)
        self._supports = problem.packed_supports
        self._motion = GripMotion(problem.moves, properties.length / (2.0 * np.pi))
        goal_grips = problem.feasible_goal_grips
        start = self._state(problem.state.positions, problem.grips, count_turns(problem.state))
        goal = self._state(problem.goal.nodes, goal_grips, problem.goal.turns)
        self._goal = goal
        roots = (Grips.of(problem.grips), start), (Grips.of(goal_grips), goal)
        self._trees = [ShapeTree(self._motion, grips, state) for grips, state in roots]
        self._check = ShapeCheck(
            problem, clearance, [(state.positions, grips) for grips, state in roots]
        )
        self._sampler = GripSampler(
            problem, self._motion, SagTable(self._rod), clearance, seed, STEP
        )
        self._random = np.random.default_rng([problem.seed, seed, 3])
        self._open_threads = [list(range(len(self._sampler.threads))) for _ in self._trees]
        """Threads through which each tree has not been led."""
        self._iteration = 0

    def run(self, iterations: int) -> TreePath:
        """Return the path found, or a path to the nearest shape that was reached.

        Called again, the search goes on where it was, also beyond a path that it has found.

        Args:
            iterations: Number of iterations in all after which it gives up.
        """
        path = None
        while path is None and self._iteration <= iterations:
            path = self._connected(self._iteration)
            self._iteration += 1
        if path is not None:
            grips = self._shortened(path)
        else:
            tree, goal = self._trees[0], self._problem.goal.nodes
            coarse = polylines.resample_smooth(goal, self._rod.node_count)
            branch = tree.branch(int(np.argmin(tree.mean_distances(coarse))))
            grips = tree.grips[branch if len(branch) > 1 else [0, 0]]
        return TreePath(path is not None, grips, self._motion.length(grips[:-1], grips[1:]))

    def _connected(self, iteration: int) -> Grips | None:
        """Grow one tree, at first only between the roots; return the path where both trees meet."""
        if iteration == 0:
            return self._connect(0, np.array([0]))
        side = (iteration - 1) % 2
        for grow in (self._thread, self._grow):
            new = grow(side)
            if len(new) and (path := self._connect(side, new)) is not None:
                return path
        return None

    def _state(
        self, nodes: Float64[np.ndarray, "n 3"], grips: tuple[Pose, Pose], turns: int
    ) -> RodState:
        """Coarse rod at rest between two grips, in a given shape with given turns of twist."""
        coarse = polylines.resample_smooth(nodes, self._rod.node_count)
        guess = state_along(coarse, grips[0].orientation, grips[1].orientation)
        if turns:
            guess = add_turns(guess, turns)
        return self._rod.rest(*grips, guess=guess, obstacles=self._supports).state

    def _aimed(
        self, side: int, lines: Chords, passing: Bool[np.ndarray, "k"]
    ) -> tuple[np.ndarray, Grips]:
        """Node of a tree nearest to each line between the grips, and the grips that it aims at."""
        tree = self._trees[side]
        rough = self._motion.placed(lines, tree.grips[np.zeros(len(lines), dtype=int)])
        nearest = tree.nearest(rough, turning=False)
        return nearest, self._sampler.grips(lines, passing, tree.grips[nearest])

    def _grow(self, side: int) -> np.ndarray:
        """Grow a tree towards samples; return the last new nodes of its branches."""
        nearest, targets = self._aimed(side, *self._sampler.sample(BATCH_SIZE))
        last, _ = self._extend(side, nearest, targets)
        return np.unique(last[last != nearest])

    def _thread(self, side: int) -> np.ndarray:
        """Grow a tree to the mouths of narrow passages, and lengthwise through them."""
        waiting = self._open_threads[side]
        first = len(self._trees[side]) == 1
        some = waiting if first else waiting[:THREADS_PER_ITERATION]
        if not some:
            return np.zeros(0, dtype=int)
        threads = self._sampler.threads[some, slice(None, None, 1 if side == 0 else -1)]
        nearest, targets = self._aimed(side, threads[:, 0], np.ones(len(some), dtype=bool))
        last, arrived = nearest.copy(), np.zeros(len(some), dtype=bool)
        going = ~arrived
        for _ in range(MAX_CONNECTION_EXTENSIONS if first else 1):
            before = last[going]
            last[going], arrived[going] = self._extend(side, before, targets[going])
            going[going] = (last[going] != before) & ~arrived[going]
            if not going.any():
                break
        if arrived.any():
            onward, mouths = threads[arrived, 1:], targets[arrived]
            like = mouths[np.repeat(np.arange(len(mouths)), onward.middles.shape[1])]
            lines = Chords(onward.middles.reshape(-1, 3), onward.chords.reshape(-1, 3))
            grips = self._motion.placed(lines, like)
            last[arrived], _ = self._grown(side, last[arrived], mouths, grips)
        done = {k for k, there in zip(some, arrived, strict=True) if there}
        # The others wait for a larger tree, each for its turn.
        self._open_threads[side] = [k for k in (*waiting[len(some) :], *some) if k not in done]
        return np.unique(last[last != nearest])

    def _connect(self, side: int, new: np.ndarray) -> Grips | None:
        """Grow the other tree towards new nodes; return the path if they meet."""
        tree, other = self._trees[side], self._trees[1 - side]
        targets = tree.grips[new]
        nearest = other.nearest(targets, turning=True)
        away = self._motion.length(targets, other.grips[nearest])
        order = np.argsort(away, kind="stable")[:CONNECTION_COUNT]
        new, here = new[order], nearest[order]
        for _ in range(MAX_CONNECTION_EXTENSIONS):
            last, arrived = self._extend(1 - side, here, tree.grips[new])
            for node, at in zip(new[arrived], last[arrived], strict=True):
                path = self._joined(side, int(node), int(at))
                if path is not None:
                    return path
            going = (last != here) & ~arrived
            if not going.any():
                break
            new, here = new[going], last[going]
        return None

    def _joined(self, side: int, node: int, at: int) -> Grips | None:
        """Path through nodes of both trees between the same grips, if its shapes agree."""
        tree, other = self._trees[side], self._trees[1 - side]
        one, two = tree.states[node], other.states[at]
        apart = polylines.mean_node_distance(one.positions, two.positions)
        if apart > SAME_SHAPE_DISTANCE or count_turns(one) != count_turns(two):
            return None
        at_start, at_goal = (node, at) if side == 0 else (at, node)
        grips = Grips.joined(
            self._trees[0].grips[self._trees[0].branch(at_start)],
            self._trees[1].grips[self._trees[1].branch(at_goal)[:-1][::-1]],
        )
        return grips if self._followed(grips)[1] else None

    def _extend(
        self, side: int, nodes: np.ndarray, targets: Grips
    ) -> tuple[np.ndarray, np.ndarray]:
        """Grow branches from nodes towards targets, as far as all shapes are clear."""
        start = self._trees[side].grips[nodes]
        counts = self._step_counts(start, targets)
        shares = np.minimum(np.arange(1, STEPS_PER_EXTENSION + 1) / counts[:, None], 1.0)
        grips = self._motion.between(start, targets, shares)
        last, grown = self._grown(side, nodes, start, grips, counts)
        return last, grown == counts

    def _step_counts(self, start: Grips, targets: Grips) -> Int64[np.ndarray, "k"]:
        """Numbers of steps of motions."""
        return np.maximum(np.ceil(self._motion.length(start, targets) / STEP), 1.0).astype(int)

    def _grown(
        self,
        side: int,
        nodes: np.ndarray,
        start: Grips,
        grips: Grips,
        most: float | Int64[np.ndarray, "k"] = np.inf,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Grow branches along motions, as far as all shapes are clear, by some steps at most.

        Returns:
            Last node of each branch, and its number of new nodes.
        """
        tree, steps = self._trees[side], len(grips) // len(nodes)
        states, clear = self._rolled([tree.states[k] for k in nodes], start, grips)
        grown = np.where(clear.all(axis=1), steps, np.argmin(clear, axis=1))
        grown = np.minimum(grown, most).astype(int)
        last = nodes.copy()
        for b, count in enumerate(grown):
            new = [states(b, h) for h in range(count)]
            last[b] = tree.add(int(nodes[b]), grips[b * steps : b * steps + count], new)
        return last, grown

    def _rolled(self, begin: list[RodState], start: Grips, grips: Grips):
        """Roll rods out along motions, in one launch."""
        count, steps = len(begin), len(grips) // len(begin)
        positions = grips.positions.reshape(count, steps, 2, 3)
        orientations = grips.orientations.reshape(count, steps, 2, 4)
        before = np.concatenate([start.positions[:, None], positions[:, :-1]], axis=1)
        turned = np.concatenate([start.orientations[:, None], orientations[:, :-1]], axis=1)
        rotations = poses.rotation_from(turned, orientations)
        actions = np.concatenate([positions - before, rotations], axis=3) / STEP_TIME
        rollouts = self._rod.rollout(
            RolloutSpec(begin, actions, STEP_TIME, obstacles=self._supports)
        )
        nodes = np.stack([r.positions for r in rollouts])
        first = np.stack([state.positions for state in begin])[:, None]
        previous = np.concatenate([first, nodes[:, :-1]], axis=1)
        moved = np.linalg.norm(nodes - previous, axis=3).max(axis=2)
        flat = nodes.reshape(count * steps, -1, 3)
        half = 0.5 * (nodes + previous).reshape(count * steps, -1, 3)
        middle = Grips(
            0.5 * (positions + before).reshape(-1, 2, 3),
            poses.normalized((orientations + turned).reshape(-1, 2, 4)),
        )
        both = self._check.clear(np.concatenate([flat, half]), Grips.joined(grips, middle))
        clear = (both[: len(flat)] & both[len(flat) :]).reshape(count, steps)
        clear &= moved < MAX_JUMP * STEP
        clear &= np.stack([r.converged for r in rollouts])

        return lambda b, h: _at_rest(rollouts[b], h), clear

    def _followed(self, grips: Grips) -> tuple[list[RodState], bool]:
        """Rod along a path from the start, and whether it leads to the goal with clear shapes."""
        begin = self._trees[0].states[0]
        rollout = self._rod.rollout(
            RolloutSpec(begin, grips.steps() / STEP_TIME, STEP_TIME, obstacles=self._supports)
        )
        states = [begin, *(_at_rest(rollout, k) for k in range(len(grips) - 1))]
        clear = self._check.clear(rollout.positions, grips[1:]) & rollout.converged
        miss = polylines.mean_node_distance(states[-1].positions, self._goal.positions)
        return states, bool(clear.all() and miss < SAME_SHAPE_DISTANCE)

    def _shortened(self, grips: Grips) -> Grips:
        """Path with random shortcuts wherever the rope can take them."""
        for _ in range(SHORTCUT_ROUNDS):
            states, _ = self._followed(grips)
            if len(grips) < 4:
                break
            pairs = self._random.integers(0, len(grips), (SHORTCUT_BATCH, 2))
            first, last = np.sort(pairs, axis=1).T
            counts = self._step_counts(grips[first], grips[last])
            shorter = (last - first > 1) & (counts < last - first)
            if not shorter.any():
                continue
            first, last, counts = first[shorter], last[shorter], counts[shorter]
            most = counts.max()
            shares = np.minimum(np.arange(1, most + 1) / counts[:, None], 1.0)
            steps = self._motion.between(grips[first], grips[last], shares)
            state, clear = self._rolled([states[k] for k in first], grips[first], steps)
            for b in np.argsort(counts - (last - first), kind="stable"):
                end = state(b, most - 1).positions
                same = polylines.mean_node_distance(end, states[last[b]].positions)
                if not clear[b].all() or same > SAME_SHAPE_DISTANCE:
                    continue
                cut = Grips.joined(
                    grips[: first[b] + 1],
                    steps[b * most : b * most + counts[b]],
                    grips[last[b] + 1 :],
                )
                if self._followed(cut)[1]:
                    grips = cut
                    break
        return grips


def _at_rest(rollout: Rollout, step: int) -> RodState:
    """Rod after a step, without its velocities."""
    still = np.zeros_like(rollout.final.velocities), np.zeros_like(rollout.final.angular_velocities)
    return RodState(rollout.positions[step], rollout.orientations[step], *still)
