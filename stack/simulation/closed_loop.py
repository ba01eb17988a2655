"""One run of a scenario on simulated time, from idle to its end, scored."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from shared import topics
from shared.messages import FAILED, REACHED, ArmCommand, ArmStates, TaskRequest, TaskState
from shared.scenario import SIDES, Scenario
from shared.service import SECOND, Service
from stack import services
from stack.simulation.recorder_tap import RecorderTap
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import START, SimulatedStack, Tap, session

READY_LIMIT = 20 * SECOND
"""A cell that is not ready after so long will not become so [ns]."""
TICK = SECOND // 10
"""Time between two looks at how the run goes [ns]."""


@dataclass(frozen=True)
class Score:
    """What `lariat run --json` answers; None where there is nothing to measure."""

    scenario: str
    reached: bool
    """The final error is within tolerance."""
    reached_s: float | None
    """When the rope last came within tolerance, since the start of the run."""
    final_error_mm: float | None
    """Mean node distance of true rope and goal, averaged over the last 0.2 s."""
    max_node_error_mm: float | None
    """Largest node distance, averaged over the last 0.2 s."""
    min_clearance_mm: float | None
    """Least distance of the surfaces of rope and obstacles over the whole run."""
    contact_time_s: float
    length_error_mm: float
    """Largest deviation of the true rope's length over the whole run."""
    sim_s: float
    wall_s: float
    real_time_factor: float
    plan_ms: dict[str, float]
    """Wall time of the controller's steps: p50, p99, max."""
    replans: int
    parameters: dict[str, list[float]]
    """Value and standard deviation by name."""
    prediction_error_mm: float | None
    """Of what is seen from what was expected of it, mean over the run; it holds the noise."""
    horizon_error_mm: float | None
    """Of the true rope from the ends of all horizons, root mean square while it moved."""
    recording: str | None


@dataclass(frozen=True)
class Outcome:
    """A finished run."""

    score: Score
    reason: str
    """Why it ended as it did, in words."""
    stack: SimulatedStack
    """As it was left."""
    scorer: Scorer


Watch = Callable[[SimulatedStack, Scorer], None]
"""Looks at a run while it goes on."""


def in_simulation(scenario: Scenario) -> Scenario:
    """The same cell without its real arms: the emulator plays them."""
    ends = {side: replace(scenario.end(side), address="") for side in SIDES}
    return replace(scenario, ends=replace(scenario.ends, **ends))


def run(
    scenario: Scenario,
    record: Path | None = None,
    stop_after: float | None = None,
    watch: Watch | None = None,
    taps: tuple[Tap, ...] = (),
    members: tuple[Service, ...] | None = None,
) -> Outcome:
    """Steps a cell until its time is over.

    Args:
        scenario: What to run; a real arm's address is left out.
        record: File for the recording, which must not exist.
        stop_after: End so long after the controller has said that the goal is reached [s]; the
            scenario's time limit holds besides.
        watch: Called ten times a simulated second.
        taps: See every message.
        members: Services in the place of the scenario's own.

    Raises:
        ConfigurationError: A service cannot do what the scenario asks for.
        OSError: The recording cannot be written.
    """
    scenario = in_simulation(scenario)
    scorer = Scorer(scenario)
    if members is None:
        members = tuple(services.build(n, scenario, session(n)) for n in services.NAMES)
    with ExitStack() as cleanup:
        stack = SimulatedStack(members, [scorer, *taps])
        if record:
            # Before anything is compiled: a folder that cannot be written is said at once.
            recorder = RecorderTap(record, scenario, stack)
            cleanup.callback(recorder.close)
            stack.taps.append(recorder)
        stack.warm_up()
        reason = _get_ready(stack, scenario, watch, scorer)
        steps_before = len(stack.step_ms("controller"))
        began = time.perf_counter()
        if not reason:
            reason = _drive(stack, scenario, stop_after, watch, scorer)
        wall = time.perf_counter() - began
    score = _score(scenario, scorer, wall, stack.step_ms("controller")[steps_before:], record)
    return Outcome(score, reason, stack, scorer)


def _get_ready(
    stack: SimulatedStack, scenario: Scenario, watch: Watch | None, scorer: Scorer
) -> str:
    """Steps until a run can start; says what is missing when that does not come."""
    asked, missing = False, "no time"
    while stack.now < START + READY_LIMIT:
        stack.advance_to(stack.now + TICK)
        if watch:
            watch(stack, scorer)
        missing = _missing(stack)
        if not missing:
            return ""
        arms = stack.latest(topics.ARM_STATE)
        automatic = all(scenario.end(side).arm_automatically for side in SIDES)
        if arms and arms.mode == ArmStates.DISARMED and not automatic and not asked:
            # Who types `lariat run` stands in for the person who arms a cell.
            stack.send(
                topics.ARM_COMMAND,
                ArmCommand(
                    id="run-arm",
                    stamp=stack.now,
                    boot=arms.boot,
                    expires=stack.now + SECOND,
                    action=ArmCommand.ARM,
                ),
            )
            asked = True
    return f"the cell did not become ready: {missing}"


def _missing(stack: SimulatedStack) -> str:
    arms = stack.latest(topics.ARM_STATE)
    rope = stack.latest(topics.ROPE_NODES)
    task = stack.latest(topics.TASK_STATE)
    if arms is None:
        return "no arm/state"
    # An idle controller holds explicitly: arms that hold without asking for a person are ready.
    ready = (ArmStates.ARMED, ArmStates.MOVING, ArmStates.HOLDING)
    if arms.mode not in ready or arms.needs_acknowledgement:
        return f"the arms are {ArmStates.Mode.Name(arms.mode).lower()}: {arms.reason}"
    if rope is None:
        return "no rope/nodes"
    if not rope.positions:
        return f"the rope is not seen: {rope.lost}"
    if task is None:
        return "no task/state"
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
    """Starts the task and steps until it is over; says how it ended."""
    stack.send(
        topics.TASK_REQUEST, TaskRequest(id="run-start", stamp=stack.now, action=TaskRequest.START)
    )
    asked = stack.now
    reached: int | None = None
    while True:
        stack.advance_to(stack.now + TICK)
        if watch:
            watch(stack, scorer)
        task = stack.latest(topics.TASK_STATE) or TaskState()
        if task.last_request == "run-start" and task.refusal:
            return f"the start was refused: {task.refusal}"
        if not scorer.started:
            if stack.now > asked + SECOND:
                return "the controller does not answer task/request"
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
            return "the time limit of the run"


def _score(
    scenario: Scenario, scorer: Scorer, wall: float, step_ms: list[float], record: Path | None
) -> Score:
    mean, largest = scorer.final
    seconds = max(scorer.ended - scorer.started, 0) / SECOND
    quantiles = np.quantile(step_ms, [0.5, 0.99, 1.0]) if step_ms else np.zeros(3)
    predictions = scorer.prediction_errors
    reached = scorer.reached_after
    horizon = scorer.horizon_error.error
    return Score(
        scenario=scenario.name,
        reached=reached is not None,
        reached_s=None if reached is None else round(reached, 3),
        final_error_mm=_mm(mean),
        max_node_error_mm=_mm(largest),
        min_clearance_mm=_mm(scorer.min_clearance),
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
        recording=str(record) if record else None,
    )


def _mm(meters: float) -> float | None:
    return round(1e3 * meters, 4) if np.isfinite(meters) else None


def as_json(score: Score) -> dict[str, Any]:
    """The score as one JSON object."""
    return asdict(score)
