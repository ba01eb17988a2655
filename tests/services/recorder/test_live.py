"""The recorder as a process on a real bus."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lariat.trajectory import SECOND
from shared import bus, topics
from shared.bus import BusOptions
from shared.messages import IDLE, RUNNING, NodeChain, TaskState
from shared.recording import Recording
from shared.runtime.clock import SystemClock
from shared.runtime.free_port import free_port
from tests.services.recorder.test_service import TEXT
from tests.shared.cell import until

pytestmark = pytest.mark.live


def recorder_command(folder: Path, hub: str, *options: str) -> list[str]:
    (folder / "s.toml").write_text(TEXT)
    command = [sys.executable, "-m", "services.recorder", "--scenario", str(folder / "s.toml")]
    command += ["--namespace", "recorder-test", "--connect", hub]
    return [*command, "--folder", str(folder / "recordings"), *options]


def test_a_run_on_the_bus_becomes_a_file_that_outlives_the_recorder(tmp_path: Path):
    hub = f"tcp/127.0.0.1:{free_port()}"
    options = BusOptions(namespace="recorder-test", connect=(), listen=(hub,))
    command = recorder_command(tmp_path, hub)
    clock = SystemClock()
    with bus.open(options, "tester", clock) as cell:
        rope, task = cell.publisher(topics.ROPE_NODES), cell.publisher(topics.TASK_STATE)
        state = cell.subscribe(topics.RUN_RECORD)
        recorder = subprocess.Popen(command)
        try:
            newest, began, sent = None, time.monotonic(), 0
            while not (newest and newest.run == "run-7" and newest.messages > 100):
                assert time.monotonic() - began < 20.0, f"the recorder does not answer: {newest}"
                for _, item in state.take():
                    newest = item.message
                rope.put(NodeChain(stamp=clock.now(), positions=[0.0] * 6))
                begun = newest is not None
                task.put(TaskState(state=RUNNING if begun else IDLE, run="run-7" if begun else ""))
                sent += begun
                time.sleep(0.01)
            assert newest.drops == 0
            task.put(TaskState(state=IDLE, run="run-7"))
            time.sleep(0.3)
        finally:
            recorder.send_signal(signal.SIGINT)
            assert recorder.wait(5.0) == 0
    files = (tmp_path / "recordings").glob("*.mcap")
    (file,) = (path for path in files if not path.name.endswith("_idle.mcap"))
    recording = Recording(file)
    entries = list(recording.messages())
    assert recording.damage == ""
    chains = [e.sequence for e in entries if e.key == "rope/nodes"]
    assert chains == list(range(chains[0], chains[0] + len(chains)))
    assert len(chains) >= sent
    assert {e.key for e in entries} >= {"task/state", "run/record", "view/scene", "health/recorder"}
    assert all(abs(e.log_time - clock.now()) < 60 * SECOND for e in entries)


def test_all_that_was_sent_before_a_signal_is_in_the_file(tmp_path: Path):
    hub = f"tcp/127.0.0.1:{free_port()}"
    options = BusOptions(namespace="recorder-test", connect=(), listen=(hub,))
    with bus.open(options, "tester", SystemClock()) as cell:
        state = cell.subscribe(topics.RUN_RECORD)
        rope = cell.publisher(topics.ROPE_NODES)
        recorder = subprocess.Popen(recorder_command(tmp_path, hub, "--always"))
        try:
            until(lambda: [item for _, item in state.take() if item.message.recording], 20.0)
            for k in range(600):
                rope.put(NodeChain(stamp=k, positions=[0.0] * 120))
        finally:
            recorder.send_signal(signal.SIGTERM)
            assert recorder.wait(10.0) == 0
    (file,) = (tmp_path / "recordings").glob("*.mcap")
    assert [e.sequence for e in Recording(file).messages(["rope/nodes"])] == list(range(600))
