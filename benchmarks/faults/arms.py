"""Emulated arms of a live stack, of which the observed one is behind a TCP proxy.

The scenario's CR5 gets an address, as a real arm has. The proxy listens there and connects to the
emulator, which logs the motion of its joints. To the stack both look like a real arm.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

from benchmarks.faults.tcp_proxy import LineCommand
from benchmarks.operator import DeadlineMissed
from lariat.scenario import Scenario, Side, load
from lariat.scenario.settings import load_with
from stack.launcher import module_entry
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT
from stack.launcher.process import child_command

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


class Arms:
    """Emulated arms, and the proxy of the observed one."""

    def __init__(self, scenario: Path, folder: Path, firmware: str) -> None:
        """Start the arms and the proxy.

        Args:
            scenario: A scenario with a CR5 at its right end.
            folder: Folder for logs.
            firmware: Firmware of the arms, v3 or v4.
        """
        self.log = folder / "joints.csv"
        """The observed arm's log."""
        sides = [s for s in (OBSERVED_SIDE, OTHER_SIDE) if load(scenario).end(s).driver == "cr5"]
        arm = load_with(scenario, [f"ends.{side}.firmware={firmware}" for side in sides])
        self._arm_scenario = folder / "arm.toml"
        self._arm_scenario.write_text(arm.text, encoding="utf-8")
        hosts = {OBSERVED_SIDE: PROXY_HOST, OTHER_SIDE: OTHER_ARM_HOST}
        addresses = [f"ends.{side}.address={hosts[side]}" for side in sides]
        self.scenario: Scenario = load_with(self._arm_scenario, addresses)
        """The cell, whose arms have addresses."""
        self.cell_scenario = folder / "cell.toml"
        """Its file."""
        self.cell_scenario.write_text(self.scenario.text, encoding="utf-8")
        self._other_emulator: subprocess.Popen[bytes] | None = None
        self._emulator = self._spawn_emulator()
        if OTHER_SIDE in sides:
            self.start_other_emulator()
        ports = [str(port) for port in ARM_PORTS[firmware]]
        module = "benchmarks.faults.tcp_proxy"
        self._proxy = self._spawn(module_entry.command(module, PROXY_HOST, ARM_HOST, *ports))

    @property
    def pid(self) -> int:
        """Id of the observed arm's process."""
        return self._emulator.pid

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
        assert self._proxy.stdin is not None
        self._proxy.stdin.write(f"{command}\n".encode())
        self._proxy.stdin.flush()

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
            env={**os.environ, **LIBRARY_ENVIRONMENT},
            start_new_session=True,
        )
        assert process.stdout is not None
        if not process.stdout.readline().startswith(b"ready"):
            raise DeadlineMissed(f"{arguments[2]} does not start; is another bench running?")
        return process

    def close(self) -> None:
        """End arms and proxy."""
        for process in (self._proxy, self._emulator, self._other_emulator):
            if process is not None:
                process.kill()
                process.wait()
