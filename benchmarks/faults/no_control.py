"""Control of an attack."""

from __future__ import annotations


class NoControl(RuntimeError):
    """What must be possible is not, so that the refusal of an attack would prove nothing."""
