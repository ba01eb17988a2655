from __future__ import annotations

import pytest

from dashboard.recordings.timeline import RecordedMessage, Timeline, thin_topic
from shared import topics
from shared.messages import ArmStates, RunResult, TaskState
from shared.runtime.service import Inbox

READS = (topics.TASK_STATE, topics.ARM_STATE)


def recorded() -> list[RecordedMessage]:
    """Ten seconds: the task each second, the arms each half second, and something else."""
    messages = []
    for k in range(21):
        time = 1_000 + 500 * k
        arms = ArmStates(stamp=time)
        messages.append(RecordedMessage("arm/state", arms.SerializeToString(), "g", k, time))
        if k % 2 == 0:
            task = TaskState(stamp=time)
            messages.append(RecordedMessage("task/state", task.SerializeToString(), "c", k // 2, time))
        messages.append(RecordedMessage("run/result", RunResult().SerializeToString(), "c", k, time))
    return messages


def stamps(inbox: Inbox) -> tuple[int, list[int]]:
    task = inbox.latest(topics.TASK_STATE)
    return task.message.stamp, [r.message.stamp for r in inbox.every(topics.ARM_STATE)]


def test_advancing_delivers_each_message_once() -> None:
    timeline = Timeline(recorded(), READS)
    assert (timeline.start, timeline.end) == (1_000, 11_000)
    assert stamps(timeline.advance(2_600)) == (2_000, [1_000, 1_500, 2_000, 2_500])
    assert stamps(timeline.advance(3_600)) == (3_000, [3_000, 3_500])
    assert stamps(timeline.advance(3_700)) == (3_000, [])


def test_a_jump_back_or_ahead_finds_the_newest_of_each_topic() -> None:
    timeline = Timeline(recorded(), READS)
    assert stamps(timeline.jump(7_600)) == (7_000, [7_500])
    assert stamps(timeline.jump(2_600)) == (2_000, [2_500])
    assert stamps(timeline.advance(3_100)) == (3_000, [3_000])


def test_the_past_ends_where_the_reader_stands() -> None:
    past = Timeline(recorded(), READS).past(topics.TASK_STATE, 4_999)
    assert [t.stamp for t in past] == [1_000, 2_000, 3_000, 4_000]


def test_recording_without_anything_to_show_is_refused() -> None:
    with pytest.raises(ValueError, match="no message"):
        Timeline([m for m in recorded() if m.key == "run/result"], READS)


def test_thinning_spares_other_topics() -> None:
    kept = list(thin_topic(recorded(), "arm/state", 1_000))
    assert [m.time for m in kept if m.key == "arm/state"] == list(range(1_000, 11_001, 1_000))
    assert sum(m.key == "task/state" for m in kept) == 11
