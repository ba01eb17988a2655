"""Credentials of all users of a cell that spans containers or machines, in one folder.

    authority/certificate.pem, key.pem   signs the others; keep it off the machines of the cell
    USER/bus.json                        settings with which a user joins, for `--settings`

A settings file holds certificates and private key itself, so that it is all that a user's machine
needs.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lariat.configuration import ConfigurationError
from lariat.files.file_kind import kind_of
from shared.bus import check_namespace
from stack.credentials.access_control import ROUTER, USERS, access_control
from stack.credentials.authority import Authority, Credential, check_address, days_left
from stack.credentials.private_file import write_private

SETTINGS_FILE = "bus.json"
"""Name of a user's settings file in its folder."""
MAX_DAYS = 36500
"""Longest time for which a certificate is valid [d]."""
RENEWAL_TIME = 30.0
"""Time before its end in which a certificate is renewed [d]."""
_TLS = "transport/link/tls"


def make_credentials(
    folder: Path, addresses: Sequence[str], namespace: str, days: int, *, renew: bool = False
) -> list[str]:
    """Make the credentials that are missing or about to expire."""
    check_namespace(namespace)
    if not 1 <= days <= MAX_DAYS:
        raise ConfigurationError(f"--days is {days}; give 1 to {MAX_DAYS}")
    for address in addresses:
        check_address(address)
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{folder} is {kind_of(folder)}; name a folder for credentials")
    try:
        authority, is_new = _authority(folder / "authority", days, renew)
        made = []
        for user in (ROUTER, *USERS):
            path = folder / user / SETTINGS_FILE
            if not is_new and _is_valid(path, user, addresses, namespace):
                continue
            credential = authority.sign(user, addresses if user == ROUTER else (), days)
            if user == ROUTER:
                settings = router_settings(authority, credential, namespace)
                settings["metadata"] = {"addresses": list(addresses), "namespace": namespace}
            else:
                settings = client_settings(authority, credential)
            write_private(path, json.dumps(settings, indent=1).encode())
            made.append(user)
    except OSError as error:
        raise ConfigurationError(f"cannot write credentials to {folder}: {error}") from None
    return made


def router_settings(authority: Authority, credential: Credential, namespace: str) -> dict[str, Any]:
    """Return the Zenoh settings of a router: it demands certificates, and controls access."""
    return {
        f"{_TLS}/root_ca_certificate_base64": _base64(authority.certificate),
        f"{_TLS}/listen_certificate_base64": _base64(credential.certificate),
        f"{_TLS}/listen_private_key_base64": _base64(credential.key),
        f"{_TLS}/enable_mtls": True,
        f"{_TLS}/close_link_on_expiration": True,
        "access_control": access_control(namespace),
    }


def client_settings(authority: Authority, credential: Credential) -> dict[str, Any]:
    """Return the Zenoh settings with which a user connects to the router."""
    return {
        f"{_TLS}/root_ca_certificate_base64": _base64(authority.certificate),
        f"{_TLS}/connect_certificate_base64": _base64(credential.certificate),
        f"{_TLS}/connect_private_key_base64": _base64(credential.key),
        f"{_TLS}/enable_mtls": True,
        f"{_TLS}/verify_name_on_connect": True,
    }


def _authority(folder: Path, days: int, renew: bool) -> tuple[Authority, bool]:
    """Return the authority of a folder, and whether it had to be made."""
    if not renew and (folder / "key.pem").exists():
        authority = Authority.load(folder)
        if authority.days_left > RENEWAL_TIME:
            return authority, False
    authority = Authority.create(days)
    authority.save(folder)
    return authority, True


def _is_valid(path: Path, user: str, addresses: Sequence[str], namespace: str) -> bool:
    """Whether a settings file exists, will not expire soon and fits what is asked for."""
    try:
        settings = json.loads(path.read_text(encoding="utf-8"))
        side = "listen" if user == ROUTER else "connect"
        encoded = settings[f"{_TLS}/{side}_certificate_base64"]
        left = days_left(base64.b64decode(encoded))
    except (OSError, ValueError, KeyError):
        return False
    if user == ROUTER:
        asked = {"addresses": list(addresses), "namespace": namespace}
        if settings.get("metadata") != asked or settings["access_control"] != access_control(
            namespace
        ):
            return False
    return left > RENEWAL_TIME


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
