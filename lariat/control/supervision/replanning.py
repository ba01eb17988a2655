"""Requests for other paths during a run: a few for each cause, some of them more careful."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from lariat.control.run.task import Task

MARGIN_STEP = 0.003
"""Clearance that is added after each path that was not followed to its end [m]."""
MAX_MARGIN = 0.02
"""Largest clearance that is added [m]."""
MARGIN_DEVIATIONS = 2.0
"""Deviations of the prediction that the added clearance covers [-]."""
USUAL_DEVIATION = 0.002
"""Deviation of the prediction that a path's own reserve covers [m]."""
SLOWDOWN = 0.6
"""Factor on the pace after each path that was not followed to its end [-]."""
MIN_PACE = 0.2
"""Least pace [-]."""


class Cause(Enum):
    """Cause of a request for another path."""

    STALLED = auto()
    """The rope does not reach the goal at the end of its path."""
    MATERIAL = auto()
    """The material has changed."""
    UNFOLLOWED = auto()
    """The arms did not follow the path."""
    CONTACT = auto()
    """The rope came too near to an obstacle."""
    UNFORESEEN = auto()
    """Predictions were wrong."""
    UNCERTAIN = auto()
    """The path may come too near to an obstacle."""
    SNAG = auto()
    """The rope stays behind.

    After that it hangs on something. A rope in another equilibrium than the model stays behind
    once.
    """


MAX_REPLANS: Mapping[Cause, int] = {
    Cause.STALLED: 2,
    Cause.MATERIAL: 2,
    Cause.UNFOLLOWED: 3,
    Cause.CONTACT: 4,
    Cause.UNFORESEEN: 2,
    Cause.UNCERTAIN: 3,
    Cause.SNAG: 1,
}
"""Paths that are requested for each cause in one run."""


class Replanning:
    """Requests of one task for other paths, counted by cause."""

    def __init__(self, task: Task) -> None:
        """Request paths for a task."""
        self._task = task
        self.begin_run()

    def begin_run(self) -> None:
        """Restore the budgets of a run, with the usual clearance and pace."""
        self._counts = dict.fromkeys(Cause, 0)
        self._task.clearance_margin, self._task.pace = 0.0, self._task.usual_pace

    def request(self, cause: Cause) -> bool:
        """Request another path.

        Returns:
            Whether it is requested; False where those of the cause are used up.
        """
        if self._counts[cause] >= MAX_REPLANS[cause]:
            return False
        self._counts[cause] += 1
        self._task.request_path()
        return True

    def request_careful(self, cause: Cause, deviation: float, lack: float = 0.0) -> bool:
        """Request a path with more clearance and less speed.

        Args:
            deviation: Error of the predictions so far [m].
            lack: Clearance that the path before it lacks [m].

        Returns:
            Whether it is requested; False where those of the cause are used up.
        """
        if not self.request(cause):
            return False
        task = self._task
        unsure = MARGIN_DEVIATIONS * max(deviation - USUAL_DEVIATION, 0.0)
        margin = max(task.clearance_margin + max(lack, MARGIN_STEP), unsure)
        task.clearance_margin = min(margin, MAX_MARGIN)
        task.pace = min(task.pace, max(SLOWDOWN * task.pace, MIN_PACE))
        return True
