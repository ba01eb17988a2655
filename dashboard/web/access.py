"""Rules of who may see and use the page.

* The name in `Host` must be a loopback name or one that the user named. A foreign site whose name
  resolves to this machine (DNS rebinding) is refused.
* The `Origin` of a WebSocket or a POST must be the page's own, so that no other site can act in the
  browser of a person who has the page open.
* On a loopback name, the token of this start admits; on any other name, the password.
* Who was admitted has a cookie. Its path is secret and new with every start: browsers send a cookie
  to every port of a host, but to this path only here.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

COOKIE = "lariat"
"""Name of the cookie of those who were admitted."""


@dataclass(frozen=True)
class Address:
    """Address under which browsers reach the page, as `Host` and `Origin` name it."""

    scheme: str
    """`http` or `https`."""
    netloc: str
    """Name and port, in lower case, without a default port."""
    name: str
    """Name without port, in lower case."""

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine reaches the name."""
        return is_loopback(self.name)

    def __str__(self) -> str:
        return f"{self.scheme}://{self.netloc}"


def parse_address(text: str) -> Address:
    """Parse an address such as `https://lab.example:8443`."""
    form = "an address has the form http://NAME:PORT or https://NAME:PORT"
    try:
        parts = urlsplit(text)
        name, port = parts.hostname or "", parts.port
    except ValueError:
        raise ValueError(f"{text!r}: {form}") from None
    rest = parts.path.strip("/") or parts.query or parts.fragment or parts.username
    if parts.scheme not in ("http", "https") or not name or rest:
        raise ValueError(f"{text!r}: {form}")
    shown = f"[{name}]" if ":" in name else name
    default = 443 if parts.scheme == "https" else 80
    netloc = shown if port in (None, default) else f"{shown}:{port}"
    return Address(parts.scheme, netloc, name)


def is_loopback(name: str) -> bool:
    """Return whether a host name reaches only the machine that uses it."""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"


class Access:
    """Rules of one start of the page."""

    def __init__(self, addresses: Sequence[Address], token: str, password: str = "") -> None:
        """Derive the secrets of this start from its token."""
        self._addresses = {a.netloc: a for a in addresses}
        self._token = token
        self._password = password
        self.path = _derive(token, "path")
        """Secret part of the page's path."""

    def address_of(self, host: str) -> Address | None:
        """Return the address that a `Host` header names; None if it is not one of the page's."""
        try:
            address = parse_address(f"http://{host}")
        except ValueError:
            return None
        named = self._addresses.get(address.netloc)
        return named or (address if address.is_loopback else None)

    def is_own_origin(self, address: Address, origin: str | None) -> bool:
        """Return whether an `Origin` header is that of the page at this address."""
        return origin is not None and origin.lower() == str(address)

    def admits_token(self, address: Address, token: str) -> bool:
        """Return whether a token admits at this address."""
        return address.is_loopback and _equal(token, self._token)

    def admits_password(self, address: Address, password: str) -> bool:
        """Return whether a password admits at this address."""
        return not address.is_loopback and bool(self._password) and _equal(password, self._password)

    def cookie(self, address: Address) -> str:
        """Return the value of the cookie of those who were admitted at this address."""
        return _derive(self._token, f"cookie {address}")

    def admits_cookie(self, address: Address, cookie: str) -> bool:
        """Return whether a cookie was given at this address."""
        return _equal(cookie, self.cookie(address))

    def admits_path(self, path: str) -> bool:
        """Return whether this is the secret part of the page's path."""
        return _equal(path, self.path)


def _derive(token: str, purpose: str) -> str:
    return hmac.new(token.encode(), purpose.encode(), hashlib.sha256).hexdigest()[:43]


def _equal(offered: str, secret: str) -> bool:
    # Digests have one length, so that the time of the comparison says nothing about the secret's.
    digests = (hashlib.sha256(text.encode(errors="replace")).digest() for text in (offered, secret))
    return hmac.compare_digest(*digests)
