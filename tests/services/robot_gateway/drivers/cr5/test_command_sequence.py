"""Sequences of requests that are advanced over many ticks."""

from __future__ import annotations

from services.robot_gateway.drivers.cr5.command_sequence import (
    CommandSequence,
    Request,
    SequenceSteps,
    WaitUntil,
)
from services.robot_gateway.drivers.cr5.replies import Reply

SECOND = 1_000_000_000


def steps(log: list[object]) -> SequenceSteps:
    reply = yield Request("PowerOn()")
    log.append(reply)
    log.append((yield WaitUntil(lambda: len(log) > 2, 1.0)))
    return "failed at the end"


def test_each_step_waits_for_its_own_reply() -> None:
    asked: list[str] = []
    log: list[object] = []
    sequence = CommandSequence(asked.append)
    sequence.begin(steps(log))
    sequence.advance(0)
    assert asked == ["PowerOn()"]
    sequence.answer(Reply(0, "", "RobotMode()"))
    sequence.advance(1)
    assert log == [], "the reply to another command does not count"
    reply = Reply(0, "", "PowerOn()")
    sequence.answer(reply)
    sequence.advance(2)
    assert log == [reply]


def test_condition_that_does_not_come_true_in_time_is_reported_as_false() -> None:
    log: list[object] = []
    sequence = CommandSequence(lambda text: None)
    sequence.begin(steps(log))
    sequence.advance(0)
    sequence.answer(Reply(0, "", "PowerOn()"))
    sequence.advance(1)
    sequence.advance(SECOND)
    assert sequence.running
    sequence.advance(SECOND + 2)
    assert log[1] is False
    assert not sequence.running
    assert sequence.failure == "failed at the end"


def test_stopped_sequence_fails_with_the_given_reason() -> None:
    sequence = CommandSequence(lambda text: None)
    sequence.begin(steps([]))
    sequence.advance(0)
    sequence.stop("the connection was lost")
    assert not sequence.running
    assert sequence.failure == "the connection was lost"
    sequence.advance(1)
