"""Plug-in of pytest that makes tests of recordings.

    pytest -p cli.pytest_plugin --lariat-recordings recordings/kept

Each `.mcap` file of the folder becomes one test for each service that it can be replayed for: the
service is stepped through its recorded inputs and must publish what it published.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

OPTION = "lariat_recordings"
"""Name of the option among pytest's."""
LISTED_DIFFERENCES = 5
"""Number of differences that a failed test lists."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option."""
    parser.getgroup("lariat").addoption(
        "--lariat-recordings",
        dest=OPTION,
        action="append",
        default=[],
        metavar="FOLDER",
        help="replay every recording of a folder as tests; may be repeated",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Collect the folders beside what the command line names, or alone."""
    folders = [str(Path(folder).resolve()) for folder in config.getoption(OPTION) or ()]
    for folder in folders:
        if not Path(folder).is_dir():
            raise pytest.UsageError(f"--lariat-recordings {folder}: no such folder")
    if not folders:
        return
    named = config.args if config.args_source is config.ArgsSource.ARGS else []
    config.args = [*named, *folders]


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a recording of one of the folders."""
    folders = [Path(folder).resolve() for folder in parent.config.getoption(OPTION) or ()]
    if file_path.suffix != ".mcap" or not any(file_path.is_relative_to(f) for f in folders):
        return None
    return RecordingFile.from_parent(parent, path=file_path)


class RecordingFile(pytest.File):
    """A recording, with a test for each service."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the tests."""
        # Imported late: a run of pytest without recordings loads nothing of the stack.
        from cli.replay import traced_services
        from shared.recording import Recording

        try:
            names = traced_services(Recording.open(self.path))
        except ValueError as error:
            raise self.CollectError(str(error)) from None
        if not names:
            raise self.CollectError(f"{self.path} holds no trace of a service")
        for name in names:
            yield ReplayItem.from_parent(self, name=name)


class Differs(Exception):
    """A service published something else than it did; the text lists the first differences."""


class ReplayItem(pytest.Item):
    """Replay of one service."""

    def runtest(self) -> None:
        """Step the service again and compare what it publishes."""
        from cli.replay import replay
        from cli.terminal import Terminal
        from shared.recording import Recording
        from stack.replay.outside_inputs import NotReplayable

        recording = Recording.open(self.path)
        with tempfile.TemporaryDirectory() as folder:
            scenario = recording.scenario(Path(folder))
            try:
                results = replay(recording, scenario, (self.name,), Terminal(stderr=True))
            except NotReplayable as reason:
                pytest.skip(str(reason))
        differences = [d for result in results for d in result.differences]
        if differences:
            listed = "\n".join(
                f"  {d.topic} #{d.sequence} {d.field or d.kind}: {d.recorded} → {d.replayed}"
                for d in differences[:LISTED_DIFFERENCES]
            )
            raise Differs(f"{self.name}: {len(differences)} differences, first:\n{listed}")

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return the differences alone; other errors with their traceback."""
        if isinstance(excinfo.value, Differs):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return file and name of the test."""
        return self.path, None, f"{self.path.name}: {self.name}"
