"""Requests for scenarios, and the switch of the stack to another one.

A scenario is checked in a process of its own while the present cell goes on. It is started only
while no run goes on and no real arm is armed; one that drives real arms must be confirmed by their
addresses. Where the new cell does not come up, the stack returns to the former one.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from lariat.configuration import MAX_REASON_LENGTH, ConfigurationError
from lariat.scenario import Scenario, load
from shared.door import Door
from shared.messages import PAUSED, RUNNING, ArmStates, StackRequest, StackState, TaskState
from stack.launcher.process import Program
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary, real_arms, write
from stack.scenario_manager.requested_scenario import requested_scenario


@dataclass(frozen=True)
class CellCondition:
    """What decides whether the present cell may be ended."""

    task: TaskState | None = None
    """Newest state of the task; None before the first."""
    arms: ArmStates | None = None
    """Newest state of the arms; None before the first."""


@dataclass(frozen=True)
class _Cell:
    """Scenario that runs, is checked, or ran before."""

    path: Path
    name: str
    """Name for people."""
    real_arms: Sequence[str]
    """Addresses of its real arms."""
    programs: Sequence[Program]
    """Its processes, which read a copy of the file."""


class ScenarioManager:
    """Scenario that runs, the one that shall follow, and answers to requests."""

    def __init__(
        self,
        library: ScenarioLibrary,
        running: Path,
        staging: Path,
        check: Callable[[Path], Sequence[str]],
        campaigns: Campaigns,
        programs_of: Callable[[Path, Scenario], Sequence[Program]],
    ) -> None:
        """Take the scenario that runs; `programs_of` may take as long as it likes."""
        self.campaigns = campaigns
        """Campaigns that run beside the cell."""
        self.door = Door()
        """Refuses requests."""
        self._library = library
        self._staging = staging
        self._command = check
        self._programs_of = programs_of
        first, name = load(running), library.name_of(running) or running.stem
        self._cell = _Cell(running, name, real_arms(first), programs_of(running, first))
        self._former: _Cell | None = None
        self._check: tuple[_Cell, subprocess.Popen[str]] | None = None
        """Scenario that is being checked, and the process that does it."""
        self._staged = 0
        self._activity = ""
        self._answer = ("", "")
        """Id of the last request that was answered and its refusal: one value, since the thread
        that answers is not the one that publishes."""

    @property
    def name(self) -> str:
        """Name of the scenario that runs, or starts."""
        return self._cell.name

    @property
    def programs(self) -> Sequence[Program]:
        """Programs of the scenario that runs, or starts."""
        return self._cell.programs

    def fill(self, state: StackState) -> None:
        """Add scenarios and the answer to the last request to a state of the stack."""
        state.scenario = self.name
        state.scenarios.extend(self._library.entries)
        state.activity = self._activity
        state.last_request, refusal = self._answer
        state.refusal = refusal[:MAX_REASON_LENGTH]

    def handle(self, request: StackRequest, condition: CellCondition) -> None:
        """Carry out a request, or refuse it."""
        with self.door.guard("a request for a scenario") as outcome:
            if self._activity and request.action != StackRequest.CANCEL_CAMPAIGN:
                raise ConfigurationError(f"{self._activity}; wait for it")
            match request.action:
                case StackRequest.START:
                    self._begin(request, condition)
                case StackRequest.SAVE:
                    scenario = requested_scenario(request, self._base(request))
                    self._library.save(scenario, request.name)
                case StackRequest.DELETE:
                    if self._library.find(request.name) == self._cell.path:
                        raise ConfigurationError(f"{request.name} runs; start another one first")
                    self._library.delete(request.name)
                case StackRequest.RUN_CAMPAIGN:
                    self._start_campaign(request)
                case StackRequest.CANCEL_CAMPAIGN:
                    self.campaigns.cancel()
                case _:
                    raise ConfigurationError(f"there is no action {request.action}")
        self._answer = request.id, outcome.refusal

    def poll(self, condition: Callable[[], CellCondition]) -> bool:
        """Return whether another scenario is to start now, since its check has ended well."""
        if self._check is None:
            return False
        cell, process = self._check
        if process.poll() is None:
            return False
        self._check, self._activity = None, ""
        if process.returncode:
            lines = process.communicate()[1].strip().splitlines()
            self._refuse(lines[-1] if lines else f"the check of {cell.name} has failed")
            return False
        try:
            self._check_condition(condition())
        except ConfigurationError as error:
            self._refuse(str(error))
            return False
        self._former, self._cell = self._cell, cell
        self._activity = f"starting {cell.name}"
        return True

    def confirm_ready(self) -> None:
        """Take note that every process is ready, which ends a start."""
        if self._former is not None:
            self._former, self._activity = None, ""

    def take_failure(self, reason: str) -> bool:
        """Return whether the former scenario is to start, since a new cell did not come up."""
        if self._former is None:
            return False
        self._refuse(f"{self._cell.name} did not start: {reason}; {self._former.name} runs again")
        self._cell, self._former, self._activity = self._former, None, ""
        return True

    def close(self) -> None:
        """End a check and a campaign that go on."""
        self.campaigns.close()
        if self._check is not None:
            self._check[1].kill()
            self._check[1].wait()

    def _refuse(self, reason: str) -> None:
        """Refuse the request that was answered last after all."""
        self._answer = self._answer[0], reason

    def _base(self, request: StackRequest) -> Path:
        return self._library.find(request.scenario) if request.scenario else self._cell.path

    def _start_campaign(self, request: StackRequest) -> None:
        """Start a campaign, unless real arms need the processor."""
        if arms := self._cell.real_arms:
            raise ConfigurationError(
                f"the present cell has real arms at {', '.join(arms)}, which need the processor; "
                "start a simulated one first"
            )
        path = self._base(request)
        self.campaigns.start(request, path, self._library.name_of(path) or self._cell.name)

    def _begin(self, request: StackRequest, condition: CellCondition) -> None:
        self._check_condition(condition)
        path = self._base(request)
        scenario = requested_scenario(request, path)
        arms = real_arms(scenario)
        if self.campaigns.running and arms:
            raise ConfigurationError(
                "a campaign goes on, which takes processor time from real arms; cancel it first"
            )
        unconfirmed = set(arms) - set(request.confirmed)
        if unconfirmed:
            raise ConfigurationError(
                f"the scenario drives real arms at {', '.join(sorted(unconfirmed))}: a person must "
                "confirm them"
            )
        name = self._library.name_of(path) or self._cell.name
        if request.content or request.settings:
            name = scenario.name if request.content else f"{name.removesuffix(CHANGED)}{CHANGED}"
            self._staged += 1
            path = write(scenario, self._staging / str(self._staged), "scenario")
        cell = _Cell(path, name, arms, self._programs_of(path, scenario))
        process = subprocess.Popen(
            self._command(path), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        self._check = cell, process
        self._activity = f"checking {name}"

    def _check_condition(self, condition: CellCondition) -> None:
        """Refuse to end a cell that moves, or whose real arms could."""
        task, arms = condition.task, condition.arms
        if task is not None and task.state in (RUNNING, PAUSED):
            raise ConfigurationError("a run goes on; stop it first")
        if arms is not None and arms.approaching:
            raise ConfigurationError("the arms approach their start; stop them first")
        if self._cell.real_arms:
            if arms is None:
                raise ConfigurationError("the gateway does not say whether its arms are disarmed")
            if arms.mode != ArmStates.DISARMED:
                raise ConfigurationError("the real arms are armed; disarm them first")


CHANGED = ", changed"
"""Ending of the name of a scenario that was started with changes and not saved."""
