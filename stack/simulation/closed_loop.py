"""Scored run of a scenario in simulated time."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lariat.arms.description import with_own_urdfs
from lariat.scenario import SIDES, Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import FAILED, REACHED, ArmCommand, ArmStates, TaskRequest, TaskState
from shared.runtime.service import Service
from stack import services
from stack.simulation.recorder_tap import RecorderTap
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import (
    START,
    Network,
    SimulatedStack,
    Tap,
    session_id,
)

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
class Score:
    """Score of a run, as `lariat run --json` prints it; None for what cannot be measured."""

    scenario: str
    """Name of the scenario."""
    reached: bool
    """Whether the final error is within tolerance."""
    reached_s: float | None
    """Time from the start of the run until the rope was within tolerance for good."""
    final_error_mm: float | None
    """Mean node distance between true rope and goal, averaged over the last 0.2 s."""
    max_node_error_mm: float | None
    """Largest node distance between true rope and goal, averaged over the last 0.2 s."""
    final_angle_rad: float | None
    """Angle of the true rope's ends from a goal of them alone, averaged over the last 0.2 s."""
    final_shape_error_mm: float | None
    """Mean distance of the goal's nodes from the curve of the true rope at the end: without what
    the rope is shifted along itself."""
    min_clearance_mm: float | None
    """Least distance between the surfaces of rope and obstacles."""
    min_distractor_clearance_mm: float | None
    """Least distance between the surfaces of rope and distractors, through which it passes."""
    contact_time_s: float
    """Time during which the rope touches obstacles."""
    length_error_mm: float
    """Largest deviation of the true rope's length from its length at rest."""
    sim_s: float
    """Simulated duration of the run."""
    wall_s: float
    """Wall time of the run."""
    real_time_factor: float
    """Simulated duration divided by wall time."""
    plan_ms: dict[str, float]
    """Wall time of the controller's steps: p50, p99, max."""
    replans: int
    """Number of new paths that the controller requested."""
    parameters: dict[str, list[float]]
    """Value and standard deviation of each estimated parameter by name."""
    prediction_error_mm: float | None
    """Mean node distance between prediction and observation, which includes the sensor noise."""
    horizon_error_mm: float | None
    """Root mean square node distance between true rope and ends of horizons, while it moved."""
    sensing_error_mm: float | None
    """Root mean square node distance between true and perceived rope, while it moved."""
    recording: str | None
    """File of the recording."""


@dataclass(frozen=True)
class RunOutcome:
    """Result of a finished run."""

    score: Score
    """Measured quantities."""
    reason: str
    """Why the run ended."""
    stack: SimulatedStack
    """Services in their final state."""
    scorer: Scorer
    """Time series behind the score."""


Watch = Callable[[SimulatedStack, Scorer], None]
"""Observer of a run, called once per `POLL_PERIOD`."""


def with_emulated_arms(scenario: Scenario) -> Scenario:
    """Return the scenario with emulated arms in place of real ones."""
    ends = {side: replace(scenario.end(side), address="") for side in SIDES}
    return replace(scenario, ends=replace(scenario.ends, **ends))


def run(
    scenario: Scenario,
    record: Path | None = None,
    stop_after: float | None = None,
    watch: Watch | None = None,
    taps: tuple[Tap, ...] = (),
    members: tuple[Service, ...] | None = None,
    network: Network = lambda _: (0,),
    start: int = START,
) -> RunOutcome:
    """Run a scenario until the goal is reached or its time is over, and score the run.

    Args:
        scenario: The scenario; real arms are replaced by emulated ones.
        record: File for the recording, which must not exist.
        stop_after: Time from the controller's report that the goal is reached to the end of the
            run [s]; by default the run lasts until the scenario's time limit.
        watch: Observer of the run.
        taps: Functions that are called with every message.
        members: Services of the cell; by default those of the scenario.
        network: Faults of the network; by default none.
        start: Time at which simulated time begins [ns], e.g. that of the wall clock.

    Raises:
        ConfigurationError: A service does not support the scenario.
        OSError: The recording cannot be written.
    """
    scenario = with_emulated_arms(scenario)
    scorer = Scorer(scenario)
    if members is None:
        members = tuple(services.build(n, scenario, session_id(n), start) for n in services.NAMES)
    with ExitStack() as cleanup:
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
        reason = make_ready(stack, scenario, lambda: watch and watch(stack, scorer))
        steps_before = len(stack.step_ms("controller"))
        began = time.perf_counter()
        if not reason:
            reason = _drive(stack, scenario, stop_after, watch, scorer)
        wall = time.perf_counter() - began
    score = score_of(scenario, scorer, wall, stack.step_ms("controller")[steps_before:], record)
    return RunOutcome(score, reason, stack, scorer)


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
    watch: Watch | None,
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
        if watch:
            watch(stack, scorer)
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


def score_of(
    scenario: Scenario, scorer: Scorer, wall: float, step_ms: list[float], record: Path | None
) -> Score:
    """Return the score of a run that a scorer has followed.

    Args:
        scenario: Scenario of the run.
        scorer: Tap that has followed it.
        wall: Wall time that it took [s].
        step_ms: Wall times of the controller's steps [ms].
        record: Its recording.
    """
    mean, largest = scorer.final
    seconds = max(scorer.ended - scorer.started, 0) / SECOND
    quantiles = np.quantile(step_ms, [0.5, 0.99, 1.0]) if step_ms else np.zeros(3)
    predictions = scorer.prediction_errors
    reached = scorer.reached_after
    horizon, sensing = scorer.horizon_error.error, scorer.sensing_error.error
    return Score(
        scenario=scenario.name,
        reached=reached is not None,
        reached_s=None if reached is None else round(reached, 3),
        final_error_mm=_mm(mean),
        max_node_error_mm=_mm(largest),
        final_angle_rad=None if scorer.final_angle is None else round(scorer.final_angle, 5),
        final_shape_error_mm=_mm(scorer.final_shape_error),
        min_clearance_mm=_mm(scorer.min_clearance),
        min_distractor_clearance_mm=_mm(scorer.min_distractor_clearance),
        contact_time_s=round(scorer.contact_time, 3),
        length_error_mm=round(1e3 * scorer.length_error, 4),
        sim_s=round(seconds, 3),
        wall_s=round(wall, 3),
        real_time_factor=round(seconds / wall, 3) if wall > 0.0 else 0.0,
        plan_ms=dict(zip(("p50", "p99", "max"), quantiles.round(3).tolist(), strict=True)),
        replans=scorer.replans,
        parameters=scorer.parameters,
        prediction_error_mm=_mm(float(np.mean(predictions))) if predictions else None,
        horizon_error_mm=None if horizon is None else _mm(horizon),
        sensing_error_mm=None if sensing is None else _mm(sensing),
        recording=str(record) if record else None,
    )


def _mm(meters: float) -> float | None:
    return round(1e3 * meters, 4) if np.isfinite(meters) else None


def as_json(score: Score) -> dict[str, Any]:
    """Return the score as a JSON object."""
    return asdict(score)
