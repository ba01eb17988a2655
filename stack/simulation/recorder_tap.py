"""Recorder of a run in simulated time."""

from __future__ import annotations

from pathlib import Path

from services.recorder.foxglove_scene import FoxgloveScene
from shared import topics
from shared.recording import Writer
from shared.scenario import Scenario
from stack.simulation.simulated_time import Delivery, SimulatedStack


class RecorderTap:
    """Tap that records every message, and a Foxglove scene for each perceived rope."""

    def __init__(self, path: Path, scenario: Scenario, stack: SimulatedStack) -> None:
        """Create the file.

        Args:
            path: The file, which must not exist.
            scenario: Scenario of the run.
            stack: Stack whose time is the start of the recording.

        Raises:
            OSError: It exists already or cannot be written.
        """
        self._writer = Writer(path, scenario, stack.now, {"time": "simulated"})
        self._scene = FoxgloveScene(scenario)
        self._drawings = 0

    def __call__(self, delivery: Delivery) -> None:
        """Record one message."""
        self._writer.write(
            delivery.topic,
            delivery.payload,
            delivery.publisher,
            delivery.sequence,
            delivery.received,
        )
        self._scene.take(delivery.key, delivery.payload)
        if delivery.key == topics.ROPE_NODES.key:
            drawing = self._scene.draw(delivery.received)
            payload = drawing.SerializeToString(deterministic=True)
            self._writer.write(
                topics.VIEW_SCENE, payload, "recorder-0", self._drawings, delivery.received
            )
            self._drawings += 1

    def close(self) -> None:
        """Close the file."""
        self._writer.close()
