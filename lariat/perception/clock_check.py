"""Check that the machine of a camera and that of the gateway have the same time.

An image is matched to the grips' poses by its stamp. Clocks that differ by more than can be latency
are found out; a difference within it is not.
"""

from __future__ import annotations

from lariat.trajectory import SECOND

MAX_LEAD = SECOND // 20
"""Time by which an image may be newer than the arms' newest state [ns]: states come every 8 ms."""
MAX_LAG = 2 * SECOND
"""Time by which an image may be older [ns]: latency of a camera, and of a machine at its limit."""
FRESH_AGE = SECOND // 10
"""Age up to which the arms' newest state tells the present time of the gateway [ns]."""


class ClockCheck:
    """Comparison of the stamps of images with those of the arms' newest state."""

    def __init__(self) -> None:
        self._arms = self._received = -SECOND

    def take(self, stamp: int, received: int) -> None:
        """Take the arms' newest state: its stamp, and the time of its receipt [ns]."""
        self._arms, self._received = stamp, received

    def fault(self, stamp: int, now: int) -> str:
        """Return how the clock of an image's stamp differs, in words; empty where it agrees.

        Args:
            stamp: Stamp of an image that has just arrived [ns].
            now: Present time by the clock of the receipts [ns].
        """
        age = now - self._received
        if age > FRESH_AGE:
            return ""
        lead = stamp - (self._arms + age)
        if -MAX_LAG <= lead <= MAX_LEAD:
            return ""
        word = "ahead of" if lead > 0 else "behind"
        return (
            f"the camera's clock is {abs(lead) / SECOND:.2f} s {word} the gateway's; set the "
            "clocks of their machines (NTP), then restart what runs on them"
        )
