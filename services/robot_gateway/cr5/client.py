"""A client of the CR5's protocol, V3 and V4: bytes in, bytes out, time in; it owns no socket.

Port 30003 tells the versions apart: V3 takes motion there, V4 refuses the connection. One request
at a time is outstanding on 29999 and is matched with its answer by the echo, so that a late answer
never counts for another question; servo points are sent and their answers, if any come, are read
only for errors. What a person must agree to (enabling, recovering) runs as a sequence of requests
and waits over many steps.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from services.robot_gateway.cr5.alarms import FOLLOWING, MODES, alarm_words
from services.robot_gateway.cr5.outliers import Outliers
from services.robot_gateway.cr5.packet import PacketReader, credible
from services.robot_gateway.cr5.replies import Reply, ReplyReader, integers
from services.robot_gateway.link import Link, Network

SECOND = 1_000_000_000
COMMANDS, MOTION, FEEDBACK = 29999, 30003, 30004
ANSWER_TIME = 2.0
"""In which a request is answered, or the connection is begun anew [s]."""
CONNECT_TIME = 3.0
HEARTBEAT = 1.0
"""Between RobotMode requests when nothing else is asked [s]: the ports may close when idle."""
STALE = 0.1
"""Age of the feedback from which the link counts as lost [s]."""
BACK_OFF = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Between attempts to connect [s]."""


@dataclass(frozen=True)
class Request:
    """A step of a sequence: a command whose answer is waited for."""

    text: str


@dataclass(frozen=True)
class Until:
    """A step of a sequence: a condition that comes true in time, or not."""

    condition: Callable[[], bool]
    seconds: float


Sequence = Generator[Request | Until, Reply | bool, str]
"""Yields steps, is sent their outcome, and returns what went wrong in words, or nothing."""

Phase = Literal["away", "connecting", "online"]


class Client:
    """The connection to one arm."""

    def __init__(self, network: Network, load: float = 0.0, collision_level: int = 3) -> None:
        """Args: load: On the flange [kg]. collision_level: 0 (off) to 5 (most sensitive)."""
        self._network = network
        self._load, self._collision_level = load, collision_level
        self.phase: Phase = "away"
        self.firmware: Literal["v3", "v4"] | None = None
        self.feedback: np.ndarray | None = None
        """The newest packet."""
        self.heard: int | None = None
        """When a new packet came last [ns]."""
        self.trouble = ""
        """Why there is no connection, in words."""
        self.alarms: tuple[str, ...] = ()
        """As the arm names them."""
        self.refusal = ""
        """The last error of a servo point, in words."""
        self.enabled = False
        """Whether a sequence has made it ready and nothing has stopped it since."""
        self.times_joints = True
        """Whether ServoJ takes the time in which a point is to be reached."""
        self.control_lost = ""
        """Why the arm listens to somebody else, in words."""
        self.failure = ""
        """Why the last sequence failed."""
        self._links: dict[int, Link] = {}
        self._readers: dict[int, ReplyReader] = {}
        self._packets = PacketReader()
        self._outliers = Outliers()
        self._now = self._since = 0
        self._attempts = 0
        self._retry_at: int | None = None
        self._asked: tuple[str, int] | None = None
        self._answer: Reply | None = None
        self._queue: deque[str] = deque()
        self._sequence: Sequence | None = None
        self._step: Request | Until | None = None
        self._step_since = 0
        self._spoke = 0
        self._pointed = -1
        self._knows_alarms = False

    @property
    def mode(self) -> int | None:
        """RobotMode of the newest packet."""
        return None if self.feedback is None else int(self.feedback["robot_mode"])

    @property
    def mode_words(self) -> str:
        """The mode in words."""
        if self.mode is None or self.firmware is None:
            return "not heard yet"
        return MODES[self.firmware].get(self.mode, f"in mode {self.mode}")

    @property
    def busy(self) -> bool:
        """Whether it is being enabled or recovered."""
        return self._sequence is not None

    @property
    def age(self) -> float:
        """Of the newest packet [s]."""
        return np.inf if self.heard is None else (self._now - self.heard) / SECOND

    @property
    def lost(self) -> bool:
        """Whether the arm cannot be heard."""
        return self.phase != "online" or self.age > STALE

    # What the driver asks for

    def enable(self) -> None:
        """Begins to make the arm ready; clears alarms, since a person has asked for it."""
        self._begin(self._make_ready())

    def disable(self) -> None:
        """Takes the power off the joints."""
        self.enabled, self._sequence, self._step = False, None, None
        self.request("DisableRobot()")

    def request(self, text: str) -> None:
        """A command whose answer matters only when it is an error."""
        if self.phase == "online":
            self._queue.append(text)

    def servo_pose(self, vector: np.ndarray, t: float) -> None:
        """A point for the flange.

        Args:
            vector: X, Y, Z [mm], Rx, Ry, Rz [deg].
            t: In which it is to be reached [s]; V3 takes none and needs 0.1 s or so.
        """
        self._point("ServoP", vector, f",t={t:.3f}" if self.firmware == "v4" else "")

    def servo_joints(self, joints: np.ndarray, t: float) -> None:
        """A point for the joints [deg], to be reached in `t` [s]; V3 from 3.5.5 on, and V4."""
        self._point("ServoJ", joints, f",t={t:.3f}")

    def _point(self, name: str, values: np.ndarray, rest: str) -> None:
        """Sends a point unless the arm has not been heard since the last one.

        So that no more than one is ever under way to an arm that has stopped listening.
        """
        if not np.all(np.isfinite(values)):
            raise ValueError(f"a servo point must be finite, got {values}")
        if self.heard is None or self.heard <= self._pointed:
            return
        self._pointed = self._now
        numbers = ",".join(f"{v:.6f}" for v in values)
        port = MOTION if self.firmware == "v3" else COMMANDS
        self._send(port, f"{name}({numbers}{rest})")

    def shut_down(self) -> None:
        """Closes every connection."""
        for link in self._links.values():
            link.close()
        self._links = {}
        self.phase = "away"

    # Time

    def step(self, now: int) -> None:
        """Reads, judges and writes what is due [ns]."""
        self._now = now
        self._network.advance(now)
        match self.phase:
            case "away":
                if self._retry_at is None or now >= self._retry_at:
                    self._connect()
            case "connecting":
                self._check_connecting()
            case "online":
                self._read()
                if self.phase == "online":
                    self._check_links()
                if self.phase == "online":
                    self._watch_alarms()
                    self._advance_sequence()
                    self._ask_next()

    # Connecting

    def _connect(self) -> None:
        self._links = {p: self._network.open(p) for p in (COMMANDS, MOTION, FEEDBACK)}
        self._readers = {p: ReplyReader() for p in (COMMANDS, MOTION)}
        self._packets = PacketReader()
        self._asked, self._answer = None, None
        self._queue.clear()
        self.phase, self._since = "connecting", self._now

    def _check_connecting(self) -> None:
        states = {port: link.state for port, link in self._links.items()}
        for port in (COMMANDS, FEEDBACK):
            if states[port] == "closed":
                self._give_up(
                    f"{self._links[port].reason}; is the address right, and no other program "
                    "or pendant connected?"
                )
                return
        if "opening" in states.values():
            if self._now - self._since > CONNECT_TIME * SECOND:
                slow = [str(p) for p, s in states.items() if s == "opening"]
                self._give_up(f"no answer on port {', '.join(slow)}; is the arm on this network?")
            return
        self.firmware = "v3" if states[MOTION] == "open" else "v4"
        if self.firmware == "v4":
            del self._links[MOTION]
        self.phase, self.trouble, self._attempts = "online", "", 0
        self._spoke, self._since = self._now, self._now

    def _give_up(self, why: str) -> None:
        self.shut_down()
        self.trouble = why
        wait = BACK_OFF[min(self._attempts, len(BACK_OFF) - 1)]
        self._attempts += 1
        self._retry_at = self._now + round(wait * SECOND)
        self.enabled = False
        if self._sequence is not None:
            self.failure, self._sequence, self._step = why, None, None

    # Reading

    def _read(self) -> None:
        packet = self._packets.feed(self._links[FEEDBACK].receive())
        # A number that is none passes every comparison: such a packet was not heard.
        if packet is not None and credible(packet) and self._outliers.believes(packet, self._now):
            # A packet that repeats its time is an arm that has stopped thinking.
            before = None if self.feedback is None else int(self.feedback["time_stamp"])
            if before != int(packet["time_stamp"]):
                self.heard = self._now
            self.feedback = packet
        for port, reader in self._readers.items():
            if port not in self._links:
                continue
            for reply in reader.feed(self._links[port].receive()):
                self._take(reply)
            if reader.not_tcp:
                reader.not_tcp = False
                self.control_lost = "the control mode is not TCP; choose it in the maker's program"
                self.enabled = False
                if self._asked is not None:
                    self._answer = Reply(-1, "", self._asked[0])
                    self._asked = None

    def _take(self, reply: Reply) -> None:
        if self._asked is not None and reply.answers(self._asked[0]):
            self._answer, self._asked = reply, None
            if reply.error and self._sequence is None:
                self.refusal = f"{reply.echo}: {reply.words}"
        elif reply.echo.lower().startswith("servoj") and reply.error in (-10000, -20000):
            # Firmware before 3.5.5 knows no time for it.
            self.times_joints = False
        elif reply.echo.lower().startswith("servo") and reply.error:
            self.refusal = f"servo point: {reply.words}"

    def _check_links(self) -> None:
        closed = [link for link in self._links.values() if link.state == "closed"]
        if closed:
            self._give_up(closed[0].reason)
        elif self._asked is not None and self._now - self._asked[1] > ANSWER_TIME * SECOND:
            self._give_up(f"{self._asked[0]} was not answered within {ANSWER_TIME:.0f} s")
        elif self.enabled and self.age > STALE:
            # A point that the arm has not read yet must not reach it when the line is well again.
            for link in self._links.values():
                link.abort()
            self._give_up(f"no feedback for {self.age:.2f} s")
        elif self._now - max(self.heard or 0, self._since) > ANSWER_TIME * SECOND:
            self._give_up(f"no feedback on port {FEEDBACK} for {ANSWER_TIME:.0f} s")

    def _watch_alarms(self) -> None:
        """Asks what the alarm is, once for each time that one comes."""
        alarmed = self.mode == 9 or (self.firmware == "v4" and self.mode == 11)
        if self.mode is not None and self.mode not in FOLLOWING:
            self.enabled = False
        if alarmed and not self._knows_alarms and not self.busy:
            self._knows_alarms = True
            self._begin(self._read_alarms(), keep=True)
        elif not alarmed and not self.busy and self.mode in FOLLOWING:
            self.alarms, self._knows_alarms = (), False

    # Sequences

    def _begin(self, sequence: Sequence, keep: bool = False) -> None:
        if self.phase != "online":
            self.failure = self.trouble or "there is no connection"
            return
        self.failure = "" if not keep else self.failure
        self._sequence, self._step = sequence, None
        self._answer = None

    def _advance_sequence(self) -> None:
        sequence = self._sequence
        if sequence is None:
            return
        try:
            if self._step is None:
                self._take_step(next(sequence))
            elif isinstance(self._step, Request) and self._answer is not None:
                answer, self._answer = self._answer, None
                self._take_step(sequence.send(answer))
            elif isinstance(self._step, Until):
                if self._step.condition():
                    self._take_step(sequence.send(True))
                elif self._now - self._step_since > self._step.seconds * SECOND:
                    self._take_step(sequence.send(False))
        except StopIteration as stop:
            self._sequence, self._step = None, None
            self.failure = stop.value or ""

    def _take_step(self, step: Request | Until) -> None:
        self._step, self._step_since = step, self._now
        if isinstance(step, Request):
            self._queue.append(step.text)

    def _read_alarms(self) -> Sequence:
        reply = yield Request("GetErrorID()")
        assert isinstance(reply, Reply)
        numbers = integers(reply.values)
        self.alarms = tuple(alarm_words(n) for n in numbers) or (self.mode_words,)
        return f"{self.mode_words}: {'; '.join(self.alarms)}"

    def _make_ready(self) -> Sequence:
        """Alarms cleared, power on, enabled, settings restored, nothing left of old motion."""
        self.enabled = False
        if self.firmware == "v4":
            # Older firmware does not know it, and it is refused while enabled: both are fine.
            yield Request("RequestControl()")
            yield Request("EmergencyStop(0)")
        if self.mode not in FOLLOWING:
            yield Request("ClearError()")
        yield Request("ResetRobot()" if self.firmware == "v3" else "Stop()")
        if self.mode == 6:
            yield Request("StopDrag()")
        if self.mode in (1, 3, 9):
            # On V3 this also resets a software emergency stop.
            reply = yield Request("PowerOn()")
            yield Until(lambda: False, 0.2)
            if not (yield Until(lambda: self.mode in (4, *FOLLOWING), 20.0)):
                words = reply.words if isinstance(reply, Reply) and reply.error else ""
                return f"no power after PowerOn: {self.mode_words} {words}".strip()
        reply = yield Request(f"EnableRobot({self._load:.6f})")
        if isinstance(reply, Reply) and reply.error:
            why = "; ".join(self.alarms)
            return f"EnableRobot: {reply.words}{f' ({why})' if why else ''}"
        for text in (
            "SpeedFactor(100)",
            "User(0)",
            "Tool(0)",
            f"SetCollisionLevel({self._collision_level})",
            "Continue()",
        ):
            reply = yield Request(text)
            # Continue is only known from 3.5.7 on, and there is nothing to continue.
            if isinstance(reply, Reply) and reply.error and not text.startswith("Continue"):
                return f"{text}: {reply.words}"
        if not (yield Until(lambda: self.mode == 5, 3.0)):
            return f"not idle after it was enabled: {self.mode_words}"
        self.enabled, self.refusal, self.control_lost = True, "", ""
        self.alarms, self._knows_alarms = (), False
        return ""

    # Writing

    def _ask_next(self) -> None:
        if self._asked is None and self._queue:
            text = self._queue.popleft()
            self._asked = (text, self._now)
            self._answer = None
            self._send(COMMANDS, text)
        elif self._asked is None and self._now - self._spoke > HEARTBEAT * SECOND:
            self._queue.append("RobotMode()")

    def _send(self, port: int, text: str) -> None:
        if port == COMMANDS:
            self._spoke = self._now
        self._links[port].send(text.encode())
