"""Connection to a CR5: three ports, opened together, retried with growing pauses.

Port 30003 distinguishes the versions: V3 takes motion there, V4 refuses the connection.
"""

from __future__ import annotations

from typing import Literal

from lariat.trajectory import SECOND
from services.robot_gateway.drivers.cr5.link import ByteStream, Link

COMMAND_PORT, MOTION_PORT, FEEDBACK_PORT = 29999, 30003, 30004
"""Ports of the arm: commands, motion (V3 only) and feedback at 125 Hz."""
CONNECT_TIMEOUT = 3.0
"""Time limit for all ports to open [s]."""
RETRY_PAUSES = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Pauses between attempts to connect [s]; the last one repeats."""

Phase = Literal["disconnected", "connecting", "online"]


class ArmConnection:
    """Opens the streams to all ports, and keeps the reason when that fails."""

    def __init__(self, link: Link) -> None:
        """Create a connection that is not open yet. Args: link: Access to the arm's ports."""
        self._link = link
        self.phase: Phase = "disconnected"
        self.firmware: Literal["v3", "v4"] | None = None
        self.streams: dict[int, ByteStream] = {}
        self.trouble = ""
        """Why there is no connection, in words."""
        self.since = 0
        """Time at which this phase began [ns]."""
        self._attempts = 0
        self._retry_at: int | None = None

    def advance(self, now: int) -> bool:
        """Advance to `now` [ns]; return True when all streams have just been opened."""
        if self.phase == "disconnected" and (self._retry_at is None or now >= self._retry_at):
            self.streams = {
                p: self._link.open(p) for p in (COMMAND_PORT, MOTION_PORT, FEEDBACK_PORT)
            }
            self.phase, self.since = "connecting", now
        elif self.phase == "connecting":
            return self._check(now)
        return False

    def broken(self) -> str:
        """Return why a stream that was open has ended; empty while all are open."""
        closed = (stream for stream in self.streams.values() if stream.state == "closed")
        return next((stream.reason for stream in closed), "")

    def give_up(self, why: str, now: int) -> None:
        """Close everything and retry after a pause. Args: why: In words. now: [ns]."""
        self.close()
        self.trouble = why
        self._retry_at = now + round(
            RETRY_PAUSES[min(self._attempts, len(RETRY_PAUSES) - 1)] * SECOND
        )
        self._attempts += 1

    def reset_pauses(self) -> None:
        """Begin with the shortest pause again, after the arm has answered."""
        self._attempts = 0

    def abort(self) -> None:
        """Close every stream at once; data in flight is discarded."""
        for stream in self.streams.values():
            stream.abort()

    def close(self) -> None:
        """Close every stream."""
        for stream in self.streams.values():
            stream.close()
        self.streams = {}
        self.phase = "disconnected"

    def _check(self, now: int) -> bool:
        states = {port: stream.state for port, stream in self.streams.items()}
        if (
            states[FEEDBACK_PORT] == "closed"
            and "open" == states[COMMAND_PORT] == states[MOTION_PORT]
        ):
            self.give_up(
                f"{self.streams[FEEDBACK_PORT].reason}, though the other ports are open; firmware "
                "before 3.5.2 has no such port and is not supported: update the controller",
                now,
            )
            return False
        for port in (COMMAND_PORT, FEEDBACK_PORT):
            if states[port] == "closed" and states[MOTION_PORT] != "opening":
                self.give_up(
                    f"{self.streams[port].reason}; is the address right, and no other program or "
                    "pendant connected?",
                    now,
                )
                return False
        if "opening" in states.values():
            if now - self.since > CONNECT_TIMEOUT * SECOND:
                ports = ", ".join(str(p) for p, s in states.items() if s == "opening")
                self.give_up(f"no answer on port {ports}; is the arm on this network?", now)
            return False
        self.firmware = "v3" if states[MOTION_PORT] == "open" else "v4"
        if self.firmware == "v4":
            del self.streams[MOTION_PORT]
        self.phase, self.trouble, self.since = "online", "", now
        return True
