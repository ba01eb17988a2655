"""Film of recorded runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from shared.recording import Recording
from shared.video import gif, video
from shared.video.picture import ARM, GOAL, OTHER_ROPE, ROPE, SKY, Renderer
from shared.video.recorded_run import Instant, RecordedRun
from shared.video.video import VideoSettings
from tests.browser.film import title_card

RECORDING = Path(__file__).parents[2] / "replay" / "three-cylinders.mcap"
SIZE = (160, 96)


def instant(*obstacles: Obstacle) -> Instant:
    rope = np.zeros((9, 3))
    rope[:, 0], rope[:, 2] = np.linspace(-0.2, 0.2, 9), 0.1
    goal = rope + np.array([0.0, 0.0, 0.2])
    return Instant(rope, (), goal, np.zeros((2, 0, 3)), obstacles, (), 0.2)


def pixels_near(image: np.ndarray, color: tuple[int, int, int]) -> int:
    return int(np.sum(np.abs(image.astype(int) - color).max(axis=2) < 40))


def test_a_recorded_run_comes_to_its_goal():
    run = RecordedRun(Recording.open(RECORDING))
    first, last = run.at(0.0), run.at(run.duration)
    assert first.error > 0.1
    assert last.error < 0.002
    assert len(last.grips) == 2
    assert last.path.shape[1] > 10
    between = run.at(run.duration / 2.0)
    assert last.error < between.error < first.error
    assert np.array_equal(run.at(run.duration + 5.0).nodes, last.nodes)


def test_an_arm_reaches_to_the_end_that_it_holds():
    run = RecordedRun(Recording.open(RECORDING.with_name("rope.mcap")))
    for time in (0.0, run.duration):
        now = run.at(time)
        assert len(now.arms) > 6
        # The last body joins the arm's flange to its gripper.
        stem = now.arms[-1]
        tip = np.array(stem.position) - poses.rotate(
            np.array(stem.orientation), np.array([0.0, 0.0, -stem.height / 2.0])
        )
        assert tip == pytest.approx(now.grips[-1][1], abs=1e-9)
        assert stem.height < 0.25
    assert run.at(0.0).arms != run.at(run.duration).arms
    assert run.at(0.0).view is not None


def test_an_arm_is_painted_before_what_it_hides():
    renderer = Renderer(SIZE, (0.0, -1.0, 0.3), (0.0, 0.0, 0.15))
    link = Obstacle("capsule", (0.0, -0.2, 0.1), radius=0.1, height=0.2)
    image = renderer.paint(replace(instant(), arms=(link,)), 0.01, 0.012)
    assert pixels_near(image, ARM) > 50
    free = renderer.paint(instant(), 0.01, 0.012)
    assert pixels_near(image, ROPE) < 0.8 * pixels_near(free, ROPE)


def test_a_body_hides_what_is_behind_it():
    renderer = Renderer(SIZE, (0.0, -1.0, 0.3), (0.0, 0.0, 0.15))
    wall = Obstacle("box", (0.0, -0.2, 0.1), size=(1.0, 0.02, 0.2))
    behind = Obstacle("box", (0.0, 0.2, 0.1), size=(1.0, 0.02, 0.2))
    free = pixels_near(renderer.paint(instant(), 0.01, 0.012), ROPE)
    assert free > 50
    assert pixels_near(renderer.paint(instant(behind), 0.01, 0.012), ROPE) > 0.8 * free
    assert pixels_near(renderer.paint(instant(wall), 0.01, 0.012), ROPE) == 0
    assert pixels_near(renderer.paint(instant(wall), 0.01, 0.012), GOAL) > 20


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere", "capsule"])
def test_a_body_is_as_large_as_its_projection(shape):
    body = Obstacle(shape, (0.0, 0.0, 0.1), radius=0.05, height=0.1, size=(0.1, 0.1, 0.1))
    renderer = Renderer(SIZE, (0.0, -1.0, 0.1), (0.0, 0.0, 0.1), view=0.5)
    away = instant(Obstacle("sphere", (9.0, 9.0, 0.1), radius=0.01))
    here = Instant(away.nodes + 5.0, (), away.goal + 5.0, away.path, (body,), (), 0.0)
    empty = Instant(here.nodes, (), here.goal, here.path, away.obstacles, (), 0.0)
    changed = np.abs(
        renderer.paint(here, 1e-3, 0.01).astype(int) - renderer.paint(empty, 1e-3, 0.01)
    )
    columns = np.flatnonzero(changed[SIZE[1] // 2].max(axis=1) > 8)
    wide = SIZE[0] / (2.0 * np.tan(0.25)) * 0.1
    assert np.ptp(columns) + 1 == pytest.approx(wide, abs=5.0)


def test_video_shows_runs_one_after_the_other(tmp_path: Path):
    recording, file = Recording.open(RECORDING), tmp_path / "film.mp4"
    settings = VideoSettings(size=SIZE, rate=5, title_time=0.4, rest_time=0.2)
    written = video.write_video((recording, recording), file, settings)
    duration = 2.0 * (0.6 + RecordedRun(recording).duration)
    assert written == pytest.approx(duration, abs=0.3)
    capture = cv2.VideoCapture(str(file))
    images = [capture.read()[1] for _ in range(round(written * 5))]
    assert not capture.read()[0]
    assert images[0].shape == (SIZE[1], SIZE[0], 3)
    # The second run begins as the first one did.
    assert np.abs(images[len(images) // 2].astype(int) - images[0]).mean() < 4.0
    assert np.abs(images[len(images) // 2 - 1].astype(int) - images[0]).mean() > 4.0


def test_a_video_of_another_suffix_is_refused_by_name(tmp_path: Path):
    with pytest.raises(ValueError, match=r"\.mp4.*film\.avi"):
        video.write_video((Recording.open(RECORDING),), tmp_path / "film.avi")


def test_an_interrupted_video_leaves_nothing_and_the_former_one(tmp_path: Path):
    file = tmp_path / "run.mp4"
    file.write_bytes(b"former")
    picture = np.zeros((128, 128, 3), np.uint8)

    def pictures() -> Iterator[np.ndarray]:
        yield picture
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        video.encode_video(pictures(), file, VideoSettings(size=(128, 128)))
    assert [f.name for f in tmp_path.iterdir()] == ["run.mp4"]
    assert file.read_bytes() == b"former"


def test_gif_lasts_as_long_as_its_run(tmp_path: Path):
    recording, file = Recording.open(RECORDING), tmp_path / "run.gif"
    settings = VideoSettings(size=SIZE, rate=4, title_time=0.5, rest_time=0.5)
    gif.write_gif(recording, file, settings)
    with Image.open(file) as picture:
        shown = sum(_durations(picture)) / 1000.0
    assert shown == pytest.approx(1.0 + RecordedRun(recording).duration, abs=0.3)


def test_a_small_thing_keeps_its_colour_in_a_gif(tmp_path: Path):
    shades = np.tile(np.linspace(20, 235, SIZE[0]).astype(np.uint8), (SIZE[1], 1))
    image = np.stack([shades, np.roll(shades, 40, axis=1), np.roll(shades, 80, axis=1)], axis=2)
    image[50:52, 70:90] = GOAL
    gif.encode_gif([image, image], tmp_path / "small.gif")
    with Image.open(tmp_path / "small.gif") as shown_gif:
        shown = np.asarray(shown_gif.convert("RGB"))[51, 80, ::-1]
    assert np.abs(shown.astype(int) - GOAL).max() < 30


def _durations(picture: Image.Image):
    for k in range(getattr(picture, "n_frames", 1)):
        picture.seek(k)
        yield picture.info["duration"]


@pytest.mark.parametrize("title", ["Twist", "Obstacles that stand elsewhere than they should"])
def test_a_title_ends_within_the_picture(title: str):
    settings = VideoSettings(size=(480, 270), rate=5)
    (picture,) = title_card(title, (), 0.2, settings)
    written = np.flatnonzero((picture != picture[0, 0]).any(axis=(0, 2)))
    assert len(written) > 20
    assert written.max() < 0.92 * settings.size[0]


def test_another_rope_is_painted():
    renderer = Renderer(SIZE, (0.0, -1.0, 0.3), (0.0, 0.0, 0.15))
    line = np.array([[-0.1, -0.1, 0.2], [0.1, -0.1, 0.2]])
    both = renderer.paint(replace(instant(), others=(line,)), 0.01, 0.012)
    assert pixels_near(renderer.paint(instant(), 0.01, 0.012), OTHER_ROPE) == 0
    assert pixels_near(both, OTHER_ROPE) > 50


def test_the_table_reaches_below_a_near_camera():
    renderer = Renderer(SIZE, (0.3, -0.6, 0.5), (0.0, 0.0, 0.1))
    image = renderer.paint(instant(), 0.01, 0.012)
    for column in (2, SIZE[0] // 2, SIZE[0] - 3):
        below = image[-6:, column].astype(int)
        assert np.abs(below - SKY).max(axis=1).min() > 10
