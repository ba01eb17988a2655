"""What becomes of a run: learnt first, then reached, tried again or given up."""

from __future__ import annotations

import math

from services.controller.estimation.material_filter import MaterialFilter
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.paper.adaptation import PaperAdaptation
from services.controller.run.progress import ProgressMonitor
from services.controller.run.task import Task
from shared.service import SECOND

LEARNING = 3 * SECOND
"""Longest that a run waits while the rope's material is learnt from its shape at rest [ns]."""
LEARNT = 0.2
"""Change of the stiffness's logarithm that makes a path worth planning again."""
STALLED = 5 * SECOND
"""At the end of a path for so long without being within tolerance, control has stalled [ns]; sooner
where the rope rests and comes no nearer."""
STUCK = 3 * SECOND // 2
"""At the end of a path for so long before a rope that rests counts as stuck [ns]."""
LEFT = 3.0
"""Error, in tolerances, from which a rope that nobody controls has left the goal it had reached."""
PATIENCE = 2
"""New paths that are asked for after stalling, in one run."""
BARRED = 1
"""New paths that are asked for in one run after arms could not follow one."""


class Course:
    """Watches one run after the other, and moves the task on."""

    def __init__(
        self, task: Task, monitor: ProgressMonitor, adaptation: MaterialFilter | PaperAdaptation
    ) -> None:
        self._task, self._monitor, self._adaptation = task, monitor, adaptation
        self._planned_stiffness = adaptation.bending_stiffness
        self._arrived = 0
        self.begin()

    def begin(self) -> None:
        """A run begins anew."""
        self._stalls = self._relearnt = self._barred = 0

    def follow(self, stiffness: float) -> None:
        """A path is followed from now on.

        Args:
            stiffness: EI of the rope that it was planned for [N m^2].
        """
        self._arrived = 0
        self._planned_stiffness = stiffness

    def learning(self, now: int) -> bool:
        """Whether a look or two more at the rope as it hangs will tell what it is made of."""
        waited = now - self._task.run_started
        return self._task.adapts and not self._adaptation.settled and waited < LEARNING

    def outdated(self, stiffness: float) -> bool:
        """Asks for another path when the rope has turned out not to be that of the one at hand."""
        if not self._learnt_since(stiffness) or self._relearnt >= PATIENCE:
            return False
        self._relearnt += 1
        self._task.ask_for_path()
        return True

    def barred(self, reason: str) -> None:
        """The arms cannot follow the path at hand: another one may lead elsewhere, once."""
        if self._barred >= BARRED:
            self._task.enter("failed", f"{reason}; another path did not help")
            return
        self._barred += 1
        self._task.ask_for_path()

    def judge(self, now: int, path: ReferenceTrajectory, arrived: bool) -> None:
        """Whether the goal is reached, or given up.

        Args:
            arrived: Whether the path has been passed.
        """
        task, monitor = self._task, self._monitor
        if not arrived:
            return
        if monitor.settled(now):
            self._arrived = 0
            if task.state == "running":
                task.enter("reached", "within tolerance and at rest")
            return
        self._arrived = self._arrived or now
        late = now - self._arrived > STALLED
        rests = monitor.resting(now)
        if task.state != "running" or not (rests or late):
            return
        stuck = rests and monitor.stuck(now) and now - self._arrived > STUCK
        # "Unreachable" was said of the rope as it was believed to be.
        learnt = rests and self._learnt_since(self._planned_stiffness)
        stalled = path.reached and (stuck or late)
        if (learnt or stalled) and self._stalls < PATIENCE:
            self._arrived = 0
            self._stalls += 1
            task.ask_for_path()
        elif stalled:
            error = f"{1e3 * monitor.error:.1f} mm from the goal on average"
            task.enter("failed", f"stalled {error}, {PATIENCE} new paths did not help")
        elif stuck:
            task.enter("failed", path.reason)

    def let_go(self) -> None:
        """While the arms do not follow: a rope that left the goal is not led back without a start.

        An arm may be moved by hand meanwhile, or be another one when it comes back.
        """
        error = self._monitor.error
        if self._task.state == "reached" and error > LEFT * self._monitor.tolerance:
            self._task.enter(
                "idle", f"the rope has left the goal, {1e3 * error:.0f} mm; start again"
            )

    def _learnt_since(self, stiffness: float) -> bool:
        """Whether the rope has turned out to be another one than a path was planned for.

        Args:
            stiffness: EI of that one [N m^2]; 0 in recordings that are older than it.
        """
        adaptation = self._adaptation
        # The planner's rod knows nothing of the paper's parameters.
        if not self._task.adapts or isinstance(adaptation, PaperAdaptation) or stiffness <= 0.0:
            return False
        return abs(math.log(adaptation.bending_stiffness / stiffness)) > LEARNT
