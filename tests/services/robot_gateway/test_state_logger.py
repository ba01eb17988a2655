from __future__ import annotations

import logging

import pytest

from services.robot_gateway.state_logger import StateLogger
from shared.messages import ArmState, ArmStates

REFUSED = "10.0.0.1:29999: connection refused"


def written(caplog: pytest.LogCaptureFixture) -> list[str]:
    lines = [record.getMessage() for record in caplog.records]
    caplog.clear()
    return lines


def test_every_trouble_is_written_once_and_its_end_too(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    logger = StateLogger()

    def tell(seconds: float, *alarms: str) -> list[str]:
        arm = ArmState(arm="right", driver="cr5", mode="idle", alarms=alarms)
        logger.take(ArmStates(stamp=round(1e9 * seconds), mode=ArmStates.DISARMED, arms=[arm]))
        return written(caplog)

    assert tell(0.0, "no feedback on port 30004 yet") == []
    assert tell(0.2, REFUSED) == []
    assert tell(0.8, REFUSED) == [f"right arm: {REFUSED}"]
    assert tell(2.0, "no feedback for 1.20 s") == []
    assert tell(2.6, "no feedback for 1.80 s") == ["right arm: no feedback for 1.80 s"]
    assert tell(9.0, REFUSED) == tell(9.6, "no feedback for 2.10 s") == []
    assert tell(10.0) == ["right arm: alarms cleared, idle"]
    assert tell(11.0, REFUSED) == []
    assert tell(12.0, REFUSED) == [f"right arm: {REFUSED}"]


def test_what_stops_the_cell_is_written_and_its_small_holds_are_not(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    logger = StateLogger()

    def tell(mode: int, cause: str, reason: str, waits: bool = False) -> list[tuple[str, str]]:
        moves = mode not in (ArmStates.DISARMED, ArmStates.FAULT) and not waits
        stands = cause == "acknowledged"
        logger.take(
            ArmStates(mode=mode, cause=cause, reason=reason, may_move=moves, needs_resume=stands)
        )
        lines = [(r.levelname, r.getMessage()) for r in caplog.records]
        caplog.clear()
        return lines

    assert tell(ArmStates.DISARMED, "boot", "started; a person arms") == []
    assert tell(ArmStates.ARMED, "", "armed") == [("INFO", "the arms may move: armed")]
    assert tell(ArmStates.HOLDING, "writer_holds", "waiting for a path") == []
    assert tell(ArmStates.MOVING, "", "following setpoints") == []
    stop = "no fresh setpoints for 100 ms"
    assert tell(ArmStates.HOLDING, "silence", stop, True) == [("WARNING", f"holding: {stop}")]
    assert tell(ArmStates.HOLDING, "silence", stop, True) == []
    assert tell(ArmStates.FAULT, "alarm", "right: collision", True) == [
        ("WARNING", "fault: right: collision")
    ]
    assert tell(ArmStates.HOLDING, "acknowledged", "it stands", True) == [
        ("INFO", "holding: it stands")
    ]
    assert tell(ArmStates.HOLDING, "writer_holds", "the arms do not follow: it stands") == [
        ("INFO", "the arms may move")
    ]
    assert tell(ArmStates.HOLDING, "silence", stop, True) == [("WARNING", f"holding: {stop}")]
    assert tell(ArmStates.ARMED, "", "resumed") == [("INFO", "the arms may move: resumed")]
    assert tell(ArmStates.DISARMED, "disarm", "by a person") == [("INFO", "disarmed: by a person")]
