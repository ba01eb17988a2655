"""`lariat up`: the live stack."""

from __future__ import annotations

from typing import Annotated

import tyro

from cli.up.options import UpOptions
from stack.launcher.fork_server import ForkServer
from stack.launcher.process import process_environment


def main(options: Annotated[UpOptions, tyro.conf.arg(name="")]) -> int:
    """Start the whole stack of a scenario and keep it running until Ctrl-C.

    Examples:
      lariat up
      lariat up fixed-end --dashboard-port 9000
    """
    with ForkServer(process_environment()) as fork_server:
        # This process and the fork server import what they need at the same time.
        from cli.up.live_stack import run

        return run(options, fork_server)
