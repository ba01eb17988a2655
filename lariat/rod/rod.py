"""The differentiable Cosserat rod: roll-outs, derivatives and equilibria.

Ends: a grip (p, R) clamps the first edge, x_0 = p and x_1 = p + l R z at the left, x_n-1 = p and
x_n-2 = p - l R z at the right; a pinned end holds its outermost node alone; a free one nothing.
Actions are, per block and end (0 left, 1 right), linear velocity [m/s] and angular velocity
[rad/s] of the grip in the world frame. Orientations enter derivatives as tangent vectors.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import statics
from lariat.rod.integration_schemes import HISTORY, Scheme
from lariat.rod.launch.buffers import BufferPool
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.inputs import ENDS, End, Wanted, constants, opened
from lariat.rod.launch.kernel_launch import launch
from lariat.rod.launch.layout import REPORT_WIDTH, ReportRow, Section
from lariat.rod.launch.outputs import linearized, rolled, slopes
from lariat.rod.parameters import PARAMETERS
from lariat.rod.properties import RodProperties
from lariat.rod.state import Gradient, Linearization, Rest, RodState, Rollout, StateDirections


class Rod:
    """A rod of n nodes, stepped implicitly; see `kernels` for its energy."""

    def __init__(
        self,
        properties: RodProperties,
        node_count: int,
        left: End = "clamped",
        right: End = "clamped",
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        tolerance: float = 1e-7,
        scheme: Scheme = "euler",
        self_contact: bool = False,
    ) -> None:
        """
        Args:
            properties: What it is made of.
            node_count: At least 5.
            left: How the end at node 0 is held.
            right: How the other end is held.
            gravity: Acceleration in the world frame [m/s^2].
            tolerance: A solve is done when its last Newton step moved no node by more [m]; where
                no derivative is wanted, when the next one would not, judged by the last two.
            scheme: How time goes on: "euler" is of first order, one solve a step, and never adds
                energy; "sdirk2" is of second order, two solves a step.
            self_contact: Whether the rod's strands touch each other instead of passing through.
                They must not come closer by a diameter within a step.
        """
        if node_count < 5:
            raise ValueError(f"node_count must be at least 5, got {node_count}; try 40")
        for name, end in (("left", left), ("right", right)):
            if end not in ENDS:
                raise ValueError(f"{name} must be one of {', '.join(ENDS)}, got {end!r}")
        if not 0.0 < tolerance < properties.length:
            raise ValueError(f"tolerance must be small and positive, got {tolerance} m; try 1e-7")
        if len(gravity) != 3 or not np.all(np.isfinite(gravity)):
            raise ValueError(f"gravity must be three finite numbers, got {gravity} m/s^2")
        if scheme not in HISTORY:
            raise ValueError(f"scheme must be one of {', '.join(HISTORY)}, got {scheme!r}")
        self.properties = properties
        self.scheme: Scheme = scheme
        self.self_contact = self_contact
        self.node_count = node_count
        self.left: End = left
        self.right: End = right
        self.gravity = gravity
        self.tolerance = tolerance
        self.buffer_pool = BufferPool()
        self.constants = constants(self)

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        return self.properties.length / (self.node_count - 1)

    def with_properties(self, properties: RodProperties) -> Rod:
        """The same rod of another material; shares buffers with this one."""
        other = Rod.__new__(Rod)
        other.__dict__.update(self.__dict__)
        other.properties = properties
        other.constants = constants(other)
        return other

    def straight(self, left_point: Sequence[float], right_point: Sequence[float]) -> RodState:
        """At rest on the line from one point towards the other, at its own length.

        The first node lies at `left_point`; the last reaches as far as the rod is long.
        """
        start, goal = np.asarray(left_point, float), np.asarray(right_point, float)
        along = goal - start
        if not np.all(np.isfinite(along)) or np.linalg.norm(along) < 1e-9:
            raise ValueError(f"straight needs two different points, got {start} and {goal}")
        along = along / np.linalg.norm(along)
        n = self.node_count
        steps = self.edge_length * np.arange(n)
        q = poses.between(np.array([0.0, 0.0, 1.0]), along)
        return RodState(
            start + steps[:, None] * along,
            np.tile(q, (n - 1, 1)),
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
        """Where the rod goes.

        Args:
            state: Start.
            actions: Velocities of the grips, constant over each block.
            dt: Duration of a step [s].
            steps: H; as many as there are blocks, where neither this nor the next is given.
            block_of_step: Block that drives each step, never decreasing; one block a step.
            substeps: Implicit steps per step.
            obstacles: From `lariat.geometry.obstacles.pack`.
        """
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
        buffers = opened(self, states, actions, dt, steps, block_of_step, substeps, obstacles)
        launch(buffers)
        return [rolled(buffers, b, self.properties.length) for b in range(len(states))]

    def linearize(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
        parameters: tuple[str, ...] = (),
        state_directions: StateDirections | None = None,
        with_actions: bool = True,
    ) -> Linearization:
        """The roll-out and how its positions answer actions, parameters and the start.

        Args:
            parameters: Names as in `PARAMETERS`.
            state_directions: Changes of the start whose effect is wanted.
            with_actions: Whether the effect of actions is wanted; long roll-outs have many.
        """
        return self.linearizations(
            [state],
            actions[None],
            dt,
            steps,
            block_of_step,
            substeps,
            obstacles,
            parameters,
            None if state_directions is None else [state_directions],
            with_actions,
        )[0]

    def linearizations(
        self,
        states: Sequence[RodState],
        actions: Float64[np.ndarray, "B K 2 6"],
        dt: float,
        steps: int | None = None,
        block_of_step: Int64[np.ndarray, "H"] | None = None,
        substeps: int = 1,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
        parameters: tuple[str, ...] = (),
        state_directions: Sequence[StateDirections] | None = None,
        with_actions: bool = True,
    ) -> list[Linearization]:
        """`linearize` of several rods in one launch."""
        wanted = Wanted(
            Derivatives.SENSITIVITIES, parameters, with_actions, directions=state_directions
        )
        buffers = opened(
            self, states, actions, dt, steps, block_of_step, substeps, obstacles, wanted
        )
        launch(buffers)
        return [linearized(buffers, b, self.properties.length) for b in range(len(states))]

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
        d_cost_d_positions: Float64[np.ndarray, "H n 3"],
    ) -> Gradient:
        """The roll-out and the gradient of a cost whose slope in its positions is given."""
        return self.gradients(
            [state],
            actions[None],
            dt,
            steps,
            block_of_step,
            substeps,
            obstacles,
            parameters,
            d_cost_d_positions=np.asarray(d_cost_d_positions)[None],
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
        d_cost_d_positions: Float64[np.ndarray, "B H n 3"],
    ) -> list[Gradient]:
        """`gradient` of several rods in one launch."""
        wanted = Wanted(Derivatives.ADJOINT, parameters, cost=d_cost_d_positions)
        buffers = opened(
            self, states, actions, dt, steps, block_of_step, substeps, obstacles, wanted
        )
        launch(buffers)
        length = self.properties.length
        return [slopes(buffers, b, state, length, parameters) for b, state in enumerate(states)]

    def rest(
        self,
        left: Pose,
        right: Pose,
        guess: RodState | None = None,
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
    ) -> Rest:
        """A shape at which the rod stays, between two grips; that of a free end counts for nothing.

        Without a guess it starts from a smooth curve that sags along gravity. A guess keeps its
        own branch: its turns of twist stay in while its grips walk to the wanted ones.

        Raises:
            ValueError: The grips are further apart than the rod between them is long.
        """
        return statics.rest(self, left, right, guess, obstacles)

    def settle(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "K 2 6"],
        durations: Float64[np.ndarray, "K"],
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
    ) -> tuple[Rollout, bool]:
        """Steps of given durations [s] which forget all velocity, and whether the end is stable.

        Long steps walk to equilibrium; the energy never grows while the grips stand still.
        """
        buffers = opened(
            self, [state], actions[None], durations, obstacles=obstacles, carries=False
        )
        launch(buffers)
        report = buffers.section(Section.REPORTS)[0].reshape(-1, REPORT_WIDTH)
        return rolled(buffers, 0, self.properties.length), bool(
            report[-1, ReportRow.DEFINITE] > 0.0
        )
