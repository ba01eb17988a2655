"""What the rope is doing: the rod moved by the measured grips, and what cameras see beside it.

The model is rolled along the measured motion of the grips and never overwritten: orientations,
twist and velocities cannot be seen in node positions, and a model keeps its own. What observation
adds is the offset between the seen and the modelled nodes. It changes slowly where the model is
wrong in stiffness, so a filter of one number per node follows it; predictions are the model's plus
the offset, and at rest they agree with what is seen.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod import Rod, RodState, RolloutSpec, add_turns, count_turns, framed
from lariat.rod.xpbd import XpbdRod
from lariat.trajectory import MotionState, mean_twists

LONGEST_STEP = 0.0051
"""Of the model [s]; longer implicit steps damp the rope's swinging."""
HISTORY = 0.5
"""How far back an image may lie [s]."""
DRIFT = 2e-3
"""Growth of the offset's standard deviation [m/sqrt(s)]."""
QUICKEST = 0.12
"""Least time constant of the offset, so that swinging is not taken for an offset [s]."""
UNKNOWN = 0.03
"""Standard deviation of the offset before the first observation [m]."""
ALIKE = 0.35
"""Of the model's distance, below which another shape of rest is the one that is seen [-]."""
FAR = 0.08
"""Mean offset at which the model is another shape than the rope [m]."""


class StateEstimator:
    """Model state and offset of one rope."""

    def __init__(self, rod: Rod | XpbdRod, motion: MotionState, time: int) -> None:
        """A rope at rest between the grips at `time` [ns]."""
        self.rod = rod
        self.supports: Float64[np.ndarray, "m 12"] | None = None
        """What the rope leans on, packed for the rod."""
        self.restart(motion, time)

    def restart(
        self,
        motion: MotionState,
        time: int,
        seen: Float64[np.ndarray, "n 3"] | None = None,
        turns: int = 0,
    ) -> None:
        """Begins again at rest with some turns of twist, from the shape that is seen if any is."""
        guess = None
        if seen is not None:
            guess = add_turns(framed(seen, *motion.orientations), turns)
        elif turns:
            guess = add_turns(self.rod.rest(*motion.grips, obstacles=self.supports).state, turns)
        self.state: RodState = self.rod.rest(
            *motion.grips, guess=guess, obstacles=self.supports
        ).state
        self.motion, self.time = motion, time
        self.start_time = time
        count = len(self.state.positions)
        self.offset: Float64[np.ndarray, "n 3"] = np.zeros((count, 3))
        self._variance = np.full(count, UNKNOWN**2)
        self._observed_at: int | None = None
        self._history = deque([(time, self.state.positions)])
        self.innovation = 0.0
        """Mean distance of the last observation from what was predicted [m]."""

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Where the rope is now, as far as is known [m]."""
        return self.state.positions + self.offset

    @property
    def turns(self) -> int:
        """Whole turns of twist in the rope: they cannot be seen, but the model keeps them."""
        return count_turns(self.state)

    def advance(self, motion: MotionState, time: int) -> None:
        """Moves the model's ends to measured poses at `time` [ns]."""
        if time <= self.time:
            return
        dt = (time - self.time) * 1e-9
        steps = max(1, int(np.ceil(dt / LONGEST_STEP)))
        self.state = self._rollout(self.state, mean_twists(self.motion, motion, dt), dt, steps)
        self.motion, self.time = motion, time
        self._history.append((time, self.state.positions))
        while (time - self._history[0][0]) * 1e-9 > HISTORY:
            self._history.popleft()

    def predict(self, motion: MotionState, time: int) -> RodState:
        """The model when its ends will have reached poses at `time` [ns]; nothing is kept."""
        dt = (time - self.time) * 1e-9
        if dt <= 0.0:
            return self.state
        steps = max(1, int(np.ceil(dt / 0.021)))
        return self._rollout(self.state, mean_twists(self.motion, motion, dt), dt, steps)

    def change_material(self, rod: Rod | XpbdRod, change: Float64[np.ndarray, "n 3"]) -> None:
        """Goes on with another material, which will change the model's shape so much [m].

        The offset must learn as much anew, and no more: noise would come in with it.
        """
        self.rod = rod
        self._variance = self._variance + np.mean(change**2, axis=1)

    def rest_with_material(self, rod: Rod | XpbdRod) -> None:
        """Goes on with another material in its own shape of rest: the rope stands still.

        What the rope was believed to be stays: the offset makes up for it.
        """
        self.rod = rod
        before = self.state.positions
        self.state = rod.rest(
            *self.motion.grips, guess=self.state.at_rest(), obstacles=self.supports
        ).state
        self.offset = self.offset + before - self.state.positions
        self.offset[[0, 1, -2, -1]] = 0.0
        self._history = deque([(self.time, self.state.positions)])

    def switch_equilibrium(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
    ) -> bool:
        """Goes on from another shape of rest between the same grips, if the rope is seen in one.

        Where a rope has two, it does not always leave the one for the other with the model.

        Args:
            nodes: As seen [m].
            observed: Which of them count.
        """
        seen = np.where(observed[:, None], nodes, self.nodes)
        guess = add_turns(framed(seen, *self.motion.orientations), self.turns)
        try:
            found = self.rod.rest(*self.motion.grips, guess=guess, obstacles=self.supports)
        except ValueError:
            # Grips that hold the rope taut leave it no other shape.
            return False
        if not found.converged:
            return False
        now, then = (
            np.linalg.norm(nodes - shape.positions, axis=1)[observed]
            for shape in (self.state, found.state)
        )
        if np.max(then) > ALIKE * np.max(now):
            return False
        self.restart(self.motion, self.time, seen, self.turns)
        return True

    def _rollout(
        self, state: RodState, twist: Float64[np.ndarray, "2 2 3"], dt: float, steps: int
    ) -> RodState:
        """A state after `dt` [s] with constant velocities of the grips."""
        action = twist.reshape(1, 2, 6)
        blocks = np.zeros(steps, dtype=np.int64)
        return self.rod.rollout(
            RolloutSpec(state, action, dt / steps, block_of_step=blocks, obstacles=self.supports)
        ).final

    def observe(
        self,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> None:
        """Takes in what was seen at `stamp` [ns]; nodes that were bridged do not count."""
        error = nodes - self.model_nodes_at(stamp)
        if np.any(observed):
            self.innovation = float(np.mean(np.linalg.norm(error - self.offset, axis=1)[observed]))
        elapsed = 1.0 if self._observed_at is None else (stamp - self._observed_at) * 1e-9
        if elapsed <= 0.0:
            return
        self._variance += DRIFT**2 * min(elapsed, 10.0)
        gain = self._variance / (self._variance + np.maximum(sigma, 1e-6) ** 2)
        if self._observed_at is not None:
            gain = np.minimum(gain, 1.0 - np.exp(-elapsed / QUICKEST))
        # A node far off its neighbours' story counts less: one bad match moves nothing much.
        miss = np.linalg.norm(error - self.offset, axis=1)
        typical = 0.01 + 3.0 * np.sqrt(self._variance + sigma**2)
        gain = gain * np.minimum(1.0, typical / np.maximum(miss, 1e-12))
        wanted = np.where(observed[:, None], error, self._interpolated(error, observed))
        self.offset = self.offset + gain[:, None] * (wanted - self.offset)
        self._variance = np.where(observed, (1.0 - gain) * self._variance, self._variance)
        # The clamped nodes are where the grips are.
        self.offset[[0, 1, -2, -1]] = 0.0
        self._observed_at = stamp

    @property
    def diverged(self) -> bool:
        """Whether the model has become another shape than the rope."""
        return float(np.mean(np.linalg.norm(self.offset, axis=1))) > FAR

    def model_nodes_at(self, stamp: int) -> Float64[np.ndarray, "n 3"]:
        """The model's nodes at an earlier time, between what is remembered."""
        before = after = self._history[0]
        for entry in self._history:
            before, after = after, entry
            if entry[0] >= stamp:
                break
        if after[0] <= stamp or after[0] == before[0]:
            return after[1]
        share = max(0.0, (stamp - before[0]) / (after[0] - before[0]))
        return (1.0 - share) * before[1] + share * after[1]

    def _interpolated(
        self, error: Float64[np.ndarray, "n 3"], observed: Bool[np.ndarray, "n"]
    ) -> Float64[np.ndarray, "n 3"]:
        """Offsets of unseen nodes: between those of seen ones, nothing at the grips."""
        known = observed.copy()
        known[[0, 1, -2, -1]] = True
        values = np.where(observed[:, None], error, 0.0)
        values[[0, 1, -2, -1]] = 0.0
        (at,) = np.nonzero(known)
        index = np.arange(len(known))
        return np.stack([np.interp(index, at, values[at, k]) for k in range(3)], axis=1)
