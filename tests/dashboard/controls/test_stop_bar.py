from __future__ import annotations

import json

import pytest

from dashboard.controls.hold_path import HoldPath
from dashboard.controls.stop_bar import MAX_SIGN_GAP, STATUS_PERIOD, StopBar
from dashboard.outbox import Outbox
from dashboard.web.cell_socket import Approach
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmCommand, ArmStates, Consent

START = 1_000 * SECOND
STEP = SECOND // 30
AWAY = ArmStates(boot="boot-7", stamp=5, needs_approach=True, approach_distance=0.334)


class Page:
    """Stop bar that is stepped, and what it has sent."""

    def __init__(self, newest: ArmStates | None = None) -> None:
        self.outbox = Outbox("dashboard-ab")
        self.bar = StopBar(self.outbox, HoldPath("dashboard-ab"))
        self.newest = newest
        self.now = START
        self.status: dict = {}
        self.step()

    def step(self, *arms: ArmStates, after: int = STEP) -> list:
        self.now += after
        if arms:
            self.newest = arms[-1]
        status = self.bar.step(self.newest, 0.0, self.now)
        self.status = json.loads(status) if status else self.status
        return [p.message for p in self.outbox.take(self.now)]


@pytest.mark.parametrize("mode", [ArmStates.DISARMED, ArmStates.HOLDING, ArmStates.FAULT])
def test_arms_that_stand_until_a_person_acts_are_shown_as_stopped(mode: ArmStates.Mode) -> None:
    page = Page()
    page.step(ArmStates(mode=mode), after=STATUS_PERIOD)
    assert page.status["stopped"]
    page.step(ArmStates(mode=mode, may_move=True), after=STATUS_PERIOD)
    assert not page.status["stopped"]


def test_approach_is_offered_with_its_distance() -> None:
    page = Page(AWAY)
    page.step(AWAY, after=STATUS_PERIOD)
    assert page.status["approach"]["label"] == "Approach by 334.0 mm"
    page.step(ArmStates(), after=STATUS_PERIOD)
    assert page.status["approach"] is None


def test_press_requests_one_approach_and_consents_while_signs_come() -> None:
    page = Page(AWAY)
    sign = Approach(press=3, distance=0.334, angle=0.1)
    page.bar.approach(sign)
    (command,) = page.step()
    assert (command.action, command.boot) == (ArmCommand.APPROACH, "boot-7")
    assert (command.approach_distance, command.approach_angle) == (0.334, 0.1)
    for k in range(1, 4):
        page.bar.approach(sign)
        (consent,) = page.step()
        assert isinstance(consent, Consent)
        assert (consent.command, consent.boot, consent.sequence) == (command.id, "boot-7", k)
    assert page.step() == [], "no sign, no consent"


def test_signs_after_the_release_count_for_nothing() -> None:
    page = Page(AWAY)
    sign = Approach(press=3, distance=0.334, angle=0.0)
    page.bar.approach(sign)
    page.step()
    page.bar.release(3)
    page.bar.approach(sign)
    assert page.step() == []


def test_signs_that_wait_when_the_button_is_released_count_for_nothing() -> None:
    page = Page(AWAY)
    sign = Approach(press=3, distance=0.334, angle=0.0)
    page.bar.approach(sign)
    page.step()
    for _ in range(5):
        page.bar.approach(sign)
    page.bar.release(3)
    assert page.step() == []


def test_press_whose_signs_were_late_has_ended() -> None:
    page = Page(AWAY)
    sign = Approach(press=3, distance=0.334, angle=0.0)
    page.bar.approach(sign)
    page.step()
    page.step(after=MAX_SIGN_GAP + STEP)
    page.bar.approach(sign)
    assert page.step() == []
    page.step(after=STATUS_PERIOD)
    assert page.status["ended"] == 3


def test_hold_ends_an_approach_and_a_second_person_cannot_join_it() -> None:
    page = Page(AWAY)
    page.bar.approach(Approach(press=3, distance=0.334, angle=0.0))
    page.step()
    page.bar.approach(Approach(press=4, distance=0.334, angle=0.0))
    assert page.step() == []
    page.bar.hold()
    page.bar.approach(Approach(press=3, distance=0.334, angle=0.0))
    assert page.step() == []


def test_consents_have_a_topic_of_their_own() -> None:
    outbox = Outbox("dashboard-ab")
    outbox.consent("dashboard-ab-1", ArmStates(boot="boot-7", stamp=9))
    (publication,) = outbox.take(START)
    assert publication.topic == topics.ARM_CONSENT
    assert (publication.message.answers, publication.message.stamp) == (9, START)
