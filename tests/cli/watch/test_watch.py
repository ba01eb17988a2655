"""`lariat watch` as a process: from the bus to a viewer, until Ctrl-C."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from contextlib import ExitStack

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from shared import topics
from shared.messages import NodeChain
from tests.shared.cell import Cell

pytestmark = pytest.mark.live


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_viewer_sees_the_bus_and_the_process_ends_when_told_to(number: signal.Signals) -> None:
    with ExitStack() as stack:
        cell = Cell(stack)
        publisher = cell("perception").publisher(topics.ROPE_NODES)
        command = [sys.executable, "-m", "cli", "watch", "--port", "0", *cell.arguments]
        process = stack.enter_context(subprocess.Popen(command, stderr=subprocess.PIPE, text=True))
        stack.callback(process.kill)
        assert process.stderr is not None
        address = process.stderr.readline().split()[0]
        ended = threading.Event()
        stack.callback(ended.set)

        def publish() -> None:
            rope = NodeChain(stamp=1, positions=[0.1 * k for k in range(9)])
            while not ended.wait(0.05):
                publisher.put(rope)

        threading.Thread(target=publish, daemon=True).start()
        with connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as viewer:
            seen: set[str] = set()
            while "rope/nodes" not in seen:
                frame = json.loads(viewer.recv(10.0))
                seen |= {channel["topic"] for channel in frame.get("channels", ())}
            process.send_signal(number)
            assert process.wait(10.0) == 0
