"""Task: the goal, the state of the run and the requests that change them."""

from __future__ import annotations

from dataclasses import dataclass, field

from lariat.configuration import ConfigurationError
from lariat.control.run import live_settings
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.state_machine import ACTIVE, RunEvent, RunState, accepts, next_state
from lariat.scenario import Goal


class RequestRefused(ValueError):
    """Refusal of a request, with the reason for the person who made it."""


@dataclass
class Task:
    """Goal, state and settings; `revision` grows with every change."""

    goal: Goal
    settings: dict[str, str] = field(default_factory=dict)
    """Texts of the settings that act at once, by their keys in the section `control`."""
    resettable: bool = True
    """Whether the cell is a simulation, which can return to its start."""
    state: RunState = RunState.IDLE
    reason: Reason = Reason(ReasonCode.WAITING_FOR_START)
    """Reason of the state."""
    revision: int = 1
    """Number of changes."""
    goal_revision: int = 1
    """Number of goals."""
    replan_count: int = 0
    """Number of requests for a path."""
    clearance_margin: float = 0.0
    """Clearance that the next path keeps beyond the scenario's [m]."""
    usual_pace: float = 1.0
    """Share of the usual limits that a run's first path uses [-]."""
    pace: float = 1.0
    """Share of the usual limits that the next path uses [-]."""
    reset_count: int = 0
    """Number of resets, those of controllers before this one included; 0 while it is not known."""
    restore_count: int = 1
    """Number of times that the scenario's goal and obstacles have been restored, plus one."""
    run: str = ""
    """Name of the present or last run."""
    run_count: int = 0
    """Number of runs."""
    run_started: int = 0
    """Start of the run [ns]; 0 before the first one."""
    last_request: str = ""
    """Id of the request that was handled last."""
    refusal: str = ""
    """Reason why it was refused; empty when it was carried out."""

    @property
    def adapts(self) -> bool:
        """Whether the rope's material is learnt."""
        return self.settings.get("adapt") == "true"

    @property
    def active(self) -> bool:
        """Whether the arms are controlled."""
        return self.state in ACTIVE

    def accepts(self, event: RunEvent) -> bool:
        """Whether an event changes the present state."""
        return accepts(self.state, event)

    def apply(self, event: RunEvent, code: ReasonCode, **detail: object) -> None:
        """Go to the state after an event.

        Args:
            event: Event that the present state accepts.
            code: Reason of the new state.
            **detail: Detail of the reason.

        Raises:
            ValueError: The present state does not accept the event.
        """
        changed = next_state(self.state, event), Reason(code, detail)
        if changed != (self.state, self.reason):
            self.state, self.reason = changed
            self.revision += 1

    def answer(self, request: str, refusal: str = "") -> None:
        """Record how a request ended.

        Args:
            request: Id of the request.
            refusal: Reason why it was refused; empty when it was carried out.
        """
        self.last_request, self.refusal = request, refusal
        self.revision += 1

    def set_goal(self, goal: Goal) -> None:
        """Replace the goal; a run goes on towards it, one that has ended waits for a start."""
        self.goal = goal
        self.goal_revision += 1
        self.request_path()
        if self.accepts(RunEvent.NEW_GOAL):
            self.apply(RunEvent.NEW_GOAL, ReasonCode.WAITING_FOR_START)

    def request_path(self) -> None:
        """Ask the planner for a path from the present configuration."""
        self.replan_count += 1
        self.revision += 1

    def start(self, now: int) -> None:
        """Begin a run, or resume a paused one.

        Args:
            now: Present time [ns].

        Raises:
            RequestRefused: A run is under way.
        """
        if not self.accepts(RunEvent.START):
            raise RequestRefused("already running; stop or pause first")
        if self.state is not RunState.PAUSED:
            self.run_count += 1
            self.run = f"run-{self.run_count}"
            self.run_started = now
        self.apply(RunEvent.START, ReasonCode.STARTED)

    def pause(self) -> None:
        """Hold until a start.

        Raises:
            RequestRefused: No run is under way.
        """
        if not self.accepts(RunEvent.PAUSE):
            raise RequestRefused(
                f"cannot pause while {self.state.name.lower()}; only a run can be paused"
            )
        self.apply(RunEvent.PAUSE, ReasonCode.PAUSE_REQUESTED)

    def stop(self) -> None:
        """End the run."""
        self.apply(RunEvent.STOP, ReasonCode.STOP_REQUESTED)

    def take_reset_count(self, count: int) -> None:
        """Go on from the count of resets that the gateway states.

        A controller that replaces another one learns it there: a count that begins again would be
        another reset.

        Args:
            count: Reset that the gateway carried out last; 0 where it knows none.
        """
        latest = max(self.reset_count, count, 1)
        if latest != self.reset_count:
            self.reset_count = latest
            self.revision += 1

    def reset(self) -> None:
        """Ask sim and gateway to return to the scenario's start.

        Raises:
            RequestRefused: The cell is no simulation.
        """
        if not self.resettable:
            raise RequestRefused(
                "only a simulation can be reset; move the arm by hand and set a goal"
            )
        self.reset_count += 1
        self.apply(RunEvent.RESET, ReasonCode.RESET_REQUESTED)
        self.request_path()

    def restore(self, goal: Goal) -> None:
        """Reset, and ask perception to restore the obstacles of the scenario.

        Args:
            goal: Goal of the scenario.

        Raises:
            RequestRefused: The cell is no simulation.
        """
        self.reset()
        self.restore_count += 1
        self.set_goal(goal)

    def set(self, key: str, value: str) -> None:
        """Change one setting.

        Args:
            key: Key of the setting.
            value: Text of its value, in TOML.

        Raises:
            RequestRefused: There is no such setting or value.
        """
        if key not in self.settings:
            raise RequestRefused(
                f"no setting {key!r}; there are {', '.join(sorted(self.settings))}"
            )
        try:
            self.settings[key] = live_settings.checked(key, value)
        except ConfigurationError as error:
            raise RequestRefused(str(error)) from None
        self.revision += 1
