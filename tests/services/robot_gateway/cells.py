"""Cells and setpoints for the tests of the gateway."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.constraints.motion_constraints import CellBoundaries
from lariat.safety.guard.operator_commands import OperatorCommand
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.validation import ChunkTolerances
from lariat.scenario.sections import Limits
from lariat.trajectory import MotionState, SetpointChunk
from services.robot_gateway.cell import Cell
from services.robot_gateway.drivers.ideal import FixedDriver, IdealDriver
from services.robot_gateway.status import CellStatus
from services.robot_gateway.writer_control import WriterChunk

TICK = 8_000_000
START = 1_000_000_000
ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
BOOT = "gateway-0"
LIMITS = Limits()
TOLERANCES = ChunkTolerances(poses=200, longest_span=10.0)
"""Tolerances of the cells, to which tests send whole ways in one chunk."""


class Driven:
    """Writer of a cell's setpoints, and a person at it."""

    cell: Cell
    report: CellStatus
    now: int
    _sequence: int
    _command: int

    def step(self) -> CellStatus:
        """One tick."""
        raise NotImplementedError

    def run(self, seconds: float) -> CellStatus:
        """Ticks without a message."""
        for _ in range(round(seconds / 0.008)):
            self.step()
        return self.report

    def follow(
        self,
        path: Callable[[float], np.ndarray],
        seconds: float,
        since: int | None = None,
        session: str = "writer",
    ) -> CellStatus:
        """Ticks with a chunk along `path`(s since `since`) at every 20 ms or so."""
        since = since or self.now
        end = self.now + round(seconds * 1e9)
        due = self.now
        while self.now < end:
            if self.now >= due:
                self.send(path, since, session)
                due += 20_000_000
            self.step()
        return self.report

    def send(
        self, path: Callable[[float], np.ndarray], since: int, session: str = "writer"
    ) -> None:
        """One chunk of 0.3 s along the path, with a stop behind it."""
        times = (self.now - since) * 1e-9 + 0.02 * np.arange(16)
        points = stopping(np.array([path(t) for t in times]))
        self.send_points(points.reshape(len(points), -1, 3), session)

    def send_points(
        self,
        points: np.ndarray,
        session: str = "writer",
        sequence: int | None = None,
        **changes: object,
    ) -> None:
        """One chunk of positions of the driven ends: k n 3, 20 ms apart."""
        orientations = np.broadcast_to(ALONG_X, (*points.shape[:-1], 4)).copy()
        values = {
            "start": self.now,
            "dt": 0.02,
            "positions": points,
            "orientations": orientations,
        }
        number = self._sequence if sequence is None else sequence
        self._sequence += 1
        self.cell.take_chunks(
            [WriterChunk(SetpointChunk(**{**values, **changes}), session, number, self.now)]
        )

    def command(self, action: str, **changes: object) -> str:
        """A person's command; the answer, empty when it was carried out."""
        self._command += 1
        values = {
            "id": f"command-{self._command}",
            "boot": BOOT,
            "answers": self.now,
            "action": action,
            "session": self.report.next_session,
            "distance": self.report.approach_distance,
            "angle": self.report.approach_angle,
        }
        self.cell.take_command(OperatorCommand(**{**values, **changes}), self.now)
        return self.step().rejection


class World(Driven):
    """A cell with its clock, and everything that it commanded."""

    def __init__(
        self,
        left: str = "fixed",
        length: float = 0.6,
        obstacles: Sequence[Obstacle] = (TABLE,),
        automatic: bool = True,
        workspace: tuple = ((-0.8, -0.8, 0.01), (0.8, 0.8, 1.2)),
        spacing: float = 0.03,
        regions: tuple[Obstacle, ...] = (),
        simulated: bool = False,
    ) -> None:
        starts = (
            Pose(np.array([-0.2, 0.0, 0.3]), ALONG_X),
            Pose(np.array([0.2, 0.0, 0.3]), ALONG_X),
        )
        drivers = (
            FixedDriver(starts[0]) if left == "fixed" else IdealDriver(starts[0]),
            IdealDriver(starts[1]),
        )
        for driver in drivers:
            driver.reaches_hardware = not simulated
        driven = [k for k, d in enumerate(drivers) if d.moves]
        bodies = gripper_bodies(0.048, 0.012)
        boundaries = CellBoundaries(length, workspace, bodies, spacing=spacing, regions=regions)
        follower = SetpointFollower(LIMITS, boundaries, starts, driven, tolerances=TOLERANCES)
        self.cell = Cell(follower, drivers, starts, BOOT, automatic)
        self.cell.take_scene(obstacles)
        self.now = START
        self.states: list[tuple[int, MotionState]] = []
        self.report: CellStatus = self.run(0.016)
        self._sequence = 0
        self._command = 0

    def step(self) -> CellStatus:
        """One tick."""
        self.now += TICK
        self.report = self.cell.step(self.now)
        self.states.append((self.now, self.cell.follower.state))
        return self.report

    def go_on(self) -> None:
        """Acknowledge a stop, and resume."""
        assert self.command("acknowledge") == ""
        assert self.command("resume") == ""


def stopping(points: np.ndarray, deceleration: float = 1.2) -> np.ndarray:
    """The points with a stop from their last velocity on."""
    rows, velocity = list(points), points[-1] - points[-2]
    while np.max(np.abs(velocity)) > 1e-12:
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        left = np.maximum(speed - deceleration * 0.02**2, 0.0)
        velocity = velocity * left / np.maximum(speed, 1e-12)
        rows.append(rows[-1] + velocity)
    return np.array(rows)


def smooth_step(t: float, duration: float) -> float:
    """From 0 to 1 with rest at both ends."""
    u = min(max(t / duration, 0.0), 1.0)
    return 10 * u**3 - 15 * u**4 + 6 * u**5
