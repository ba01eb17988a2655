from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from shared import bus as buses
from shared import topics
from shared.bus import BusOptions, Unreachable
from shared.messages import TaskRequest
from shared.runtime.free_port import free_port
from stack import client
from stack.credentials.local_secret import find_local_secret, local_secret, port_lock
from tests.shared.cell import until


@pytest.fixture(autouse=True)
def runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "lariat"


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def test_secret_is_for_its_owner_alone_differs_each_time_and_is_removed(
    runtime_folder: Path,
) -> None:
    seen = []
    for _ in range(2):
        with local_secret(7447) as path:
            assert stat.S_IMODE(runtime_folder.stat().st_mode) == 0o700
            for file in runtime_folder.iterdir():
                assert stat.S_IMODE(file.stat().st_mode) == 0o600
            seen.append(json.loads(path.read_text())["transport/auth/usrpwd/password"])
        assert list(runtime_folder.iterdir()) == []
    assert seen[0] != seen[1]


def test_folder_that_others_can_use_is_refused(runtime_folder: Path) -> None:
    runtime_folder.mkdir(mode=0o755)
    with pytest.raises(ConfigurationError, match="0700"), local_secret(7447):
        pass
    assert find_local_secret(("tcp/127.0.0.1:7447",)) is None


def test_second_stack_on_a_port_is_told_of_the_first_and_harms_nothing() -> None:
    second = "with port_lock(7447, 'second'), local_secret(7447): pass"
    program = f"from stack.credentials.local_secret import local_secret, port_lock\n{second}"

    def start() -> str:
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
        )
        return done.stderr

    with port_lock(7447, "first"):
        with local_secret(7447) as path:
            own = path.read_text()
            assert f"port 7447 (process {os.getpid()}: first)" in start()
            assert path.read_text() == own
        with port_lock(7448, "another port"):
            pass
    assert start() == ""


def test_lock_ends_with_a_process_that_is_killed() -> None:
    program = (
        "from stack.credentials.local_secret import port_lock\n"
        "with port_lock(7447, 'first'):\n    print(1, flush=True)\n    input()"
    )
    first = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with first:
        assert first.stdout is not None
        first.stdout.readline()
        with pytest.raises(ConfigurationError, match="first"), port_lock(7447, "second"):
            pass
        first.kill()
    with port_lock(7447, "second"):
        pass


def test_secret_is_found_by_the_port_of_the_hub() -> None:
    with local_secret(7447) as path:
        assert find_local_secret(("tcp/127.0.0.1:7447",)) == path
        assert find_local_secret(("tcp/127.0.0.1:7448",)) is None
        assert find_local_secret(("tcp/10.0.0.1:7447",)) is None


def test_only_who_knows_the_secret_joins_the_hub_or_a_process(
    stack: ExitStack, tmp_path: Path
) -> None:
    port, process_port = free_port(), free_port()
    hub, direct = f"tcp/127.0.0.1:{port}", f"tcp/127.0.0.1:{process_port}"
    settings = stack.enter_context(local_secret(port))
    stack.enter_context(buses.open(BusOptions("cell", (), (hub,), settings=settings), "hub"))
    process = BusOptions("cell", (hub,), (direct,), settings=settings)
    controller = stack.enter_context(buses.open(process, "controller", timeout=3.0))
    requests = controller.subscribe(topics.TASK_REQUEST)

    wrong = tmp_path / "wrong.json"
    table = json.loads(settings.read_text())
    wrong.write_text(json.dumps({**table, "transport/auth/usrpwd/password": "guess"}))
    for endpoint in (hub, direct):
        for credentials in (None, wrong):
            stranger = BusOptions("cell", (endpoint,), (), "client", credentials)
            with pytest.raises(Unreachable), buses.open(stranger, "stranger", timeout=1.0):
                pass

    with client.connect(client.Cell((hub,))) as person:
        publisher = person.bus.publisher(topics.TASK_REQUEST)
        until(lambda: publisher.has_subscribers)
        publisher.put(TaskRequest(id="start"))
        found: list[str] = []
        until(lambda: found.extend(i.message.id for _, i in requests.take()) or found)
        assert found == ["start"]
