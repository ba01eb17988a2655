"""What the dashboard takes on its command line beside what every service takes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DashboardOptions:
    """Where the page is served."""

    port: int = 8080
    host: str = "127.0.0.1"
    """The page has no login: whoever reaches it can move the arms."""
