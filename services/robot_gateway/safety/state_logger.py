"""What of the cell's state is worth a line in the log: who watches it may not look at a page."""

from __future__ import annotations

import logging
import re

from shared.messages import ArmState, ArmStates
from shared.service import SECOND

log = logging.getLogger(__name__)

LASTS = SECOND // 2
"""For which something must be wrong with an arm before it is written down [ns]."""


class Journal:
    """Writes down what changed."""

    def __init__(self) -> None:
        self._said = (ArmStates.DISARMED, "")
        self._since: dict[tuple[str, str], int] = {}
        """When each thing began to be wrong with an arm, until nothing is [ns]."""
        self._written: set[tuple[str, str]] = set()

    def take(self, state: ArmStates) -> None:
        """The state after a tick."""
        self._take_cell(state)
        for arm in state.arms:
            self._take_arm(arm, state.stamp)

    def _take_cell(self, state: ArmStates) -> None:
        stopped = state.needs_acknowledgement or state.mode == ArmStates.FAULT
        free = state.mode in (ArmStates.ARMED, ArmStates.MOVING, ArmStates.HOLDING)
        mode = ArmStates.ARMED if free and not stopped else state.mode
        said = (mode, state.cause if stopped else "")
        if said == self._said:
            return
        self._said = said
        name = "the arms may move" if mode == ArmStates.ARMED else ArmStates.Mode.Name(mode).lower()
        words = f"{name}: {state.reason}"
        log.log(logging.WARNING if stopped else logging.INFO, words)

    def _take_arm(self, arm: ArmState, now: int) -> None:
        if not arm.alarms:
            for key in [k for k in self._since if k[0] == arm.arm]:
                del self._since[key]
            if any(name == arm.arm for name, _ in self._written):
                self._written = {k for k in self._written if k[0] != arm.arm}
                log.info(f"{arm.arm} arm: well again, {arm.mode}")
            return
        words = "; ".join(arm.alarms)
        # Times and distances in the words change all the while.
        key = (arm.arm, re.sub(r"\d+(\.\d+)?", "#", words))
        begun = self._since.setdefault(key, now)
        if now - begun >= LASTS and key not in self._written:
            self._written.add(key)
            log.warning(f"{arm.arm} arm: {words}")
