"""A client of the CR5's protocol, V3 and V4: bytes in, bytes out, time in; it owns no socket.

One request at a time is outstanding on 29999 and is matched with its answer by the echo, so that a
late answer never counts for another question; servo points are sent and their answers, if any come,
are read only for errors. What a person must agree to (enabling, recovering) runs as a procedure
over many steps.
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np

from services.robot_gateway.drivers.cr5.command_sequence import (
    SECOND,
    Procedure,
    Request,
    Steps,
)
from services.robot_gateway.drivers.cr5.connection import (
    COMMANDS,
    FEEDBACK,
    MOTION,
    Dial,
    Phase,
)
from services.robot_gateway.drivers.cr5.enable_sequence import Settings, make_ready
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.cr5.outliers import Outliers
from services.robot_gateway.drivers.cr5.replies import Reply, ReplyReader, integers
from shared.cr5.alarms import FOLLOWING, MODES, alarm_words
from shared.cr5.packet import PacketReader, credible

ANSWER_TIME = 2.0
"""In which a request is answered, or the connection is begun anew [s]."""
HEARTBEAT = 1.0
"""Between RobotMode requests when nothing else is asked [s]: the ports may close when idle."""
BLOCKED = 0.1
"""For which the queue stands still before it counts as blocked [s]: what the flag does between two
motions is not documented."""
STALE = 0.1
"""Age of the feedback from which the link counts as lost [s]."""
OCCUPIED = ", as soon as it was opened; does another program or a pendant hold it?"


class Client:
    """The connection to one arm."""

    def __init__(self, link: Link, settings: Settings | None = None) -> None:
        self._link = link
        self._settings = settings or Settings()
        self._dial = Dial(link)
        self._procedure = Procedure(self.request)
        self.feedback: np.ndarray | None = None
        """The newest packet."""
        self.heard: int | None = None
        """When a new packet came last [ns]."""
        self.alarms: tuple[str, ...] = ()
        """As the arm names them."""
        self.refusal = ""
        """The last error of a servo point, in words."""
        self.enabled = False
        """Whether a procedure has made it ready and nothing has stopped it since."""
        self.times_joints = True
        """Whether ServoJ takes the time in which a point is to be reached."""
        self.control_lost = ""
        """Why the arm does not listen, in words, though it is not in alarm."""
        self._readers: dict[int, ReplyReader] = {}
        self._packets = PacketReader()
        self._outliers = Outliers()
        self._oddity = ""
        """What is wrong with what has come since the arm was last heard, in words."""
        self._now = 0
        self._asked: tuple[str, int] | None = None
        self._queue: deque[str] = deque()
        self._spoke = 0
        self._pointed = -1
        self._knows_alarms = False
        self._queue_ran = 0
        """When the arm said so last since it was enabled [ns]; 0: it has not."""

    @property
    def phase(self) -> Phase:
        """Of the connection."""
        return self._dial.phase

    @property
    def firmware(self) -> Literal["v3", "v4"] | None:
        """As the ports told it."""
        return self._dial.firmware

    @property
    def trouble(self) -> str:
        """Why there is no connection, in words."""
        return self._dial.trouble

    @property
    def failure(self) -> str:
        """Why the last procedure failed."""
        return self._procedure.failure

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
        return self._procedure.running

    @property
    def age(self) -> float:
        """Of the newest packet [s]."""
        return np.inf if self.heard is None else (self._now - self.heard) / SECOND

    @property
    def lost(self) -> bool:
        """Whether the arm cannot be heard."""
        return self.phase != "online" or self.age > STALE

    @property
    def silence(self) -> str:
        """That the arm is not heard, and what comes instead, in words."""
        age = f"for {self.age:.2f} s" if self.age < np.inf else "yet"
        why = f": {self._oddity}" if self._oddity else ""
        return f"no feedback on port {FEEDBACK} {age}{why}"

    # What the driver asks for

    def enable(self) -> None:
        """Begins to make the arm ready; clears alarms, since a person has asked for it."""
        if self.phase != "online":
            self._procedure.failure = self.trouble or "there is no connection"
            return
        self._procedure.failure = ""
        self._procedure.begin(self._make_ready())

    def disable(self) -> None:
        """Takes the power off the joints."""
        self.enabled = False
        self._procedure.stop()
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
        self._dial.close()

    # Time

    def step(self, now: int) -> None:
        """Reads, judges and writes what is due [ns]."""
        self._now = now
        self._link.advance(now)
        if self.phase != "online":
            if self._dial.advance(now):
                self._begin_anew()
            return
        self._read()
        self._check_links()
        if self.phase == "online":
            self._watch_alarms()
            self._watch_queue()
            self._procedure.advance(now)
            self._ask_next()

    def _begin_anew(self) -> None:
        """Nothing of an earlier connection counts."""
        self._readers = {p: ReplyReader() for p in (COMMANDS, MOTION)}
        self._packets = PacketReader()
        self._asked = None
        self._queue.clear()
        self._spoke = self._now

    def _give_up(self, why: str) -> None:
        self._dial.give_up(why, self._now)
        self.enabled = False
        self._procedure.stop(why)

    # Reading

    def _read(self) -> None:
        self._read_feedback(self._dial.streams[FEEDBACK].receive())
        for port, reader in self._readers.items():
            if port not in self._dial.streams:
                continue
            for reply in reader.feed(self._dial.streams[port].receive()):
                self._take(reply)
            if reader.not_tcp:
                reader.not_tcp = False
                self._lose_control()

    def _read_feedback(self, data: bytes) -> None:
        packet = self._packets.feed(data)
        if packet is None:
            self._oddity = self._oddity or ("what comes is no packet" if data else "")
        # A number that is none passes every comparison: such a packet was not heard.
        elif not credible(packet) or not self._outliers.believes(packet, self._now):
            self._oddity = "what it says of itself is impossible"
        else:
            # A packet that repeats its time is an arm that has stopped thinking.
            before = None if self.feedback is None else int(self.feedback["time_stamp"])
            self._oddity = "the same packet comes again and again"
            if before != int(packet["time_stamp"]):
                self.heard, self._oddity = self._now, ""
            self.feedback = packet

    def _take(self, reply: Reply) -> None:
        if self._asked is not None and reply.answers(self._asked[0]):
            self._asked = None
            # Not by its feedback: that goes on while another program holds the command port.
            self._dial.settled()
            self._procedure.answer(reply)
            if reply.error and not self.busy:
                self.refusal = f"{reply.echo}: {reply.words}"
        elif reply.echo.lower().startswith("servoj") and reply.error in (-10000, -20000):
            # Firmware before 3.5.5 knows no time for it.
            self.times_joints = False
        elif reply.echo.lower().startswith("servo") and reply.error:
            self.refusal = f"servo point: {reply.words}"

    def _lose_control(self) -> None:
        self.control_lost = "the control mode is not TCP; choose it in the maker's program"
        self.enabled = False
        if self._asked is not None:
            self._procedure.answer(Reply(-1, "", self._asked[0]))
            self._asked = None

    def _check_links(self) -> None:
        broken = self._dial.broken()
        if broken:
            soon = self._now - self._dial.since < SECOND and not self.enabled
            self._give_up(broken + OCCUPIED if soon else broken)
        elif self._asked is not None and self._now - self._asked[1] > ANSWER_TIME * SECOND:
            self._give_up(f"{self._asked[0]} was not answered within {ANSWER_TIME:.0f} s")
        elif self.enabled and self.age > STALE:
            # A point that the arm has not read yet must not reach it when the line is well again.
            self._dial.abort()
            self._give_up(self.silence)
        elif self._now - max(self.heard or 0, self._dial.since) > ANSWER_TIME * SECOND:
            self._give_up(self.silence)

    def _watch_alarms(self) -> None:
        """Asks what the alarm is, once for each time that one comes."""
        alarmed = self.mode == 9 or (self.firmware == "v4" and self.mode == 11)
        if self.mode is not None and self.mode not in FOLLOWING:
            self.enabled = False
        if alarmed and not self._knows_alarms and not self.busy:
            self._knows_alarms = True
            self._procedure.begin(self._read_alarms())
        elif not alarmed and not self.busy and self.mode in FOLLOWING:
            self.alarms, self._knows_alarms = (), False

    def _watch_queue(self) -> None:
        """Points that wait in a queue that stands still would be gone to when it runs again."""
        if not self.enabled or self.feedback is None:
            self._queue_ran = 0
        elif self.feedback["queue_running"]:
            self._queue_ran = self._now
        elif self._queue_ran and self._now - self._queue_ran > BLOCKED * SECOND:
            self.control_lost = "its motion queue is blocked"
            self.enabled = False

    # Procedures

    def _read_alarms(self) -> Steps:
        reply = yield Request("GetErrorID()")
        assert isinstance(reply, Reply)
        numbers = integers(reply.values)
        self.alarms = tuple(alarm_words(n) for n in numbers) or (self.mode_words,)
        return f"{self.mode_words}: {'; '.join(self.alarms)}"

    def _make_ready(self) -> Steps:
        self.enabled = False
        failure = yield from make_ready(
            self.firmware,
            lambda: self.mode,
            lambda: self.mode_words,
            lambda: self.alarms,
            self._settings,
        )
        if not failure:
            self.enabled, self.refusal, self.control_lost = True, "", ""
            self.alarms, self._knows_alarms = (), False
        return failure

    # Writing

    def _ask_next(self) -> None:
        if self._asked is None and self._queue:
            text = self._queue.popleft()
            self._asked = (text, self._now)
            self._send(COMMANDS, text)
        elif self._asked is None and self._now - self._spoke > HEARTBEAT * SECOND:
            self._queue.append("RobotMode()")

    def _send(self, port: int, text: str) -> None:
        if port == COMMANDS:
            self._spoke = self._now
        self._dial.streams[port].send(text.encode())
