"""Make Lariat's film and the GIFs of the documentation: `python -m tests.browser.film`.

Runs are recorded by `lariat run`, unless the folder holds them, and drawn from their messages. The
page is that of `lariat show`, photographed while its time bar is moved. Every piece is kept in the
folder, so that an interrupted film goes on.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import tyro

from shared.recording import Recording
from shared.runtime.free_port import free_port
from shared.video import gif, video
from shared.video.recorded_run import RecordedRun
from shared.video.video import Picture, VideoSettings
from tests.browser.chromium import opened

FILM = VideoSettings(size=(960, 540), rate=15)
"""Settings of the film."""
PAGE_SIZE = (1280, 720)
"""Columns and rows of the page [pixels]."""
PAGE_RUN = "three-cylinders"
"""Scenario of the run that the page shows."""
GIFS = {"run.gif": PAGE_RUN, "two-arms.gif": "two-arms"}
"""Scenario of each GIF by the name of its file."""
PAGE_PERIOD = 0.15
"""Time of the recording between two pictures of the page [s]."""
PAGE_SETTLING_TIME = 0.4
"""Time that the page gets to draw another moment [s]."""
PAGE_GIF = VideoSettings(size=(720, 405), rate=7)
"""Settings of the page's GIF."""
TITLE_TIME = 4.0
"""Time for which a title is shown [s]."""
REPEATS = 5
"""Pictures of the video for each picture of the page, which then plays at about half speed."""


def title_card(
    title: str, lines: Sequence[str], duration: float, settings: VideoSettings = FILM
) -> Iterator[Picture]:
    """Yield the pictures of a title."""
    width, height = settings.size
    picture = np.full((height, width, 3), (40, 33, 30), np.uint8)
    left, top, bold = width // 10, 2 * height // 5, (cv2.FontFace(video.FONT), 700)
    size = height // 10
    *_, wide, _ = cv2.getTextSize((0, 0), title, (0, 0), bold[0], size, bold[1])
    fitting = min(size, size * (width - 2 * left) // max(wide, 1))
    cv2.putText(picture, title, (left, top), video.TEXT_COLOR, bold[0], fitting, bold[1])
    for k, line in enumerate(lines):
        place = (left, top + height // 8 + k * height // 16)
        video.write_text(picture, line, place, height // 26)
    for _ in range(round(duration * settings.rate)):
        yield picture


@dataclass(frozen=True)
class Scene:
    """Part of the film: a title, then a recorded run."""

    scenario: str
    """Shipped scenario."""
    title: str
    """Title."""
    lines: tuple[str, ...]
    """Lines below it."""


SCENES = (
    Scene(
        "three-cylinders",
        "Over obstacles",
        (
            "A planned path around three cylinders,",
            "followed by model predictive control at 50 Hz.",
        ),
    ),
    Scene(
        "cable",
        "Unknown stiffness",
        (
            "The cable's stiffness is believed wrong by a factor of four.",
            "It is learned on the way.",
        ),
    ),
    Scene(
        "fixed-end",
        "One arm",
        ("One end is fixed, an emulated CR5 moves the other.", "The camera sees the rope."),
    ),
    Scene(
        "two-arms",
        "Two arms",
        ("Links and joint limits of both arms are part of the plan.",),
    ),
    Scene(
        "markers",
        "Obstacles found by markers",
        ("They stand elsewhere than the scenario says, and one of them moves.",),
    ),
    Scene(
        "over-a-bar",
        "Leaning on a support",
        ("The rope is laid over a bar with friction.",),
    ),
    Scene(
        "second-rope",
        "Another rope",
        ("A second rope of the same colour lies in the way.", "The camera tells them apart."),
    ),
    Scene("two-turns", "Twist", ("The rope is wound by two whole turns.",)),
    Scene("twenty-posts", "Long ropes", ("Two metres of rope among twenty posts.",)),
)
"""Parts of the film, in its order."""


def main(folder: Path = Path("film"), gifs: Path | None = None) -> None:
    """Make the film, and the GIFs of the documentation if their folder is named.

    Args:
        folder: Folder of recordings, pictures of the page and the film, `lariat.mp4`.
        gifs: Folder for `run.gif`, `two-arms.gif` and `page.gif`, e.g. docs/guide.
    """
    folder.mkdir(parents=True, exist_ok=True)
    recordings = {s.scenario: recorded(s.scenario, folder) for s in SCENES}
    page = page_pictures(recordings[PAGE_RUN], folder / "page")
    if gifs is not None:
        for name, scenario in GIFS.items():
            gif.write_gif(Recording.open(recordings[scenario]), gifs / name)
        gif.encode_gif((resized(p, PAGE_GIF) for p in page), gifs / "page.gif", PAGE_GIF)
    file = folder / "lariat.mp4"
    duration = video.encode_video(pictures(recordings, page), file, FILM)
    print(f"{file}: {duration:.0f} s")


def recorded(scenario: str, folder: Path) -> Path:
    """Return the recording of a scenario's run, which is made if it is missing."""
    file = folder / f"{scenario}.mcap"
    if not file.exists():
        run = [sys.executable, "-m", "cli", "run", scenario, "--stop-when-reached"]
        subprocess.run([*run, "--record", str(file)], check=True)
    return file


def page_pictures(file: Path, folder: Path) -> list[Path]:
    """Return pictures of the page that shows a recording, `PAGE_PERIOD` apart."""
    folder.mkdir(exist_ok=True)
    run = RecordedRun(Recording.open(file))
    # At the first moment, nothing is known yet.
    moments = range(1, int(run.duration / PAGE_PERIOD))
    pictures = [folder / f"{k:03d}.png" for k in moments]
    missing = [(k, p) for k, p in zip(moments, pictures, strict=True) if not p.exists()]
    if not missing:
        return pictures
    command = [sys.executable, "-m", "cli", "show", str(file), "--port", str(free_port())]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        address = next(word for word in line.split() if word.startswith("http://"))
        with opened(address, *PAGE_SIZE, niceness=19) as page:
            time_field = page.get_by_role("textbox").first
            for k, picture in missing:
                time_field.fill(f"{k * PAGE_PERIOD:.2f}")
                time_field.press("Enter")
                page.wait_for_timeout(1e3 * PAGE_SETTLING_TIME)
                page.screenshot(path=picture)
    finally:
        process.terminate()
        process.wait(10.0)
    return pictures


def resized(file: Path, settings: VideoSettings) -> Picture:
    """Return the picture of a file in the size of a film."""
    picture = cv2.imread(str(file))
    assert picture is not None
    return cv2.resize(picture, settings.size, interpolation=cv2.INTER_AREA)


def pictures(recordings: dict[str, Path], page: list[Path]) -> Iterator[Picture]:
    """Yield the pictures of the whole film.

    Args:
        recordings: Recordings by scenario.
        page: Pictures of the page.
    """
    yield from title_card("Lariat", ("Shaping ropes and cables with a robot",), TITLE_TIME, FILM)
    yield from title_card(
        "The page",
        ("Set a goal, press Start, watch rope, path, camera and plots.",),
        TITLE_TIME,
        FILM,
    )
    for file in page:
        picture = resized(file, FILM)
        for _ in range(REPEATS):
            yield picture
    for scene in SCENES:
        yield from title_card(scene.title, scene.lines, TITLE_TIME, FILM)
        run = RecordedRun(Recording.open(recordings[scene.scenario]))
        yield from video.run_pictures(run, FILM)
    yield from title_card(
        "Lariat",
        (
            "All runs are simulated and shown in real time.",
            "Orange: rope. Magenta: goal. Blue: path.",
        ),
        TITLE_TIME,
        FILM,
    )


if __name__ == "__main__":
    tyro.cli(main)
