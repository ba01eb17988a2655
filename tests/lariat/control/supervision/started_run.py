"""Run that has begun, with a material and a progress that a test sets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lariat.control.estimation.adaptation import ParameterEstimate
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.supervision.path_choice import PathChoice, PathOffer
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import Replanning
from lariat.trajectory import SECOND
from tests.lariat.control.run.test_task import task

NODE_COUNT = 5
"""Nodes of the rope of the paths."""


@dataclass
class Material:
    """Adaptation whose state a test sets."""

    settled: bool = True
    bending_stiffness: float = 1.0
    informs_planner: bool = True
    deviation: float = 0.1

    @property
    def scalars(self) -> dict[str, ParameterEstimate]:
        return {"bending_stiffness": ParameterEstimate(self.bending_stiffness, self.deviation)}


class Progress(ProgressMonitor):
    """Progress that a test sets."""

    at_rest = at_goal = without_progress = False

    def settled(self, now: int) -> bool:
        return self.at_goal

    def resting(self, now: int) -> bool:
        return self.at_rest

    def stuck(self, now: int) -> bool:
        return self.without_progress


class Run:
    """Run that has been started at 1 s."""

    def __init__(self) -> None:
        self.task = task()
        self.progress, self.material = Progress(0.003, 0.004), Material()
        self.replanning = Replanning(self.task)
        self.paths = self.choice()
        self.task.start(SECOND)

    def choice(
        self, *, obstacles_move: bool = False, certain_clearance: float | None = None
    ) -> PathChoice:
        return PathChoice(
            self.task,
            self.material,  # pyright: ignore[reportArgumentType]
            self.replanning,
            NODE_COUNT,
            certain_clearance=certain_clearance,
            obstacles_move=obstacles_move,
        )

    def offer(self, **changes: object) -> PathOffer:
        asked = self.task.goal_revision, self.task.replan_count
        now = PathOffer(2 * SECOND, *asked, True, "", 1.0, NODE_COUNT, 0, 0, 0, 0, 0.01, path)
        return replace(now, **changes)


def path(*, reached: bool = True, start: float = 0.0) -> ReferenceTrajectory:
    points = np.full((2, 2, 3), start)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (2, 2, 1))
    nodes = np.zeros((2, NODE_COUNT, 3))
    return ReferenceTrajectory(points, turned, 0.02, nodes, reached, "blocked")


def code_of(reason: Reason | None) -> ReasonCode | None:
    return None if reason is None else reason.code
