"""A reference recording: what the services said once, they say again.

After a change that is meant to change trajectories, say so in the commit and take the new one:
`lariat run scenarios/three-cylinders.toml --set sensing.source=truth --stop-when-reached --record
tests/replay/three-cylinders.mcap` (the old file removed first), or keep the recorded inputs and
take only the new outputs: `lariat replay tests/replay/three-cylinders.mcap --update`.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lariat import replay

REFERENCE = Path(__file__).parent / "three-cylinders.mcap"


@pytest.mark.parametrize("service", ["controller", "perception", "planner", "robot_gateway"])
def test_a_service_says_what_it_said_in_the_reference_recording(
    service: str, capsys: pytest.CaptureFixture[str]
):
    code = replay.main(REFERENCE, service=(service,), json=True)
    answer = json.loads(capsys.readouterr().out)
    assert code == 0, json.dumps(answer["services"][0]["first_differences"][:3], indent=2)
    assert answer["services"][0]["notes"] == []
    assert sum(answer["services"][0]["compared"].values()) >= 5


def test_the_reference_recording_stays_small():
    assert REFERENCE.stat().st_size < 2_000_000
