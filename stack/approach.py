"""Approach of a running cell's arms to the start, kept going by a person who holds a button."""

from __future__ import annotations

import time
from collections.abc import Callable

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmCommand, ArmStates, Consent
from stack.client import POLL_PERIOD, Client, RequestFailed

CONSENT_PERIOD = 20_000_000
"""Time between two signs of life [ns]."""
SILENCE_TIMEOUT = 2 * SECOND
"""Longest wait for a state of the gateway [ns]."""


def approach(client: Client, shown: ArmStates, distance: float, is_held: Callable[[], bool]) -> str:
    """Let the arms go to the start, at a distance that the person saw, while the button is held."""
    states = client.bus.subscribe(topics.ARM_STATE)
    signs = client.matched_publisher(topics.ARM_CONSENT)
    command = client.send_to_arms(
        ArmCommand.APPROACH,
        shown,
        approach_distance=distance,
        approach_angle=shown.approach_angle,
    )
    newest, heard = shown, client.now()
    sent = number = 0
    answered = False
    while True:
        for _, item in states.take():
            newest, heard = item.message, client.now()
            if newest.last_command == command and newest.refusal and not answered:
                raise RequestFailed(f"refused: {newest.refusal}")
            answered |= newest.last_command == command
        now = client.now()
        if now - heard > SILENCE_TIMEOUT:
            raise RequestFailed("the robot gateway has fallen silent")
        if answered and not newest.approaching:
            return "" if newest.may_move else newest.reason
        if now - sent >= CONSENT_PERIOD and is_held():
            sent, number = now, number + 1
            signs.put(
                Consent(
                    command=command,
                    boot=newest.boot,
                    sequence=number,
                    stamp=now,
                    answers=newest.stamp,
                )
            )
        time.sleep(POLL_PERIOD)
