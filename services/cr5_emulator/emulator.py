"""Emulated arm without sockets: bytes and time in, bytes out.

`connect` accepts a connection. Bytes from the client go to `Connection.feed`, bytes for it come
from `Connection.take`, one segment at a time. `advance_to` steps the arm in periods of 8 ms and
sends the feedback packets that are due.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from services.cr5_emulator.command_parser import Call, format_reply
from services.cr5_emulator.commands.dispatch import CommandDispatcher
from services.cr5_emulator.connection import Connection
from services.cr5_emulator.controller import COLLISION_ALARM, Controller
from services.cr5_emulator.feedback import FeedbackWriter
from services.cr5_emulator.options import EmulatorOptions

STEP_TIME = 0.008
"""Period of the controller and of port 30004 [s]."""
COMMAND_PORTS = {"v3": (29999, 30003), "v4": (29999,)}
"""Ports that take commands, by firmware."""
FEEDBACK_PERIODS = {
    "v3": {30004: 8, 30005: 200, 30006: 50},
    "v4": {30004: 8, 30005: 200, 30006: 1000},
}
"""Mean time between packets on each port [ms]."""
IDLE_TIMEOUT = 10.0
"""Time without a command after which the fault `idle_close` closes a connection [s]."""
REPLY_DELAY = 1.5
"""Delay of replies under the fault `late_reply` [s]."""
REPLY_JOIN_TIME = 0.05
"""Longest time for which the fault `joined_replies` holds a reply back [s]."""
SLOW_FEEDBACK_PERIOD = 40
"""Time between packets under the fault `slow_feedback` [ms]."""
TORN_PIECE_SIZE = 400
"""Size of the pieces of a packet under the fault `torn_feedback` [bytes]."""
BRIEF_FAULT_TIME = 0.2
"""Duration of the faults `wrong_test_value` and `wrong_size` [s]."""
MOTION_ALARMS = {
    "alarm_singular": (26,),
    "alarm_overspeed": (49,),
    "collision": (COLLISION_ALARM,),
}
"""Alarms of the faults that strike during a motion."""


class Emulator:
    """Emulator of a CR5: its controller, its ports and the faults injected into it."""

    def __init__(
        self,
        options: EmulatorOptions,
        start: float = 0.0,
        watch: Callable[[float, Controller], None] | None = None,
    ) -> None:
        """Switch the arm on at a time of the caller's clock; `watch` is called after every step."""
        self.options = options
        self._watch = watch
        self.controller = Controller(options)
        self.commands = CommandDispatcher(self.controller)
        self.feedback = FeedbackWriter(self.controller)
        self.now = start
        self._start = start
        self._steps = 0
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
        """Ports on which the arm listens."""
        return tuple(dict.fromkeys((*self._command_ports, *self._feedback_periods)))

    @property
    def _command_ports(self) -> tuple[int, ...]:
        return COMMAND_PORTS[self.options.firmware]

    @property
    def _feedback_periods(self) -> dict[int, int]:
        """Time between packets by port [ms]; the oldest firmware sends them on its motion port."""
        legacy = self.options.version < "3.5.2"
        return {30003: 8} if legacy else FEEDBACK_PERIODS[self.options.firmware]

    def connect(self, port: int) -> Connection | None:
        """Accept a client; None when it is refused."""
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
        """Start a fault."""
        self._pending[fault] = self.now - self._start
        self._begin_faults()

    def heal(self, fault: str) -> None:
        """End a fault."""
        self._active.pop(fault, None)
        self._apply_lasting()

    def process(self) -> None:
        """Answer the commands that have come in, without advancing the time."""
        if "frozen" in self._active:
            return
        for connection in self._connections:
            data = connection.received()
            if connection.closed or connection.port not in self._command_ports:
                continue
            if data:
                connection.last_received = self.now
                connection.waiting.extend(connection.reader.feed(data))
            self._handle_waiting(connection)

    def advance_to(self, now: float) -> None:
        """Advance the time to `now` [s]."""
        self.process()
        while self._start + (self._steps + 1) * STEP_TIME <= now + 1e-9:
            self._steps += 1
            self.now = self._start + self._steps * STEP_TIME
            self._step()

    def _step(self) -> None:
        self._begin_faults()
        self.process()
        self.controller.advance(STEP_TIME)
        for connection, call in list(self._syncs):
            if not self.controller.busy:
                self._syncs.remove((connection, call))
                self._send(connection, format_reply(0, "", call))
                self._handle_waiting(connection)
        while self._late and self._late[0][0] <= self.now:
            _, connection, segment = self._late.popleft()
            connection.write(segment)
        for connection, (since, data) in list(self._joined.items()):
            if self.now - since > REPLY_JOIN_TIME:
                del self._joined[connection]
                connection.write(data)
        if "idle_close" in self._active:
            for connection in self._connections:
                idle = self.now - connection.last_received
                if connection.port in self._command_ports and idle > IDLE_TIMEOUT:
                    connection.close()
        self._send_feedback()
        if self._watch is not None:
            self._watch(self.now, self.controller)
        self._connections = [c for c in self._connections if not c.closed or c.unread]

    # Commands

    def _handle_waiting(self, connection: Connection) -> None:
        while connection.waiting and not any(c is connection for c, _ in self._syncs):
            call = connection.waiting.popleft()
            text = self.commands.answer(call, connection.port)
            if text is None:
                self._syncs.append((connection, call))
            elif self._replies_to(call):
                self._send(connection, text)

    def _replies_to(self, call: Call) -> bool:
        if "no_reply" in self._active:
            return False
        if call.name.lower() not in ("servoj", "servop"):
            return True
        silent = self.options.firmware == "v3" and not self.options.servo_reply
        return not silent and "no_servo_reply" not in self._active

    def _send(self, connection: Connection, text: str) -> None:
        data = text.encode()
        if "late_reply" in self._active:
            self._late.append((self.now + REPLY_DELAY, connection, data))
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
                period = max(period, SLOW_FEEDBACK_PERIOD)
            if connection.closed or period is None or 8 * self._steps % period >= 8:
                continue
            packet = packet or self._corrupted(self._next_packet())
            if "torn_feedback" in self._active:
                for k in range(0, len(packet), TORN_PIECE_SIZE):
                    connection.write(packet[k : k + TORN_PIECE_SIZE])
            else:
                connection.write(packet)

    def _next_packet(self) -> bytes:
        if "repeated_feedback" not in self._active or not self._sent:
            self._sent = self.feedback.packet(self.now)
        return self._sent

    def _corrupted(self, packet: bytes) -> bytes:
        data = bytearray(packet)
        if self._is_brief("wrong_test_value"):
            data[48:56] = bytes(8)
        if self._is_brief("wrong_size"):
            data[0:2] = (1441).to_bytes(2, "little")
        if "time_back" in self._active:
            data[32:40] = (1_000_000).to_bytes(8, "little")
        return bytes(data)

    def _is_brief(self, fault: str) -> bool:
        return fault in self._active and self.now - self._active[fault] < BRIEF_FAULT_TIME

    # Faults

    def _begin_faults(self) -> None:
        for fault, at in list(self._pending.items()):
            if self.now - self._start < at:
                continue
            # Alarms of a motion wait until the arm moves.
            if fault in MOTION_ALARMS and not self.controller.busy:
                continue
            del self._pending[fault]
            self._active[fault] = self.now
            self._apply_once(fault)
        self._apply_lasting()

    def _apply_lasting(self) -> None:
        self.controller.not_tcp = bool({"not_tcp", "taken_over"} & self._active.keys())
        self.controller.uncalibrated = "no_user_tool" in self._active

    def _apply_once(self, fault: str) -> None:
        controller = self.controller
        if fault in MOTION_ALARMS:
            controller.alarm(*MOTION_ALARMS[fault])
        elif fault == "emergency_stop":
            controller.press_emergency_stop()
        elif fault == "power_off":
            controller.lose_power()
        elif fault == "queue_blocked":
            controller.queue_running = False
        elif fault == "drag":
            controller.set_dragging(1)
        elif fault == "taken_over":
            controller.stop()
        elif fault == "links_closed":
            for connection in self._connections:
                connection.close()
