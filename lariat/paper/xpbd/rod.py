"""Rod of the paper behind the interface of `lariat.rod.Rod`: roll-outs, gradients, rest.

Source: S. Ying and K. Yamazaki, "Obstacle avoidance shape control of deformable linear objects
with online parameters adaptation based on differentiable simulation", ROBOMECH Journal (2024),
Algorithm 1 with eqs. (2) to (11).

Ends, actions and states are those of `Rod`: the paper's n positions lie between n + 1 orientations,
the outermost of which are those of the grips. The compliances of the constraints (7) at a clamp and
beside it have the weights `CLAMP_WEIGHTS`, as in `Rod`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.paper.xpbd import rest
from lariat.paper.xpbd.launch.inputs import pack_constants, prepare, write_adjoint_seed
from lariat.paper.xpbd.launch.kernel_launch import launch
from lariat.paper.xpbd.launch.outputs import read_gradient, read_positions, read_rollout
from lariat.paper.xpbd.launch.sizes import Sizes
from lariat.paper.xpbd.model import DEFAULT_ITERATIONS, XpbdRodModel
from lariat.paper.xpbd.parameters import PARAMETERS, check_parameters
from lariat.paper.xpbd.properties import XpbdProperties
from lariat.rod import initial_shapes
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers
from lariat.rod.model import End
from lariat.rod.results import Gradient, Rest, Rollout
from lariat.rod.rollout_spec import CostGradient, RolloutSpec
from lariat.rod.state import RodState


class XpbdRod:
    """Rod of n nodes, stepped by Algorithm 1 of the paper (extended position-based dynamics).

    A rod is immutable except for the buffers of its launches: use it from one thread at a time.
    """

    def __init__(
        self,
        properties: XpbdProperties,
        node_count: int,
        left: End = "clamped",
        right: End = "clamped",
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        iterations: int = DEFAULT_ITERATIONS,
    ) -> None:
        """Create a rod.

        Args:
            properties: Parameters of the rope.
            node_count: Number of nodes n, at least 5.
            left: Hold of the end at node 0.
            right: Hold of the end at node n - 1.
            gravity: Gravitational acceleration in the world frame [m/s^2].
            iterations: Number J of sweeps over the constraints in a step.

        Raises:
            ValueError: An argument is out of its range.
        """
        self.model = XpbdRodModel(properties, node_count, left, right, gravity, iterations)
        self._constants = pack_constants(self.model)
        self._pool = BufferPool()

    @property
    def properties(self) -> XpbdProperties:
        """Parameters of the rope."""
        return self.model.properties

    @property
    def node_count(self) -> int:
        """Number of nodes n."""
        return self.model.node_count

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        return self.model.edge_length

    @property
    def left(self) -> End:
        """Hold of the end at node 0."""
        return self.model.left

    @property
    def right(self) -> End:
        """Hold of the end at node n - 1."""
        return self.model.right

    def with_properties(self, properties: XpbdProperties) -> XpbdRod:
        """Return the same rod with other parameters; it shares its buffers with this one."""
        other = XpbdRod.__new__(XpbdRod)
        other.model = replace(self.model, properties=properties)
        other._constants = pack_constants(other.model)
        other._pool = self._pool
        return other

    def straight(self, left_point: Sequence[float], right_point: Sequence[float]) -> RodState:
        """Return the straight rod at rest from one point towards another [m]; as `Rod.straight`."""
        return initial_shapes.straight(self.model, left_point, right_point)

    def rollout(self, spec: RolloutSpec[RodState]) -> Rollout:
        """Simulate the rod.

        Args:
            spec: Roll-out of one rod.

        Returns:
            The motion. Sweeps are counted, not judged: `converged` says only that all numbers are
            finite.

        Raises:
            ValueError: The specification does not fit the rod.
        """
        buffers = self._prepare(spec, with_tape=False)
        launch(buffers, forward=True, backward=False)
        return read_rollout(buffers, 0)

    def gradient(
        self,
        spec: RolloutSpec[RodState],
        d_cost_d_positions: Float64[np.ndarray, "H n 3"] | CostGradient,
        parameters: tuple[str, ...] = PARAMETERS,
    ) -> Gradient:
        """Simulate the rod and differentiate a cost of its positions, back through every sweep.

        Args:
            spec: Roll-out of one rod.
            d_cost_d_positions: Gradient of the cost with respect to the positions [1/m], or a
                function that returns it for the positions of the roll-out; the function is called
                between the forward and the backward launch.
            parameters: Names of the parameters to differentiate in, as in `PARAMETERS`.

        Raises:
            ValueError: The specification does not fit the rod, or a parameter is unknown.
        """
        check_parameters(parameters)
        buffers = self._prepare(spec, with_tape=True)
        stepped = callable(d_cost_d_positions)
        if stepped:
            launch(buffers, forward=True, backward=False)
            d_cost_d_positions = d_cost_d_positions(read_positions(buffers)[0])
        write_adjoint_seed(buffers, np.asarray(d_cost_d_positions, float)[None])
        launch(buffers, forward=not stepped, backward=True)
        return read_gradient(buffers, 0, parameters)

    def rest(
        self,
        left: Pose,
        right: Pose,
        guess: RodState | None = None,
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
        dt: float = 0.01,
    ) -> Rest:
        """Find an equilibrium between two grips; as `Rod.rest`.

        Sweeps that have not converged leave the rod at another shape for every duration of a step.

        Args:
            left: Left grip.
            right: Right grip.
            guess: Shape to start from.
            obstacles: Obstacles from `lariat.geometry.pack`.
            dt: Duration of the steps that leave the shape unchanged [s].

        Raises:
            ValueError: The grips are farther apart than the rod between them is long.
        """
        damped = self.with_properties(rest.heavily_damped(self.properties, dt))
        return rest.find_rest(self.model, damped.rollout, left, right, guess, obstacles, dt)

    def _prepare(self, spec: RolloutSpec[RodState], with_tape: bool) -> LaunchBuffers[Sizes]:
        if spec.is_batch:
            raise ValueError(
                f"the paper's rod rolls out one rod at a time, got a batch of {len(spec.states)}; "
                "roll them out one after the other"
            )
        return prepare(self.model, self._constants, self._pool, spec, with_tape=with_tape)
