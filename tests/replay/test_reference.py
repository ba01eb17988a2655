"""Reference recordings: every service publishes again what it published when they were made.

`python -m tests.replay.record` makes them; after a change that is meant to change outputs, see
there.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from rich.console import Console

from cli import replay
from shared import topics
from shared.messages import ArmStates
from shared.recording import Recording
from stack import services

FOLDER = Path(__file__).parent
LOOP = services.NAMES
REPLAYED = {
    "rope": LOOP,
    "markers": LOOP,
    "requests": (*LOOP, "recorder", "dashboard"),
    "camera": ("camera",),
}
"""Services by recording."""


@pytest.mark.parametrize(
    ("name", "service"), [(name, s) for name, all_ in REPLAYED.items() for s in all_]
)
def test_a_service_publishes_what_it_published_in_the_reference(
    name: str, service: str, tmp_path: Path
):
    recording = Recording.open(FOLDER / f"{name}.mcap")
    scenario = recording.scenario(tmp_path)
    (result,) = replay.replay(recording, scenario, (service,), Console(stderr=True))
    assert result.differences[:3] == []
    assert result.notes == []
    assert sum(result.compared.values()) >= 2


def test_an_updated_reference_keeps_its_messages_in_their_order(tmp_path: Path):
    path = tmp_path / "requests.mcap"
    shutil.copy(FOLDER / path.name, path)

    def places(file: Path) -> list[tuple[str, str, int, int, int]]:
        messages = Recording.open(file).messages()
        return [(e.key, e.publisher, e.sequence, e.log_time, e.publish_time) for e in messages]

    assert replay.main(path, service=("sim", "dashboard"), update=True) == 0
    assert places(path) == places(FOLDER / path.name)
    assert replay.main(path, service=("recorder", "dashboard")) == 0


def test_the_references_cover_every_service():
    assert {service for traced in REPLAYED.values() for service in traced} == set(services.ALL)
    for name, traced in REPLAYED.items():
        assert set(replay.traced_services(Recording.open(FOLDER / f"{name}.mcap"))) == set(traced)


def test_the_references_hold_adaptation_markers_a_refusal_a_hold_and_an_acknowledgement():
    rope = Recording(FOLDER / "rope.mcap").messages([topics.CONTROLLER_PARAMETERS.key])
    stiffnesses = [entry.parse().rod.bending_stiffness.value for entry in rope]
    first, last = stiffnesses[0], stiffnesses[-1]
    assert abs(last / first - 1.0) > 0.2

    scenes = list(Recording(FOLDER / "markers.mcap").messages([topics.SCENE_STATE.key]))
    places = {o.name: list(o.position) for o in scenes[-1].parse().obstacles}
    assert places["low"][:2] == pytest.approx([-0.14, 0.02], abs=0.01)

    requests = Recording(FOLDER / "requests.mcap")
    refusals = [e.parse().refusal for e in requests.messages([topics.TASK_STATE.key])]
    assert any(refusals)
    arms = [e.parse() for e in requests.messages([topics.ARM_STATE.key])]
    held = [s.mode == ArmStates.HOLDING and s.needs_acknowledgement for s in arms]
    assert any(held)
    assert not held[-1]


def test_the_references_stay_small():
    assert sum(path.stat().st_size for path in FOLDER.glob("*.mcap")) < 5_000_000
