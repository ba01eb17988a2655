"""Command-line options of the dashboard, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DashboardOptions:
    """Address of the web page."""

    port: int = 8080
    """TCP port."""
    host: str = "127.0.0.1"
    """Address to listen on. The page has no login: whoever reaches it can move the arms."""
