"""Rope as the planner has it: the given rod, updated with what has been identified."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, has_friction, pack_supports
from lariat.geometry.poses import Pose
from lariat.planning.problem import UNMOVED, DrawnRope
from lariat.rod import Rod, RodProperties, RodState, add_turns, count_turns_along, state_along
from lariat.rod.part_fit import fit_part
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.sections import Goal, Rope

SAME_SHAPE_DISTANCE = 0.02
"""Mean node distance between the observed rope and the rod at rest below which both have the same
shape [m]."""
COVERED_MISMATCH = 0.002
"""Root mean square distance of rod and rope at rest that a path's own reserve covers [m]."""
MISMATCH_DEVIATIONS = 2.0
"""Distances beyond that one that are added to the clearance [-]."""
MAX_MISMATCH_MARGIN = 0.015
"""Largest clearance that is added for the distance of rod and rope [m]."""


class RopeModel:
    """Rod with the best known properties, and how the grips hold it."""

    def __init__(self, rope: Rope, moves: Bool[np.ndarray, "2 6"]) -> None:
        """Create the rope of a scenario.

        Args:
            rope: Rope section of a scenario.
            moves: Free components of each grip's velocity.
        """
        self.given, self._moves = rod_properties(rope), moves
        """Properties that the scenario gives."""
        self.rod = Rod(self.given, rope.node_count)
        """Rod with the best known properties."""
        self.variants: tuple[Rod, ...] = ()
        """Rods with one identified property off by its standard deviation each."""
        self.drawn: tuple[DrawnRope, ...] = ()
        """Ropes drawn from what is known of the present one; none where all is known."""
        self.held = (UNMOVED, UNMOVED)
        """Poses of the rope's ends in the frames of the grips. Paths are planned for the ends."""
        self._set: Float64[np.ndarray, "b l 3"] | None = None
        """What the layers of all bends of the present rope keep [1/m]; None without a set."""

    def update(
        self,
        properties: RodProperties,
        unsure: Sequence[RodProperties],
        ends_in_grips: tuple[Pose, Pose],
        drawn: tuple[DrawnRope, ...] = (),
    ) -> None:
        """Take what has been identified.

        Args:
            properties: Properties of the rope.
            unsure: The same with one property off by its standard deviation each.
            ends_in_grips: Poses of the rope's ends in the frames of the grips.
            drawn: Ropes drawn from what is known.
        """
        self.rod = self.rod.with_properties(properties)
        self.held, self.drawn = ends_in_grips, drawn
        self.variants = tuple(self.rod.with_properties(p) for p in unsure)

    def take_set(self, kept: Float64[np.ndarray, "k"]) -> None:
        """Take what the layers of all bends of the present rope keep, of a rod of as many nodes.

        Args:
            kept: Numbers of `RodState.plastic_curvature`, in one row [1/m]; none for no set.
        """
        shape = (self.rod.node_count, len(self.given.layers), 3)
        self._set = kept.reshape(shape) if len(kept) == np.prod(shape) else None

    def ends(self, left: Pose, right: Pose) -> tuple[Pose, Pose]:
        """Poses of the rope's ends between two grips."""
        return left @ self.held[0], right @ self.held[1]

    def goal(self, goal: Goal, obstacles: Sequence[Obstacle]) -> Goal:
        """Goal of this rod's nodes and ends; beside a part that counts, they are fitted with it.

        Where the ends alone count, the rope's own ends are to come to the goal's poses.

        Args:
            goal: The goal.
            obstacles: Obstacles, supports among them.
        """
        nodes = self._resampled(goal.nodes)
        ends = goal.grips if goal.ends_only else self.ends(*goal.grips)
        supports = pack_supports(obstacles)
        try:
            if goal.ends_only:
                nodes = self.rod.rest(*ends, obstacles=supports).state.positions
            if goal.part:
                counted = polylines.within(nodes, *goal.part)
                fit = fit_part(
                    self.rod, ends, self._moves, nodes[counted], counted, goal.turns, supports
                )
                nodes, ends = np.where(counted[:, None], nodes, fit.state.positions), fit.grips
        except ValueError:
            pass  # A goal that this rod does not take is approached as it is given.
        return replace(goal, nodes=nodes, left=ends[0], right=ends[1], part=None)

    def rest_state(
        self,
        grips: tuple[Pose, Pose],
        seen: Float64[np.ndarray, "k 3"] | None,
        obstacles: Sequence[Obstacle],
        turns: int,
    ) -> RodState:
        """State at rest between the grips, with the observed shape and the given turns of twist.

        With a set, or friction on supports, the rope has a history: it is the one that was seen.

        Args:
            grips: Poses of the rope's ends.
            seen: Nodes of the observed rope [m]; None before the first observation.
            obstacles: Obstacles, supports among them.
            turns: Whole turns of twist of the observed shape.

        Raises:
            ValueError: The rope does not reach from grip to grip.
        """
        supports = pack_supports(obstacles)
        if seen is not None and (self._set is not None or has_friction(supports)):
            observed = self._resampled(seen)
            guess = state_along(observed, grips[0].orientation, grips[1].orientation)
            guess = replace(add_turns(guess, turns), plastic_curvature=self._set)
            return self.rod.rest(*grips, guess=guess, obstacles=supports).state
        state = self.rod.rest(*grips, obstacles=supports).state
        if seen is None:
            return self._rest_with_turns(state, turns, grips, supports)
        observed = self._resampled(seen)
        guess = add_turns(state_along(observed, grips[0].orientation, grips[1].orientation), turns)
        # The turns are those of the observed shape.
        state = self._rest_with_turns(
            state, count_turns_along(guess, state.positions), grips, supports
        )
        if polylines.mean_node_distance(state.positions, observed) < SAME_SHAPE_DISTANCE:
            return state
        other = self.rod.rest(*grips, guess=guess, obstacles=supports).state
        return min(
            (state, other), key=lambda s: polylines.mean_node_distance(s.positions, observed)
        )

    def _rest_with_turns(
        self,
        state: RodState,
        turns: int,
        grips: tuple[Pose, Pose],
        supports: Float64[np.ndarray, "m 13"] | None,
    ) -> RodState:
        """State at rest to which another one relaxes when turns of twist are added to it."""
        if not turns:
            return state
        return self.rod.rest(*grips, guess=add_turns(state, turns), obstacles=supports).state

    def mismatch_margin(
        self,
        state: RodState,
        seen: Float64[np.ndarray, "k 3"] | None,
        sigma: Float64[np.ndarray, "k"],
    ) -> float:
        """Clearance that is added where the rod at rest is not where the rope is seen [m].

        Args:
            state: Rod at rest.
            seen: Nodes of the observed rope [m]; None before the first observation.
            sigma: Their standard deviations [m]; empty where they are not stated.
        """
        if seen is None:
            return 0.0
        missed = self._resampled(seen) - state.positions
        noise = 3.0 * float(np.mean(np.square(sigma))) if len(sigma) else 0.0
        square = float(np.mean(np.sum(missed**2, axis=1))) - noise
        mismatch = math.sqrt(max(square, 0.0)) - COVERED_MISMATCH
        return min(MISMATCH_DEVIATIONS * max(mismatch, 0.0), MAX_MISMATCH_MARGIN)

    def _resampled(self, nodes: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "n 3"]:
        """Chain with as many nodes as the rod, by arc length."""
        count = self.rod.node_count
        return nodes if len(nodes) == count else polylines.resample_smooth(nodes, count)
