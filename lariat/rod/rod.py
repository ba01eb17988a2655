"""Differentiable Cosserat rod: roll-outs, derivatives and equilibria.

Model: geometrically exact Cosserat rod with stretch, shear, bending and twist, on the staggered
grid of Spillmann & Teschner, "CoRdE" (SCA 2007): positions on nodes, a quaternion on every edge.
A step is implicit and minimizes the incremental potential by Newton's method with a banded
factorization; derivatives follow from the implicit function theorem with the same factors.
`lariat.rod.kernels` holds the energy and the solver.

Ends: a grip (p, R) clamps the rod at p along R z: the end node lies at p, and the bends there have
the weights of an end correction (`CLAMP_WEIGHTS`), so that shapes converge to those of the clamped
continuum with the square of the edge length. A pinned end holds its node alone, a free one nothing.
Orientations enter derivatives as rotation vectors in the world frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import overload

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.rod import initial_shapes, statics
from lariat.rod.integration_schemes import Scheme
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.inputs import NO_DERIVATIVES, DerivativeRequest, pack_constants, prepare
from lariat.rod.launch.kernel_launch import Device, check_device, launch
from lariat.rod.launch.layout import REPORT_WIDTH, ReportRow, Section
from lariat.rod.launch.outputs import read_gradients, read_linearizations, read_rollouts
from lariat.rod.launch.sizes import Sizes
from lariat.rod.model import End, ImplicitRodModel
from lariat.rod.parameters import PARAMETERS
from lariat.rod.properties import RodProperties
from lariat.rod.results import Gradient, Linearization, Rest, Rollout
from lariat.rod.rollout_spec import CostGradient, RolloutSpec
from lariat.rod.state import RodState, StateDirections


class Rod:
    """Rod of n nodes, stepped implicitly.

    A rod is immutable except for the buffers of its launches: use it from one thread at a time.
    """

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
        threads: int = 1,
        device: Device | None = None,
    ) -> None:
        """Create a rod.

        Args:
            properties: Material and dimensions.
            node_count: Number of nodes n, at least 5.
            left: Hold of the end at node 0.
            right: Hold of the end at node n - 1.
            gravity: Gravitational acceleration in the world frame [m/s^2].
            tolerance: Largest displacement of a node in the last Newton step of a converged solve
                [m]; without derivatives, in the step after it as predicted from the last two.
            scheme: Time integration: "euler" is of first order, with one solve a step, and never
                adds energy; "sdirk2" is of second order, with two solves a step.
            self_contact: Whether strands of the rod collide with each other. They must not
                approach by a diameter within a step.
            threads: Number of threads that share the rods of a batch; results do not depend on it.
            device: Runtime of Taichi that steps each rod of a batch in a thread of its own: "cuda"
                on a GPU, "taichi-cpu" on all cores. By default machine code on `threads`. The
                search for equilibria always takes the latter.

        Raises:
            ValueError: An argument is out of its range, or the device is not there.
        """
        self.model = ImplicitRodModel(
            properties, node_count, left, right, gravity, tolerance, scheme, self_contact
        )
        if threads < 1:
            raise ValueError(f"threads must be at least 1, got {threads}")
        check_device(device, threads)
        self._constants = pack_constants(self.model)
        self._pool = BufferPool()
        self._threads = threads
        self._device: Device | None = device

    @property
    def properties(self) -> RodProperties:
        """Material and dimensions."""
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

    def with_properties(self, properties: RodProperties) -> Rod:
        """Return the same rod with another material; it shares its buffers with this one."""
        other = Rod.__new__(Rod)
        other.model = replace(self.model, properties=properties)
        other._constants = pack_constants(other.model)
        other._pool = self._pool
        other._threads = self._threads
        other._device = self._device
        return other

    def straight(self, left_point: Sequence[float], right_point: Sequence[float]) -> RodState:
        """Return the straight rod at rest from one point towards another [m].

        The first node lies at `left_point`, the last one at the rod's length from it.

        Raises:
            ValueError: The points coincide or are not finite.
        """
        return initial_shapes.straight(self.model, left_point, right_point)

    @overload
    def rollout(self, spec: RolloutSpec[RodState]) -> Rollout: ...
    @overload
    def rollout(self, spec: RolloutSpec[Sequence[RodState]]) -> list[Rollout]: ...
    def rollout(
        self, spec: RolloutSpec[RodState] | RolloutSpec[Sequence[RodState]]
    ) -> Rollout | list[Rollout]:
        """Simulate the rod.

        Args:
            spec: Roll-out of one rod or of a batch.

        Returns:
            The motion; for a batch, a list of them.

        Raises:
            ValueError: The specification does not fit the rod.
        """
        buffers = self._prepare(spec)
        launch(buffers, self._threads, self._device)
        rollouts = read_rollouts(buffers, self.properties.length, spec.obstacles)
        return rollouts if spec.is_batch else rollouts[0]

    @overload
    def linearize(
        self,
        spec: RolloutSpec[RodState],
        parameters: tuple[str, ...] = (),
        state_directions: StateDirections | None = None,
        with_actions: bool = True,
    ) -> Linearization: ...
    @overload
    def linearize(
        self,
        spec: RolloutSpec[Sequence[RodState]],
        parameters: tuple[str, ...] = (),
        state_directions: Sequence[StateDirections] | None = None,
        with_actions: bool = True,
    ) -> list[Linearization]: ...
    def linearize(
        self,
        spec: RolloutSpec[RodState] | RolloutSpec[Sequence[RodState]],
        parameters: tuple[str, ...] = (),
        state_directions: StateDirections | Sequence[StateDirections] | None = None,
        with_actions: bool = True,
    ) -> Linearization | list[Linearization]:
        """Simulate the rod and differentiate its positions, forward in time.

        Args:
            spec: Roll-out of one rod or of a batch.
            parameters: Names of the parameters to differentiate in, as in `PARAMETERS`.
            state_directions: Directions of the initial state to differentiate along, for each rod
                of a batch.
            with_actions: Whether to differentiate in the actions; long roll-outs have many.

        Returns:
            The motion and its Jacobians; for a batch, a list of them.

        Raises:
            ValueError: The specification does not fit the rod, or a parameter is unknown.
        """
        if isinstance(state_directions, StateDirections):
            state_directions = (state_directions,)
        buffers = self._prepare(
            spec,
            DerivativeRequest(
                Derivatives.SENSITIVITIES, parameters, with_actions, directions=state_directions
            ),
        )
        launch(buffers, self._threads, self._device)
        linearizations = read_linearizations(buffers, self.properties.length, spec.obstacles)
        return linearizations if spec.is_batch else linearizations[0]

    @overload
    def gradient(
        self,
        spec: RolloutSpec[RodState],
        d_cost_d_positions: Float64[np.ndarray, "H n 3"] | CostGradient,
        parameters: tuple[str, ...] = PARAMETERS,
    ) -> Gradient: ...
    @overload
    def gradient(
        self,
        spec: RolloutSpec[Sequence[RodState]],
        d_cost_d_positions: Float64[np.ndarray, "B H n 3"] | CostGradient,
        parameters: tuple[str, ...] = PARAMETERS,
    ) -> list[Gradient]: ...
    def gradient(
        self,
        spec: RolloutSpec[RodState] | RolloutSpec[Sequence[RodState]],
        d_cost_d_positions: Float64[np.ndarray, "*B H n 3"] | CostGradient,
        parameters: tuple[str, ...] = PARAMETERS,
    ) -> Gradient | list[Gradient]:
        """Simulate the rod and differentiate a cost of its positions by the adjoint method.

        Args:
            spec: Roll-out of one rod or of a batch.
            d_cost_d_positions: Gradient of the cost with respect to the positions [1/m], or a
                function that returns it for the positions of the roll-out.
            parameters: Names of the parameters to differentiate in, as in `PARAMETERS`.

        Returns:
            The motion and the gradient; for a batch, a list of them.

        Raises:
            ValueError: The specification does not fit the rod, or a parameter is unknown.
        """
        if callable(d_cost_d_positions):
            motion = self.rollout(spec)
            if isinstance(motion, Rollout):
                positions = motion.positions
            else:
                positions = np.stack([rollout.positions for rollout in motion])
            d_cost_d_positions = d_cost_d_positions(positions)
        seed = np.asarray(d_cost_d_positions)
        if not spec.is_batch:
            seed = seed[None]
        buffers = self._prepare(
            spec, DerivativeRequest(Derivatives.ADJOINT, parameters, d_cost_d_positions=seed)
        )
        launch(buffers, self._threads, self._device)
        gradients = read_gradients(
            buffers, spec.states, self.properties.length, parameters, spec.obstacles
        )
        return gradients if spec.is_batch else gradients[0]

    def rest(
        self,
        left: Pose,
        right: Pose,
        guess: RodState | None = None,
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
    ) -> Rest:
        """Find an equilibrium between two grips.

        A rod that yields goes straight from the set of the guess, by default from none, to that of
        the equilibrium, whatever shapes the search passes; `settle` follows a history.

        Args:
            left: Left grip; without effect if that end is free.
            right: Right grip; without effect if that end is free.
            guess: Shape to start from; its grips move to `left` and `right`, and its turns of
                twist are kept. By default a smooth curve that sags along gravity.
            obstacles: Obstacles from `lariat.geometry.pack`.

        Raises:
            ValueError: The grips are farther apart than the rod between them is long.
        """

        def settle(
            state: RodState,
            actions: Float64[np.ndarray, "H 2 6"],
            durations: Float64[np.ndarray, "H"],
            obstacles: Float64[np.ndarray, "m 13"] | None,
        ) -> tuple[Rollout, bool]:
            return self._settle(state, actions, durations, obstacles, yields_last=True)

        return statics.find_rest(self.model, settle, left, right, guess, obstacles)

    def settle(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "H 2 6"],
        durations: Float64[np.ndarray, "H"],
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
    ) -> tuple[Rollout, bool]:
        """Simulate steps without inertia, which approach an equilibrium.

        The energy never grows while the grips stand still.

        Args:
            state: Initial state; its velocities have no effect.
            actions: Grip velocities in each step, as in `RolloutSpec.actions`.
            durations: Duration of each step [s]; longer steps come closer to the equilibrium.
            obstacles: Obstacles from `lariat.geometry.pack`.

        Returns:
            The motion, and whether its last shape is stable.

        Raises:
            ValueError: An argument does not fit the rod.
        """
        return self._settle(state, actions, durations, obstacles)

    def _settle(
        self,
        state: RodState,
        actions: Float64[np.ndarray, "H 2 6"],
        durations: Float64[np.ndarray, "H"],
        obstacles: Float64[np.ndarray, "m 13"] | None,
        yields_last: bool = False,
    ) -> tuple[Rollout, bool]:
        spec = RolloutSpec(state, actions, 1.0, obstacles=obstacles)
        buffers = self._prepare(spec, durations=durations, yields_last=yields_last)
        launch(buffers)
        report = buffers.section(Section.REPORTS)[0].reshape(-1, REPORT_WIDTH)
        motion = read_rollouts(buffers, self.properties.length, spec.obstacles)[0]
        return motion, bool(report[-1, ReportRow.DEFINITE] > 0.0)

    def _prepare(
        self,
        spec: RolloutSpec[RodState] | RolloutSpec[Sequence[RodState]],
        request: DerivativeRequest = NO_DERIVATIVES,
        durations: Float64[np.ndarray, "H"] | None = None,
        yields_last: bool = False,
    ) -> LaunchBuffers[Sizes]:
        return prepare(
            self.model, self._constants, self._pool, spec, request, durations, yields_last
        )
