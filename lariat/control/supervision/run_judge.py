"""Judge of a run: reached, in need of another path, or given up."""

from __future__ import annotations

from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.control.supervision.path_choice import PathChoice
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import MAX_REPLANS, Cause, Replanning
from lariat.trajectory import SECOND

STALL_TIME = 5 * SECOND
"""Time at the end of a path without settling after which control has stalled [ns]."""
STUCK_TIME = 3 * SECOND // 2
"""Time at the end of a path before a rope at rest counts as stuck [ns]."""
LEAVE_ERROR = 3.0
"""Error above which an uncontrolled rope has left its goal, in tolerances [-]."""


class RunJudge:
    """Judge of the runs of one task."""

    def __init__(
        self, task: Task, progress: ProgressMonitor, replanning: Replanning, paths: PathChoice
    ) -> None:
        """Judge the runs of one task.

        Args:
            task: Task whose state changes.
            progress: Measures of the run.
            replanning: Requests for other paths.
            paths: Choice of the path.
        """
        self._task, self._progress = task, progress
        self._replanning, self._paths = replanning, paths
        self._end_since = 0
        """Time since when the end of the path has been passed [ns]; 0 before."""

    def begin_path(self) -> None:
        """Begin a path, whose end has not been passed."""
        self._end_since = 0

    def judge(self, now: int, reference: ReferenceTrajectory, *, at_end: bool) -> None:
        """Decide whether the goal is reached, another path is needed, or the run has failed.

        Args:
            now: Present time [ns].
            reference: Path that is followed.
            at_end: Whether the end of the path has been passed.
        """
        task, progress = self._task, self._progress
        if not at_end:
            return
        if progress.settled(now):
            self._end_since = 0
            if task.accepts(RunEvent.SETTLE):
                task.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
            return
        self._end_since = self._end_since or now
        late = now - self._end_since > STALL_TIME
        resting = progress.resting(now)
        if task.state is not RunState.RUNNING or not (resting or late):
            return
        stuck = resting and progress.stuck(now) and now - self._end_since > STUCK_TIME
        # A path that ends short was planned for the rope as it was believed to be.
        changed = resting and self._paths.material_changed
        stalled = reference.reached and (stuck or late)
        if (changed or stalled) and self._replanning.request(Cause.STALLED):
            self._end_since = 0
        elif stalled:
            task.apply(
                RunEvent.GIVE_UP,
                ReasonCode.STALLED,
                error_mm=1e3 * progress.error,
                paths=MAX_REPLANS[Cause.STALLED],
            )
        elif stuck:
            task.apply(RunEvent.GIVE_UP, ReasonCode.PATH_ENDS_SHORT, answer=reference.reason)

    def released(self) -> None:
        """Leave the reached state when the rope has left the goal while the arms hold.

        An arm may have been moved by hand, or replaced: the rope is not led back without a start.
        """
        error = self._progress.error
        limit = LEAVE_ERROR * self._progress.tolerance
        if self._task.accepts(RunEvent.LEAVE_GOAL) and error > limit:
            self._task.apply(RunEvent.LEAVE_GOAL, ReasonCode.LEFT_GOAL, error_mm=1e3 * error)
