from __future__ import annotations

from collections.abc import Iterator

import pytest

from stack.launcher.fork_server import ForkServer
from stack.launcher.process import process_environment


@pytest.fixture(scope="module")
def fork_server() -> Iterator[ForkServer]:
    with ForkServer(process_environment()) as server:
        yield server
