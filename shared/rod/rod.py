"""The differentiable Cosserat rod: roll-outs, derivatives and equilibria.

Ends: a grip (p, R) clamps the first edge, x_0 = p and x_1 = p + l R z at the left, x_n-1 = p and
x_n-2 = p - l R z at the right; a pinned end holds its outermost node alone; a free one nothing.
Actions are, per block and end (0 left, 1 right), linear velocity [m/s] and angular velocity
[rad/s] of the grip in the world frame. Orientations enter derivatives as tangent vectors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64, Int64

from shared.geometry import poses
from shared.geometry.poses import Pose
from shared.rod import layout, statics
from shared.rod.launch import Launch, Sheet
from shared.rod.layout import Sizes
from shared.rod.parameters import PARAMETERS, numbered
from shared.rod.properties import RodProperties
from shared.rod.scene import unpacked
from shared.rod.schemes import HISTORY, Scheme, time_table
from shared.rod.state import (
    Gradient,
    Linearization,
    Rest,
    RodState,
    Rollout,
    StateDirections,
    StateGradient,
)

End = Literal["free", "pinned", "clamped"]
ENDS: tuple[End, ...] = get_args(End)
_HELD = {"free": 0, "pinned": 1, "clamped": 3}

MAX_ITERATIONS = 1000
OVERSTRETCHED = 1.5
"""Distance between the ends of a state, in lengths, beyond which it is a mistake [-].

Below that it may be a rope that has been pulled, or whose length an estimate has too short.
"""
MAX_SAMPLES = 64


class Rod:
    """A rod of n nodes, stepped implicitly; see `kernels_newton` for its energy."""

    def __init__(
        self,
        properties: RodProperties,
        node_count: int,
        left: End = "clamped",
        right: End = "clamped",
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        tolerance: float = 1e-7,
        scheme: Scheme = "euler",
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
        self.node_count = node_count
        self.left: End = left
        self.right: End = right
        self.gravity = gravity
        self.tolerance = tolerance
        self._launch = Launch()
        self._constants = self._packed_constants()

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        return self.properties.length / (self.node_count - 1)

    def with_properties(self, properties: RodProperties) -> Rod:
        """The same rod of another material; shares buffers with this one."""
        other = Rod.__new__(Rod)
        other.__dict__.update(self.__dict__)
        other.properties = properties
        other._constants = other._packed_constants()
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
            obstacles: From `shared.geometry.obstacles.pack`.
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
        sheet = self._run(states, actions, dt, steps, block_of_step, substeps, obstacles)
        return [self._rollout(sheet, b) for b in range(len(states))]

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
        sheet = self._run(
            states,
            actions,
            dt,
            steps,
            block_of_step,
            substeps,
            obstacles,
            parameters,
            layout.WANT_SENSITIVITIES,
            directions=state_directions,
            with_actions=with_actions,
        )
        n, sizes = self.node_count, sheet.sizes
        driven, blocks = 6 * sizes.driven, sizes.driven // 2
        steady = driven + 6 * -(-sizes.parameters // 6)
        answers = []
        for b in range(len(states)):
            out = sheet.section(layout.AT_SENSITIVITIES_OUT)[b].reshape(sizes.horizon, n, 3, -1)
            answers.append(
                Linearization(
                    self._rollout(sheet, b),
                    out[..., :driven].reshape(sizes.horizon, n, 3, blocks, 2, 6).copy(),
                    out[..., driven : driven + len(parameters)].copy(),
                    out[..., steady : steady + sizes.directions].copy(),
                )
            )
        return answers

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
        sheet = self._run(
            states,
            actions,
            dt,
            steps,
            block_of_step,
            substeps,
            obstacles,
            parameters,
            layout.WANT_ADJOINT,
            d_cost_d_positions,
        )
        blocks = sheet.sizes.blocks
        return [
            Gradient(
                self._rollout(sheet, b),
                sheet.section(layout.AT_ACTIONS_OUT)[b].reshape(blocks, 2, 6).copy(),
                self._state_gradient(sheet, b, float(sheet.section(layout.AT_TIMES)[b, 0])),
                dict(
                    zip(
                        parameters,
                        sheet.section(layout.AT_PARAMETERS_OUT)[b].tolist(),
                        strict=True,
                    )
                ),
            )
            for b in range(len(states))
        ]

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
        sheet = self._run(
            [state], actions[None], durations, None, None, 1, obstacles, carries=False
        )
        report = sheet.section(layout.AT_REPORT)[0].reshape(-1, layout.REPORT_WIDTH)
        return self._rollout(sheet, 0), bool(report[-1, 3] > 0.0)

    def _packed_constants(self) -> Float64[np.ndarray, "k"]:
        """Scalars, node masses and bends, in the order of their sections."""
        p, n, length = self.properties, self.node_count, self.edge_length
        scalars = np.zeros(layout.SCALAR_COUNT)
        scalars[layout.STRETCH] = p.stretch_stiffness
        scalars[layout.DAMPING] = p.damping
        scalars[layout.INTERNAL_DAMPING] = p.internal_damping
        scalars[layout.EDGE_LENGTH] = length
        scalars[layout.GRAVITY_X : layout.GRAVITY_Z + 1] = self.gravity
        scalars[layout.CONTACT_STIFFNESS] = p.effective_contact_stiffness
        scalars[layout.CONTACT_REACH] = p.diameter / 2.0 + p.contact_margin
        scalars[layout.CONTACT_MARGIN] = p.contact_margin
        scalars[layout.TOLERANCE] = self.tolerance
        scalars[layout.BENDING] = p.bending_stiffness
        scalars[layout.TWISTING] = p.twisting_stiffness
        scalars[layout.DENSITY] = p.linear_density
        # Of a solid cylinder: rho I = linear density times r^2 / 4, twice that about its axis.
        scalars[layout.INERTIA_BEND] = p.linear_density * length * p.diameter**2 / 16.0
        scalars[layout.INERTIA_TWIST] = 2.0 * scalars[layout.INERTIA_BEND]
        masses = p.linear_density * length * p.density_at(n)
        masses[[0, -1]] *= 0.5
        bends = np.empty((n - 2, 6))
        bends[:, :2] = p.bending_stiffness / length
        bends[:, 2] = p.twisting_stiffness / length
        bends[:, :3] *= p.profile_at(n - 2)[:, None]
        bends[:, 3:] = p.rest_curvature_at(n - 2) * length
        return np.concatenate([scalars, masses, bends.ravel()])

    def _run(
        self,
        states: Sequence[RodState],
        actions: Float64[np.ndarray, "B K 2 6"],
        dt: float | Float64[np.ndarray, "K"],
        steps: int | None,
        block_of_step: Int64[np.ndarray, "H"] | None,
        substeps: int,
        obstacles: Float64[np.ndarray, "m 12"] | None,
        parameters: tuple[str, ...] = (),
        want: int = 0,
        cost: Float64[np.ndarray, "B H n 3"] | None = None,
        *,
        carries: bool = True,
        directions: Sequence[StateDirections] | None = None,
        with_actions: bool = True,
    ) -> Sheet:
        n = self.node_count
        actions = np.asarray(actions, float)
        if actions.ndim != 4 or actions.shape[2:] != (2, 6) or len(actions) != len(states):
            raise ValueError(
                f"actions must be (blocks, 2 ends, 6), got shape {actions.shape[1:]} for "
                f"{len(states)} rod(s)"
            )
        blocks = actions.shape[1]
        if block_of_step is None:
            horizon = steps or blocks
            block_of_step = np.minimum(np.arange(horizon), blocks - 1)
        block_of_step = np.asarray(block_of_step, dtype=np.int64)
        horizon = len(block_of_step)
        _check(states, actions, dt, steps, block_of_step, substeps, n)
        for state in states:
            apart = float(np.linalg.norm(state.positions[-1] - state.positions[0]))
            if apart > OVERSTRETCHED * self.properties.length:
                raise ValueError(
                    f"the ends of the state are {apart:.4f} m apart but the rod is "
                    f"{self.properties.length} m long; bring them together"
                )
        numbers = numbered(parameters, self.properties)
        columns = [] if directions is None else [d.checked(n) for d in directions]
        if columns and len({len(d.positions) for d in columns} | {len(columns), len(states)}) > 2:
            raise ValueError("state_directions must be as many for each state")
        rows = np.zeros((0, layout.OBSTACLE_WIDTH)) if obstacles is None else unpacked(obstacles)
        times = time_table(self.scheme if carries else "still", dt, horizon, substeps)
        sizes = Sizes(
            len(states),
            n,
            len(times),
            horizon,
            blocks,
            len(rows),
            len(parameters),
            len(columns[0].positions) if columns else 0,
            2 * blocks if with_actions else 0,
            want,
            HISTORY[self.scheme] if carries else 1,
        )
        sheet = self._launch.open(sizes, block_of_step, numbers)
        integers = sheet.integers
        integers[layout.FIRST_FREE] = _HELD[self.left]
        integers[layout.END_FREE] = 2 * n - 1 - _HELD[self.right]
        integers[layout.LEFT], integers[layout.RIGHT] = (
            ENDS.index(self.left),
            ENDS.index(self.right),
        )
        integers[layout.MAX_ITERATIONS] = MAX_ITERATIONS
        integers[layout.SAMPLES] = min(
            MAX_SAMPLES, max(1, int(np.ceil(2.0 * self.edge_length / self.properties.diameter)))
        )
        rods = sheet.doubles[: sheet.stride * sizes.batch].reshape(sizes.batch, -1)
        rods[:, : len(self._constants)] = self._constants
        if parameters:
            # What a step leaves unsolved counts a hundred times more in these derivatives.
            rods[:, layout.TOLERANCE] = 0.01 * self.tolerance
        sheet.section(layout.AT_TIMES)[:] = times.ravel()
        sheet.section(layout.AT_ACTIONS)[:] = actions.reshape(sizes.batch, -1)
        positions = sheet.section(layout.AT_POSITIONS).reshape(sizes.batch, -1, n, 3)
        positions = positions[:, : layout.NEW]
        orientations = sheet.section(layout.AT_ORIENTATIONS).reshape(sizes.batch, -1, n - 1, 4)
        orientations = orientations[:, : layout.NEW]
        for b, state in enumerate(states):
            positions[b, -2] = state.velocities
            positions[b, -1] = state.positions
            orientations[b, -2, :, :3] = state.angular_velocities
            orientations[b, -1] = state.orientations
        if want & layout.WANT_SENSITIVITIES:
            sheet.section(layout.AT_SENSITIVITIES)[:] = 0.0
            sheet.section(layout.AT_SENSITIVITIES_OUT)[:] = 0.0
            h = float(times[0, layout.DURATION])
            for b, (state, along) in enumerate(zip(states, columns, strict=False)):
                self._start_columns(sheet, b, state, along, h)
        if want & layout.WANT_ADJOINT:
            cost = np.asarray(cost, float)
            if cost.shape != (sizes.batch, horizon, n, 3):
                raise ValueError(
                    f"d_cost_d_positions must be ({horizon} steps, {n} nodes, 3), got shape "
                    f"{cost.shape[1:]}"
                )
            if not np.all(np.isfinite(cost)):
                raise ValueError("d_cost_d_positions holds a number that is not finite")
            for name in (layout.AT_ADJOINT, layout.AT_ACTIONS_OUT, layout.AT_PARAMETERS_OUT):
                sheet.section(name)[:] = 0.0
            sheet.section(layout.AT_COST)[:] = cost.reshape(sizes.batch, -1)
        sheet.obstacles()[:] = rows
        sheet.run()
        return sheet

    def _start_columns(
        self, sheet: Sheet, b: int, state: RodState, along: StateDirections, h: float
    ) -> None:
        """Write the directions into the sensitivities of the start and of the time before it."""
        n, sizes = self.node_count, sheet.sizes
        groups = -(-sizes.directions // 6)
        tail = np.zeros((6 * groups, layout.NEW, 2 * n, 3))
        new, old = tail[: sizes.directions, -1], tail[: sizes.directions, 0]
        new[:, ::2], old[:, ::2] = along.positions, along.positions - h * along.velocities
        # Before the start an edge was at exp(-h omega) q.
        turned_by = _jacobian(h * state.angular_velocities, along.angular_velocities)
        back = poses.conjugate(state.orientations)
        new[:, 1:-1:2] = poses.rotate(back, along.rotations)
        old[:, 1:-1:2] = poses.rotate(back, along.rotations - h * turned_by)
        tail[:, 1:-1] = tail[:, :1]
        rows = tail[:, :, :-1].reshape(groups, 6, layout.NEW, 2 * n - 1, 3)
        rows = rows.transpose(0, 2, 3, 4, 1).reshape(groups, layout.NEW, -1)
        columns = sheet.section(layout.AT_SENSITIVITIES)[b].reshape(
            sizes.columns, -1, rows.shape[2]
        )
        columns[-groups:, : layout.NEW] = rows

    def _rollout(self, sheet: Sheet, b: int) -> Rollout:
        n, sizes = self.node_count, sheet.sizes
        every = sizes.steps // sizes.horizon
        positions = sheet.section(layout.AT_POSITIONS)[b].reshape(-1, n, 3)
        positions = positions[layout.NEW - 1 + every :: every]
        orientations = sheet.section(layout.AT_ORIENTATIONS)[b].reshape(-1, n - 1, 4)
        orientations = orientations[layout.NEW - 1 + every :: every]
        report = sheet.section(layout.AT_REPORT)[b].reshape(sizes.horizon, every, -1)
        positions, orientations = positions.copy(), orientations.copy()
        return Rollout(
            positions,
            orientations,
            RodState(
                positions[-1],
                orientations[-1],
                sheet.section(layout.AT_TARGETS)[b].reshape(n, 3).copy(),
                sheet.section(layout.AT_TENSIONS)[b].reshape(n - 1, 3).copy(),
            ),
            report[:, :, 0].sum(axis=1).astype(np.int64),
            np.all(report[:, :, 1] > 0.0, axis=1),
            self.properties.length,
        )

    def _state_gradient(self, sheet: Sheet, b: int, h: float) -> StateGradient:
        n = self.node_count
        adjoint = sheet.section(layout.AT_ADJOINT)[b].reshape(-1, 3 * (2 * n - 1))[: layout.NEW]
        older, old = (
            np.append(row, np.zeros(3)).reshape(n, 2, 3)
            for row in (adjoint[:-1].sum(0), adjoint[-1])
        )
        orientations = sheet.section(layout.AT_ORIENTATIONS)[b].reshape(-1, n - 1, 4)
        q0, q1 = orientations[layout.NEW - 2 : layout.NEW]
        # Before the start an edge was at exp(-h omega) q1: it turns along, and against omega.
        turns = old[:-1, 1] + older[:-1, 1]
        omega = poses.logarithm(poses.multiply(q1, poses.conjugate(q0))) / h
        pull = poses.rotate(q1, older[:-1, 1])
        return StateGradient(
            old[:, 0] + older[:, 0],
            poses.rotate(q1, turns),
            -h * older[:, 0],
            -h * _jacobian(-h * omega, pull),
        )


def _jacobian(
    y: Float64[np.ndarray, "m 3"], v: Float64[np.ndarray, "*b m 3"]
) -> Float64[np.ndarray, "*b m 3"]:
    """J_l(y) v, where exp(y + dy) = exp(J_l(y) dy) exp(y); it is also J_r(y)^T v."""
    t = np.linalg.norm(y, axis=1, keepdims=True)
    small = t < 1e-4
    safe = np.where(small, 1.0, t)
    a = np.where(small, 0.5 - t**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    b = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    turned = np.cross(y, v)
    return v + a * turned + b * np.cross(y, turned)


def _check(
    states: Sequence[RodState],
    actions: Float64[np.ndarray, "B K 2 6"],
    dt: float | Float64[np.ndarray, "K"],
    steps: int | None,
    block_of_step: Int64[np.ndarray, "H"],
    substeps: int,
    n: int,
) -> None:
    """Refuse what no kernel should see, by name."""
    if not np.all(np.asarray(dt, float) > 0.0) or not np.all(np.isfinite(dt)):
        raise ValueError(f"dt must be positive, got {dt} s; try 0.01")
    if substeps < 1:
        raise ValueError(f"substeps must be at least 1, got {substeps}")
    if not np.all(np.isfinite(actions)):
        raise ValueError("actions hold a number that is not finite; were they clipped?")
    horizon, blocks = len(block_of_step), actions.shape[1]
    if horizon < 1 or (steps is not None and steps != horizon):
        raise ValueError(
            f"block_of_step must name a block for each of the {steps} steps, got {horizon}"
        )
    if block_of_step[0] < 0 or block_of_step[-1] >= blocks or np.any(np.diff(block_of_step) < 0):
        raise ValueError(
            f"block_of_step must rise from 0 to at most {blocks - 1}, got {block_of_step}"
        )
    for state in states:
        for name, rows, width in (
            ("positions", n, 3),
            ("orientations", n - 1, 4),
            ("velocities", n, 3),
            ("angular_velocities", n - 1, 3),
        ):
            value = getattr(state, name)
            if np.shape(value) != (rows, width):
                raise ValueError(
                    f"state.{name} must be ({rows}, {width}), got {np.shape(value)}; this rod "
                    f"has {n} nodes"
                )
            if not np.all(np.isfinite(value)):
                raise ValueError(f"state.{name} holds a number that is not finite")
        if np.any(np.abs(np.linalg.norm(state.orientations, axis=1) - 1.0) > 1e-3):
            raise ValueError("state.orientations must be unit quaternions; normalise them")
