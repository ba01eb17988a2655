"""Launcher of small services, as `lariat up` launches the real ones:

python -m tests.stack.launch PORT NAMESPACE NAME[:BUILD]...
"""

from __future__ import annotations

import sys

from shared import bus as buses
from shared.bus import BusOptions
from stack.launcher.console import ProcessConsole
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program


def main() -> int:
    port, namespace, *names = sys.argv[1:]
    hub = f"tcp/127.0.0.1:{port}"
    programs = []
    for name in names:
        name, _, build = name.partition(":")
        arguments = ("--namespace", namespace, "--connect", hub, "--name", name, "--build", build)
        restarted = ("--restarted",)
        programs.append(Program(name, "tests.shared.beacon", arguments, restarted))
    options = BusOptions(namespace, connect=(), listen=(hub,))
    with buses.open(options, "lariat") as bus:
        launcher = Launcher(programs, bus, ProcessConsole(sys.stderr))
        return launcher.run(lambda seconds: print("all ready", flush=True))


if __name__ == "__main__":
    sys.exit(main())
