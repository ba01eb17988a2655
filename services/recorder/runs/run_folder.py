"""Runs as files: a JSON file for each run, in a folder beside the recordings."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

from google.protobuf.json_format import MessageToJson, Parse

from lariat.files.bounded_file import path_inside, read_file
from lariat.trajectory import SECOND
from services.recorder.private_folder import make_folder
from shared import topics
from shared.door import Door
from shared.messages import RunFile, RunList, RunSummary, validation

FOLDER = "runs"
"""Name of the folder inside that of the recordings."""
MAX_RUNS = 300
"""Largest number of runs that are listed, newest first [-]."""
MAX_FILE_SIZE = 2**20
"""Largest size of a run's file [bytes]."""
MAX_SUMMARY_SIZE = 2**13
"""Largest size of a run in the list [bytes]: the whole list is one message."""
MAX_NOTE_LENGTH = 200
"""Largest length of a note [characters]."""


class RunFolder:
    """Runs of a folder of recordings."""

    def __init__(self, recordings: Path, door: Door | None = None) -> None:
        self._door = door or Door()
        self._recordings = recordings
        self._folder = recordings / FOLDER
        self._runs: dict[str, RunFile] = {}
        self._changed = 0
        """Time of the folder's last change that has been listed [ns]."""
        self._read: set[str] = set()
        """Names of the files that have been read, broken ones too."""
        self.revision = 0
        """Number of changes."""

    def load(self, now: int) -> None:
        """List the newest runs that are not listed yet, as other processes may have written some.

        A file that is none is left out and logged.
        """
        try:
            changed = self._folder.stat().st_mtime_ns
        except OSError:
            return
        if changed == self._changed:
            return
        # Another change may follow within the resolution of the file system's clock.
        self._changed = changed if now - changed > SECOND else 0
        newest = sorted(self._folder.glob("*.json"), reverse=True)[:MAX_RUNS]
        for path in [p for p in newest if p.name not in self._read]:
            self._read.add(path.name)
            with self._door.guard(f"{path} in the list of runs"):
                run = Parse(read_file(path, MAX_FILE_SIZE), RunFile(), ignore_unknown_fields=True)
                if run.summary.id != path.stem:
                    raise ValueError(f"it holds the run {run.summary.id[:100]!r}")
                _check(run)
                self._runs.setdefault(run.summary.id, run)
                self.revision += 1
        self._forget_oldest()

    def summaries(self) -> list[RunSummary]:
        """Return the runs, newest first, with the size of what is left of their recordings."""
        runs = sorted(self._runs.values(), key=lambda run: run.summary.started, reverse=True)
        for run in runs:
            run.summary.bytes = sum(self._size(name) for name in run.summary.files)
        return [run.summary for run in runs]

    def keep(self, run: RunFile) -> None:
        """Write a run; note and star that it has already stay."""
        if kept := self._runs.get(run.summary.id):
            run.summary.note, run.summary.star = kept.summary.note, kept.summary.star
        self._write(run)
        self._forget_oldest()

    def annotate(self, id: str, note: str, star: bool) -> None:
        """Set note and star of a run."""
        if len(note) > MAX_NOTE_LENGTH:
            raise ValueError(f"the note has {len(note)} characters, more than {MAX_NOTE_LENGTH}")
        run = RunFile()
        run.CopyFrom(self.named(id))
        run.summary.note, run.summary.star = note, star
        self._write(run)

    def delete(self, id: str, open_file: str = "") -> None:
        """Delete a run, and its recordings unless another run is in them."""
        summary = self.named(id).summary
        if not summary.over or open_file in summary.files:
            raise ValueError(f"{id} is being recorded; wait until its file is closed")
        for name in set(summary.files) - recordings_of_runs(self._recordings, besides=id):
            # A run's file is somebody's word: it may name anything.
            if name == Path(name).name and name.endswith(".mcap"):
                (self._recordings / name).unlink(missing_ok=True)
        (self._folder / f"{id}.json").unlink(missing_ok=True)
        del self._runs[id]
        self.revision += 1

    def named(self, id: str) -> RunFile:
        """Return a run."""
        if id not in self._runs:
            raise ValueError(f"there is no run {id[:100]!r}")
        return self._runs[id]

    def _forget_oldest(self) -> None:
        for old in self.summaries()[MAX_RUNS:]:
            del self._runs[old.id]

    def _size(self, name: str) -> int:
        with suppress(OSError, ValueError):
            return path_inside(self._recordings, name).stat().st_size
        return 0

    def _write(self, run: RunFile) -> None:
        make_folder(self._recordings)
        make_folder(self._folder)
        path = self._folder / f"{run.summary.id}.json"
        part = path.with_suffix(".part")
        part.write_text(MessageToJson(run, preserving_proto_field_name=True))
        os.replace(part, path)
        self._runs[run.summary.id] = run
        self._read.add(path.name)
        self.revision += 1


def recordings_of_runs(recordings: Path, besides: str = "", starred: bool = False) -> set[str]:
    """Return the names of the recordings of runs, listed or not, besides those of one run."""
    names: set[str] = set()
    for path in (recordings / FOLDER).glob("*.json"):
        with suppress(OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
            summary = json.loads(read_file(path, MAX_FILE_SIZE))["summary"]
            if path.stem != besides and (summary.get("star") or not starred):
                names |= set(summary["files"])
    return names


def _check(run: RunFile) -> None:
    """Check a file as its readers on the bus check it: one run must not spoil the list."""
    if (size := run.summary.ByteSize()) > MAX_SUMMARY_SIZE:
        raise ValueError(f"its summary has {size} bytes, more than {MAX_SUMMARY_SIZE}")
    validation.decode(topics.RUN_LIST, RunList(runs=[run.summary]).SerializeToString())
    validation.decode(topics.RUN_CURVES, run.curves.SerializeToString())
