from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.safety.guard.consent import CONSENT_TIMEOUT, MAX_ECHO_AGE, HoldToRun, SignOfLife

NOW = 5_000_000_000
TIMEOUT = round(CONSENT_TIMEOUT * 1e9)
SIGN = SignOfLife("approach-1", "boot-1", 1, NOW)


def begun() -> HoldToRun:
    consent = HoldToRun("boot-1")
    consent.begin("approach-1", NOW)
    return consent


def test_consent_ends_without_signs_of_life() -> None:
    consent = begun()
    assert not consent.ended(NOW + TIMEOUT)
    assert consent.ended(NOW + TIMEOUT + 1)


def test_sign_of_life_prolongs_the_consent() -> None:
    consent = begun()
    consent.take(replace(SIGN, answers=NOW + TIMEOUT), NOW + TIMEOUT)
    assert not consent.ended(NOW + 2 * TIMEOUT)


@pytest.mark.parametrize(
    "changes",
    [
        {"command": "approach-0"},
        {"boot": "boot-0"},
        {"sequence": -1},
        {"answers": NOW + TIMEOUT - round(MAX_ECHO_AGE * 1e9) - 1},
        {"answers": NOW + TIMEOUT + 1},
    ],
    ids=["other command", "other start", "repeated", "stale", "of a state to come"],
)
def test_other_signs_of_life_do_not(changes: dict) -> None:
    consent = begun()
    consent.take(replace(SIGN, **changes), NOW + TIMEOUT)
    assert consent.ended(NOW + TIMEOUT + 1)


def test_nobody_consents_before_a_command() -> None:
    assert HoldToRun("boot-1").ended(NOW)
