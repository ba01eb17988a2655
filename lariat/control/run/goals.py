"""Goals of a scenario, of requests and of grips, and the checks that they pass before a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from lariat.control.run.node_drag_solver import NodeDragSolver
from lariat.control.run.task import RequestRefused
from lariat.geometry import polylines
from lariat.geometry.cable_routes import clip_names, clip_openings
from lariat.geometry.obstacles import Obstacle, chain_clearance, pack_supports
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodState, add_turns, connected
from lariat.rod.cable_laying import laid, laying
from lariat.rod.part_fit import fit_part, part_points
from lariat.scenario import SIDES, Goal, Scenario, Shape
from lariat.scenario.checks import check_part
from lariat.scenario.goal_table import length_fault
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.sections import MIN_PART_NODES

MAX_LENGTH_ERROR = 0.03
"""Largest deviation of a goal's length from the rope's, as a share of the rope's length [-]."""
MAX_PART_ERROR = 0.01
"""Largest mean distance of a part of the rope at rest from its wanted shape [m]."""
MAX_SUPPORT_PENETRATION = 0.002
"""Largest depth of a goal in a support [m]; a rope at rest presses into it a little."""

Pull = tuple[int, Float64[np.ndarray, "3"]]
"""Node, and the place to which it is pulled [m]."""


@dataclass(frozen=True)
class GoalFactory:
    """Factory and checks of the goals of one cell."""

    scenario: Scenario
    """Scenario of the cell."""
    rod: Rod
    """Rod that shapes the goals."""
    start: tuple[Pose, Pose]
    """Grips at the scenario's start; an end that does not rotate keeps this orientation."""
    _of_parts: dict[Shape, Goal] = field(default_factory=dict, repr=False)
    """Goals of parts of the rope and of routes, whose fit is not repeated."""

    @cached_property
    def _start_state(self) -> RodState:
        """Rod at rest at the scenario's start."""
        state = self.rod.rest(*self.start).state
        return add_turns(state, self.scenario.start.turns)

    @classmethod
    def of_scenario(cls, scenario: Scenario) -> GoalFactory:
        """Create the factory of a cell whose rod is the scenario's."""
        rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
        return cls(scenario, rod, scenario.grips(scenario.start))

    def from_shape(self, shape: Shape) -> Goal:
        """Goal of a scenario's section.

        Raises:
            RequestRefused: The rod does not come to rest there, or not in the shape of a part.
        """
        part = self.scenario.part_nodes(shape)
        if part is not None:
            if shape not in self._of_parts:
                self._of_parts[shape] = self._of_part(part, shape)
            return self._of_parts[shape]
        if shape.route:
            if shape not in self._of_parts:
                self._of_parts[shape] = self.laid(shape, self.scenario.bodies)
            return self._of_parts[shape]
        grips = self.feasible_grips(*self.scenario.grips(shape))
        nodes = self.scenario.nodes(shape)
        if nodes is None:
            whole = self.at_rest(*grips, self.scenario.bodies, shape.turns)
            return _counting(whole, shape)
        rotates = [self.scenario.end(side).rotates for side in SIDES]
        # Twist is counted between the orientations of the ends.
        oriented = [
            o is not None or shape.turns != 0.0
            for o in (shape.left_orientation, shape.right_orientation)
        ]
        return Goal(
            nodes,
            *grips,
            left_oriented=rotates[0] and oriented[0],
            right_oriented=rotates[1] and oriented[1],
            **shape.terms,
        )

    def prepare(self) -> None:
        """Fit the goals of parts of the rope that the scenario sets while a run goes on.

        Raises:
            RequestRefused: A part does not take its shape at rest.
        """
        events = (event.goal for event in self.scenario.events if event.goal)
        for shape in (*self.scenario.next_goals, *events):
            if shape.leaves_grips_open or shape.route:
                self.from_shape(shape)

    def from_request(
        self, request: Goal, obstacles: tuple[Obstacle, ...], pull: Pull | None = None
    ) -> Goal:
        """Goal of a person's request, resampled to the nodes of the rope.

        Args:
            request: Goal with nodes, or with grips alone; without grips, those of the start hold.
            obstacles: Obstacles of the scene, of which the supports count.
            pull: Node of the rope at rest between the grips, and the place to which it is pulled
                [m]; None where the grips stay.

        Raises:
            RequestRefused: The rod does not come to rest there, the grips are too far apart, or
                the goal has a route without nodes, whose laying takes longer than a step may.
        """
        nodes = request.nodes
        if request.route and not len(nodes):
            raise RequestRefused(
                "a goal with a route needs the nodes of the laid rope, which the page and `lariat "
                "goal` compute"
            )
        placed = all(len(grip.position) for grip in request.grips)
        grips = self.feasible_grips(*(request.grips if placed or not len(nodes) else self.start))
        if not len(nodes):
            if pull is not None:
                grips = self._pulled(grips, pull, request.turns, obstacles)
            return replace(self.at_rest(*grips, obstacles, request.turns), **request.terms)
        count = self.scenario.rope.node_count
        if len(nodes) != count and len(nodes) >= 3:
            nodes = polylines.resample_smooth(nodes, count)
        return replace(request, nodes=nodes, left=grips[0], right=grips[1])

    def laid(
        self,
        shape: Shape,
        obstacles: Sequence[Obstacle],
        report: Callable[[str], None] = lambda _: None,
    ) -> Goal:
        """Rod at rest after it has been laid along a route, which takes seconds.

        Args:
            shape: Shape with a route.
            obstacles: Obstacles, of which the supports count.
            report: Takes in words what is done at present.

        Raises:
            ConfigurationError: The route names something that is not there.
            RequestRefused: The rod is too short, or does not come to lie in all clips.
        """
        grips = self.feasible_grips(*self.scenario.grips(shape, obstacles))
        rotates = [self.scenario.end(side).rotates for side in SIDES]
        stops = self.scenario.route_stops(shape, obstacles)
        try:
            way = laying(self.rod, stops, grips, (rotates[0], rotates[1]), obstacles, report)
            nodes = laid(self.rod, *way, pack_supports(obstacles)).final.positions
        except ValueError as error:
            raise RequestRefused(str(error)) from error
        openings = clip_openings(obstacles)
        for clip in (openings[name] for name in clip_names(shape.route)):
            if not clip.holds(nodes):
                raise RequestRefused(
                    f"the rope that is laid along the route does not come to lie in clip "
                    f"{clip.name!r}: it {clip.miss(nodes)}; widen the clip, or turn it towards its "
                    "neighbours"
                )
        return Goal(nodes, *grips, rotates[0], rotates[1], **shape.terms)

    def _of_part(self, nodes: Float64[np.ndarray, "m 3"], shape: Shape) -> Goal:
        """Rod at rest, leaning on the supports, a part of which lies on some nodes.

        The fit takes up to seconds where the ends rotate.

        Raises:
            RequestRefused: The part does not take this shape at rest.
        """
        part = shape.part
        assert part is not None
        points, counted = part_points(nodes, part, self.rod.node_count, self.scenario.rope.length)
        if np.sum(counted) < MIN_PART_NODES:
            raise RequestRefused(_too_few_nodes(part, int(np.sum(counted))))
        supports, moves = pack_supports(self.scenario.bodies), self.scenario.moves
        try:
            fit = fit_part(self.rod, self.start, moves, points, counted, shape.turns, supports)
        except ValueError as error:
            raise RequestRefused(str(error)) from error
        if fit.error > MAX_PART_ERROR:
            raise RequestRefused(
                f"the part {part[0]:g} to {part[1]:g} m does not take this shape at rest; the "
                f"nearest that was found is {1e3 * fit.error:.1f} mm away"
            )
        nodes = fit.state.positions.copy()
        nodes[counted] = points
        return Goal(nodes, *fit.grips, **shape.terms)

    def _pulled(
        self,
        grips: tuple[Pose, Pose],
        pull: Pull,
        turns: float,
        obstacles: tuple[Obstacle, ...],
    ) -> tuple[Pose, Pose]:
        """Grips whose rest shape comes nearer to where a node is pulled.

        Raises:
            RequestRefused: The rod has no rest shape between the grips, or no such node.
        """
        movable = [self.scenario.end(side).driver != "fixed" for side in SIDES]
        try:
            return NodeDragSolver(self.rod, movable).pull(
                grips, *pull, turns, pack_supports(obstacles)
            )
        except ValueError as error:
            raise RequestRefused(str(error)) from error

    def feasible_grips(self, left: Pose, right: Pose) -> tuple[Pose, Pose]:
        """Grips that the ends can reach; what is fixed or does not rotate stays as it started.

        Args:
            left: Wanted left grip.
            right: Wanted right grip.
        """
        grips = []
        for side, grip, start in zip(SIDES, (left, right), self.start, strict=True):
            end = self.scenario.end(side)
            position = start.position if end.driver == "fixed" else grip.position
            turned = grip.orientation if end.rotates else start.orientation
            grips.append(Pose(position, turned))
        return grips[0], grips[1]

    def at_rest(
        self, left: Pose, right: Pose, obstacles: Sequence[Obstacle], turns: float = 0.0
    ) -> Goal:
        """Rod at rest between two grips, leaning on the supports.

        Args:
            left: Left grip.
            right: Right grip.
            obstacles: Obstacles of the scene, of which the supports count.
            turns: Whole turns of twist in the rod.

        Raises:
            RequestRefused: It does not come to rest there, or the grips are too far apart.
        """
        rotates = [self.scenario.end(side).rotates for side in SIDES]
        try:
            packed = pack_supports(obstacles)
            rest = self.rod.rest(left, right, obstacles=packed)
            twist = turns
            if not any(rotates) and not connected(self._start_state, add_turns(rest.state, turns)):
                # E.g. where the ends change places: a loop of the rope has become a turn of twist.
                twist += 1.0
            if twist:
                guess = add_turns(rest.state, twist)
                rest = self.rod.rest(left, right, guess=guess, obstacles=packed)
        except ValueError as error:
            raise RequestRefused(str(error)) from error
        if not rest.converged:
            raise RequestRefused(
                f"the rope does not come to rest between these grips (still moves "
                f"{1e3 * rest.residual:.2f} mm); bring them further apart"
            )
        return Goal(rest.state.positions, left, right, rotates[0], rotates[1], turns=turns)

    def check(self, goal: Goal, obstacles: tuple[Obstacle, ...]) -> None:
        """Check that a goal is possible.

        Args:
            goal: Goal.
            obstacles: Obstacles of the scene.

        Raises:
            RequestRefused: The goal is not possible.
        """
        scenario = self.scenario
        rope, limits = scenario.rope, scenario.limits
        if not np.all(np.isfinite(goal.nodes)) or len(goal.nodes) != rope.node_count:
            raise RequestRefused(
                f"a goal has {rope.node_count} nodes of finite numbers, got {len(goal.nodes)}"
            )
        if goal.turns and not any(scenario.end(side).rotates for side in SIDES):
            raise RequestRefused(f"the goal has {goal.turns:g} turns of twist, but no end rotates")
        if goal.turns != round(goal.turns):
            raise RequestRefused(
                f"the goal has {goal.turns:g} turns of twist; give whole turns, and the rest as "
                "the orientation of an end"
            )
        if fault := length_fault(goal.nodes, rope.length, MAX_LENGTH_ERROR):
            raise RequestRefused(f"the goal is {fault}")
        if goal.part is not None:
            try:
                check_part(scenario, "goal", goal.part)
            except ValueError as error:
                raise RequestRefused(str(error)) from error
            if (node_count := int(np.sum(goal.counted))) < MIN_PART_NODES:
                raise RequestRefused(_too_few_nodes(goal.part, node_count))
        distance = float(np.linalg.norm(goal.right.position - goal.left.position))
        if distance > limits.overstretch * rope.length:
            raise RequestRefused(
                f"the grips of the goal are {distance:.4f} m apart; at most "
                f"{limits.overstretch * rope.length:.4f} m keep the rope from being stretched"
            )
        low, high = np.array(limits.workspace)
        for side, grip in zip(SIDES, (goal.left, goal.right), strict=True):
            if np.any(grip.position < low) or np.any(grip.position > high):
                raise RequestRefused(
                    f"the {side} grip of the goal at {grip.position.round(4).tolist()} m is "
                    "outside limits.workspace"
                )
        for obstacle in obstacles:
            depth = -chain_clearance(goal.nodes, rope.diameter / 2.0, [obstacle])
            if depth > 0.0 and obstacle.keep_in:
                raise RequestRefused(
                    f"the goal leaves the region {obstacle.name!r} by {1e3 * depth:.1f} mm"
                )
            if depth > (MAX_SUPPORT_PENETRATION if obstacle.support else 0.0):
                raise RequestRefused(
                    f"the goal lies {1e3 * depth:.1f} mm deep in obstacle {obstacle.name!r}"
                )


def _counting(goal: Goal, shape: Shape) -> Goal:
    """Goal of the rope at rest of which only what a shape names counts.

    Raises:
        RequestRefused: A part has too few nodes.
    """
    counting = replace(goal, **shape.terms)
    if shape.part is None:
        return counting
    node_count = int(np.sum(counting.counted))
    if node_count < MIN_PART_NODES:
        raise RequestRefused(_too_few_nodes(shape.part, node_count))
    return replace(counting, left_oriented=False, right_oriented=False)


def _too_few_nodes(part: tuple[float, float], node_count: int) -> str:
    return (
        f"the part {part[0]:g} to {part[1]:g} m holds {node_count} nodes of the model; at least "
        f"{MIN_PART_NODES} make a shape"
    )
