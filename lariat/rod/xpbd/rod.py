"""The paper's rod behind the interface of `lariat.rod.Rod`: roll-outs, gradients, rest.

Ends, actions and states are those of `Rod`. A grip clamps the first edge: its quaternion and both
its nodes are manipulated particles. The paper's n positions between n + 1 orientations are the
nodes and edges from there to the other clamp, whose outer quaternions are the held ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod.launch.buffers import BufferPool
from lariat.rod.launch.inputs import ENDS, End
from lariat.rod.state import Gradient, Rest, RodState, Rollout
from lariat.rod.xpbd import rest
from lariat.rod.xpbd.launch.inputs import constants, opened
from lariat.rod.xpbd.launch.kernel_launch import launch
from lariat.rod.xpbd.launch.layout import Section
from lariat.rod.xpbd.launch.outputs import PARAMETERS, positions, rolled, slopes
from lariat.rod.xpbd.properties import XpbdProperties

ITERATIONS = 20
"""J, which the paper does not give."""

Slope = Callable[[Float64[np.ndarray, "H n 3"]], Float64[np.ndarray, "H n 3"]]
"""A cost's slope in the positions, from the positions."""


class XpbdRod:
    """A rod of n nodes, stepped by Algorithm 1 of the paper."""

    def __init__(
        self,
        properties: XpbdProperties,
        node_count: int,
        left: End = "clamped",
        right: End = "clamped",
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        iterations: int = ITERATIONS,
    ) -> None:
        """
        Args:
            properties: What it is made of.
            node_count: At least 5.
            left: How the end at node 0 is held.
            right: How the other end is held.
            gravity: Acceleration in the world frame [m/s^2].
            iterations: J, sweeps over the constraints in each step.
        """
        if node_count < 5:
            raise ValueError(f"node_count must be at least 5, got {node_count}; try 40")
        for name, end in (("left", left), ("right", right)):
            if end not in ENDS:
                raise ValueError(f"{name} must be one of {', '.join(ENDS)}, got {end!r}")
        if iterations < 1:
            raise ValueError(f"iterations must be at least 1, got {iterations}; try {ITERATIONS}")
        if len(gravity) != 3 or not np.all(np.isfinite(gravity)):
            raise ValueError(f"gravity must be three finite numbers, got {gravity} m/s^2")
        self.properties = properties
        self.node_count = node_count
        self.left: End = left
        self.right: End = right
        self.gravity = gravity
        self.iterations = iterations
        self.buffer_pool = BufferPool()
        self.constants = constants(self)

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        return self.properties.length / (self.node_count - 1)

    def with_properties(self, properties: XpbdProperties) -> XpbdRod:
        """The same rod of another material; shares buffers with this one."""
        other = XpbdRod.__new__(XpbdRod)
        other.__dict__.update(self.__dict__)
        other.properties = properties
        other.constants = constants(other)
        return other

    def straight(self, left_point: Sequence[float], right_point: Sequence[float]) -> RodState:
        """At rest on the line from one point towards the other, at its own length."""
        start, goal = np.asarray(left_point, float), np.asarray(right_point, float)
        along = goal - start
        if not np.all(np.isfinite(along)) or np.linalg.norm(along) < 1e-9:
            raise ValueError(f"straight needs two different points, got {start} and {goal}")
        along = along / np.linalg.norm(along)
        n = self.node_count
        return RodState(
            start + self.edge_length * np.arange(n)[:, None] * along,
            np.tile(poses.between(np.array([0.0, 0.0, 1.0]), along), (n - 1, 1)),
            np.zeros((n, 3)),
            np.zeros((n - 1, 3)),
        )

    def rollout(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
    ) -> Rollout:
        """Where the rod goes; arguments as of `Rod.rollout`."""
        return self.rollouts([state], actions[None], dt, steps, block_of_step, substeps, obstacles)[
            0
        ]

    def rollouts(
        self,
        states: Sequence[RodState],
        actions: Float64[np.ndarray, "B K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
    ) -> list[Rollout]:
        """`rollout` of several rods in one launch."""
        buffers = opened(
            self, states, actions, dt, steps, block_of_step, substeps, obstacles, taped=False
        )
        launch(buffers, forward=True, backward=False)
        return [rolled(buffers, b) for b in range(len(states))]

    def gradient(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
        parameters: tuple[str, ...] = PARAMETERS,
        *,
        d_cost_d_positions: Float64[np.ndarray, "H n 3"] | Slope,
    ) -> Gradient:
        """The roll-out and the gradient of a cost.

        Args:
            d_cost_d_positions: The cost's slope, or a function that gives it for the positions of
                the roll-out.
        """
        given = d_cost_d_positions
        slope = (lambda x: given(x[0])[None]) if callable(given) else np.asarray(given)[None]
        return self.gradients(
            [state],
            actions[None],
            dt,
            steps,
            block_of_step,
            substeps,
            obstacles,
            parameters,
            d_cost_d_positions=slope,
        )[0]

    def gradients(
        self,
        states: Sequence[RodState],
        actions: Float64[np.ndarray, "B K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
        parameters: tuple[str, ...] = PARAMETERS,
        *,
        d_cost_d_positions: Float64[np.ndarray, "B H n 3"]
        | Callable[[Float64[np.ndarray, "B H n 3"]], Float64[np.ndarray, "B H n 3"]],
    ) -> list[Gradient]:
        """`gradient` of several rods; one launch, or one each way where the slope is a function."""
        unknown = [name for name in parameters if name not in PARAMETERS]
        if unknown:
            raise ValueError(f"no parameter {unknown[0]!r}; there are {', '.join(PARAMETERS)}")
        buffers = opened(
            self, states, actions, dt, steps, block_of_step, substeps, obstacles, taped=True
        )
        slope = d_cost_d_positions
        later = callable(slope)
        if callable(slope):
            launch(buffers, forward=True, backward=False)
            slope = slope(positions(buffers))
        horizon = buffers.sizes.steps // substeps
        slope = np.asarray(slope, float)
        if slope.shape != (len(states), horizon, self.node_count, 3):
            raise ValueError(
                f"d_cost_d_positions must be ({horizon} steps, {self.node_count} nodes, 3), got "
                f"shape {slope.shape[1:]}"
            )
        buffers.section(Section.COST_GRADIENT)[:] = slope.reshape(len(states), -1)
        launch(buffers, forward=not later, backward=True)
        clamped = self.left == "clamped", self.right == "clamped"
        return [
            Gradient(rolled(buffers, b), *slopes(buffers, b, clamped, parameters))
            for b in range(len(states))
        ]

    def rest(
        self,
        left: Pose,
        right: Pose,
        guess: RodState | None = None,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
        dt: float = 0.01,
    ) -> Rest:
        """A shape at which the rod stays, between two grips; see `Rod.rest`.

        Sweeps that have not converged leave it at another shape for every length of a step.

        Args:
            dt: Of the step that leaves it where it is [s].
        """
        return rest.rest(self, left, right, guess, obstacles, dt)
