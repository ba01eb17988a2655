"""`lariat repair FILE`: a cut recording made whole.

A recording whose writer was killed has no index and perhaps half a chunk at its end. Everything
before that is copied to a new file with an index, which takes the old one's place; the cut one is
kept beside it.
"""

from __future__ import annotations

import json as jsons
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import tyro

from shared.configuration import ConfigurationError
from shared.recording import Recording, copy_readable


@dataclass(frozen=True)
class Repair:
    """What was done."""

    recording: str
    """The whole file."""
    damage: str
    """What was wrong; empty when it was whole already and was left alone."""
    kept: str
    """Where the cut file went; empty when nothing was done."""
    messages: int
    """In the whole file."""


def repair(path: Path) -> Repair:
    """Makes a recording whole in its place.

    Raises:
        ConfigurationError: There is no such recording, or no place for the repaired one.
    """
    try:
        recording = Recording(path)
        count = sum(1 for _ in recording.messages())
        if not recording.damage:
            return Repair(str(path), "", "", count)
        whole, kept = path.with_name(path.name + ".whole"), path.with_name(path.name + ".cut")
        whole.unlink(missing_ok=True)
        if kept.exists():
            raise ConfigurationError(f"{kept} exists already; move it away first")
        count, damage = copy_readable(path, whole)
        os.rename(path, kept)
        os.rename(whole, path)
    except ConfigurationError:
        raise
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"cannot repair {path}: {error}") from error
    return Repair(str(path), damage, str(kept), count)


def main(file: tyro.conf.Positional[Path], /, json: bool = False) -> int:
    """Make a cut recording whole, in its place; the cut one is kept beside it as FILE.cut.

    Examples:
      lariat repair recordings/run.mcap

    Args:
        file: The recording of a writer that was killed.
        json: Answer with one JSON object on standard output.
    """
    result = repair(file)
    if json:
        print(jsons.dumps(asdict(result)))
    elif result.damage:
        print(
            f"{file} {result.damage}: {result.messages} messages saved, "
            f"the cut file is kept as {result.kept}"
        )
    else:
        print(f"{file} is whole: {result.messages} messages, nothing to repair")
    return 0
