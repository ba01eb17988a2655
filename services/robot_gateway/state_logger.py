"""State logger: writes changes of the cell's state to the log."""

from __future__ import annotations

import logging
import re

from lariat.trajectory import SECOND
from shared.messages import ArmState, ArmStates

log = logging.getLogger(__name__)

LEAST_ALARM_DURATION = SECOND // 2
"""Time for which an alarm of an arm must last before it is logged [ns]."""


class StateLogger:
    """Logs stops of the cell and lasting alarms of its arms, each once."""

    def __init__(self) -> None:
        self._logged_cell = (ArmStates.DISARMED, "")
        self._since: dict[tuple[str, str], int] = {}
        """Beginning of each alarm of an arm, until the arm has none [ns]."""
        self._logged: set[tuple[str, str]] = set()

    def take(self, state: ArmStates) -> None:
        """Log what has changed with the state after a tick."""
        self._log_cell(state)
        for arm in state.arms:
            self._log_arm(arm, state.stamp)

    def _log_cell(self, state: ArmStates) -> None:
        stopped = state.mode in (ArmStates.HOLDING, ArmStates.FAULT) and not state.may_move
        mode = ArmStates.ARMED if state.may_move else state.mode
        summary = (mode, state.cause if stopped else "")
        if summary == self._logged_cell:
            return
        self._logged_cell = summary
        name = "the arms may move" if mode == ArmStates.ARMED else ArmStates.Mode.Name(mode).lower()
        # A controller that still holds gives the reason for which the arms stood until this moment.
        words = name if state.may_move and state.cause else f"{name}: {state.reason}"
        asks = stopped and not state.needs_resume
        log.log(logging.WARNING if asks else logging.INFO, words)

    def _log_arm(self, arm: ArmState, now: int) -> None:
        if not arm.alarms:
            for key in [k for k in self._since if k[0] == arm.arm]:
                del self._since[key]
            if any(name == arm.arm for name, _ in self._logged):
                self._logged = {k for k in self._logged if k[0] != arm.arm}
                log.info(f"{arm.arm} arm: alarms cleared, {arm.mode}")
            return
        words = "; ".join(arm.alarms)
        # Numbers in an alarm change continually; without them it counts as the same alarm.
        key = (arm.arm, re.sub(r"\d+(\.\d+)?", "#", words))
        begun = self._since.setdefault(key, now)
        if now - begun >= LEAST_ALARM_DURATION and key not in self._logged:
            self._logged.add(key)
            log.warning(f"{arm.arm} arm: {words}")
