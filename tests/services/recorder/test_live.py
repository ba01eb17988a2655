"""The recorder as a process on a real bus."""

from __future__ import annotations

import signal
import socket
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
from tests.services.recorder.test_service import TEXT

pytestmark = pytest.mark.live


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def test_a_run_on_the_bus_becomes_a_file_that_outlives_the_recorder(tmp_path: Path):
    (tmp_path / "s.toml").write_text(TEXT)
    hub = f"tcp/127.0.0.1:{free_port()}"
    options = BusOptions(namespace="recorder-test", connect=(), listen=(hub,))
    command = [sys.executable, "-m", "services.recorder", "--scenario", str(tmp_path / "s.toml")]
    command += ["--namespace", "recorder-test", "--connect", hub]
    command += ["--folder", str(tmp_path / "recordings")]
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
