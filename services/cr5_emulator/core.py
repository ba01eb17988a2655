"""The emulated arm behind its ports: bytes in, bytes out, time in; it owns no socket.

Connections are accepted by `connect`; what a client sent goes to `Connection.feed`, what it gets is
taken from `Connection.take`, one segment at a time. `advance_to` moves the arm, 8 ms at a time, and
sends what is due.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from services.cr5_emulator.commands.answering import Commands
from services.cr5_emulator.controller import COLLISION, Controller
from services.cr5_emulator.feedback import Feedback
from services.cr5_emulator.grammar import Call, CommandReader, reply
from services.cr5_emulator.options import Options
from services.cr5_emulator.pages import Pages, RequestReader

TICK = 0.008
"""Of the controller and of port 30004 [s]."""
COMMAND_PORTS = {"v3": (29999, 30003), "v4": (29999,)}
FEEDBACK_PERIODS = {
    "v3": {30004: 8, 30005: 200, 30006: 50},
    "v4": {30004: 8, 30005: 200, 30006: 1000},
}
"""Between packets [ms]; where that is no whole number of ticks, on the average."""
PAGE_PORTS = {"v3": (), "v4": (22000,)}
IDLE = 10.0
LATE = 1.5
JOINED = 0.05
"""Longest time for which an answer waits for another one to go with [s]."""
ONCE = {
    "alarm_singular": (26,),
    "alarm_overspeed": (49,),
    "collision": (COLLISION,),
}


class Connection:
    """One client at one port."""

    def __init__(self, port: int, now: float) -> None:
        self.port = port
        self.closed = False
        self.heard = now
        """When the client last said something [s]."""
        self.reader = CommandReader()
        self.requests = RequestReader()
        self.waiting: deque[Call] = deque()
        """Calls behind a Sync."""
        self._segments: deque[bytes] = deque()
        self._inbox = bytearray()

    def feed(self, data: bytes) -> None:
        """Bytes from the client."""
        self._inbox += data

    def take(self) -> bytes | None:
        """The next segment for the client."""
        return self._segments.popleft() if self._segments else None

    def close(self) -> None:
        """The client is gone, or shall be."""
        self.closed = True

    def received(self) -> bytes:
        data, self._inbox = bytes(self._inbox), bytearray()
        return data

    def write(self, segment: bytes) -> None:
        self._segments.append(segment)
        # A feedback client that does not read loses the oldest packets, not the emulator's memory.
        while len(self._segments) > 250:
            self._segments.popleft()


class Emulator:
    """A CR5 with its ports."""

    def __init__(
        self,
        options: Options,
        start: float = 0.0,
        watch: Callable[[float, Controller], None] | None = None,
    ) -> None:
        """Args: start: Present time on the caller's clock [s]. watch: Called after every tick."""
        self.options = options
        self._watch = watch
        self.controller = Controller(options)
        self.commands = Commands(self.controller)
        self.feedback = Feedback(self.controller)
        self.pages = Pages(self.controller)
        self.now = start
        self._start = start
        self._ticks = 0
        self._connections: list[Connection] = []
        self._syncs: list[tuple[Connection, Call]] = []
        self._late: deque[tuple[float, Connection, bytes]] = deque()
        self._joined: dict[Connection, tuple[float, bytes]] = {}
        self._sent = b""
        self._pending = dict(options.fault_times)
        self._active: dict[str, float] = {}
        self._begin_faults()

    @property
    def ports(self) -> tuple[int, ...]:
        """On which it listens."""
        pages = PAGE_PORTS[self.options.firmware]
        return tuple(dict.fromkeys((*self._command_ports, *self._feedback_periods, *pages)))

    @property
    def _command_ports(self) -> tuple[int, ...]:
        return COMMAND_PORTS[self.options.firmware]

    @property
    def _feedback_periods(self) -> dict[int, int]:
        """The oldest firmware sends feedback where it takes motion."""
        legacy = self.options.version < "3.5.2"
        return {30003: 8} if legacy else FEEDBACK_PERIODS[self.options.firmware]

    def connect(self, port: int) -> Connection | None:
        """A client connects; None when it is refused."""
        if port not in self.ports or ("port_taken" in self._active and port == 29999):
            return None
        if port in self._command_ports:
            others = [c for c in self._connections if c.port == port and not c.closed]
            if others and self.options.second_client == "refuse":
                return None
            for other in others:
                other.close()
        connection = Connection(port, self.now)
        self._connections.append(connection)
        return connection

    def inject(self, fault: str) -> None:
        """Begins a fault now."""
        self._pending[fault] = self.now - self._start
        self._begin_faults()

    def heal(self, fault: str) -> None:
        """Ends a fault."""
        self._active.pop(fault, None)
        self._apply_lasting()

    def process(self) -> None:
        """Answers what has come in, without moving time."""
        if "frozen" in self._active:
            return
        for connection in self._connections:
            data = connection.received()
            if connection.port in PAGE_PORTS[self.options.firmware]:
                for request in connection.requests.feed(data):
                    connection.write(self.pages.answer(*request))
            if connection.closed or connection.port not in self._command_ports:
                continue
            if data:
                connection.heard = self.now
                connection.waiting.extend(connection.reader.feed(data))
            self._work_off(connection)

    def advance_to(self, now: float) -> None:
        """Moves time to `now` [s]."""
        self.process()
        while self._start + (self._ticks + 1) * TICK <= now + 1e-9:
            self._ticks += 1
            self.now = self._start + self._ticks * TICK
            self._tick()

    def _tick(self) -> None:
        self._begin_faults()
        self.process()
        self.controller.advance(TICK)
        self.pages.watch(self.now)
        for connection, call in list(self._syncs):
            if not self.controller.busy:
                self._syncs.remove((connection, call))
                self._send(connection, reply(0, "", call))
                self._work_off(connection)
        while self._late and self._late[0][0] <= self.now:
            _, connection, segment = self._late.popleft()
            connection.write(segment)
        for connection, (since, data) in list(self._joined.items()):
            if self.now - since > JOINED:
                del self._joined[connection]
                connection.write(data)
        if "idle_close" in self._active:
            for connection in self._connections:
                idle = self.now - connection.heard
                if connection.port in self._command_ports and idle > IDLE:
                    connection.close()
        self._send_feedback()
        if self._watch is not None:
            self._watch(self.now, self.controller)
        self._connections = [c for c in self._connections if not c.closed or c._segments]

    # Commands

    def _work_off(self, connection: Connection) -> None:
        while connection.waiting and not any(c is connection for c, _ in self._syncs):
            call = connection.waiting.popleft()
            text = self.commands.answer(call, connection.port)
            if text is None:
                self._syncs.append((connection, call))
            elif self._answers(call):
                self._send(connection, text)

    def _answers(self, call: Call) -> bool:
        if "no_reply" in self._active:
            return False
        if call.name.lower() not in ("servoj", "servop"):
            return True
        silent = self.options.firmware == "v3" and not self.options.servo_reply
        return not silent and "no_servo_reply" not in self._active

    def _send(self, connection: Connection, text: str) -> None:
        data = text.encode()
        if "late_reply" in self._active:
            self._late.append((self.now + LATE, connection, data))
        elif "joined_replies" in self._active:
            if connection in self._joined:
                connection.write(self._joined.pop(connection)[1] + data)
            else:
                self._joined[connection] = (self.now, data)
        elif "torn_replies" in self._active:
            middle = len(data) // 2
            connection.write(data[:middle])
            connection.write(data[middle:])
        else:
            connection.write(data)

    # Feedback

    def _send_feedback(self) -> None:
        if {"stale_feedback", "frozen"} & self._active.keys():
            return
        packet = None
        for connection in self._connections:
            period = self._feedback_periods.get(connection.port)
            if period is not None and "slow_feedback" in self._active:
                period = max(period, 40)
            if connection.closed or period is None or 8 * self._ticks % period >= 8:
                continue
            packet = packet or self._spoiled(self._packet())
            if "torn_feedback" in self._active:
                for k in range(0, len(packet), 400):
                    connection.write(packet[k : k + 400])
            else:
                connection.write(packet)

    def _packet(self) -> bytes:
        if "repeated_feedback" not in self._active or not self._sent:
            self._sent = self.feedback.packet(self.now)
        return self._sent

    def _spoiled(self, packet: bytes) -> bytes:
        data = bytearray(packet)
        if self._brief("wrong_test_value"):
            data[48:56] = bytes(8)
        if self._brief("wrong_size"):
            data[0:2] = (1441).to_bytes(2, "little")
        if "time_back" in self._active:
            data[32:40] = (1_000_000).to_bytes(8, "little")
        return bytes(data)

    def _brief(self, fault: str) -> bool:
        return fault in self._active and self.now - self._active[fault] < 0.2

    # Faults

    def _begin_faults(self) -> None:
        for fault, at in list(self._pending.items()):
            if self.now - self._start < at:
                continue
            # An alarm of a motion waits for one.
            if fault in ONCE and not self.controller.busy:
                continue
            del self._pending[fault]
            self._active[fault] = self.now
            self._strike(fault)
        self._apply_lasting()

    def _apply_lasting(self) -> None:
        self.commands.power.not_tcp = bool({"not_tcp", "taken_over"} & self._active.keys())
        self.commands.settings.uncalibrated = "no_user_tool" in self._active

    def _strike(self, fault: str) -> None:
        controller = self.controller
        if fault in ONCE:
            controller.alarm(*ONCE[fault])
        elif fault == "emergency_stop":
            controller.press()
        elif fault == "power_off":
            controller.lose_power()
        elif fault == "queue_blocked":
            controller.queue_running = False
        elif fault == "drag":
            controller.drag(1)
        elif fault == "taken_over":
            controller.stop()
        elif fault == "links_closed":
            for connection in self._connections:
                connection.close()
