"""Scored run of a scenario in simulated time."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

from lariat.arms.description import with_own_urdfs
from lariat.scenario import SIDES, Scenario
from lariat.scenario.settings import completed
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import FAILED, REACHED, ArmCommand, ArmStates, TaskRequest, TaskState
from shared.runtime.service import Service
from stack import services
from stack.simulation.progress import Watch, count_progress, run_progress
from stack.simulation.recorder_tap import RecorderTap
from stack.simulation.score import score_of
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_run import SimulatedRun
from stack.simulation.simulated_time import (
    START,
    Network,
    SimulatedStack,
    Tap,
    session_id,
)
from stack.workers import Workers, compute

READY_TIMEOUT = 20 * SECOND
"""Longest simulated time until the cell is ready for a run [ns]."""
START_TIMEOUT = SECOND
"""Longest simulated time until the controller starts a requested run [ns]."""
POLL_PERIOD = SECOND // 10
"""Simulated time between two checks of the state of the run [ns]."""
GARBAGE_THRESHOLD = 100_000
"""Number of new containers after which the garbage collector looks for cycles: hardly any step
leaves one."""


@dataclass(frozen=True)
class RunOutcome(SimulatedRun):
    """Finished run with the services that ran."""

    stack: SimulatedStack
    """Services in their final state."""
    scorer: Scorer
    """Time series behind the score."""


def with_emulated_arms(scenario: Scenario) -> Scenario:
    """Return the scenario with emulated arms in place of real ones."""
    ends = {side: replace(scenario.end(side), address="") for side in SIDES}
    return replace(scenario, ends=replace(scenario.ends, **ends))


def run(
    scenario: Scenario,
    record: Path | str | None = None,
    stop_after: float | None = None,
    progress: bool = False,
    watch: Watch | None = None,
    taps: tuple[Tap, ...] = (),
    members: tuple[Service, ...] | None = None,
    network: Network = lambda _: (0,),
    start: int = START,
) -> RunOutcome:
    """Run a scenario until the goal is reached or its time is over, and score the run.

    Args:
        scenario: The scenario, of a file or with values replaced since; real arms are replaced by
            emulated ones.
        record: MCAP file for the recording, which must not exist.
        stop_after: Time from the controller's report that the goal is reached to the end of the
            run [s]; by default the run lasts until the scenario's time limit.
        progress: Whether to show a progress bar on standard error.
        watch: Observer of the run.
        taps: Functions that are called with every message.
        members: Services of the cell; by default those of the scenario.
        network: Faults of the network; by default none.
        start: Time at which simulated time begins [ns], e.g. that of the wall clock.

    Raises:
        ConfigurationError: A value is wrong, or a service does not support the scenario.
        OSError: The recording cannot be written.
    """
    scenario = completed(with_emulated_arms(scenario))
    record = None if record is None else Path(record)
    scorer = Scorer(scenario)
    if members is None:
        members = tuple(services.build(n, scenario, session_id(n), start) for n in services.NAMES)
    with ExitStack() as cleanup:
        watches = [cleanup.enter_context(run_progress(scenario))] if progress else []
        watches += [watch] if watch else []
        stack = SimulatedStack(members, [scorer, *taps], start, network)
        if record:
            # Before the kernels are compiled: a folder that is not writable is reported at once.
            recorder = RecorderTap(record, with_own_urdfs(scenario), stack)
            cleanup.callback(recorder.close)
            stack.taps.append(recorder)
        stack.warm_up()
        # Modules and kernels stay: the garbage collector need not visit them again and again.
        gc.freeze()
        cleanup.callback(gc.unfreeze)
        cleanup.callback(gc.set_threshold, *gc.get_threshold())
        gc.set_threshold(GARBAGE_THRESHOLD)

        def look() -> None:
            for each in watches:
                each(stack, scorer)

        reason = make_ready(stack, scenario, look)
        steps_before = len(stack.step_ms("controller"))
        began = time.perf_counter()
        if not reason:
            reason = _drive(stack, scenario, stop_after, look, scorer)
        wall = time.perf_counter() - began
    score = score_of(scenario, scorer, wall, stack.step_ms("controller")[steps_before:], record)
    return RunOutcome(scenario, score, reason, **scorer.series, stack=stack, scorer=scorer)


def run_all(
    scenarios: Iterable[Scenario],
    workers: Workers | None = None,
    stop_after: float | None = None,
    progress: bool = True,
) -> list[SimulatedRun]:
    """Run scenarios on all cores, a process for each, and return their runs in the same order.

    A script calls it below `if __name__ == "__main__":`, as the processes import its file.

    Args:
        scenarios: The scenarios, e.g. one with several seeds.
        workers: Number of processes, or the address of a Dask scheduler; by default one for each
            core.
        stop_after: As for `run`.
        progress: Whether to show a progress bar on standard error.

    Raises:
        ConfigurationError: A value is wrong, or a service does not support a scenario.
    """
    items = [completed(with_emulated_arms(scenario)) for scenario in scenarios]
    count = min(os.cpu_count() or 1, len(items)) if workers is None else workers
    runs: dict[int, SimulatedRun] = {}
    with count_progress(len(items)) if progress else nullcontext(lambda: None) as advance:
        for index, each in compute(partial(_alone, stop_after), items, count):
            runs[index] = each
            advance()
    return [runs[index] for index in range(len(items))]


def _alone(stop_after: float | None, scenario: Scenario) -> SimulatedRun:
    """Run a scenario and leave its services behind."""
    outcome = run(scenario, stop_after=stop_after)
    kept = {item.name: getattr(outcome, item.name) for item in fields(SimulatedRun)}
    return SimulatedRun(**kept)


def make_ready(
    stack: SimulatedStack, scenario: Scenario, watch: Callable[[], object] = lambda: None
) -> str:
    """Step until a run can start; arm the cell where the scenario leaves that to a person.

    Args:
        stack: Services that are warmed up.
        scenario: Their scenario.
        watch: Function to call once per `POLL_PERIOD`.
    """
    missing = "no time"
    deadline = stack.now + READY_TIMEOUT
    while stack.now < deadline:
        stack.advance_to(stack.now + POLL_PERIOD)
        watch()
        missing = _missing(stack)
        if not missing:
            return ""
        arms = stack.latest(topics.ARM_STATE)
        automatic = all(scenario.end(side).arm_automatically for side in SIDES)
        if arms and arms.mode == ArmStates.DISARMED and not automatic:
            # In simulation, no person needs to arm the cell.
            stack.send(
                topics.ARM_COMMAND,
                ArmCommand(
                    id=f"run-arm-{stack.now}",
                    stamp=stack.now,
                    boot=arms.boot,
                    answers=arms.stamp,
                    action=ArmCommand.ARM,
                    session=arms.next_session,
                ),
            )
    return f"the cell did not become ready: {missing}"


def _missing(stack: SimulatedStack) -> str:
    arms = stack.latest(topics.ARM_STATE)
    rope = stack.latest(topics.ROPE_NODES)
    task = stack.latest(topics.TASK_STATE)
    if arms is None:
        return "there is no message on arm/state"
    # An idle controller sends holds: arms that hold without need of acknowledgement are ready.
    if not arms.may_move:
        return f"the arms are {ArmStates.Mode.Name(arms.mode).lower()}: {arms.reason}"
    if rope is None:
        return "there is no message on rope/nodes"
    if not rope.positions:
        return f"the rope is not seen: {rope.lost}"
    if task is None:
        return "there is no message on task/state"
    if not task.goal.positions:
        return f"there is no goal: {task.refusal or task.reason}"
    return ""


def _drive(
    stack: SimulatedStack,
    scenario: Scenario,
    stop_after: float | None,
    look: Callable[[], object],
    scorer: Scorer,
) -> str:
    """Start the task and step until the run is over."""
    stack.send(
        topics.TASK_REQUEST, TaskRequest(id="run-start", stamp=stack.now, action=TaskRequest.START)
    )
    requested = stack.now
    reached: int | None = None
    while True:
        stack.advance_to(stack.now + POLL_PERIOD)
        look()
        task = stack.latest(topics.TASK_STATE) or TaskState()
        if task.last_request == "run-start" and task.refusal:
            return f"the start was refused: {task.refusal}"
        if not scorer.started:
            if stack.now > requested + START_TIMEOUT:
                return "the controller does not answer on task/request"
            continue
        if task.state == FAILED:
            return f"the controller gave up: {task.reason}"
        if task.state != REACHED:
            reached = None
        elif reached is None:
            reached = stack.now
        if (
            stop_after is not None
            and reached is not None
            and stack.now >= reached + round(stop_after * SECOND)
        ):
            return "reached"
        if stack.now >= scorer.started + round(scenario.run.time_limit * SECOND):
            return "the time limit has passed"
