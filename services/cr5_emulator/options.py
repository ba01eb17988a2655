"""What an emulated arm is like: its firmware, and a switch for everything documents leave open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from services.cr5_emulator.load import Tether

Firmware = Literal["v3", "v4"]
Release = Literal["", "3.5.1", "3.5.2", "3.5.5", "3.5.7", "4.5", "4.6"]
NEWEST: dict[Firmware, Release] = {"v3": "3.5.7", "v4": "4.6"}

FAULTS: dict[str, str] = {
    "no_servo_reply": "ServoJ and ServoP are not answered",
    "late_reply": "answers come 1.5 s late",
    "joined_replies": "two answers come in one segment",
    "torn_replies": "answers come in two pieces, torn within a number",
    "not_tcp": "the control mode is not TCP: bare text outside the grammar",
    "no_user_tool": "User and Tool are not calibrated: -1",
    "alarm_singular": "alarm 26 while moving",
    "alarm_overspeed": "alarm 49 while moving; V3 also powers the arm off",
    "collision": "alarm 117 while moving",
    "emergency_stop": "somebody presses the emergency stop",
    "power_off": "the power of the arm goes away",
    "idle_close": "a command port closes after 10 s without a command",
    "port_taken": "another program holds port 29999",
    "torn_feedback": "packets come in pieces of 400 bytes",
    "stale_feedback": "no packets any more",
    "repeated_feedback": "the same packet again and again, while commands are taken",
    "slow_feedback": "a packet every 40 ms",
    "no_reply": "commands are taken and never answered",
    "wrong_test_value": "packets with another test value for 0.2 s",
    "wrong_size": "packets that state another size for 0.2 s",
    "time_back": "the packets' clock jumps back",
    "queue_blocked": "the queue stops until Continue",
    "drag": "somebody switches to hand guiding",
    "taken_over": "the pendant takes control away: not TCP any more",
    "links_closed": "all connections are closed",
    "frozen": "the controller answers nothing and sends nothing",
}
"""Names for `--fault NAME` (from the start) and `--fault NAME@SECONDS`."""


@dataclass(frozen=True)
class Options:
    """Settings of one emulated arm."""

    firmware: Firmware = "v3"
    release: Release = ""
    """Of the firmware; empty: 3.5.7 or 4.6. 3.5.1 sends feedback on 30003 and only echoes; 3.5.2
    takes no time with ServoJ and half a turn of a joint; 3.5.5 does not know Pause, Continue,
    SetUser or trays; 4.5 lists alarms by drive and knows no RequestControl and no force control."""
    calibrated: bool = False
    """Its geometry differs from the nominal one by about a millimetre."""
    joints: tuple[float, float, float, float, float, float] = (0.0, 0.0, -90.0, 0.0, 90.0, 0.0)
    """At the start [deg]."""
    robot_type: int = 5
    """Byte 1031: 5 is a CR5."""
    power_on_time: float = 10.0
    """From PowerOn until the arm can be enabled [s]."""
    powered: bool = True
    """Whether the arm has power at the start."""
    servo_lag: float = 0.03
    """Time constant with which the drives follow, at lookahead 50 and gain 500 [s]."""
    servo_jitter: float = 0.0
    """Greatest random delay before a servo point takes effect [s]."""
    servo_time: float = 0.1
    """In which V3's ServoP, which states none, reaches its point [s]."""
    servo_reply: bool = True
    """Whether V3 answers ServoJ and ServoP."""
    silence: Literal["hold", "coast", "alarm"] = "hold"
    """What the arm does when servo points stop coming: nothing is documented."""
    silence_time: float = 0.2
    """After which `coast` and `alarm` act [s]."""
    second_client: Literal["refuse", "replace"] = "refuse"
    """On a command port that has one already."""
    queue_depth: int = 64
    """Entries; what more come in are answered with -1."""
    decimals: int = 6
    """Of numbers in answers."""
    result_id: bool = True
    """Whether V4 answers queued commands with their number."""
    scripts: tuple[str, ...] = ("demo",)
    """That the controller has; one that runs stands still."""
    script_time: float = 5.0
    """Of every script [s]."""
    traces: tuple[str, ...] = ("swing.csv",)
    """Recorded paths that the controller has: five degrees of the first joint, to and fro."""
    skin: bool = False
    """Whether the arm wears its skin."""
    force_sensor: bool = True
    """Whether there is one at the flange."""
    tether: tuple[float, ...] = ()
    """An elastic line that pulls at the gripper: x y z of its far end in the base [m], its length
    [m] and stiffness [N/m], and x y z of the grip in the flange [m]; empty: nothing pulls."""
    force_noise: float = 0.0
    """Standard deviation of the force that the arm tells [N]."""
    seed: int = 0
    """Of jitter and noise."""
    faults: tuple[str, ...] = ()
    """NAME or NAME@SECONDS."""

    def __post_init__(self) -> None:
        Tether.of(self.tether)
        fitting = [r for r in get_args(Release) if r[:1] == self.firmware[-1]]
        if self.release and self.release not in fitting:
            raise ValueError(
                f"release {self.release!r} is none of {self.firmware}; there are "
                f"{', '.join(fitting)}"
            )
        for fault in self.faults:
            name, _, at = fault.partition("@")
            if name not in FAULTS:
                raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
            if at and not at.replace(".", "", 1).isdigit():
                raise ValueError(f"fault {fault!r}: write NAME@SECONDS")

    @property
    def version(self) -> Release:
        """The release, or the newest one of the firmware."""
        return self.release or NEWEST[self.firmware]

    @property
    def frame_count(self) -> int:
        """Greatest index of a user or tool frame."""
        return 50 if self.version >= "4.6" else 9

    @property
    def fault_times(self) -> dict[str, float]:
        """When each fault begins [s since the start]."""
        return {f.partition("@")[0]: float(f.partition("@")[2] or 0.0) for f in self.faults}
