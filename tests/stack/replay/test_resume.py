"""Runs that go on from a moment of a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import chain
from shared.recording import Recording
from stack.replay.resume import scenario_at
from stack.simulation import closed_loop

REFERENCE = Path("tests/replay/requests.mcap")
REACHED = Path("tests/replay/three-cylinders.mcap")
"""Recording of a run that reaches its goal."""


def test_scenario_begins_as_the_recording_was(tmp_path: Path) -> None:
    recording = Recording.open(REFERENCE)
    first = next(recording.messages()).log_time
    truths = [
        chain(entry.parse().positions)
        for entry in recording.messages([topics.ROPE_TRUTH.key])
        if entry.log_time <= first + SECOND
    ]
    scenario = scenario_at(recording, tmp_path, 1.0)
    nodes = scenario.nodes(scenario.start)
    assert nodes is not None
    # The controller's nodes lie on the rope, which has more of them.
    distances = np.linalg.norm(nodes[:, None] - truths[-1][None], axis=2).min(axis=1)
    assert distances.max() < 0.5 * scenario.rope.length / len(nodes)
    assert [b.name for b in scenario.bodies]
    assert scenario.events == ()


def test_run_goes_on_to_the_goal_of_the_moment(tmp_path: Path) -> None:
    scenario = scenario_at(Recording.open(REACHED), tmp_path, 0.5)
    outcome = closed_loop.run(scenario, stop_after=0.0)
    assert outcome.score.reached, outcome.reason


@pytest.mark.parametrize(("seconds", "words"), [(-1.0, "lasts"), (1e6, "lasts"), (0.0, "later")])
def test_moment_without_states_is_refused(tmp_path: Path, seconds: float, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        scenario_at(Recording.open(REFERENCE), tmp_path, seconds)
