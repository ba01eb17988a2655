from __future__ import annotations

from lariat.safety.guard.state_machine import SafetyState
from lariat.safety.motion.setpoint_sources import MAX_SEQUENCE_STEP, WRITER_SILENCE, SetpointSources
from lariat.safety.motion.validation import ChunkRefused

NOW = 10_000_000_000
ARMED = SafetyState("boot").armed()


class Writers:
    """Sources with the state of their cell."""

    def __init__(self) -> None:
        self.sources, self.safety = SetpointSources(), ARMED

    def take(self, session: str, sequence: int, start: int = NOW, now: int = NOW) -> int | str:
        """Clock offset of a message that is followed, or the rule by which it is refused."""
        answer = self.offer(session, sequence, start, now)
        if isinstance(answer, int):
            self.sources.accept(session, sequence, now, answer)
        return answer

    def offer(self, session: str, sequence: int, start: int = NOW, now: int = NOW) -> int | str:
        """Clock offset of an admitted message that is not followed, or the rule."""
        self.safety, answer = self.sources.admit(self.safety, session, sequence, now, start)
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


def test_writer_beside_the_followed_one_is_refused_and_stops_nothing() -> None:
    writers = Writers()
    writers.take("a", 3)
    assert writers.take("b", 1) == "ordered"
    assert writers.safety.may_move
    assert writers.take("a", 4) == 0
    assert writers.sources.writers(NOW) == ["a", "b"]


def test_writer_after_the_followed_one_holds_the_cell_until_a_person_goes_on() -> None:
    writers = Writers()
    writers.take("a", 3)
    later = NOW + round(WRITER_SILENCE * 1e9) + 1
    assert writers.take("b", 1, now=later) == "ordered"
    assert writers.safety.cause == "new_writer"
    assert writers.sources.writers(later) == ["b"]
    writers.safety = writers.safety.acknowledged().resumed()
    assert writers.take("b", 2, start=later, now=later) == 0
    assert writers.take("a", 5, now=later) == "ordered"


def test_sequence_is_not_run_ahead_of_a_writer_that_speaks() -> None:
    writers = Writers()
    writers.take("a", 3)
    assert writers.take("a", 3 + MAX_SEQUENCE_STEP + 1) == "ordered"
    assert writers.take("a", 2**62) == "ordered"
    assert writers.take("a", 4) == 0


def test_sequence_run_ahead_before_its_writer_speaks_shuts_it_out_for_a_moment_only() -> None:
    writers = Writers()
    assert writers.take("a", 2**62) == 0
    assert writers.take("a", 3, now=NOW + 20_000_000) == "ordered"
    assert writers.take("a", 8, now=NOW + 120_000_000) == 0
    assert writers.take("a", 9, now=NOW + 140_000_000) == 0


def test_sequences_of_many_made_up_writers_do_not_replace_the_followed_one() -> None:
    writers = Writers()
    writers.take("a", 3)
    for k in range(200):
        assert writers.take(f"stranger-{k}", 1) == "ordered"
    assert writers.safety.session == "a"
    assert writers.safety.may_move


def test_clock_far_off_is_offset_by_the_first_message_of_a_session() -> None:
    writers = Writers()
    behind = 3_600_000_000_000
    assert writers.take("a", 1, start=NOW - behind) == behind
    assert writers.take("a", 2, start=NOW - behind + 7) == behind


def test_clock_that_is_nearly_right_is_believed() -> None:
    assert Writers().take("a", 1, start=NOW - 249_000_000) == 0
    assert Writers().take("a", 1, start=NOW - 251_000_000) == 251_000_000


def test_message_that_is_not_followed_neither_advances_the_sequence_nor_sets_the_clock() -> None:
    writers = Writers()
    hour = 3_600_000_000_000
    assert writers.offer("a", MAX_SEQUENCE_STEP, start=NOW - hour) == hour
    assert writers.take("a", 3) == 0
    assert writers.offer("a", 3 + MAX_SEQUENCE_STEP) == 0
    assert writers.take("a", 4) == 0


def test_hold_does_not_set_the_clock() -> None:
    writers = Writers()
    hour = 3_600_000_000_000
    writers.offer("a", 1)
    writers.sources.accept("a", 1, NOW)
    assert writers.take("a", 2, start=NOW - hour) == hour
