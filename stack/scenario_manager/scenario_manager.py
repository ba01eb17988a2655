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
from lariat.scenario import load
from shared.door import Door
from shared.messages import PAUSED, RUNNING, ArmStates, StackRequest, StackState, TaskState
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


@dataclass
class _Check:
    """Scenario that is being checked."""

    path: Path
    name: str
    """Name for people."""
    process: subprocess.Popen[str]


class ScenarioManager:
    """Scenario that runs, the one that shall follow, and answers to requests."""

    def __init__(
        self,
        library: ScenarioLibrary,
        running: Path,
        staging: Path,
        check: Callable[[Path], Sequence[str]],
        campaigns: Campaigns,
    ) -> None:
        """Take the scenario that runs."""
        self.campaigns = campaigns
        """Campaigns that run beside the cell."""
        self.door = Door()
        """Refuses requests."""
        self._library = library
        self._staging = staging
        self._command = check
        self._running, self._name = running, library.name_of(running) or running.stem
        self._former: tuple[Path, str] | None = None
        self._check: _Check | None = None
        self._staged = 0
        self._activity = ""
        self._answer = ("", "")
        """Id of the last request that was answered and its refusal: one value, since the thread
        that answers is not the one that publishes."""

    def fill(self, state: StackState) -> None:
        """Add scenarios and the answer to the last request to a state of the stack."""
        state.scenario = self._name
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
                    if self._library.find(request.name) == self._running:
                        raise ConfigurationError(f"{request.name} runs; start another one first")
                    self._library.delete(request.name)
                case StackRequest.RUN_CAMPAIGN:
                    self._start_campaign(request)
                case StackRequest.CANCEL_CAMPAIGN:
                    self.campaigns.cancel()
                case _:
                    raise ConfigurationError(f"there is no action {request.action}")
        self._answer = request.id, outcome.refusal

    def poll(self, condition: Callable[[], CellCondition]) -> Path | None:
        """Return the scenario to start now, once its check has ended well."""
        check = self._check
        if check is None or check.process.poll() is None:
            return None
        self._check, self._activity = None, ""
        if check.process.returncode:
            lines = check.process.communicate()[1].strip().splitlines()
            self._refuse(lines[-1] if lines else f"the check of {check.name} has failed")
            return None
        try:
            self._check_condition(condition())
        except ConfigurationError as error:
            self._refuse(str(error))
            return None
        self._former = (self._running, self._name)
        self._running, self._name = check.path, check.name
        self._activity = f"starting {check.name}"
        return check.path

    def confirm_ready(self) -> None:
        """Take note that every process is ready, which ends a start."""
        if self._former is not None:
            self._former, self._activity = None, ""

    def take_failure(self, reason: str) -> Path | None:
        """Return the former scenario after a new cell did not come up; None without one."""
        if self._former is None:
            return None
        self._refuse(f"{self._name} did not start: {reason}; {self._former[1]} runs again")
        (self._running, self._name), self._former = self._former, None
        self._activity = ""
        return self._running

    def close(self) -> None:
        """End a check and a campaign that go on."""
        self.campaigns.close()
        if self._check is not None:
            self._check.process.kill()
            self._check.process.wait()

    def _refuse(self, reason: str) -> None:
        """Refuse the request that was answered last after all."""
        self._answer = self._answer[0], reason

    def _base(self, request: StackRequest) -> Path:
        return self._library.find(request.scenario) if request.scenario else self._running

    def _start_campaign(self, request: StackRequest) -> None:
        """Start a campaign, unless real arms need the processor.

        Raises:
            ConfigurationError: The present cell has real arms, or a trial is not valid.
            OSError: The scenarios of the trials cannot be written.
        """
        if arms := real_arms(load(self._running)):
            raise ConfigurationError(
                f"the present cell has real arms at {', '.join(arms)}, which need the processor; "
                "start a simulated one first"
            )
        path = self._base(request)
        self.campaigns.start(request, path, self._library.name_of(path) or self._name)

    def _begin(self, request: StackRequest, condition: CellCondition) -> None:
        self._check_condition(condition)
        path = self._base(request)
        scenario = requested_scenario(request, path)
        if self.campaigns.running and real_arms(scenario):
            raise ConfigurationError(
                "a campaign goes on, which takes processor time from real arms; cancel it first"
            )
        unconfirmed = set(real_arms(scenario)) - set(request.confirmed)
        if unconfirmed:
            raise ConfigurationError(
                f"the scenario drives real arms at {', '.join(sorted(unconfirmed))}: a person must "
                "confirm them"
            )
        name = self._library.name_of(path) or self._name
        if request.content or request.settings:
            name = scenario.name if request.content else f"{name.removesuffix(CHANGED)}{CHANGED}"
            self._staged += 1
            path = write(scenario, self._staging / str(self._staged), "scenario")
        process = subprocess.Popen(
            self._command(path), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        self._check = _Check(path, name, process)
        self._activity = f"checking {name}"

    def _check_condition(self, condition: CellCondition) -> None:
        """Refuse to end a cell that moves, or whose real arms could.

        Raises:
            ConfigurationError: A run goes on, or real arms are not disarmed.
        """
        task, arms = condition.task, condition.arms
        if task is not None and task.state in (RUNNING, PAUSED):
            raise ConfigurationError("a run goes on; stop it first")
        if arms is not None and arms.approaching:
            raise ConfigurationError("the arms approach their start; stop them first")
        if real_arms(load(self._running)):
            if arms is None:
                raise ConfigurationError("the gateway does not say whether its arms are disarmed")
            if arms.mode != ArmStates.DISARMED:
                raise ConfigurationError("the real arms are armed; disarm them first")


CHANGED = ", changed"
"""Ending of the name of a scenario that was started with changes and not saved."""
