"""Command-line options of the page, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class DashboardOptions:
    """Address of the web page, and who may see it."""

    port: int = 8080
    """TCP port."""
    host: str = "127.0.0.1"
    """Network address to listen on; `address` says which names browsers may use."""
    address: tuple[str, ...] = ()
    """Addresses under which browsers reach the page, beside http://127.0.0.1:PORT: of a published
    port, or of a TLS proxy, e.g. https://lab.example. The first one is printed."""
    password_file: Path | None = None
    """File whose first line is the password for names that other machines reach."""
    token_file: Path | None = None
    """File of the token that the printed address holds. It is created where it is missing; without
    it, every start has a new token."""
