from __future__ import annotations

from services.robot_gateway.motion.setpoint_sources import SetpointSources
from services.robot_gateway.motion.validation import ChunkRefused
from services.robot_gateway.safety.state_machine import SafetyState

NOW = 10_000_000_000
ARMED = SafetyState("boot").armed()


class Writers:
    """Sources with the state of their cell."""

    def __init__(self) -> None:
        self.sources, self.safety = SetpointSources(), ARMED

    def take(self, session: str, sequence: int, start: int = NOW) -> int | str:
        """Clock offset of an admitted message, or the rule by which it is refused."""
        self.safety, answer = self.sources.admit(self.safety, session, sequence, NOW, start)
        return answer.rule if isinstance(answer, ChunkRefused) else answer


def test_messages_of_one_session_are_admitted_in_sequence() -> None:
    writers = Writers()
    assert [writers.take("a", k) for k in (3, 4, 7)] == [0, 0, 0]
    assert writers.safety.session == "a"


def test_sequence_that_does_not_grow_is_refused() -> None:
    writers = Writers()
    writers.take("a", 3)
    assert writers.take("a", 3) == "ordered"
    assert writers.take("a", 2) == "ordered"
    assert writers.take("a", 4) == 0


def test_message_without_a_session_is_refused() -> None:
    writers = Writers()
    assert writers.take("", 1) == "ordered"
    assert writers.safety == ARMED


def test_second_writer_holds_the_cell_and_is_refused_until_acknowledged() -> None:
    writers = Writers()
    writers.take("a", 3)
    assert writers.take("b", 1) == "ordered"
    assert writers.safety.cause == "new_writer"
    assert writers.take("a", 4) == 0
    writers.safety = writers.safety.acknowledged()
    assert writers.take("b", 2) == 0
    assert writers.take("a", 5) == "ordered"


def test_clock_far_off_is_offset_by_the_first_message_of_a_session() -> None:
    writers = Writers()
    behind = 3_600_000_000_000
    assert writers.take("a", 1, start=NOW - behind) == behind
    assert writers.take("a", 2, start=NOW - behind + 7) == behind


def test_clock_that_is_nearly_right_is_believed() -> None:
    assert Writers().take("a", 1, start=NOW - 249_000_000) == 0
    assert Writers().take("a", 1, start=NOW - 251_000_000) == 251_000_000
