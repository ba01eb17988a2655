"""From what the rope does to what the grips shall do: one call for each chunk of setpoints.

What is commanded is the path plus an offset. The path uses a share of the grippers' limits and the
offset the rest, so their sum keeps them; the offset follows the velocities that the optimiser asks
for, jerk-limited. New setpoints take effect at a point of the row a little ahead of now: the model
is first rolled forward to there, along the motion that is already decided.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.rod import Rod
from lariat.rod.xpbd import XpbdRod
from services.controller.estimation.state_estimator import StateEstimate
from services.controller.mpc.gauss_newton import GaussNewton, Horizon, HorizonPlan
from services.controller.mpc.motion import Bounds, Motion, jerk_towards, twist_between
from services.controller.mpc.objective import Surroundings, Weights
from services.controller.mpc.reference_trajectory import PathTrack
from services.controller.mpc.setpoint_stream import Chunk, SetpointRow
from services.controller.paper.paper_control import PaperMethod
from services.controller.paper.policies import Actions, Network
from shared.scenario.sections import Control, Limits

SETPOINT = 20_000_000
"""Between setpoints [ns]."""
DELAY = 30_000_000
"""From inputs to the first point that may still be changed [ns]: the step itself, and one point
because the gateway's curve looks ahead by one."""
OFFSET_SHARE = 0.28
"""Of each limit for the offset; paths use 0.7 (`services.planner.time_parameterization`)."""
LONE_SHARE = 0.85
"""The same when there is no path."""
STOP_SHARE = 0.9
"""Of each limit for the stop at the end of a chunk."""


@dataclass(frozen=True)
class Command:
    """What one call decides."""

    chunk: Chunk
    plan: HorizonPlan
    plan_start: int
    """Time at which the predicted horizon begins [ns]."""


class ControlLoop:
    """Follows a path and brings the rope to the goal at its end."""

    def __init__(
        self,
        estimate: StateEstimate,
        moves: Bool[np.ndarray, "2 6"],
        control: Control,
        limits: Limits,
    ) -> None:
        self.estimate = estimate
        self.control, self.limits = control, limits
        self.moves = moves
        self._rotates = bool(moves[:, 3:].any())
        # Without a path all of the limits is for what the optimiser asks.
        share = OFFSET_SHARE if control.planner else LONE_SHARE
        self.offset_bounds = Bounds.share(limits, share)
        self.optimiser, self.horizon, self.time_step = optimiser(
            control, moves, self.offset_bounds, estimate.rod.node_count
        )
        self.path: PathTrack | None = None
        self.oriented = (False, False)
        """Whether the orientation of each grip is part of the goal."""
        self._row: SetpointRow | None = None
        self._anchor = 0
        self._commit = 0
        self._stepped: int | None = None

    @property
    def rod(self) -> Rod | XpbdRod:
        """The model."""
        return self.estimate.rod

    @property
    def row(self) -> SetpointRow | None:
        """The row of setpoints, while one is running."""
        return self._row

    @property
    def resting(self) -> bool:
        """Whether what is commanded has come to rest."""
        return self._row is None or self._row.resting_from(self._commit)

    @property
    def arrived(self) -> bool:
        """Whether the path has been passed."""
        return self.path is not None and self._commit - self._anchor >= self.path.end

    @property
    def remaining(self) -> Float64[np.ndarray, "t n 3"]:
        """Nodes along what is left of the path [m]."""
        if self.path is None:
            return np.zeros((0, self.rod.node_count, 3))
        return self.path.nodes[min(max(self._commit - self._anchor, 0), self.path.end) :]

    def disengage(self) -> None:
        """Forgets row and path; whoever holds the arms now decides where they stop."""
        self._row, self.path = None, None
        self.optimiser.restart()

    def follow(self, path: PathTrack, now: int) -> None:
        """Begins a path from where the commanded motion rests."""
        if self._row is None:
            bounds = Bounds.share(self.limits, STOP_SHARE)
            here = Motion.at_rest(*self.estimate.motion.grips)
            self._row = SetpointRow(here, now, SETPOINT, bounds)
            self._commit = self._row.index_at(now + DELAY)
        self.path = path
        self._anchor = max(self._commit, self._row.index_at(now + DELAY))
        self.optimiser.restart()

    def strayed(self) -> float:
        """Distance of the measured grips from the commanded ones [m]."""
        if self._row is None:
            return 0.0
        commanded = self._row.motion_at(self.estimate.time).positions
        return float(np.max(np.linalg.norm(self.estimate.motion.positions - commanded, axis=1)))

    def brake(self, now: int) -> Chunk | None:
        """Goes on with the last chunk to its resting end; nothing when no row is running."""
        if self._row is None:
            return None
        self.path = None
        self._commit = max(self._commit, self._row.index_at(now + DELAY))
        return self._row.extended(self._commit, [])

    def step(
        self, now: int, goal: Float64[np.ndarray, "n 3"], surroundings: Surroundings
    ) -> Command:
        """The next chunk along the path; `follow` comes first."""
        row, path = self._row, self.path
        if row is None or path is None:
            raise ValueError("step needs a path; call follow first")
        self._commit = max(self._commit, row.index_at(now + DELAY))
        begins = row.time_of(self._commit)
        base = row.motion(self._commit)
        at = self._commit - self._anchor
        on_path = path.motion(at)
        expected = self._expected(row, begins)
        state = self.estimate.ahead(expected, begins)
        dt, count = self.time_step, self.horizon
        stride = dt / path.dt
        if self._stepped is not None:
            self.optimiser.moved_on((now - self._stepped) * 1e-9)
        self._stepped = now
        velocity = base.velocity - on_path.velocity
        turned = np.zeros((2, 6))
        turned[:, 3:] = twist_between(on_path, base, 1.0)[:, 1]
        oriented = np.zeros((2, 6), dtype=bool)
        oriented[:, 3:] = np.array(self.oriented)[:, None]
        plan = self.optimiser.plan(
            self.rod,
            Horizon(
                state,
                self.estimate.offset,
                path.twists(at, stride, count),
                path.shapes(at, stride, count, goal),
                velocity,
                turned,
                oriented,
                self.estimate.supports,
            ),
            surroundings,
        )
        return Command(row.extended(self._commit, self._led(base, plan)), plan, begins)

    def _expected(self, row: SetpointRow, time: int) -> Motion:
        """Where the arms will be: where they are, moved as is already decided."""
        decided = twist_between(row.motion_at(self.estimate.time), row.motion_at(time), 1.0)
        still = np.zeros((2, 2, 3))
        return self.estimate.motion.moved(decided, still, still)

    def _led(self, base: Motion, plan: HorizonPlan) -> list[Motion]:
        """The path plus an offset whose velocity is led along the plan."""
        path = self.path
        assert path is not None
        dt, step = path.dt, self.time_step
        at = self._commit - self._anchor
        on_path = path.motion(at)
        offset = twist_between(on_path, base, 1.0)
        velocity = base.velocity - on_path.velocity
        acceleration = base.acceleration - on_path.acceleration
        asked = np.concatenate([velocity[None], plan.velocities])
        count = round((len(asked) - 1) * step / dt)
        at_setpoints = np.minimum(np.arange(count + 1) * dt / step, len(asked) - 1.0)
        before = np.minimum(at_setpoints.astype(int), len(asked) - 2)
        share = (at_setpoints - before)[:, None, None, None]
        wanted = (1.0 - share) * asked[before] + share * asked[before + 1]
        changes = np.diff(wanted, axis=0) / dt
        motions = []
        for k in range(1, count + 1):
            jerk = jerk_towards(
                velocity, acceleration, wanted[k - 1], changes[k - 1], self.offset_bounds, dt
            )
            offset = offset + dt * (velocity + dt * (acceleration / 2.0 + dt * jerk / 6.0))
            velocity = velocity + dt * (acceleration + dt * jerk / 2.0)
            acceleration = acceleration + dt * jerk
            here = path.motion(at + k)
            orientations = here.orientations
            if self._rotates:
                turned = poses.multiply(poses.exponential(offset[:, 1]), orientations)
                orientations = poses.normalized(turned)
            motions.append(
                Motion(
                    here.positions + offset[:, 0],
                    orientations,
                    here.velocity + velocity,
                    here.acceleration + acceleration,
                )
            )
        return motions


def optimiser(
    control: Control, moves: Bool[np.ndarray, "2 6"], bounds: Bounds, nodes: int
) -> tuple[GaussNewton | PaperMethod, int, float]:
    """The way to use the horizon, its steps and their duration [s]."""
    paper = control.paper
    count = int(moves.sum())
    match control.method:
        case "gauss_newton":
            weights = Weights(control.speed_weight, control.acceleration_weight)
            method = GaussNewton(
                moves, control.horizon, control.time_step, control.iterations, weights, bounds
            )
            return method, control.horizon, control.time_step
        case "actions":
            policy = Actions(paper.horizon, count)
        case "network":
            policy = Network(nodes, count, paper.learning_rate, seed=0)
    return PaperMethod(policy, paper, moves, bounds), paper.horizon, paper.time_step
