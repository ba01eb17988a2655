"""A recorded camera plays as a camera, and perception sees the rope in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import find, parse
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from services.camera.options import CameraOptions
from services.camera.service import build
from services.perception.service import PerceptionService
from shared import topics
from shared.messages import chain, stamp_of
from shared.runtime.service import Mailbox, Received
from stack.simulation.recorder_tap import RecorderTap
from tests.services.perception.cell import Cell, scenario

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cell]:
    path = tmp_path_factory.mktemp("camera") / "run.mcap"
    cell = Cell(scenario())
    tap = RecorderTap(path, scenario(), cell.stack)
    cell.stack.taps.append(tap)
    cell.run(1.5)
    tap.close()
    return path, cell


def outside():
    of = scenario()
    return replace(of, sensing=replace(of.sensing, outside=True))


def test_a_recording_plays_at_its_own_pace_and_is_seen(recorded: tuple[Path, Cell]) -> None:
    path, cell = recorded
    camera = build(outside(), "camera-0", CameraOptions(recording=path, repeat=True))
    perception = PerceptionService(outside())
    mailbox = Mailbox(perception.reads)
    begin, stamps, seen = 500 * SECOND, [], []
    numbers = dict.fromkeys((COLOR.key, DEPTH.key, CALIBRATION.key), 0)
    for k in range(200):
        now = begin + k * SECOND // 60
        for topic, message in camera.step(Mailbox(()).take(), now):
            mailbox.deliver(topic.key, Received(message, "camera-0", numbers[topic.key], now))
            numbers[topic.key] += 1
            if topic.key == COLOR.key:
                stamps.append(stamp_of(message))
        seen += [m for t, m in perception.step(mailbox.take(), now) if t == topics.ROPE_NODES]
    gaps = np.diff(stamps) / SECOND
    # 30 Hz, looked for at 60 Hz; it begins again after 1.5 s.
    assert len(stamps) == pytest.approx(100, abs=6)
    # On the grid of the arm states that the lab stamps by.
    assert np.median(gaps) == pytest.approx(1.0 / 30.0, abs=2e-3)
    assert "offset" in camera.note
    truth = next(iter(cell.truth().values()))
    found = [m for m in seen if m.positions]
    assert len(found) > 0.9 * len(stamps)
    for message in found:
        assert np.mean(np.linalg.norm(chain(message.positions) - truth, axis=1)) < 3e-3


def test_a_recording_ends_when_it_shall_not_repeat(recorded: tuple[Path, Cell]) -> None:
    camera = build(outside(), "c", CameraOptions(recording=recorded[0], repeat=False))
    for k in range(300):
        list(camera.step(Mailbox(()).take(), SECOND + k * SECOND // 60))
    assert camera.note in ("no exposure for 3 s", "no exposure for 4 s")


def test_a_camera_beside_the_simulated_one_is_refused(recorded: tuple[Path, Cell]) -> None:
    with pytest.raises(ConfigurationError, match=r"sensing\.outside = true"):
        build(scenario(), "c", CameraOptions(recording=recorded[0]))


def test_a_recording_without_the_camera_is_refused_by_name(recorded: tuple[Path, Cell]) -> None:
    options = CameraOptions(recording=recorded[0], camera="side")
    with pytest.raises(ConfigurationError, match="camera/side/color"):
        build(outside(), "c", options)


def test_only_devices_need_serial_numbers_where_there_are_several(
    recorded: tuple[Path, Cell],
) -> None:
    text = find("two-cameras").read_text()
    both = parse(text.replace('"camera"', '"camera"\noutside = true'), Path())
    with pytest.raises(ConfigurationError, match=r"cameras\.overhead\.serial is missing"):
        build(both, "c")
    # A recording is read for each camera; this one holds the first of them alone.
    with pytest.raises(ConfigurationError, match="camera/side/color"):
        build(both, "c", CameraOptions(recording=recorded[0]))
