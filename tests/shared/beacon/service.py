from __future__ import annotations

import time
from collections.abc import Iterator

from lariat.configuration import ConfigurationError
from lariat.kernel_cache.source import NoCompilerError
from lariat.scenario import Scenario
from shared import topics
from shared.messages import TaskState
from shared.runtime.service import Inbox, Publication
from tests.shared.beacon.options import BeaconOptions


class BeaconService:
    reads = (topics.TASK_REQUEST,)
    writes = (topics.TASK_STATE,)
    rate = 100.0
    latency = 0.0
    longest_step = 0.3

    def __init__(self, scenario: Scenario, session: str, options: BeaconOptions) -> None:
        self.name = options.name
        self.note = f"arms by itself: {scenario.end('left').arm_automatically}"
        if options.woken:
            self.rate = 0.1
            self.wakes = self.reads
        self._session = session
        self._lines_at_end = options.lines_at_end
        self._steps = 0

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        self._steps += 1
        if self._steps % 20 == 0:
            yield Publication(topics.TASK_STATE, TaskState(stamp=now, run=self._session))
        for item in inbox.every(topics.TASK_REQUEST):
            request = item.message
            if request.key == "crash":
                raise RuntimeError(f"asked to by {request.id}")
            if request.key == "linger":
                time.sleep(float(request.value))
            state = TaskState(stamp=now, last_request=request.id, run=self._session)
            if request.key == "refuse":
                state.refusal = "as asked"
            yield Publication(topics.TASK_STATE, state)

    def close(self) -> None:
        for k in range(self._lines_at_end):
            print(f"{k} of {self._lines_at_end} saved", flush=True)
            time.sleep(0.5)
        print("closed in order", flush=True)


def build(scenario: Scenario, session: str, options: BeaconOptions) -> BeaconService:
    if options.build == "refuse":
        raise ConfigurationError("rope.colour = 'mauve' is not one of 'red'")
    if options.build == "library":
        raise ModuleNotFoundError("no mujoco", name="mujoco.mjx")
    if options.build == "compiler":
        raise NoCompilerError("Taichi is not installed")
    if options.build == "crash":
        raise RuntimeError("unexpected")
    return BeaconService(scenario, session, options)
