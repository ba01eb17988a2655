"""Film of recorded runs."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from docs.film import __main__ as film
from docs.film.picture import GOAL, ROPE, Painter
from docs.film.recorded_run import Instant, RecordedRun
from lariat.geometry.obstacles import Obstacle

RECORDING = Path(__file__).parents[2] / "replay" / "three-cylinders.mcap"
SIZE = (160, 96)


def instant(*obstacles: Obstacle) -> Instant:
    rope = np.zeros((9, 3))
    rope[:, 0], rope[:, 2] = np.linspace(-0.2, 0.2, 9), 0.1
    goal = rope + np.array([0.0, 0.0, 0.2])
    return Instant(rope, (), goal, np.zeros((2, 0, 3)), obstacles, 0.2)


def pixels_near(image: np.ndarray, color: tuple[int, int, int]) -> int:
    return int(np.sum(np.abs(image.astype(int) - color).max(axis=2) < 40))


def test_a_recorded_run_comes_to_its_goal():
    run = RecordedRun(RECORDING)
    first, last = run.at(0.0), run.at(run.duration)
    assert first.error > 0.1
    assert last.error < 0.002
    assert len(last.grips) == 2
    assert last.path.shape[1] > 10
    between = run.at(run.duration / 2.0)
    assert last.error < between.error < first.error
    assert np.array_equal(run.at(run.duration + 5.0).nodes, last.nodes)


def test_a_body_hides_what_is_behind_it():
    painter = Painter(SIZE, (0.0, -1.0, 0.3), (0.0, 0.0, 0.15))
    wall = Obstacle("box", (0.0, -0.2, 0.1), size=(1.0, 0.02, 0.2))
    behind = Obstacle("box", (0.0, 0.2, 0.1), size=(1.0, 0.02, 0.2))
    free = pixels_near(painter.paint(instant(), 0.01, 0.012), ROPE)
    assert free > 50
    assert pixels_near(painter.paint(instant(behind), 0.01, 0.012), ROPE) > 0.8 * free
    assert pixels_near(painter.paint(instant(wall), 0.01, 0.012), ROPE) == 0
    assert pixels_near(painter.paint(instant(wall), 0.01, 0.012), GOAL) > 20


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere", "capsule"])
def test_a_body_is_as_large_as_its_projection(shape):
    body = Obstacle(shape, (0.0, 0.0, 0.1), radius=0.05, height=0.1, size=(0.1, 0.1, 0.1))
    painter = Painter(SIZE, (0.0, -1.0, 0.1), (0.0, 0.0, 0.1), view=0.5)
    away = instant(Obstacle("sphere", (9.0, 9.0, 0.1), radius=0.01))
    here = Instant(away.nodes + 5.0, (), away.goal + 5.0, away.path, (body,), 0.0)
    empty = Instant(here.nodes, (), here.goal, here.path, away.obstacles, 0.0)
    changed = np.abs(painter.paint(here, 1e-3, 0.01).astype(int) - painter.paint(empty, 1e-3, 0.01))
    columns = np.flatnonzero(changed[SIZE[1] // 2].max(axis=1) > 8)
    wide = SIZE[0] / (2.0 * np.tan(0.25)) * 0.1
    assert np.ptp(columns) + 1 == pytest.approx(wide, abs=5.0)


def test_video_and_gif_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(film, "RATE", 6)
    monkeypatch.setattr(film, "GIF_RATE", 4)
    video, gif = tmp_path / "film.mp4", tmp_path / "run.gif"
    film.main(film.FilmSettings((RECORDING,), output=video, gif=gif, size=SIZE, gif_size=SIZE))
    duration = film.TITLE_TIME + RecordedRun(RECORDING).duration + film.REST_TIME
    capture = cv2.VideoCapture(str(video))
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == pytest.approx(6.0 * duration, abs=1.0)
    read, image = capture.read()
    assert read
    assert image.shape == (SIZE[1], SIZE[0], 3)
    with Image.open(gif) as picture:
        shown = sum(_durations(picture)) / 1000.0
    assert shown == pytest.approx(duration, abs=0.3)


def _durations(picture: Image.Image):
    for k in range(getattr(picture, "n_frames", 1)):
        picture.seek(k)
        yield picture.info["duration"]
