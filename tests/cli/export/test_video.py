"""Export to videos and GIFs."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.__main__ import main as lariat
from shared.video import gif, video
from shared.video.video import VideoSettings

RECORDING = Path(__file__).parents[2] / "replay" / "three-cylinders.mcap"
SMALL = VideoSettings(size=(160, 96), rate=2, title_time=0.0, rest_time=0.0)


@pytest.fixture(autouse=True)
def _small_videos(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(video.write_video, "__defaults__", (SMALL, None))
    monkeypatch.setattr(gif.write_gif, "__defaults__", (SMALL,))


def test_several_recordings_join_to_one_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "film.mp4"
    names = [str(RECORDING), str(RECORDING)]
    assert lariat(["export", *names, "--to", "video", "--output", str(file)]) == 0
    assert capsys.readouterr().out == f"{file}: 6 s\n"
    assert file.stat().st_size > 1000


def test_a_gif_takes_one_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "run.gif"
    words = ["--to", "gif", "--output", str(file)]
    assert lariat(["export", str(RECORDING), *words]) == 0
    assert file.read_bytes()[:4] == b"GIF8"
    file.unlink()
    assert lariat(["export", str(RECORDING), str(RECORDING), *words]) == 2
    assert "--to lerobot and --to video" in capsys.readouterr().err
    assert not file.exists()
