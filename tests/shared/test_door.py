"""A door turns every exception of the handling of others' things into a refusal."""

from __future__ import annotations

import pytest

from lariat.configuration import MAX_REASON_LENGTH, ConfigurationError, refusing
from shared.door import MAX_SOURCES, Door


def raised(door: Door, error: Exception) -> str:
    with door.guard("a request") as outcome:
        raise error
    return outcome.refusal


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ValueError("name = 3"), "name = 3"),
        (FileNotFoundError(2, "No such file", "x"), "[Errno 2] No such file: 'x'"),
        (RecursionError("maximum"), "it is nested too deeply"),
        (MemoryError(), "it takes more memory than there is"),
        (KeyError("x"), "KeyError: 'x'"),
        (ValueError("two\nlines"), "two lines"),
    ],
)
def test_every_exception_becomes_a_reason(error: Exception, words: str) -> None:
    door = Door()
    assert raised(door, error) == words
    assert door.refused == 1
    with pytest.raises(ConfigurationError, match="cannot read x: "), refusing("cannot read x"):
        raise error


def test_what_goes_well_is_not_refused() -> None:
    door = Door()
    with door.guard("a request") as outcome:
        pass
    assert (outcome.refusal, door.refused) == ("", 0)


def test_reason_quotes_no_more_than_its_beginning() -> None:
    assert len(raised(Door(), ValueError("x" * 10_000))) == MAX_REASON_LENGTH


def test_log_says_at_each_power_of_ten_what_is_refused(caplog: pytest.LogCaptureFixture) -> None:
    door = Door()
    for _ in range(120):
        raised(door, ValueError("bad"))
    assert [r.getMessage().partition("(")[2] for r in caplog.records] == [
        "1 so far)",
        "10 so far)",
        "100 so far)",
    ]
    # A fault of the program shows where it is.
    raised(door, KeyError("x"))
    door.refuse("another", "x", KeyError("x"))
    assert caplog.records[-1].exc_info


def test_made_up_names_do_not_fill_the_log(caplog: pytest.LogCaptureFixture) -> None:
    door = Door()
    for k in range(10_000):
        door.refuse(f"task/state from p-{k}", "bad")
    assert door.refused == 10_000
    assert len(caplog.records) < MAX_SOURCES + 10
    assert "refused others" in caplog.text


def test_strict_door_does_not_hide_a_fault_of_the_program() -> None:
    door = Door()
    door.strict = True
    assert raised(door, ValueError("bad")) == "bad"
    with pytest.raises(KeyError):
        raised(door, KeyError("x"))


def test_signal_that_ends_the_process_passes() -> None:
    with pytest.raises(KeyboardInterrupt), Door().guard("a request"):
        raise KeyboardInterrupt
