"""Processes of a live stack whose arm is behind a TCP proxy.

The scenario's CR5 gets an address, as a real arm has. The proxy listens there and connects to the
emulator, which logs the motion of its joints. To the stack both look like a real arm.
"""

from __future__ import annotations

import errno
import os
import secrets
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.faults.line_condition import LineCommand
from lariat.scenario import Scenario, Side
from stack import services
from stack.credentials.local_secret import find_local_secret
from stack.launcher import module_entry
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT
from stack.launcher.process import child_command
from stack.launcher.programs import NICENESS as SERVICE_NICENESS
from stack.scenario_overrides import load_with

PROXY_HOST, ARM_HOST = "127.0.0.41", "127.0.0.42"
"""Address of the proxy, which the gateway connects to, and of the arm behind it."""
OTHER_ARM_HOST = "127.0.0.43"
"""Address of a second arm, without a proxy."""
ARM_PORTS = {"v3": (29999, 30003, 30004), "v4": (29999, 30004)}
"""Ports that the proxy forwards, by firmware."""
OBSERVED_SIDE: Side = "right"
"""End of the arm that is observed."""
OTHER_SIDE: Side = "left"
"""End of a second arm, if any."""
POWER_ON_TIME = 0.5
"""Time from PowerOn until an emulated arm can be enabled [s]."""
ARM_NICENESS = -16
"""Scheduling priority of emulators and proxy: above that of the stack."""
START_TIMEOUT = 200.0
"""Time limit for the stack to become ready; kernels may have to be compiled [s]."""
ROUTER_TIMEOUT = 20.0
"""Time limit for the router to listen [s]."""
EXIT_TIMEOUT = 8.0
"""Time limit for a process to end before it is killed [s]."""
HOSTILE_RATE = 1000.0
"""Hostile messages in a second [Hz]."""
POLL_INTERVAL = 0.01
"""Time between two checks of a condition [s]."""
BLOCKED_HOST = "127.0.0.44"
"""Address at which a second gateway reaches the bus, through a line that is opened later."""
RAISING_FOLDER = Path(__file__).parent / "raising"
"""Folder of the module that lets processes raise an exception at SIGUSR1."""
FILL_SIZE = 1 << 20
"""Bytes that are written at once to fill a disk."""
RECORDINGS_SIZE = "700m"
"""Size of the disk for recordings: above the free space at which the recorder stops."""


class DeadlineMissed(RuntimeError):
    """A condition did not become true in time."""


class CellProcesses:
    """Emulated arms, the proxy, and the stack."""

    def __init__(
        self,
        scenario: Path,
        folder: Path,
        firmware: str,
        routed: bool,
        recorded: bool = False,
        page: bool = False,
    ) -> None:
        """Start the arms and the proxy; the stack is started by `start_stack`.

        Args:
            scenario: A scenario with a CR5 at its right end.
            folder: Folder for logs.
            firmware: Firmware of the arms, v3 or v4.
            routed: Whether the services connect through a router, as in containers, without a
                launcher that restarts them; otherwise `lariat up` runs them.
            recorded: Whether runs are recorded, to a small disk of their own, which needs root.
            page: Whether `lariat up` runs the dashboard.
        """
        self.folder = folder
        self._recorded = recorded
        self._page = page
        if recorded:
            disk = folder / "recordings"
            disk.mkdir()
            mount = ["mount", "-t", "tmpfs", "-o", f"size={RECORDINGS_SIZE}", "tmpfs", str(disk)]
            subprocess.run(mount, check=True)
        self.routed = routed
        self.log = folder / "joints.csv"
        """The observed arm's log."""
        self._arm_scenario = folder / "arm.toml"
        arm = load_with(scenario, [f"ends.{OBSERVED_SIDE}.firmware={firmware}"])
        addresses = [f"ends.{OBSERVED_SIDE}.address={PROXY_HOST}"]
        has_other_arm = arm.end(OTHER_SIDE).driver == "cr5"
        if has_other_arm:
            sides = (OBSERVED_SIDE, OTHER_SIDE)
            arm = load_with(scenario, [f"ends.{side}.firmware={firmware}" for side in sides])
            addresses.append(f"ends.{OTHER_SIDE}.address={OTHER_ARM_HOST}")
        self._arm_scenario.write_text(arm.text, encoding="utf-8")
        self.scenario: Scenario = load_with(self._arm_scenario, addresses)
        self._cell_scenario = folder / "cell.toml"
        self._cell_scenario.write_text(self.scenario.text, encoding="utf-8")
        self.port = _free_port()
        self.namespace = f"faults-{secrets.token_hex(4)}"
        self._services: dict[str, subprocess.Popen[bytes]] = {}
        self._launcher: subprocess.Popen[bytes] | None = None
        self._other_emulator: subprocess.Popen[bytes] | None = None
        self._emulator = self._spawn_emulator()
        if has_other_arm:
            self.start_other_emulator()
        ports = [str(port) for port in ARM_PORTS[firmware]]
        module = "benchmarks.faults.tcp_proxy"
        self._proxy = self._spawn(module_entry.command(module, PROXY_HOST, ARM_HOST, *ports))

    # Arms and line

    def start_emulator(self, silence: str = "hold") -> None:
        """Start the observed arm, at the scenario's start."""
        self._emulator = self._spawn_emulator(silence)

    def kill_emulator(self) -> None:
        """Kill the observed arm and wait until it is gone."""
        self._emulator.kill()
        self._emulator.wait()

    def start_other_emulator(self) -> None:
        """Start the arm at the other end."""
        command = self._emulator_command(OTHER_ARM_HOST, OTHER_SIDE)
        self._other_emulator = self._spawn(command)

    def kill_other_emulator(self) -> None:
        """Kill the arm at the other end and wait until it is gone."""
        assert self._other_emulator is not None
        self._other_emulator.kill()
        self._other_emulator.wait()

    def command_line(self, command: LineCommand) -> None:
        """Give the proxy a command: a line condition, or to cut the connections."""
        _command(self._proxy, command)

    def _spawn_emulator(self, silence: str = "hold") -> subprocess.Popen[bytes]:
        options = ("--log", str(self.log), "--arm.silence", silence)
        return self._spawn(self._emulator_command(ARM_HOST, OBSERVED_SIDE, *options))

    def _emulator_command(self, host: str, side: str, *more: str) -> list[str]:
        command = [*module_entry.command("services.cr5_emulator", "--host", host)]
        command += ["--scenario", str(self._arm_scenario), "--side", side]
        return [*command, "--arm.power-on-time", str(POWER_ON_TIME), *more]

    def _spawn(self, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
        """Start an emulator or the proxy and wait until it is ready; raises DeadlineMissed."""
        process = subprocess.Popen(
            child_command(signal.SIGKILL, ARM_NICENESS, arguments),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
            start_new_session=True,
        )
        assert process.stdout is not None
        if not process.stdout.readline().startswith(b"ready"):
            raise DeadlineMissed(f"{arguments[2]} does not start; is another bench running?")
        return process

    # Stack

    def start_stack(self) -> None:
        """Start all services; with `lariat up`, wait until they are ready."""
        if self.routed:
            self.start_router()
            for name in services.NAMES:
                self._start_service(name)
        else:
            self._start_launcher()

    def start_router(self) -> None:
        """Start the router that all services connect to, and wait until it listens."""
        listen = f"tcp/127.0.0.1:{self.port}"
        self._run("router", module_entry.command("shared.bus.router", "--listen", listen))

        def listens() -> bool:
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", self.port)) == 0

        wait_until(listens, ROUTER_TIMEOUT, "the router does not listen")

    def kill_router(self) -> None:
        """Kill the router and wait until it is gone."""
        self._services["router"].kill()
        self._services["router"].wait()

    def prepare_second_gateway(self) -> None:
        """Start another gateway of the same cell, whose line to the bus is blocked.

        It looks for its arm where there is none: two that connect to one arm disturb each other
        before the bus has a say.
        """
        elsewhere = self.folder / "elsewhere.toml"
        address = f"ends.{OBSERVED_SIDE}.address={BLOCKED_HOST}"
        elsewhere.write_text(load_with(self._arm_scenario, [address]).text, encoding="utf-8")
        module, port = "benchmarks.faults.tcp_proxy", str(self.port)
        line = self._spawn(module_entry.command(module, BLOCKED_HOST, "127.0.0.1", port))
        self._services["second_line"] = line
        _command(line, "blocked")
        hub = f"tcp/{BLOCKED_HOST}:{port}"
        self._start_service(
            "robot_gateway", "second_gateway", "--restarted", hub=hub, scenario=elsewhere
        )

    def connect_second_gateway(self) -> None:
        """Let the other gateway reach the bus."""
        _command(self._services["second_line"], "normal")

    def end_second_gateway(self) -> None:
        """End the other gateway and its line."""
        self.end("second_gateway")
        self.end("second_line")

    def fill_disk(self) -> None:
        """Fill the disk of the recordings."""
        with (self.folder / "recordings" / "fill").open("wb", buffering=0) as file:
            try:
                while file.write(bytes(FILL_SIZE)) == FILL_SIZE:
                    pass
            except OSError as error:
                if error.errno != errno.ENOSPC:
                    raise

    def clear_disk(self) -> None:
        """Make room on the disk of the recordings."""
        (self.folder / "recordings" / "fill").unlink()

    def start_hostile_publisher(self) -> None:
        """Start to publish hostile messages on the bus, `HOSTILE_RATE` in a second."""
        hub = f"tcp/127.0.0.1:{self.port}"
        options = ["--hub", hub, "--namespace", self.namespace, "--rate", str(HOSTILE_RATE)]
        if secret := find_local_secret((hub,)):
            options += ["--settings", str(secret)]
        self._run("hostile", module_entry.command("benchmarks.faults.hostile_publisher", *options))

    def end(self, name: str) -> None:
        """End a process that was started here, and wait until it is gone."""
        process = self._services.pop(name)
        process.terminate()
        process.wait(EXIT_TIMEOUT)

    def pid(self, name: str) -> int | None:
        """Return the id of a process that is started here; None for one of the launcher's.

        Args:
            name: A service, `router`, `lariat` (the launcher) or `emulator`.
        """
        if name in self._services:
            return self._services[name].pid
        if name == "emulator":
            return self._emulator.pid
        if name == "lariat":
            assert self._launcher is not None
            return self._launcher.pid
        return None

    def close(self) -> None:
        """End all processes."""
        own = (self._launcher, self._emulator, self._other_emulator, self._proxy)
        for process in (*self._services.values(), *own):
            if process is None or process.poll() is not None:
                continue
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGINT)
            try:
                process.wait(EXIT_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if self._recorded:
            subprocess.run(["umount", str(self.folder / "recordings")], check=False)

    def _start_service(
        self,
        service: str,
        name: str = "",
        *options: str,
        hub: str = "",
        scenario: Path | None = None,
    ) -> None:
        """Start a service.

        Args:
            service: Name of the service.
            name: Name of the process; by default that of the service.
            options: Further options of the command line.
            hub: Endpoint of the bus; by default that of the hub or router.
            scenario: Its scenario; by default that of the cell.
        """
        own_hub = f"tcp/127.0.0.1:{self.port}"
        command = [*module_entry.command(f"services.{service}", *options)]
        command += ["--scenario", str(scenario or self._cell_scenario)]
        command += ["--connect", hub or own_hub, "--namespace", self.namespace]
        if secret := find_local_secret((own_hub,)):
            command += ["--settings", str(secret)]
        self._run(name or service, [*command, "--mode", "client", "--listen"])

    def _run(self, name: str, arguments: Sequence[str]) -> None:
        """Start a process that ends with this one."""
        with (self.folder / f"{name}.txt").open("ab") as file:
            self._services[name] = subprocess.Popen(
                child_command(signal.SIGKILL, SERVICE_NICENESS.get(name, 0), arguments),
                stdout=file,
                stderr=subprocess.STDOUT,
                env=_environment(),
                cwd=self.folder,
            )

    def _start_launcher(self) -> None:
        """Start `lariat up` and wait until it is ready."""
        output = self.folder / "up.txt"
        scenario = str(self._cell_scenario)
        arguments = [scenario, "--port", str(self.port), "--namespace", self.namespace]
        arguments += ["--record" if self._recorded else "--no-record"]
        arguments += ["--dashboard-port", str(_free_port())] if self._page else ["--no-dashboard"]
        # SIGTERM, so that it ends the services when this process is killed.
        command = child_command(signal.SIGTERM, 0, module_entry.command("cli", "up", *arguments))
        with output.open("ab") as file:
            start = file.tell()
            launcher = subprocess.Popen(
                command, stdout=file, stderr=subprocess.STDOUT, env=_environment(), cwd=self.folder
            )
        self._launcher = launcher

        def is_up() -> bool:
            if launcher.poll() is not None:
                raise DeadlineMissed(f"the stack ended:\n{output.read_text()[start:]}")
            return "Ctrl-C stops all" in output.read_text()[start:]

        wait_until(is_up, START_TIMEOUT, "the stack did not become ready")


def wait_until(condition: Callable[[], bool], seconds: float, failure: str) -> None:
    """Wait for a condition.

    Args:
        condition: Condition, polled until it is true.
        seconds: Time limit [s].
        failure: Message of the error.

    Raises:
        DeadlineMissed: The condition did not become true in time.
    """
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise DeadlineMissed(failure)
        time.sleep(POLL_INTERVAL)


def _command(line: subprocess.Popen[bytes], command: LineCommand) -> None:
    """Give a proxy a command."""
    assert line.stdin is not None
    line.stdin.write(f"{command}\n".encode())
    line.stdin.flush()


def _environment() -> dict[str, str]:
    return {**os.environ, **LIBRARY_ENVIRONMENT, "PYTHONPATH": str(RAISING_FOLDER)}


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
