"""`lariat repair FILE`: repair of a damaged recording.

A recording whose writer was killed has no index, and its last chunk may be incomplete. All readable
messages are copied to a new file with an index, which replaces the damaged one; that is kept as
FILE.cut.
"""

from __future__ import annotations

import json as jsons
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import tyro

from lariat.configuration import ConfigurationError, refusing
from shared.recording import Recording, copy_readable


@dataclass(frozen=True)
class Repair:
    """Result of a repair."""

    recording: str
    """The repaired file."""
    damage: str
    """Damage of the file; empty if it was whole and has not been changed."""
    kept: str
    """Path to which the damaged file was moved; empty if it was whole."""
    messages: int
    """Number of messages in the repaired file."""


def repair(path: Path) -> Repair:
    """Repair a recording in place."""
    with refusing(f"cannot repair {path}"):
        recording = Recording(path)
        recording.start()
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
    return Repair(str(path), damage, str(kept), count)


def main(file: tyro.conf.Positional[Path], /, json: bool = False) -> int:
    """Repair a damaged recording in place; the damaged file is kept as FILE.cut.

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
