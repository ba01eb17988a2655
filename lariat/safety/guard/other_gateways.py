"""Other gateways that speak for the same cell: two must never drive one arm."""

from __future__ import annotations

import logging

from lariat.trajectory import NANOSECONDS

log = logging.getLogger(__name__)

GATEWAY_SILENCE = 1.0
"""Silence of another gateway after which it counts as gone [s]."""


class OtherGateways:
    """The other gateway that was heard last."""

    def __init__(self) -> None:
        self._boot = ""
        self._heard = 0

    def take(self, boot: str, now: int) -> None:
        """Note that another gateway, with a boot id, spoke at `now` [ns]."""
        if not self.words(now):
            log.warning("another gateway, %s, speaks for this cell; end one of the two", boot)
        self._boot, self._heard = boot, now

    def words(self, now: int) -> str:
        """Return which other gateway speaks at `now` [ns], in words; empty where none does."""
        gone = (now - self._heard) * NANOSECONDS > GATEWAY_SILENCE
        if not self._boot or gone:
            return ""
        return f"gateway {self._boot} speaks for this cell too; end one of the two"
