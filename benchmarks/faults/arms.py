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

PROXY_HOST = "127.0.0.41"
"""Address of the proxy, which the gateway connects to."""
ARM_HOSTS: dict[Side, str] = {"right": "127.0.0.42", "left": "127.0.0.43"}
"""Addresses of the arms: of the one behind the proxy, and of a second one without."""
OBSERVED_SIDE: Side = "right"
OTHER_SIDE: Side = "left"
ARM_PORTS = {"v3": (29999, 30003, 30004), "v4": (29999, 30004)}
"""Ports that the proxy forwards, by firmware."""
POWER_ON_TIME = 0.5
"""Time from PowerOn until an emulated arm can be enabled [s]."""
ARM_NICENESS = -16
"""Scheduling priority of emulators and proxy: above that of the stack."""


class Arms:
    """Emulated arms, and the proxy of the observed one."""

    def __init__(self, scenario: Path, folder: Path, firmware: str) -> None:
        self.log = folder / "joints.csv"
        """The observed arm's log."""
        sides = [side for side in ARM_HOSTS if load(scenario).end(side).driver == "cr5"]
        arm = load_with(scenario, [f"ends.{side}.firmware={firmware}" for side in sides])
        self._arm_scenario = folder / "arm.toml"
        self._arm_scenario.write_text(arm.text, encoding="utf-8")
        hosts = {**ARM_HOSTS, OBSERVED_SIDE: PROXY_HOST}
        addresses = [f"ends.{side}.address={hosts[side]}" for side in sides]
        self.scenario: Scenario = load_with(self._arm_scenario, addresses)
        """The cell, whose arms have addresses."""
        self.cell_scenario = folder / "cell.toml"
        """Its file."""
        self.cell_scenario.write_text(self.scenario.text, encoding="utf-8")
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        for side in sides:
            self.start(side)
        ports = [str(port) for port in ARM_PORTS[firmware]]
        words = PROXY_HOST, ARM_HOSTS[OBSERVED_SIDE], *ports
        self._spawn("proxy", module_entry.command("benchmarks.faults.tcp_proxy", *words))

    @property
    def pid(self) -> int:
        """Id of the observed arm's process."""
        return self._processes[OBSERVED_SIDE].pid

    def start(self, side: Side = OBSERVED_SIDE, silence: str = "hold") -> None:
        """Start an arm, at the scenario's start."""
        words = ["--host", ARM_HOSTS[side], "--scenario", str(self._arm_scenario), "--side", side]
        words += ["--arm.power-on-time", str(POWER_ON_TIME), "--arm.silence", silence]
        if side == OBSERVED_SIDE:
            words += ["--log", str(self.log)]
        self._spawn(side, module_entry.command("services.cr5_emulator", *words))

    def kill(self, name: str = OBSERVED_SIDE) -> None:
        """Kill an arm, or the proxy, and wait until it is gone."""
        self._processes[name].kill()
        self._processes[name].wait()

    def command_line(self, command: LineCommand) -> None:
        """Give the proxy a command: a line condition, or to cut the connections."""
        pipe = self._processes["proxy"].stdin
        assert pipe is not None
        pipe.write(f"{command}\n".encode())
        pipe.flush()

    def close(self) -> None:
        """End arms and proxy."""
        for name in self._processes:
            self.kill(name)

    def _spawn(self, name: str, arguments: Sequence[str]) -> None:
        """Start an emulator or the proxy and wait until it is ready; raises DeadlineMissed."""
        process = subprocess.Popen(
            child_command(signal.SIGKILL, ARM_NICENESS, arguments),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **LIBRARY_ENVIRONMENT},
            start_new_session=True,
        )
        self._processes[name] = process
        assert process.stdout is not None
        if not process.stdout.readline().startswith(b"ready"):
            raise DeadlineMissed(f"{arguments[2]} does not start; is another bench running?")
