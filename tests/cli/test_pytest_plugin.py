"""Recordings as tests, by the plug-in of pytest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from shared import topics
from shared.messages import RecordState
from shared.recording import Recording, Writer

REFERENCE = Path("tests/replay/requests.mcap")


def run_pytest(folder: Path, *options: str) -> tuple[int, str]:
    plugin = ("-p", "cli.pytest_plugin", "--lariat-recordings", str(folder))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *plugin, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def tampered(path: Path) -> None:
    """Write the reference with another number of messages in one state of the recorder."""
    recording = Recording.open(REFERENCE)
    entries = list(recording.messages())
    scenario = recording.scenario(path.parent)
    writer = Writer(path, scenario, entries[0].log_time, dict(recording.metadata))
    for entry in entries:
        payload = entry.payload
        if entry.key == topics.RUN_RECORD.key:
            state = RecordState.FromString(payload)
            state.drops += 7
            payload = state.SerializeToString(deterministic=True)
        writer.write(entry.topic, payload, entry.publisher, entry.sequence, entry.log_time)
    writer.close()


def test_each_service_is_a_test_and_a_difference_fails_it(tmp_path: Path) -> None:
    tampered(tmp_path / "tampered.mcap")
    (tmp_path / "notes.txt").write_text("no recording")
    code, output = run_pytest(tmp_path, "-k", "recorder or perception")
    assert code == 1
    # One test for each of the seven services, and none for the other file.
    assert "1 failed, 1 passed, 5 deselected" in output
    assert "run/record #0 drops: 7 → 0" in output
    assert "Traceback" not in output


def test_missing_folder_is_named(tmp_path: Path) -> None:
    code, output = run_pytest(tmp_path / "nowhere")
    assert code == 4
    assert "nowhere: no such" in output
