"""Video of a recorded run, made by a process of its own at the lowest priority."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO

from lariat.files.temporary_folder import TemporaryFolder
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RunSummary, RunVideo
from shared.runtime.service import Publication

ROOT = Path(__file__).parents[3]
"""Folder of the clone, whose modules come before others of their names."""
LONGEST_RUN = 600.0
"""Longest run of which a video is made [s]; the process holds all pictures of the camera."""
MAX_SIZE = 2**25
"""Largest size of a video [bytes]; it is published as one message."""
MAX_FAILURE_LENGTH = 500
"""Largest length of a failure's reason [characters]."""
PUBLISH_PERIOD = SECOND
"""Time between two publications while the video is made [ns]."""
NAME, ERRORS = "run.mp4", "errors.txt"
"""Names of the video and of what the process complains about, in a temporary folder."""


@dataclass
class _Making:
    """Video that is being made."""

    run: str
    """Id of its run."""
    folder: TemporaryFolder
    """Folder of the video and of what the process complains about."""
    process: subprocess.Popen[bytes]
    """Process that makes it."""
    output: IO[bytes]
    """What the process prints, read without waiting."""
    progress: float = 0.0
    """Fraction that is done [-]."""


class VideoProcess:
    """Maker of one video at a time; what has become of it is published by the next step."""

    def __init__(self, settings: Sequence[str] = ()) -> None:
        """Prepare without a process, whose further arguments are `settings`."""
        self._settings = settings
        self._making: _Making | None = None
        self._publish_time = 0

    def start(self, run: RunSummary, files: Sequence[Path]) -> None:
        """Begin to make the video of a run."""
        if self._making is not None:
            raise ValueError(
                f"the video of {self._making.run} is being made; wait for it or cancel it"
            )
        command = f"lariat export {files[0]} --to video"
        if run.duration > LONGEST_RUN:
            raise ValueError(
                f"the run took {run.duration:.0f} s, and a video from the page {LONGEST_RUN:.0f} s "
                f"at most; `{command}` makes longer ones"
            )
        if find_spec("av") is None:
            raise ValueError(f"this recorder has no PyAV; `{command}` makes it elsewhere")
        folder = TemporaryFolder("lariat-video-")
        program = [sys.executable, "-P", "-m", "shared.video", *map(str, files)]
        program += ["--output", str(folder.path / NAME), *self._settings]
        with (folder.path / ERRORS).open("wb") as errors:
            process = subprocess.Popen(
                program,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
            )
        assert process.stdout is not None
        os.set_blocking(process.stdout.fileno(), False)
        self._making = _Making(run.id, folder, process, process.stdout)
        self._publish_time = 0

    def cancel(self) -> None:
        """End the process, if there is one, without a video."""
        if self._making is not None:
            self._making.process.kill()

    def take(self, now: int) -> Iterator[Publication]:
        """Yield how far the video is, once a second, and the video once it is made."""
        if (making := self._making) is None:
            return
        words = (making.output.read() or b"").split()
        if words and words[-1].isdigit():
            making.progress = min(int(words[-1]), 100) / 100.0
        if making.process.poll() is not None:
            self._making = None
            yield Publication(topics.RUN_VIDEO, _end(making, now))
        elif now - self._publish_time >= PUBLISH_PERIOD:
            self._publish_time = now
            message = RunVideo(stamp=now, run=making.run, progress=making.progress)
            yield Publication(topics.RUN_VIDEO, message)

    def close(self) -> None:
        """End the process and remove what it has written."""
        self.cancel()
        if self._making is not None:
            _end(self._making, 0)
            self._making = None


def _end(making: _Making, now: int) -> RunVideo:
    """Return the video of a process that has ended or is ending, or why there is none."""
    message = RunVideo(stamp=now, run=making.run, progress=making.progress)
    code = making.process.wait()
    making.output.close()
    with making.folder:
        file = making.folder.path / NAME
        if code < 0:
            message.failure = "it was canceled"
        elif code:
            errors = (making.folder.path / ERRORS).read_text(errors="replace")
            last = [line.strip() for line in errors.splitlines() if line.strip()][-1:]
            message.failure = (last or [f"exit code {code}"])[0][:MAX_FAILURE_LENGTH]
        elif (size := file.stat().st_size) > MAX_SIZE:
            message.failure = f"it has {size} bytes, more than {MAX_SIZE}"
        else:
            message.progress, message.data = 1.0, file.read_bytes()
    return message
