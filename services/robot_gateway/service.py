"""The only door to the arms: setpoints, commands and obstacles in, what the arms do out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from lariat.geometry.grippers import gripper_bodies
from lariat.trajectory import NANOSECONDS, SetpointChunk
from services.robot_gateway.cell import Cell
from services.robot_gateway.constraints.motion_constraints import Boundaries
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.factory import drivers_of
from services.robot_gateway.motion.follower import Guidance
from services.robot_gateway.safety.force_limit import Pulls
from services.robot_gateway.safety.shutdown import bring_to_rest
from services.robot_gateway.safety.state_logger import Journal
from services.robot_gateway.safety.state_machine import Action, Command
from services.robot_gateway.status import CellReport
from shared import topics
from shared.clock import SystemClock
from shared.messages import ArmCommand, ArmState, ArmStates, Setpoints, scene_obstacles
from shared.scenario import SIDES, Scenario, Side
from shared.service import Inbox, Publication

ACTIONS: dict[int, Action] = {
    ArmCommand.ARM: "arm",
    ArmCommand.DISARM: "disarm",
    ArmCommand.HOLD: "hold",
    ArmCommand.ACKNOWLEDGE: "acknowledge",
    ArmCommand.GRIPPER: "gripper",
}
MODES = {
    "disarmed": ArmStates.DISARMED,
    "armed": ArmStates.ARMED,
    "moving": ArmStates.MOVING,
    "holding": ArmStates.HOLDING,
    "fault": ArmStates.FAULT,
}


@dataclass(frozen=True)
class GatewayOptions:
    """What the gateway takes on its command line beside what every service does."""

    left_emulator: str = ""
    """Host of the emulator that plays a left CR5 without an address."""
    right_emulator: str = ""
    """Host of the emulator that plays a right CR5 without an address."""


class RobotGatewayService:
    """Steps a cell with what the bus brings."""

    name = "robot_gateway"
    reads = (topics.ARM_SETPOINTS, topics.ARM_COMMAND, topics.TASK_STATE, topics.SCENE_STATE)
    writes = (topics.ARM_STATE,)
    rate = 125.0
    latency = 0.002

    def __init__(self, cell: Cell, simulated: bool) -> None:
        """Args: simulated: Whether a reset may put the ends back to the start."""
        self.cell = cell
        self.simulated = simulated
        self._journal = Journal()
        self._scene_revision: int | None = None

    def warm_up(self) -> None:
        """Nothing is compiled here."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """One tick of the cell."""
        self.cell.wake(now)
        scene = inbox.fresh(topics.SCENE_STATE)
        if scene is not None and scene.message.revision != self._scene_revision:
            self._scene_revision = scene.message.revision
            self.cell.take_scene(scene_obstacles(scene.message))
        # Commands first: what a person stops is not moved by setpoints of the same tick.
        for command in inbox.every(topics.ARM_COMMAND):
            self.cell.take_command(command_of(command.message), now)
        for setpoints in inbox.every(topics.ARM_SETPOINTS):
            self._take_setpoints(setpoints.message, setpoints.received)
        task = inbox.fresh(topics.TASK_STATE)
        if task is not None and self.simulated:
            self.cell.take_reset(task.message.reset_count)
        state = self._state(self.cell.step(now), now)
        self._journal.take(state)
        yield Publication(topics.ARM_STATE, state)

    def close(self) -> None:
        """Brings arms on a wire to rest before the process ends."""
        if any(driver.live for driver in self.cell.arms.drivers):
            bring_to_rest(self.cell, SystemClock())
        self.cell.close()

    def _take_setpoints(self, message: Setpoints, received: int) -> None:
        if message.hold:
            self.cell.take_hold(message.session, message.sequence, received, message.reason)
            return
        names = [SIDES[k] for k in self.cell.guidance.driven]
        chunk = chunk_of(message, names)
        self.cell.take_chunk(chunk, message.session, message.sequence, received)

    def _state(self, report: CellReport, now: int) -> ArmStates:
        safety = report.safety
        return ArmStates(
            stamp=now,
            boot=safety.boot,
            mode=MODES[safety.mode],
            reason=safety.detail,
            rule=report.rule or "",
            needs_acknowledgement=safety.needs_acknowledgement,
            session=safety.session,
            sequence=report.sequence,
            refused_sequence=report.refused_sequence,
            last_command=report.command,
            refusal=report.rejection or report.refusal,
            arms=list(self._arms(report)),
            braking=report.braking,
            reset_count=report.reset_count,
            cause=safety.cause,
        )

    def _arms(self, report: CellReport) -> Iterator[ArmState]:
        for side, driver, feedback, error in zip(
            SIDES, self.cell.arms.drivers, report.arms, report.tracking, strict=True
        ):
            state = ArmState(
                arm=side,
                driver=driver.name,
                linear_velocity=feedback.velocity[0],
                angular_velocity=feedback.velocity[1],
                joints=feedback.joints,
                gripper_closed=feedback.gripper_closed,
                alarms=feedback.alarms,
                tracking_error=error,
                link_age=feedback.age,
                mode=feedback.mode,
                link_rate=feedback.link_rate,
                link_gap=feedback.link_gap,
                pull=feedback.pull,
            )
            if feedback.pose is not None:
                state.position.extend(feedback.pose.position)
                state.orientation.extend(feedback.pose.orientation)
            yield state


def build(
    scenario: Scenario,
    session: str,
    options: GatewayOptions | None = None,
    links: Mapping[Side, Link] | None = None,
) -> RobotGatewayService:
    """Create the gateway of a scenario's cell.

    Args:
        scenario: The cell.
        session: Boot id of this start.
        options: Hosts of emulated arms.
        links: Links to arms that the caller provides, used in place of hosts and addresses.

    Raises:
        ConfigurationError: An arm's start is out of its reach, or nothing says where the arm is.
    """
    options = options or GatewayOptions()
    starts = scenario.grips(scenario.start)
    emulators: dict[Side, str] = {"left": options.left_emulator, "right": options.right_emulator}
    drivers = drivers_of(scenario, starts, emulators, links or {})
    limits = scenario.limits
    boundaries = Boundaries(
        rope_length=scenario.rope.length,
        workspace=limits.workspace,
        bodies=gripper_bodies(limits.gripper_reach, limits.gripper_radius),
        keep_out=limits.keep_out,
        spacing=limits.spacing,
        overstretch=limits.overstretch,
    )
    driven = [k for k, driver in enumerate(drivers) if driver.moves]
    postures = [drivers[k].posture for k in driven]
    guidance = Guidance(limits, boundaries, starts, driven, postures)
    guidance.rules.replace_obstacles(scenario.bodies)
    pulls = Pulls(limits.pull)
    ends = [scenario.end(side) for side in SIDES]
    real = any(end.address for end in ends)
    alone = not real and all(end.arm_automatically for end in ends if end.driver != "fixed")
    cell = Cell(guidance, drivers, starts, session, alone, pulls)
    return RobotGatewayService(cell, simulated=not real)


def chunk_of(message: Setpoints, names: list[str]) -> SetpointChunk:
    """Setpoints for the named ends, in their order; checked by the cell, not here.

    Lists that do not fit together become empty ones, which no rule lets pass.
    """
    given = {arm.arm: arm for arm in message.arms}
    columns = []
    for name in names:
        arm = given.get(name)
        p = np.array(arm.positions if arm else [], dtype=float)
        q = np.array(arm.orientations if arm else [], dtype=float)
        columns.append((p.reshape(-1, 3) if p.size % 3 == 0 else p[:0].reshape(-1, 3), q))
    count = len(columns[0][0]) if columns else 0
    fits = all(len(p) == count and q.size == 4 * count for p, q in columns)
    shape = (count if fits else 0, len(names))
    positions, orientations = np.zeros((*shape, 3)), np.zeros((*shape, 4))
    if fits:
        for k, (p, q) in enumerate(columns):
            positions[:, k], orientations[:, k] = p, q.reshape(-1, 4)
    return SetpointChunk(message.t0, message.dt * NANOSECONDS, positions, orientations)


def command_of(message: ArmCommand) -> Command:
    """A person's command."""
    return Command(
        message.id,
        message.boot,
        message.expires,
        ACTIONS[message.action],
        message.arm,
        message.close,
    )
