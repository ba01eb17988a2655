"""Commands of recorded trajectories; every file of the options holds the same joint path."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    MOTION_PORT,
    SWITCH,
    TEXT,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.motions import JointMotion

RECORDED_OFFSETS = (0.0, 5.0, -5.0, 0.0)
"""Recorded path: angles of the first joint relative to the arm's start [deg]."""
FILE_MISSING, FILE_UNCHECKED, FILE_VALID = -2, -1, 0
"""Answers of HandleTrajPoints."""
REPLAY_SPEED, REPLAY_ACCELERATION = 0.1, 0.2
"""Fractions of the arm's maximum."""


class TrajectoryFileCommands:
    """Trajectory files of the controller."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        start = np.radians(context.options.joints)
        self._path = [start + np.radians([s, 0, 0, 0, 0, 0]) for s in RECORDED_OFFSETS]
        self._checked = FILE_UNCHECKED

    def table(self) -> Table:
        """Return the commands by name."""
        if self._context.v4:
            replay = (
                option("isconst", "integer", 0, 1),
                option("multi", "number", 0.25, 2),
                option("sample", "number", 8, 1000),
                option("freq", "number", 1e-9, 1),
                *self._context.frame_options,
            )
            return {
                "GetStartPose": Command(self._start_pose, (TEXT,), (Parameter("integer", 1, 2),)),
                "StartPath": Command(self._replay(), (TEXT,), replay, counts=(1,), moves=True),
            }
        return {
            "GetTraceStartPose": Command(self._first("pose"), (TEXT,)),
            "GetPathStartPose": Command(self._first("joints"), (TEXT,)),
            "HandleTrajPoints": Command(self._handle, (), (TEXT,)),
            "StartTrace": self._motion((TEXT,)),
            "StartFCTrace": self._motion((TEXT,)),
            "StartPath": self._motion((TEXT, SWITCH, SWITCH)),
        }

    def _motion(self, required: tuple[Parameter, ...]) -> Command:
        return Command(self._replay(), required, ports=(MOTION_PORT,), moves=True)

    def _check_exists(self, name: str) -> None:
        if name not in self._context.options.traces:
            raise Failure(-1)

    def _first(self, kind: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            self._check_exists(values[0])
            if kind == "joints":
                return self._context.numbers(np.degrees(self._path[0]))
            return self._context.numbers(frames.vector(self._arm.flange(self._path[0])))

        return run

    def _start_pose(self, values: Values, options: NamedValues) -> str:
        """Return the start: joint angles (1) of a recorded path, or a pose (2)."""
        if values[1:] == [2]:
            return f"2,{{{self._first('pose')(values, options)}}}"
        return f"1,{{{self._first('joints')(values, options)}}}"

    def _handle(self, values: Values, options: NamedValues) -> str:
        """Start the check of a file; without one return the result of the last check."""
        del options
        if not values:
            return str(self._checked)
        self._checked = FILE_VALID if values[0] in self._context.options.traces else FILE_MISSING
        return ""

    def _replay(self) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            self._check_exists(values[0])
            speed = REPLAY_SPEED * options.get("multi", 1.0)
            numbers = [
                self._context.queued(
                    lambda j, t=target: JointMotion(j, t, speed, REPLAY_ACCELERATION)
                )
                for target in self._path
            ]
            return numbers[-1]

        return run
