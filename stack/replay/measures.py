"""Measures of a recorded run, computed again from its messages by this version's code.

No service is stepped and no image is read. The measures are those of `lariat run`: by the true rope
where the recording has one, which only a simulation knows, otherwise by the rope as it was seen.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from lariat.scenario import Scenario
from shared import topics
from shared.messages import RunResult, TaskState
from shared.recording import Recording
from stack.simulation.score import Score, score_of
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import Delivery

READS = (
    topics.TASK_STATE.key,
    topics.SCENE_REQUEST.key,
    topics.SCENE_STATE.key,
    topics.SCENE_MOTION.key,
    topics.ROPE_TRUTH.key,
    topics.ROPE_NODES.key,
    topics.CONTROLLER_PLAN.key,
    topics.CONTROLLER_PARAMETERS.key,
    topics.RUN_RESULT.key,
)
"""Topics from which the measures follow."""


@dataclass(frozen=True)
class RecordedMeasures:
    """Measures of a recorded run."""

    score: Score
    """Measures, computed again."""
    recorded: RunResult | None
    """Result that the controller published, by the rope as it saw it; None without one."""
    by_truth: bool
    """Whether the measures are by the true rope."""


def recorded_measures(recording: Recording, scenario: Scenario) -> RecordedMeasures:
    """Compute the measures of the first run of a recording."""
    began = time.monotonic()
    entries = list(recording.messages(READS))
    by_truth = any(entry.key == topics.ROPE_TRUTH.key for entry in entries)
    scorer = Scorer(scenario)
    result: RunResult | None = None
    resets = 0
    for entry in entries:
        message = entry.parse()
        if entry.key == topics.RUN_RESULT.key:
            result = message
            continue
        if isinstance(message, TaskState):
            resets = resets if scorer.started else message.reset_count
            # What follows belongs to another run, or to none.
            if scorer.started and (
                message.run_started > scorer.started or message.reset_count > resets
            ):
                break
        payload = message.SerializeToString()
        sent = entry.publisher, entry.sequence, entry.log_time, entry.publish_time
        scorer(Delivery(entry.topic, payload, *sent))
        if entry.key == topics.ROPE_NODES.key and not by_truth and message.positions:  # pyright: ignore[reportAttributeAccessIssue]
            scorer(Delivery(topics.ROPE_TRUTH, payload, *sent))
    if not scorer.errors:
        raise ValueError(f"{recording.path} holds no run: its task is idle, or no rope was seen")
    wall = time.monotonic() - began
    return RecordedMeasures(score_of(scenario, scorer, wall, [], recording.path), result, by_truth)
