"""Grips between which the rod at rest passes through a place to which a person pulls a node.

A shape between two grips is reachable only as the rod's rest shape, so that a pulled node moves the
grips: by the least change of the whole shape that brings the node there (a damped Gauss-Newton
step whose Jacobian of the rest shape is taken by finite differences).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.rod import Rest, Rod, RodState, add_turns

STEP = 0.002
"""Displacement of a grip for finite differences [m]."""
MAX_CHANGE = 0.04
"""Largest displacement of the node in one step [m]; further away the rod is far from linear."""
SHARES = (1.0, 0.3, 0.1)
"""Shares of a step, of which the first that brings the node nearer is taken [-]."""
STEP_COUNT = 2
"""Number of steps of one call; a drag goes on with the next one [-]."""
CLOSE = 5e-4
"""Distance of the node below which it has arrived [m]."""
GRIP_WEIGHT = 0.02
"""Cost of a grip's displacement, relative to the mean displacement of the nodes [-]."""


class NodeDragSolver:
    """Solver for the grips of a shape that is pulled at a node."""

    def __init__(self, rod: Rod, movable: Sequence[bool]) -> None:
        """Take the rod.

        Args:
            rod: Rod that shapes the goals.
            movable: Whether the left and the right grip can move.
        """
        self._rod = rod
        self._movable = [side for side in range(2) if movable[side]]

    def pull(
        self,
        grips: tuple[Pose, Pose],
        node: int,
        target: Float64[np.ndarray, "3"],
        turns: float = 0.0,
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
    ) -> tuple[Pose, Pose]:
        """Return grips whose rest shape brings a node nearer to a place; orientations stay.

        Args:
            grips: Present left and right grip.
            node: Number of the node.
            target: Place to which it is pulled [m].
            turns: Whole turns of twist in the rod.
            obstacles: Supports, from `lariat.geometry.pack`.

        Raises:
            ValueError: The rod has no rest shape between the present grips, or no such node.
        """
        if not 0 <= node < self._rod.node_count:
            raise ValueError(f"node must be below {self._rod.node_count}, got {node}")
        rest = self._rod.rest(*grips, obstacles=obstacles)
        if turns:
            guess = add_turns(rest.state, turns)
            rest = self._rod.rest(*grips, guess=guess, obstacles=obstacles)
        for _ in range(STEP_COUNT):
            distance = float(np.linalg.norm(target - rest.state.positions[node]))
            if distance < CLOSE or not self._movable:
                break
            moved = self._step(grips, rest, node, target, obstacles)
            if moved is None:
                break
            grips, rest = moved
        return grips

    def _step(
        self,
        grips: tuple[Pose, Pose],
        rest: Rest,
        node: int,
        target: Float64[np.ndarray, "3"],
        obstacles: Float64[np.ndarray, "m 13"] | None,
    ) -> tuple[tuple[Pose, Pose], Rest] | None:
        """Grips after one step and the rod between them; None where none brings the node nearer."""
        columns = []
        for side in self._movable:
            for axis in np.eye(3):
                near = self._at_rest(_moved(grips, side, STEP * axis), rest.state, obstacles)
                if near is None:
                    return None
                columns.append((near.state.positions - rest.state.positions) / STEP)
        jacobian = np.array(columns)
        whole = jacobian.reshape(len(columns), -1)
        cost = whole @ whole.T / len(rest.state.positions) + GRIP_WEIGHT * np.eye(len(columns))
        move = target - rest.state.positions[node]
        move = move * min(1.0, MAX_CHANGE / float(np.linalg.norm(move)))
        own = jacobian[:, node]
        direction = np.linalg.solve(cost, own)
        change = direction @ np.linalg.solve(own.T @ direction + 1e-3 * np.eye(3), move)
        distance = np.linalg.norm(target - rest.state.positions[node])
        for share in SHARES:
            after = grips
            for k, side in enumerate(self._movable):
                after = _moved(after, side, share * change[3 * k : 3 * k + 3])
            new = self._at_rest(after, rest.state, obstacles)
            if new and np.linalg.norm(target - new.state.positions[node]) < distance:
                return after, new
        return None

    def _at_rest(
        self,
        grips: tuple[Pose, Pose],
        guess: RodState,
        obstacles: Float64[np.ndarray, "m 13"] | None,
    ) -> Rest | None:
        try:
            rest = self._rod.rest(*grips, guess=guess, obstacles=obstacles)
        except ValueError:
            return None
        return rest if rest.converged else None


def _moved(
    grips: tuple[Pose, Pose], side: int, displacement: Float64[np.ndarray, "3"]
) -> tuple[Pose, Pose]:
    changed = list(grips)
    changed[side] = Pose(grips[side].position + displacement, grips[side].orientation)
    return changed[0], changed[1]
