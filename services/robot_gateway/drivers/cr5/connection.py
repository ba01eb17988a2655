"""The three connections to one CR5: opened together, tried again with a growing pause.

Port 30003 tells the versions apart: V3 takes motion there, V4 refuses the connection.
"""

from __future__ import annotations

from typing import Literal

from services.robot_gateway.drivers.cr5.link import ByteStream, Link

SECOND = 1_000_000_000
COMMANDS, MOTION, FEEDBACK = 29999, 30003, 30004
CONNECT_TIME = 3.0
"""In which all ports answer [s]."""
BACK_OFF = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Between attempts to connect [s]."""

Phase = Literal["away", "connecting", "online"]


class Dial:
    """Connects, and says why it does not."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self.phase: Phase = "away"
        self.firmware: Literal["v3", "v4"] | None = None
        self.streams: dict[int, ByteStream] = {}
        self.trouble = ""
        """Why there is no connection, in words."""
        self.since = 0
        """When this phase began [ns]."""
        self._attempts = 0
        self._retry_at: int | None = None

    def advance(self, now: int) -> bool:
        """One tick [ns]; True when the connections have just been opened."""
        if self.phase == "away" and (self._retry_at is None or now >= self._retry_at):
            self.streams = {p: self._link.open(p) for p in (COMMANDS, MOTION, FEEDBACK)}
            self.phase, self.since = "connecting", now
        elif self.phase == "connecting":
            return self._check(now)
        return False

    def broken(self) -> str:
        """Why a connection that stood has ended; empty while all stand."""
        closed = (stream for stream in self.streams.values() if stream.state == "closed")
        return next((stream.reason for stream in closed), "")

    def give_up(self, why: str, now: int) -> None:
        """Closes everything and tries again after a while."""
        self.close()
        self.trouble = why
        self._retry_at = now + round(BACK_OFF[min(self._attempts, len(BACK_OFF) - 1)] * SECOND)
        self._attempts += 1

    def settled(self) -> None:
        """The arm has answered: the next pause is the shortest one again."""
        self._attempts = 0

    def abort(self) -> None:
        """Ends every connection at once; what has not arrived is thrown away."""
        for stream in self.streams.values():
            stream.abort()

    def close(self) -> None:
        """Closes every connection."""
        for stream in self.streams.values():
            stream.close()
        self.streams = {}
        self.phase = "away"

    def _check(self, now: int) -> bool:
        states = {port: stream.state for port, stream in self.streams.items()}
        if states[FEEDBACK] == "closed" and "open" == states[COMMANDS] == states[MOTION]:
            self.give_up(
                f"{self.streams[FEEDBACK].reason}, though the other ports are open; firmware "
                "before 3.5.2 has no such port and is not supported: update the controller",
                now,
            )
            return False
        for port in (COMMANDS, FEEDBACK):
            if states[port] == "closed" and states[MOTION] != "opening":
                self.give_up(
                    f"{self.streams[port].reason}; is the address right, and no other program or "
                    "pendant connected?",
                    now,
                )
                return False
        if "opening" in states.values():
            if now - self.since > CONNECT_TIME * SECOND:
                slow = [str(p) for p, s in states.items() if s == "opening"]
                ports = ", ".join(slow)
                self.give_up(f"no answer on port {ports}; is the arm on this network?", now)
            return False
        self.firmware = "v3" if states[MOTION] == "open" else "v4"
        if self.firmware == "v4":
            del self.streams[MOTION]
        self.phase, self.trouble, self.since = "online", "", now
        return True
