"""Recorded trajectories: one joint path per file that the options say the controller has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
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

SWINGS = (0.0, 5.0, -5.0, 0.0)
"""Of the first joint from where the arm was at its start: the recorded path [deg]."""
NOT_THERE, UNKNOWN, GOOD = -2, -1, 0
"""What HandleTrajPoints says of a file: no such one, not asked for yet, in order."""


class Traces:
    """The controller's trajectory files."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller
        start = np.radians(execution.options.joints)
        self._path = [start + np.radians([s, 0, 0, 0, 0, 0]) for s in SWINGS]
        self._checked = UNKNOWN

    def table(self) -> Table:
        """Commands by name."""
        if self._do.v4:
            replay = (
                option("isconst", "integer", 0, 1),
                option("multi", "number", 0.25, 2),
                option("sample", "number", 8, 1000),
                option("freq", "number", 1e-9, 1),
                *self._do.frame_options,
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

    def _known(self, name: str) -> None:
        if name not in self._do.options.traces:
            raise Failure(-1)

    def _first(self, kind: str) -> Callable[[Values, Options], str]:
        def run(values: Values, options: Options) -> str:
            del options
            self._known(values[0])
            if kind == "joints":
                return self._do.numbers(np.degrees(self._path[0]))
            return self._do.numbers(frames.vector(self._arm.flange(self._path[0])))

        return run

    def _start_pose(self, values: Values, options: Options) -> str:
        """A joint point (1) of a recorded path, a pose (2) of one to fit."""
        if values[1:] == [2]:
            return f"2,{{{self._first('pose')(values, options)}}}"
        return f"1,{{{self._first('joints')(values, options)}}}"

    def _handle(self, values: Values, options: Options) -> str:
        """Begins to check a file; without one it says what was found."""
        del options
        if not values:
            return str(self._checked)
        self._checked = GOOD if values[0] in self._do.options.traces else NOT_THERE
        return ""

    def _replay(self) -> Callable[[Values, Options], str]:
        def run(values: Values, options: Options) -> str:
            self._known(values[0])
            share = 0.1 * options.get("multi", 1.0)
            numbers = [
                self._do.queued(lambda j, t=target: JointMotion(j, t, share, 0.2))
                for target in self._path
            ]
            return numbers[-1]

        return run
