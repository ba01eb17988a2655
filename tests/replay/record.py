"""Record the reference recordings anew: `python -m tests.replay.record [NAME ...] [--folder F]`.

Together they hold every service, both plants, an ideal and an emulated arm, a fixed end, images,
markers, an adaptation that changes the rope's parameters, a refusal, a hold and an
acknowledgement. Times and images are as small as that allows: all files together stay below 5 MB.

A change that is meant to change trajectories takes new references: remove the old files, run this,
and say so in the commit. Where only words or last digits differ, `lariat replay FILE --update`
keeps the recorded inputs and takes the new outputs.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tyro

from dashboard.options import DashboardOptions
from dashboard.service import build as build_dashboard
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from services.camera.options import CameraOptions
from services.camera.service import build as build_camera
from services.recorder.options import RecorderOptions
from services.recorder.service import build as build_recorder
from shared import topics
from shared.messages import ArmCommand, Obstacle, SceneRequest, TaskRequest
from shared.recording import Writer
from shared.runtime.free_port import free_port
from shared.runtime.service import Inbox, Publication
from stack import services
from stack.replay.outside_inputs import CAMERA_RECORDING
from stack.simulation import closed_loop
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import START, Delivery, SimulatedStack, session_id

FOLDER = Path(__file__).parent
SCENARIOS = Path(__file__).parents[2] / "scenarios"

ROPE = (
    "sensing.resolution=[160,120]",
    "sensing.field_of_view=45.0",
    "sensing.rate=15.0",
    "run.time_limit=2.0",
)
MARKERS = (
    "sensing.resolution=[320,240]",
    "sensing.field_of_view=40.0",
    "sensing.rate=5.0",
    "rope.node_count=24",
    "events=[]",
    "run.time_limit=1.2",
)
REQUESTS = (
    "sensing.source=truth",
    "sensing.node_noise=0.0005",
    "plant.model=rod",
    "rope.node_count=20",
    "run.time_limit=1.6",
)
CAMERA_TIME = SECOND // 2
"""Simulated time for which the recorded camera plays [ns]."""


class FileTap:
    """Writes every message of a simulated stack to a recording."""

    def __init__(self, path: Path, scenario: Scenario, **metadata: str) -> None:
        self._writer = Writer(path, scenario, START, {"time": "simulated", **metadata})

    def __call__(self, delivery: Delivery) -> None:
        """Write one message."""
        self._writer.write(
            delivery.topic,
            delivery.payload,
            delivery.publisher,
            delivery.sequence,
            delivery.received,
        )

    def close(self) -> None:
        """End the file."""
        self._writer.close()


class SimulatedRecorder:
    """A recorder in a simulated stack: each step hears all messages since the step before."""

    name = "recorder"

    def __init__(self, scenario: Scenario, folder: Path) -> None:
        self.service: Any = build_recorder(
            scenario, session_id("recorder"), RecorderOptions(folder, least_free=0.0)
        )
        self.reads, self.writes = self.service.reads, self.service.writes
        self.rate, self.latency = self.service.rate, self.service.latency
        self._heard: list[Delivery] = []

    def hear(self, delivery: Delivery) -> None:
        """Take one message of the stack."""
        self._heard.append(delivery)

    def warm_up(self) -> None:
        """Compile nothing."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Hand over what was heard, and step; its file is named in the default folder."""
        for delivery in self._heard:
            self.service.tap(delivery)
        self._heard.clear()
        for topic, message in self.service.step(inbox, now):
            if topic.key == topics.RUN_RECORD.key and message.file:
                message.file = f"recordings/{Path(message.file).name}"
            yield Publication(topic, message)


class Person:
    """Operates the dashboard while a run goes on."""

    def __init__(self, outbox: Any) -> None:
        self._outbox = outbox
        self._looks = 0

    def __call__(self, stack: SimulatedStack, scorer: Scorer) -> None:
        """Ask for what is due at this look, ten of which come in a simulated second of the run."""
        if not scorer.started:
            return
        self._looks += 1
        arms = stack.latest(topics.ARM_STATE)
        match self._looks:
            case 2:
                self._outbox.request_task(TaskRequest.SET, "a setting", key="colour", value="red")
            case 4:
                post = Obstacle(name="post", shape="sphere", position=[0.3, 0.3, 0.3], radius=0.02)
                self._outbox.request_scene(SceneRequest.ADD, post, "an obstacle")
            case 6:
                self._outbox.command_arms(ArmCommand.HOLD, arms, "hold")
            case 8:
                self._outbox.command_arms(ArmCommand.ACKNOWLEDGE, arms, "acknowledge")
            case 9:
                self._outbox.command_arms(ArmCommand.RESUME, arms, "resume")
            case 10:
                self._outbox.request_task(TaskRequest.START, "start")


def record_rope(path: Path) -> None:
    """Camera, MuJoCo, a fixed end, an emulated CR5, and an adaptation from a wrong stiffness."""
    _run(path, load_with(SCENARIOS / "rope.toml", ROPE))


def record_markers(path: Path) -> None:
    """Camera, MuJoCo, ideal arms, and obstacles whose places markers tell."""
    _run(path, load_with(SCENARIOS / "markers.toml", MARKERS))


def record_requests(path: Path) -> None:
    """The rod as plant, ideal arms, recorder and dashboard; a refusal, a hold, its end."""
    scenario = load_with(SCENARIOS / "three-cylinders.toml", REQUESTS)
    tap = FileTap(path, scenario)
    with tempfile.TemporaryDirectory() as folder:
        recorder = SimulatedRecorder(scenario, Path(folder))
        dashboard = build_dashboard(
            scenario, session_id("dashboard"), DashboardOptions(port=free_port())
        )
        loop = [services.build(name, scenario, session_id(name)) for name in services.NAMES]
        try:
            closed_loop.run(
                scenario,
                watch=Person(dashboard.outbox),
                taps=(tap, recorder.hear),
                members=(*loop, recorder, dashboard),
            )
        finally:
            dashboard.close()
            recorder.service.close()
    tap.close()


def record_camera(path: Path) -> None:
    """A camera from outside that plays the images of `rope.mcap`."""
    source = "rope.mcap"
    scenario = load_with(SCENARIOS / "rope.toml", [*ROPE, "sensing.outside=true"])
    tap = FileTap(path, scenario, **{CAMERA_RECORDING: source})
    camera = build_camera(scenario, session_id("camera"), CameraOptions(path.parent / source))
    stack = SimulatedStack([camera], [tap])
    stack.warm_up()
    stack.advance_to(START + CAMERA_TIME)
    camera.close()
    tap.close()


def _run(path: Path, scenario: Scenario) -> None:
    tap = FileTap(path, scenario)
    closed_loop.run(scenario, taps=(tap,))
    tap.close()


REFERENCES = {
    "rope": record_rope,
    "markers": record_markers,
    "requests": record_requests,
    "camera": record_camera,
}
"""By the file's name; `camera` plays the images of `rope`."""


def main(names: tyro.conf.Positional[tuple[str, ...]] = (), /, folder: Path = FOLDER) -> None:
    """Record references anew; the files must not exist.

    Args:
        names: Of the references; default: all.
        folder: Where the files go.
    """
    for name in names or REFERENCES:
        REFERENCES[name](folder / f"{name}.mcap")


if __name__ == "__main__":
    tyro.cli(main)
