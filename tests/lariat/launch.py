"""Launches small services as `lariat up` launches the real ones:

python -m tests.lariat.launch PORT NAMESPACE NAME[:BUILD]...
"""

from __future__ import annotations

import sys

from lariat.launcher import Launcher
from lariat.lines import Lines
from lariat.process import Program
from shared import bus as buses
from shared.bus import BusOptions


def main() -> int:
    port, namespace, *names = sys.argv[1:]
    hub = f"tcp/127.0.0.1:{port}"
    programs = []
    for name in names:
        name, _, build = name.partition(":")
        arguments = ("-m", "tests.shared.beacon", "--namespace", namespace, "--connect", hub)
        more = ("--name", name, "--build", build)
        programs.append(Program(name, arguments + more, restart_arguments=("--restarted",)))
    options = BusOptions(namespace, connect=(), listen=(hub,))
    with buses.open(options, "lariat") as bus:
        launcher = Launcher(programs, bus, Lines(sys.stderr))
        return launcher.run(lambda seconds: print("all ready", flush=True))


if __name__ == "__main__":
    sys.exit(main())
