from __future__ import annotations

import os
import subprocess
import sys

import pytest

from dashboard.door.private_viser import PrivateViser
from tests.dashboard.door.listeners import tcp_listeners

NOBODY = 65534


def test_viser_listens_on_no_port_and_leaves_nothing() -> None:
    before = tcp_listeners()
    private = PrivateViser("test")
    try:
        assert private.path.is_socket()
        assert private.path.parent.stat().st_mode & 0o777 == 0o700
        assert tcp_listeners() == before
    finally:
        private.close()
    assert not private.path.parent.exists()


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_another_user_of_the_machine_cannot_reach_viser() -> None:
    private = PrivateViser("test")
    program = "import os, socket, sys; {}socket.socket(socket.AF_UNIX).connect(sys.argv[1])"
    command = [sys.executable, "-I", "-c", program.format(""), str(private.path)]
    try:
        assert subprocess.run(command, check=False).returncode == 0, "its own user must reach it"
        # The interpreter itself may stand where nobody else reads: the child changes its user.
        command[3] = program.format(f"os.setgroups([]); os.setgid({NOBODY}); os.setuid({NOBODY}); ")
        refused = subprocess.run(command, capture_output=True, text=True, check=False)
        assert "PermissionError" in refused.stderr
    finally:
        private.close()
