"""The task: which goal, and whether to go there. It changes by requests, which may be refused."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose

State = Literal["idle", "running", "paused", "reached", "failed"]


class RequestRefused(ValueError):
    """A request that is not carried out, in words for the person."""


@dataclass(frozen=True)
class Goal:
    """A wanted shape and the grips that go with it."""

    nodes: Float64[np.ndarray, "n 3"]
    """[m]"""
    left: Pose
    right: Pose
    left_oriented: bool = False
    """Whether the orientation of this end is part of the goal."""
    right_oriented: bool = False
    turns: float = 0.0
    """Twist of the right end against the left one [turns]."""


@dataclass
class Task:
    """State of the task; `revision` grows with every change."""

    goal: Goal
    settings: dict[str, str] = field(default_factory=dict)
    resettable: bool = True
    """Whether this is a simulation."""
    state: State = "idle"
    reason: str = "waiting for a start"
    revision: int = 1
    goal_revision: int = 1
    replan_count: int = 0
    reset_count: int = 0
    run: str = ""
    run_count: int = 0
    run_started: int = 0
    """[ns]; 0 before the first run."""
    last_request: str = ""
    refusal: str = ""

    @property
    def adapts(self) -> bool:
        """Whether the rope is learnt."""
        return self.settings.get("adapt") == "true"

    def enter(self, state: State, reason: str) -> None:
        """Goes to a state, or gives its reason new words."""
        if (state, reason) != (self.state, self.reason):
            self.state, self.reason = state, reason
            self.revision += 1

    def answered(self, request: str, refusal: str = "") -> None:
        """Says how a request ended."""
        self.last_request, self.refusal = request, refusal
        self.revision += 1

    def set_goal(self, goal: Goal) -> None:
        """Takes another goal; a run goes on towards it."""
        self.goal = goal
        self.goal_revision += 1
        self.ask_for_path()
        if self.state in ("reached", "failed"):
            self.enter("idle", "waiting for a start")

    def ask_for_path(self) -> None:
        """Asks the planner for a path from where things are now."""
        self.replan_count += 1
        self.revision += 1

    def start(self, now: int) -> None:
        """Begins a run, or resumes a paused one."""
        if self.state == "running":
            raise RequestRefused("already running; stop or pause first")
        if self.state != "paused":
            self.run_count += 1
            self.run = f"run-{self.run_count}"
            self.run_started = now
        self.enter("running", "started")

    def pause(self) -> None:
        """Stands still until a start."""
        if self.state != "running":
            raise RequestRefused(f"cannot pause while {self.state}; only a run can be paused")
        self.enter("paused", "paused by a person")

    def stop(self) -> None:
        """Ends the run."""
        self.enter("idle", "stopped by a person")

    def reset(self) -> None:
        """Asks for everything to return to the scenario's start; simulation only."""
        if not self.resettable:
            raise RequestRefused(
                "only a simulation can be reset; move the arm by hand and set a goal"
            )
        self.reset_count += 1
        self.enter("idle", "reset")
        self.ask_for_path()

    def set(self, key: str, value: str) -> None:
        """Changes one setting."""
        if key not in self.settings:
            raise RequestRefused(
                f"no setting {key!r}; there are {', '.join(sorted(self.settings))}"
            )
        if value not in ("true", "false"):
            raise RequestRefused(f"{key} = {value!r}; use true or false")
        self.settings[key] = value
        self.revision += 1
