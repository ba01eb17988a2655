"""Gateway service: setpoints, commands and obstacles in, states of the arms out."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_during
from lariat.geometry.obstacles import Obstacle
from lariat.safety.guard.force_limit import ForceLimit
from lariat.safety.guard.scene_guard import SceneGuard
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion_check import boundaries_of
from lariat.scenario import SIDES, Scenario, Side
from lariat.trajectory import NANOSECONDS, SECOND
from services.robot_gateway.cell import Cell
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.factory import drivers_of
from services.robot_gateway.messages import (
    arm_states,
    chunk_of,
    command_of,
    hold_of,
    sign_of_life_of,
    trajectory_of,
)
from services.robot_gateway.state_logger import StateLogger
from services.robot_gateway.writer_control import WriterChunk
from shared import topics
from shared.door import Door
from shared.messages import Scene, SceneMotion, Setpoints, obstacle_motions, scene_obstacles
from shared.runtime.clock import Clock, SystemClock
from shared.runtime.service import Inbox, Publication, Received

MOTION_PERIOD = SECOND // 25
"""Time between two updates of moving obstacles [ns]."""
BRAKING_TIMEOUT = 1.2
"""Longest time to brake and to disable [s]; the launcher kills a service that takes longer."""
REACTION_TIME = 0.25
"""Time by which the places of moving obstacles are kept free in advance [s]: until the next update
and until arms at full speed stand still."""


@dataclass(frozen=True)
class GatewayOptions:
    """Options of the gateway in addition to those of every service."""

    left_emulator: str = ""
    """Host of Lariat's own emulator, which stands in for a left CR5 without an address. Never that
    of a real arm: its cell arms by itself and goes on by itself after a delay of the computer."""
    right_emulator: str = ""
    """Host of Lariat's own emulator at the right end."""


class RobotGatewayService:
    """Steps a cell with the messages of the bus."""

    name = "robot_gateway"
    reads = (
        topics.ARM_SETPOINTS,
        topics.ARM_COMMAND,
        topics.ARM_HOLD,
        topics.ARM_TRAJECTORY,
        topics.ARM_CONSENT,
        topics.ARM_STATE,
        topics.TASK_STATE,
        topics.SCENE_STATE,
        topics.SCENE_MOTION,
    )
    writes = (topics.ARM_STATE,)
    rate = 125.0
    latency = 0.002

    def __init__(
        self,
        cell: Cell,
        scene_guard: SceneGuard,
        scenario: str = "",
        addresses: Mapping[str, str] | None = None,
    ) -> None:
        self.cell = cell
        self.door = Door()
        self._scene_guard = scene_guard
        self._scenario, self._addresses = scenario, dict(addresses or {})
        self._logger = StateLogger()
        self._scene_revision: int | None = None
        self._bodies: tuple[Obstacle, ...] = cell.follower.constraints.obstacles
        """Obstacles of the scene, moving ones where they stand before a run."""
        self._motions: tuple[ObstacleMotion, ...] = ()
        self._moved_at = 0
        """Time at which the moving obstacles were moved last [ns]."""

    def warm_up(self) -> None:
        """Do nothing: the kernels are loaded when the service is built."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Step the cell once."""
        self.cell.stop_if_stalled(now)
        scene = inbox.fresh(topics.SCENE_STATE)
        if scene is not None and scene.message.revision != self._scene_revision:
            self._scene_revision = scene.message.revision
            self._take_scene(scene.message)
        self._move_obstacles(inbox, now)
        for state in inbox.every(topics.ARM_STATE):
            if state.message.boot != self.cell.safety.boot:
                self.cell.take_other_gateway(state.message.boot, state.received)
        # Commands first: setpoints of the same tick do not move what a person stops.
        commands = inbox.every(topics.ARM_COMMAND)
        for command in self.door.converted(topics.ARM_COMMAND.key, commands, command_of):
            self.cell.take_command(command, now)
        # After a person's command of the same tick: a hold wins.
        for hold in self.door.converted(topics.ARM_HOLD.key, inbox.every(topics.ARM_HOLD), hold_of):
            self.cell.take_command(hold, now)
        signs = inbox.every(topics.ARM_CONSENT)
        for sign in self.door.converted(topics.ARM_CONSENT.key, signs, sign_of_life_of):
            self.cell.take_sign_of_life(sign, now)
        goals = inbox.every(topics.ARM_TRAJECTORY)
        for goal in self.door.converted(topics.ARM_TRAJECTORY.key, goals, trajectory_of):
            self.cell.take_trajectory(goal, now)
        self._take_setpoints(inbox.every(topics.ARM_SETPOINTS))
        task = inbox.fresh(topics.TASK_STATE)
        if task is not None and not self.cell.arms.reach_hardware:
            self.cell.take_reset(task.message.reset_count)
        state = arm_states(self.cell.step(now), self.cell.arms.drivers, now)
        state.scenario = self._scenario
        for arm in state.arms:
            arm.address = self._addresses.get(arm.arm, "")
        self._logger.take(state)
        yield Publication(topics.ARM_STATE, state)

    def close(self) -> None:
        """Bring real or emulated arms to rest, then end the connections."""
        if any(driver.live for driver in self.cell.arms.drivers):
            bring_to_rest(self.cell, SystemClock())
        self.cell.close()

    def _take_scene(self, message: Scene) -> None:
        # A scene that is refused leaves the former one.
        with self.door.guard(topics.SCENE_STATE.key) as outcome:
            self._bodies = self._scene_guard.admit(scene_obstacles(message))
        if not outcome.refusal:
            self.cell.take_scene(self._bodies)
            self._moved_at = 0

    def _move_obstacles(self, inbox: Inbox, now: int) -> None:
        """Keep out where moving obstacles are, and where they will be within the reaction time."""
        if (motion := inbox.fresh(topics.SCENE_MOTION)) is not None:
            self._take_motions(motion.message)
        if self._motions and now - self._moved_at >= MOTION_PERIOD:
            self._moved_at = now
            present = now * NANOSECONDS
            self.cell.take_scene(
                obstacles_during(self._bodies, self._motions, present, present + REACTION_TIME)
            )

    def _take_motions(self, message: SceneMotion) -> None:
        motions = self._motions
        with self.door.guard(topics.SCENE_MOTION.key):
            motions = self._scene_guard.admit_motions(obstacle_motions(message))
        if motions != self._motions:
            self._motions, self._moved_at = motions, 0
            if not motions:
                self.cell.take_scene(self._bodies)

    def _take_setpoints(self, arrived: Sequence[Received]) -> None:
        """Take the holds, and the newest chunks."""
        for item in arrived:
            message: Setpoints = item.message
            if message.hold:
                self.cell.take_hold(
                    message.session, message.sequence, item.received, message.reason
                )
        driven = [SIDES[k] for k in self.cell.follower.driven]

        def chunk(item: Received) -> WriterChunk:
            message: Setpoints = item.message
            setpoints = chunk_of(message, driven)
            return WriterChunk(setpoints, message.session, message.sequence, item.received)

        chunks = [item for item in reversed(arrived) if not item.message.hold]
        self.cell.take_chunks(self.door.converted(topics.ARM_SETPOINTS.key, chunks, chunk))


def bring_to_rest(cell: Cell, clock: Clock) -> None:
    """Disarm a cell and step it until its arms report that their drives are off."""
    period = cell.watchdog.settings.period
    cell.disarm()
    begun = clock.now()
    while (clock.now() - begun) * NANOSECONDS < BRAKING_TIMEOUT:
        cell.step(clock.now())
        if cell.follower.resting and not cell.arms.powered:
            break
        time.sleep(period)


def build(
    scenario: Scenario,
    session: str,
    options: GatewayOptions | None = None,
    links: Mapping[Side, Link] | None = None,
) -> RobotGatewayService:
    """Create the gateway of a scenario's cell."""
    options = options or GatewayOptions()
    starts = scenario.grips(scenario.start)
    emulators: dict[Side, str] = {"left": options.left_emulator, "right": options.right_emulator}
    drivers = drivers_of(scenario, starts, emulators, links or {})
    limits = scenario.limits
    driven = [k for k, driver in enumerate(drivers) if driver.moves]
    joints = [drivers[k].joint_constraints for k in driven]
    follower = SetpointFollower(limits, boundaries_of(scenario), starts, driven, joints)
    follower.compile()
    follower.constraints.replace_obstacles(scenario.bodies)
    ends = [scenario.end(side) for side in SIDES]
    arm_automatically = not any(driver.reaches_hardware for driver in drivers) and all(
        end.arm_automatically for end in ends if end.driver != "fixed"
    )
    force = ForceLimit(limits.pull)
    cell = Cell(follower, drivers, starts, session, arm_automatically, force)
    removed = {event.remove_obstacle for event in scenario.events}
    guard = SceneGuard([body for body in scenario.bodies if body.name not in removed])
    addresses = {side: scenario.end(side).address for side in SIDES}
    return RobotGatewayService(cell, guard, scenario.name, addresses)
