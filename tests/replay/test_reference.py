"""A reference recording: what the services said once, they say again.

After a change that is meant to change trajectories, say so in the commit and take the new one:
`lariat run scenarios/three-cylinders.toml --set sensing.source=truth --stop-when-reached --record
tests/replay/three-cylinders.mcap` (the old file removed first), or keep the recorded inputs and
take only the new outputs: `lariat replay tests/replay/three-cylinders.mcap --update`.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from cli import replay
from shared.recording import Recording

REFERENCE = Path(__file__).parent / "three-cylinders.mcap"


@pytest.mark.parametrize("service", ["controller", "perception", "planner", "robot_gateway"])
def test_a_service_says_what_it_said_in_the_reference_recording(service: str, tmp_path: Path):
    recording = Recording.open(REFERENCE)
    scenario = recording.scenario(tmp_path)
    (result,) = replay.replay(recording, scenario, (service,), Console(stderr=True))
    assert result.differences[:3] == []
    assert result.notes == []
    assert sum(result.compared.values()) >= 3


def test_the_reference_recording_stays_small():
    assert REFERENCE.stat().st_size < 2_000_000
