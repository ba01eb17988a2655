"""Client of the CR5's protocol, V3 and V4, without sockets: bytes and time in, bytes out.

One request at a time is outstanding on port 29999 and is matched with its reply by the echo, so
that a late reply is never mistaken for the reply to another request. Replies to servo points, where
the firmware sends any, are read only for errors. Enabling and recovering run as a command sequence
over many steps.
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np

from lariat.trajectory import SECOND
from services.robot_gateway.drivers.cr5.command_sequence import (
    CommandSequence,
    Request,
    SequenceSteps,
)
from services.robot_gateway.drivers.cr5.connection import (
    COMMAND_PORT,
    FEEDBACK_PORT,
    MOTION_PORT,
    ArmConnection,
    Phase,
)
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.cr5.outliers import OutlierFilter
from services.robot_gateway.drivers.cr5.power_sequences import (
    IN_ALARM,
    STARTING,
    STOP_COMMANDS,
    UNPOWERED_MODES,
    EnableSettings,
    disable_steps,
    enable_steps,
)
from services.robot_gateway.drivers.cr5.replies import Reply, ReplyReader, integers
from shared.cr5.alarms import FOLLOWING_MODES, MODE_TEXTS, alarm_text
from shared.cr5.packet import PacketReader, is_plausible

REPLY_TIMEOUT = 2.0
"""Time limit of a reply, after which the connection is opened anew [s]."""
KEEPALIVE_PERIOD = 1.0
"""Time between RobotMode requests without any other [s]: the arm may close idle ports."""
QUEUE_BLOCKED_TIME = 0.1
"""Time for which the queue must stand still to count as blocked [s]: the state of the flag between
two motions is not documented."""
REST_SPEED = 1.0
"""Speed of every joint below which the arm is at rest [deg/s]."""
DISABLE_RETRY_PAUSE = 1.0
"""Time between two attempts to disable an arm that keeps its power [s]."""
FEEDBACK_TIMEOUT = 0.1
"""Age of the feedback above which the link counts as lost [s]."""
V4_COLLISION = 11
"""RobotMode of V4 after a collision."""
OCCUPIED_HINT = ", as soon as it was opened; does another program or a pendant hold it?"
"""Hint in the reason when a port is closed within a second of being opened."""


class Cr5Client:
    """Protocol client of one arm."""

    def __init__(self, link: Link, settings: EnableSettings | None = None) -> None:
        """Create a client; the connection is opened by the first steps."""
        self._link = link
        self._settings = settings or EnableSettings()
        self._connection = ArmConnection(link)
        self._sequence = CommandSequence(self.request)
        self.feedback: np.ndarray | None = None
        """Newest packet; None before the first."""
        self._mode_of: np.ndarray | None = None
        self._mode: int | None = None
        """RobotMode, read once of each packet: a tick asks for it ten times."""
        self.last_packet: int | None = None
        """Time of the last new packet [ns]; None before the first."""
        self.packet_count = 0
        """Packets so far, without those that were rejected."""
        self.alarms: tuple[str, ...] = ()
        """Present alarms in words."""
        self.refusal = ""
        """Last error of a servo point or request, in words."""
        self.enabled = False
        """Whether the arm has been enabled and nothing has stopped it since."""
        self.timed_joints = True
        """Whether ServoJ takes the time in which a point is to be reached."""
        self.control_lost = ""
        """Reason why the arm ignores commands although it is not in alarm, in words."""
        self._readers: dict[int, ReplyReader] = {}
        self._packets = PacketReader()
        self._outliers = OutlierFilter()
        self._rejection = ""
        """Reason why the data since the last new packet was rejected, in words."""
        self._now = 0
        self._outstanding: tuple[str, int] | None = None
        self._queue: deque[str] = deque()
        self._last_sent = 0
        self._last_point = -1
        self._alarms_read = False
        self._disabled_at = 0
        """Time of the last attempt to disable the arm [ns]; 0 before the first."""
        self._queue_ran = 0
        """Last time at which the queue ran since the arm was enabled [ns]; 0: never."""

    @property
    def phase(self) -> Phase:
        """Phase of the connection."""
        return self._connection.phase

    @property
    def firmware(self) -> Literal["v3", "v4"] | None:
        """Firmware version, known from the ports that are open."""
        return self._connection.firmware

    @property
    def trouble(self) -> str:
        """Reason why there is no connection, in words."""
        return self._connection.trouble

    @property
    def failure(self) -> str:
        """Reason why the last command sequence failed."""
        return self._sequence.failure

    @property
    def mode(self) -> int | None:
        """RobotMode of the newest packet."""
        if self._mode_of is not self.feedback:
            self._mode_of = self.feedback
            self._mode = None if self.feedback is None else int(self.feedback["robot_mode"])
        return self._mode

    @property
    def mode_words(self) -> str:
        """Operating mode in words."""
        if self.mode is None or self.firmware is None:
            return "no feedback yet"
        return MODE_TEXTS[self.firmware].get(self.mode, f"in mode {self.mode}")

    @property
    def busy(self) -> bool:
        """Whether the arm is being enabled or recovered."""
        return self._sequence.running

    @property
    def age(self) -> float:
        """Age of the newest packet [s]."""
        return np.inf if self.last_packet is None else (self._now - self.last_packet) / SECOND

    @property
    def lost(self) -> bool:
        """Whether the link to the arm is lost."""
        return self.phase != "online" or self.age > FEEDBACK_TIMEOUT

    @property
    def powered(self) -> bool:
        """Whether the drives may be on: they are being switched, or recent feedback does not say
        that they are off."""
        return self.busy or self.lost or self.feedback is None or not self._drives_off()

    @property
    def silence(self) -> str:
        """Description of missing feedback, in words."""
        age = f"for {self.age:.2f} s" if self.age < np.inf else "yet"
        why = f": {self._rejection}" if self._rejection else ""
        return f"no feedback on port {FEEDBACK_PORT} {age}{why}"

    # Commands of the driver

    def enable(self) -> None:
        """Begin to enable the arm, at a person's request; alarms are cleared."""
        if self.phase != "online":
            self._sequence.failure = self.trouble or "there is no connection"
            return
        self._sequence.failure = ""
        self._disabled_at = 0
        self._sequence.begin(self._enable_steps())

    def disable(self) -> None:
        """Begin to stop the arm and disable its drives, unless that has just been begun."""
        self.enabled = False
        paused = self._disabled_at and self._now - self._disabled_at < DISABLE_RETRY_PAUSE * SECOND
        if self.phase != "online" or paused:
            return
        self._disabled_at, self._alarms_read = self._now, False
        self._sequence.begin(
            disable_steps(self.firmware, self._at_rest, self._drives_off, lambda: self.mode_words)
        )

    def request(self, text: str) -> None:
        """Queue a command; its reply matters only when it is an error."""
        if self.phase == "online":
            self._queue.append(text)

    def servo_pose(self, vector: np.ndarray, t: float) -> None:
        """Send a servo point for the flange: X, Y, Z [mm], Rx, Ry, Rz [deg], reached in t [s].

        V3 takes no t and needs about 0.1 s.
        """
        self._send_point("ServoP", vector, f",t={t:.3f}" if self.firmware == "v4" else "")

    def servo_joints(self, joints: np.ndarray, t: float) -> None:
        """Send a servo point for the joints [deg], to be reached in `t` [s]; V3 from 3.5.5 on."""
        self._send_point("ServoJ", joints, f",t={t:.3f}")

    def _send_point(self, name: str, values: np.ndarray, rest: str) -> None:
        """Send a point, but only if a packet has arrived since the last one.

        So at most one point is in flight to an arm that has stopped reading.
        """
        if not np.all(np.isfinite(values)):
            raise ValueError(f"a servo point must be finite, got {values}")
        if self.last_packet is None or self.last_packet <= self._last_point:
            return
        self._last_point = self._now
        numbers = ",".join(f"{v:.6f}" for v in values)
        port = MOTION_PORT if self.firmware == "v3" else COMMAND_PORT
        self._send(port, f"{name}({numbers}{rest})")

    def shut_down(self) -> None:
        """Close the connection."""
        self._connection.close()
        self._link.close()

    # Stepping

    def step(self, now: int) -> None:
        """Read, update the state, and write what is due. Args: now: [ns]."""
        self._now = now
        self._link.advance(now)
        self._step(now)
        stream = self._connection.streams.get(COMMAND_PORT) if self.phase == "online" else None
        moving = self.feedback is not None and not self._at_rest()
        self._link.guard(stream, STOP_COMMANDS[self.firmware or "v4"], moving)

    def _step(self, now: int) -> None:
        if self.phase != "online":
            if self._connection.advance(now):
                self._reset()
            return
        self._read()
        self._check_links()
        if self.phase == "online":
            self._watch_alarms()
            self._watch_queue()
            self._sequence.advance(now)
            self._send_next_request()

    def _reset(self) -> None:
        """Discard the state of an earlier connection."""
        self._readers = {p: ReplyReader() for p in (COMMAND_PORT, MOTION_PORT)}
        self._packets = PacketReader()
        self._outstanding = None
        self._queue.clear()
        self._last_sent = self._now
        self._disabled_at = 0

    def _give_up(self, why: str) -> None:
        self._connection.give_up(why, self._now)
        self.enabled = False
        self._sequence.stop(why)

    # Reading

    def _drives_off(self) -> bool:
        packet = self.feedback
        if packet is None:
            return False
        # The flag alone is not trusted: not every firmware is documented to set it.
        return self.mode in UNPOWERED_MODES or (
            self.mode in (STARTING, IN_ALARM) and not packet["enable_status"]
        )

    def _at_rest(self) -> bool:
        packet = self.feedback
        return packet is not None and all(
            -REST_SPEED < speed < REST_SPEED for speed in packet["qd_actual"].tolist()
        )

    def _read(self) -> None:
        self._read_feedback(self._connection.streams[FEEDBACK_PORT].receive())
        for port, reader in self._readers.items():
            if port not in self._connection.streams:
                continue
            for reply in reader.feed(self._connection.streams[port].receive()):
                self._handle_reply(reply)
            if reader.not_tcp:
                reader.not_tcp = False
                self._report_lost_control()

    def _read_feedback(self, data: bytes) -> None:
        before = self._packets.count
        packet = self._packets.feed(data)
        if packet is None:
            self._rejection = self._rejection or ("the data is no packet" if data else "")
        # Comparisons with NaN are false, so such a packet is rejected.
        elif not is_plausible(packet) or not self._outliers.accepts(packet, self._now):
            self._rejection = "its values are impossible"
        else:
            # A repeated time stamp means that the controller has stopped.
            stamp = None if self.feedback is None else int(self.feedback["time_stamp"])
            self._rejection = "the same packet repeats"
            if stamp != int(packet["time_stamp"]):
                self.last_packet, self._rejection = self._now, ""
                self.packet_count += self._packets.count - before
            self.feedback = packet

    def _handle_reply(self, reply: Reply) -> None:
        if self._outstanding is not None and reply.answers(self._outstanding[0]):
            self._outstanding = None
            # Feedback alone does not count: it continues while another program holds the port.
            self._connection.reset_pauses()
            self._sequence.answer(reply)
            if reply.error and not self.busy:
                self.refusal = f"{reply.echo}: {reply.words}"
        elif self.enabled and reply.echo in STOP_COMMANDS[self.firmware or "v4"]:
            self.control_lost = "its guard has stopped it: the gateway was suspended while it moved"
            self.enabled = False
        elif reply.echo.lower().startswith("servoj") and reply.error in (-10000, -20000):
            # Firmware before 3.5.5 takes no time.
            self.timed_joints = False
        elif reply.echo.lower().startswith("servo") and reply.error:
            self.refusal = f"servo point: {reply.words}"

    def _report_lost_control(self) -> None:
        self.control_lost = "the control mode is not TCP; choose it in the vendor's program"
        self.enabled = False
        if self._outstanding is not None:
            self._sequence.answer(Reply(-1, "", self._outstanding[0]))
            self._outstanding = None

    def _check_links(self) -> None:
        broken = self._connection.broken()
        if broken:
            just_opened = self._now - self._connection.since < SECOND and not self.enabled
            self._give_up(broken + OCCUPIED_HINT if just_opened else broken)
        elif (
            self._outstanding is not None
            and self._now - self._outstanding[1] > REPLY_TIMEOUT * SECOND
        ):
            self._give_up(f"{self._outstanding[0]} was not answered within {REPLY_TIMEOUT:.0f} s")
        elif self.enabled and self.age > FEEDBACK_TIMEOUT:
            # A point that is still in flight must not reach the arm when the link recovers.
            self._connection.abort()
            self._give_up(self.silence)
        elif (
            self._now - max(self.last_packet or 0, self._connection.since) > REPLY_TIMEOUT * SECOND
        ):
            self._give_up(self.silence)

    def _watch_alarms(self) -> None:
        """Read the alarms, once each time that the arm enters alarm."""
        alarmed = self.mode == IN_ALARM or (self.firmware == "v4" and self.mode == V4_COLLISION)
        if self.mode is not None and self.mode not in FOLLOWING_MODES:
            self.enabled = False
        if alarmed and not self._alarms_read and not self.busy:
            self._alarms_read = True
            self._sequence.begin(self._read_alarms())
        elif not alarmed and not self.busy and self.mode in FOLLOWING_MODES:
            self.alarms, self._alarms_read = (), False

    def _watch_queue(self) -> None:
        """Disable when the queue is blocked: once unblocked, the arm would follow stale points."""
        if not self.enabled or self.feedback is None:
            self._queue_ran = 0
        elif self.feedback["queue_running"]:
            self._queue_ran = self._now
        elif self._queue_ran and self._now - self._queue_ran > QUEUE_BLOCKED_TIME * SECOND:
            self.control_lost = "its motion queue is blocked"
            self.enabled = False

    # Command sequences

    def _read_alarms(self) -> SequenceSteps:
        reply = yield Request("GetErrorID()")
        assert isinstance(reply, Reply)
        numbers = integers(reply.values)
        self.alarms = tuple(alarm_text(n) for n in numbers) or (self.mode_words,)
        return f"{self.mode_words}: {'; '.join(self.alarms)}"

    def _enable_steps(self) -> SequenceSteps:
        self.enabled = False
        failure = yield from enable_steps(
            self.firmware,
            lambda: self.mode,
            lambda: self.mode_words,
            lambda: self.alarms,
            self._settings,
        )
        if not failure:
            self.enabled, self.refusal, self.control_lost = True, "", ""
            self.alarms, self._alarms_read = (), False
        return failure

    # Writing

    def _send_next_request(self) -> None:
        if self._outstanding is None and self._queue:
            text = self._queue.popleft()
            self._outstanding = (text, self._now)
            self._send(COMMAND_PORT, text)
        elif self._outstanding is None and self._now - self._last_sent > KEEPALIVE_PERIOD * SECOND:
            self._queue.append("RobotMode()")

    def _send(self, port: int, text: str) -> None:
        if port == COMMAND_PORT:
            self._last_sent = self._now
        self._connection.streams[port].send(text.encode())
