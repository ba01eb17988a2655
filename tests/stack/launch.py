"""Launcher of small services, as `lariat up` launches the real ones:

python -m tests.stack.launch PORT NAMESPACE NAME[:BUILD|:LINES]...

A process with LINES saves data while it ends, and prints so many lines.

Another scenario has one small service, of the scenario's name; of the name "refuse", it refuses,
and of the name "full", its files cannot be written. To save one as "slow" lasts until the standard
input is closed.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from lariat.scenario import Scenario, find
from shared import bus as buses
from shared.bus import BusOptions
from stack.launcher.console import ProcessConsole
from stack.launcher.fork_server import ForkServer
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program, process_environment
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary
from stack.scenario_manager.scenario_manager import ScenarioManager


class Library(ScenarioLibrary):
    """Scenarios of which one takes long to save."""

    def save(self, scenario: Scenario, name: str) -> None:
        if name == "slow":
            sys.stdin.read()
        super().save(scenario, name)


def main() -> int:
    port, namespace, *names = sys.argv[1:]
    hub = f"tcp/127.0.0.1:{port}"

    def program(name: str, build: str) -> Program:
        saves = build.isdigit()
        more = ("--lines-at-end" if saves else "--build", build)
        arguments = ("--namespace", namespace, "--connect", hub, "--name", name, *more)
        again = ("--restarted",)
        return Program(name, "tests.shared.beacon", arguments, again, niceness=3, saves=saves)

    def programs_of(path: Path, scenario: Scenario) -> list[Program]:
        name = scenario.name
        if name == "full":
            raise OSError("no space left on device")
        return [program(name, "refuse" if name == "refuse" else "")]

    programs = [program(*name.partition(":")[::2]) for name in names]
    options = BusOptions(namespace, connect=(), listen=(hub,))
    first = find("three-cylinders")
    with (
        ForkServer(process_environment()) as forks,
        buses.open(options, "lariat") as bus,
        tempfile.TemporaryDirectory() as folder,
    ):
        library = Library(Path(folder, "saved"), first)
        check = [sys.executable, "-S", "-c", ""]
        trials = Campaigns(Path(folder, "tables"), Path(folder, "trials"), lambda *_: check[1:])
        switch = ScenarioManager(
            library, first, Path(folder, "started"), lambda _: check, trials, programs_of
        )
        launcher = Launcher(programs, bus, ProcessConsole(sys.stderr), switch, forks)
        return launcher.run(lambda seconds: print("all ready", flush=True))


if __name__ == "__main__":
    sys.exit(main())
