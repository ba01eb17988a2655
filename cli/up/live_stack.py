"""The live stack of `lariat up`."""

from __future__ import annotations

import logging
import multiprocessing
import os
import socket
import sys
import tempfile
import time
import webbrowser
from contextlib import redirect_stdout
from multiprocessing.context import ForkProcess
from pathlib import Path

import cli.__main__ as commands
from cli.up.options import UpOptions
from dashboard.web.secret_files import load_token
from lariat.configuration import ConfigurationError
from lariat.files.temporary_folder import TemporaryFolder
from lariat.scenario import Scenario, Side, find, load
from lariat.scenario.plausibility import doubts
from services.recorder.options import RecorderOptions
from shared import bus as buses
from shared.bus import BusOptions
from stack import dependencies, services
from stack.credentials.local_secret import local_secret, port_lock
from stack.launcher import module_entry
from stack.launcher.console import ConsoleHandler, ProcessConsole
from stack.launcher.fork_server import ForkServer
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program
from stack.launcher.programs import (
    EMULATOR_HOSTS,
    EMULATOR_PORTS,
    emulated_sides,
    emulator_program,
    service_program,
)
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.campaign.trial_process import TrialOptions
from stack.scenario_manager.library import ScenarioLibrary, write
from stack.scenario_manager.scenario_manager import ScenarioManager

RECORDINGS = RecorderOptions().folder
"""Folder of the recorder."""
MAX_PORT = 65535
"""Largest TCP port."""
MAX_SOCKET_PATH = 100
"""Longest path of a socket, less than every system allows [bytes]."""
CAMPAIGN_FOLDER = RECORDINGS / "campaigns"
"""Folder of the tables of campaigns."""


def run(options: UpOptions, fork_server: ForkServer) -> int:
    """Start the whole stack and keep it running until a signal."""
    scenario = find(options.scenario)
    cell = load(scenario)
    page = f", page on port {options.dashboard_port}" if options.dashboard else ""
    with port_lock(options.port, f"{cell.name} since {time.strftime('%H:%M:%S')}{page}"):
        return _run(options, fork_server, scenario, cell)


def _run(options: UpOptions, fork_server: ForkServer, scenario: Path, cell: Scenario) -> int:
    """Start the whole stack of a scenario on a port that is its own."""
    # The page's libraries take the longest: it begins before those that then need the processor.
    parts = [*["dashboard"] * options.dashboard, *services.NAMES, *["recorder"] * options.record]
    parts += ["ros2"] * options.ros2
    if options.ros2_commands and not options.ros2:
        raise ConfigurationError("--ros2-commands goes with --ros2")
    dependencies.check(cell, parts)
    _check_free("127.0.0.1", options.port, "is another stack running? choose another --port")
    if options.dashboard:
        _check_free("127.0.0.1", options.dashboard_port, "choose another --dashboard-port")
    emulated = emulated_sides(cell)
    for side in emulated:
        _check_emulator_ports(side)
    for line in doubts(cell):
        print(f"lariat: plausible only by mistake: {line}", file=sys.stderr)
    check = _begin_check(scenario)
    console = ProcessConsole()
    logging.basicConfig(level=logging.INFO, handlers=[ConsoleHandler(console)], force=True)
    endpoint = f"tcp/127.0.0.1:{options.port}"

    def print_ready(seconds: float) -> None:
        ready = f"all {len(emulated) + len(parts)} processes are ready after {seconds:.1f} s"
        console.print_line("lariat", ready)
        if options.dashboard:
            print("Ctrl-C stops all", flush=True)
            print(f"dashboard at {address}", flush=True)
        else:
            print("the stack is up  (Ctrl-C stops all)", flush=True)
        if options.dashboard and options.browser:
            _open_browser(address, folder)

    def programs(path: Path, started: Scenario) -> list[Program]:
        arms = emulated_sides(started)
        # A copy: a process that is started again reads what the others have read, whatever has
        # become of the file.
        own = write(started, Path(tempfile.mkdtemp(dir=folder)), path.stem)
        common = ("--scenario", str(own), *bus_arguments)
        any_port = "tcp/127.0.0.1:0"
        inner = {
            name: (*common, "--listen", _inner_endpoint(folder, name) or any_port) for name in parts
        }
        emulators = [emulator_program(side, own) for side in arms]
        return emulators + [service_program(name, inner[name], arms, more) for name in parts]

    with (
        TemporaryFolder("lariat-up-") as temporary,
        local_secret(options.port) as settings,
    ):
        folder = temporary.path
        inner_hub = _inner_endpoint(folder, "hub") or endpoint
        bus_arguments = ("--namespace", options.namespace, "--connect", inner_hub)
        bus_arguments += ("--settings", str(settings))
        # Command lines are public, so a file hands over the token; a restart takes it again.
        token = folder / "token"
        address = f"http://127.0.0.1:{options.dashboard_port}/?token={load_token(token)}"
        page = ["--port", str(options.dashboard_port), "--token-file", str(token)]
        if options.dashboard_address:
            page += ["--address", *options.dashboard_address]
        if options.dashboard_password_file:
            page += ["--password-file", str(options.dashboard_password_file.resolve())]
        recorder = ["--always"] * options.record_always
        if options.keep is not None:
            recorder += ["--keep", str(options.keep)]
        ros2 = ["--router", options.ros2_router, *["--commands"] * options.ros2_commands]
        more = {"dashboard": page, "recorder": recorder, "ros2": ros2}
        library = ScenarioLibrary(options.saved_scenarios, scenario)
        campaigns = Campaigns(CAMPAIGN_FOLDER, folder / "campaign", _trial_command)
        listen = tuple({endpoint, inner_hub})
        hub = BusOptions(options.namespace, connect=(), listen=listen, settings=settings)
        with buses.open(hub, "lariat") as bus:
            _await_check(check)
            switch = ScenarioManager(
                library, scenario, folder / "started", _check_command, campaigns, programs
            )
            return Launcher(switch.programs, bus, console, switch, fork_server).run(print_ready)


def _inner_endpoint(folder: Path, name: str) -> str:
    """Return the endpoint of a process in a folder that other users may not enter; empty: too long.

    Every user of the machine can connect to a port, and so keep a process busy with refusals.
    """
    path = os.fsencode(folder / f"bus-{name}")
    return f"unixsock-stream/{os.fsdecode(path)}" if len(path) <= MAX_SOCKET_PATH else ""


def _open_browser(address: str, folder: Path) -> None:
    """Open a page in the default browser, where there is a screen."""
    if sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys():
        return
    # Command lines are public, the browser's too: it gets a private file that leads on.
    page = folder / "page.html"
    page.touch(0o600)
    page.write_text(f'<meta http-equiv="refresh" content="0;url={address}">')
    webbrowser.open(page.as_uri())


def _begin_check(scenario: Path) -> ForkProcess:
    """Begin to check the scenario with the rod, in a process of its own.

    So the launcher loads no compiler, and the services find the kernels compiled. The process is a
    copy of this one, which has imported most of what the check needs, and no thread yet.
    """
    process = multiprocessing.get_context("fork").Process(target=_check, args=(scenario,))
    process.start()
    return process


def _await_check(process: ForkProcess) -> None:
    """Wait for the end of the check; exit where the scenario is refused."""
    process.join()
    if code := process.exitcode:
        # The process has printed the error.
        sys.exit(128 - code if code < 0 else code)


def _check(scenario: Path) -> None:
    """Check a scenario in this process, which ends with that; print nothing but an error."""
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        sys.exit(commands.main(["check", str(scenario)]))


def _check_command(scenario: Path) -> list[str]:
    return [sys.executable, *module_entry.command("cli", "check", str(scenario))]


def _trial_command(trial: TrialOptions) -> list[str]:
    run = ["run", str(trial.scenario), "--seed", str(trial.seed), "--json"]
    run += ["--list-in", str(RECORDINGS), f"--note={trial.note}"]
    run += ["--stop-when-reached"] * trial.stop_when_reached
    if trial.recording:
        run += ["--record", str(RECORDINGS / trial.recording)]
    return list(module_entry.command("cli", *run))


def _check_emulator_ports(side: Side) -> None:
    for port in EMULATOR_PORTS:
        _check_free(EMULATOR_HOSTS[side], port, f"the emulator of ends.{side} needs it")


def _check_free(host: str, port: int, hint: str) -> None:
    if not 0 < port <= MAX_PORT:
        raise ConfigurationError(f"port {port} does not exist; give 1 to {MAX_PORT}")
    with socket.socket() as probe:
        # As servers do: a port whose connection ended a moment ago is free.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise ConfigurationError(
                f"port {port} of {host} cannot be opened ({error}); {hint}"
            ) from None
