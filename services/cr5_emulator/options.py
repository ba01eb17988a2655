"""EmulatorOptions of an emulated arm: its firmware, and what the vendor's documents leave open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from services.cr5_emulator.tether import Tether

Firmware = Literal["v3", "v4"]
Release = Literal["", "3.5.1", "3.5.2", "3.5.5", "3.5.7", "4.5", "4.6"]
LATEST_RELEASE: dict[Firmware, Release] = {"v3": "3.5.7", "v4": "4.6"}
"""Latest release of each firmware."""

FAULTS: dict[str, str] = {
    "no_servo_reply": "ServoJ and ServoP get no reply",
    "late_reply": "replies come 1.5 s late",
    "joined_replies": "two replies come in one segment",
    "torn_replies": "replies come in two pieces, split within a number",
    "not_tcp": "the control mode is not TCP: plain text outside the grammar",
    "no_user_tool": "User and Tool are not calibrated: -1",
    "alarm_singular": "alarm 26 while moving",
    "alarm_overspeed": "alarm 49 while moving; V3 also powers the arm off",
    "collision": "alarm 117 while moving",
    "emergency_stop": "the emergency stop is pressed",
    "power_off": "the power of the arm fails",
    "idle_close": "a command port closes after 10 s without a command",
    "port_taken": "another program holds port 29999",
    "torn_feedback": "packets come in pieces of 400 bytes",
    "stale_feedback": "packets stop",
    "repeated_feedback": "the same packet is repeated while commands are accepted",
    "slow_feedback": "a packet every 40 ms",
    "no_reply": "commands are accepted and never answered",
    "wrong_test_value": "packets with a wrong test value for 0.2 s",
    "wrong_size": "packets that state a wrong size for 0.2 s",
    "time_back": "the packets' clock jumps back",
    "queue_blocked": "the motion queue stops until Continue",
    "drag": "hand guiding is switched on",
    "taken_over": "the pendant takes control: the mode is no longer TCP",
    "links_closed": "all connections are closed",
    "frozen": "the controller sends nothing at all",
}
"""Names for `--fault NAME` (from the start) and `--fault NAME@SECONDS`."""


@dataclass(frozen=True)
class EmulatorOptions:
    """EmulatorOptions of one emulated arm."""

    firmware: Firmware = "v3"
    release: Release = ""
    """Release of the firmware; empty: 3.5.7 or 4.6. 3.5.1 sends feedback on 30003 and only echoes
    commands; 3.5.2 has ServoJ without a time and joints up to 180 deg; 3.5.5 lacks Pause, Continue
    and SetUser; 4.5 lists alarms by drive and lacks RequestControl."""
    calibrated: bool = False
    """Whether the geometry differs from the nominal one by about a millimetre."""
    joints: tuple[float, float, float, float, float, float] = (0.0, 0.0, -90.0, 0.0, 90.0, 0.0)
    """Joint angles at the start [deg]."""
    robot_type: int = 5
    """Byte 1031 of the feedback: 5 is a CR5."""
    power_on_time: float = 10.0
    """Time from PowerOn until the arm can be enabled [s]."""
    powered: bool = True
    """Whether the arm has power at the start."""
    servo_lag: float = 0.03
    """Time constant of the drives at lookahead 50 and gain 500 [s]."""
    servo_jitter: float = 0.0
    """Largest random delay before a servo point takes effect [s]."""
    servo_time: float = 0.1
    """Time in which ServoP of V3, which states none, reaches its point [s]."""
    servo_reply: bool = True
    """Whether V3 replies to ServoJ and ServoP."""
    silence: Literal["hold", "coast", "alarm"] = "hold"
    """Reaction of the arm when servo points stop; undocumented."""
    silence_time: float = 0.2
    """Time without points after which `coast` and `alarm` act [s]."""
    second_client: Literal["refuse", "replace"] = "refuse"
    """Reaction to a second client on a command port."""
    queue_depth: int = 64
    """Capacity of the motion queue; further entries are answered with -1."""
    decimals: int = 6
    """Decimals of numbers in replies."""
    result_id: bool = True
    """Whether V4 replies to queued commands with their number."""
    tether: tuple[float, ...] = ()
    """Elastic tether at the gripper: x y z of its fixed end in the base [m], rest length [m],
    stiffness [N/m], and x y z of the grip in the flange [m]; empty: no tether."""
    force_noise: float = 0.0
    """Standard deviation of the reported force [N]."""
    seed: int = 0
    """Seed of jitter and noise."""
    faults: tuple[str, ...] = ()
    """Faults: NAME or NAME@SECONDS."""

    def __post_init__(self) -> None:
        Tether.of(self.tether)
        matching = [r for r in get_args(Release) if r[:1] == self.firmware[-1]]
        if self.release and self.release not in matching:
            raise ValueError(
                f"release {self.release!r} is no release of {self.firmware}; there are "
                f"{', '.join(matching)}"
            )
        for fault in self.faults:
            name, _, at = fault.partition("@")
            if name not in FAULTS:
                raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
            if at and not at.replace(".", "", 1).isdigit():
                raise ValueError(f"fault {fault!r}: write NAME@SECONDS")

    @property
    def version(self) -> Release:
        """The release, or the latest one of the firmware."""
        return self.release or LATEST_RELEASE[self.firmware]

    @property
    def fault_times(self) -> dict[str, float]:
        """Start of each fault [s since the start of the arm]."""
        return {f.partition("@")[0]: float(f.partition("@")[2] or 0.0) for f in self.faults}
