"""Secret of a stack on one machine: a password for each start, which its owner alone can read.

The processes of `lariat up` meet on loopback, which every user of the machine can reach. They admit
whoever knows the password; the command line of the same user finds it by the port of the hub. It
lies in the user's runtime folder, or in a folder of the user's own in /tmp, and is removed at the
end of the stack.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from lariat.configuration import ConfigurationError
from stack.credentials.private_file import write_private

USER = "lariat"
"""User name that all processes of a stack share."""
PASSWORD_BYTES = 32
"""Random bytes of a password."""
_LOCAL_ENDPOINT = re.compile(r"tcp/(?:127\.0\.0\.1|localhost):(\d+)")


@contextmanager
def port_lock(port: int, about: str) -> Iterator[None]:
    """Hold the port of a hub for one stack of this user, before anything is written for it.

    The lock ends with the process that holds it, however that ends. `about` says what runs there,
    for whoever finds the port held.
    """
    with _open_lock(port) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigurationError(
                f"a stack of yours runs on port {port} ({file.read() or 'it is starting'}); end it "
                "with Ctrl-C in its terminal, or choose another --port"
            ) from None
        file.truncate(0)
        file.write(f"process {os.getpid()}: {about}")
        file.flush()
        try:
            yield
        finally:
            file.truncate(0)


def _open_lock(port: int) -> TextIO:
    """Open the file whose lock stands for a port."""
    folder = _folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_private(folder)
        return os.fdopen(os.open(folder / f"{port}.lock", os.O_RDWR | os.O_CREAT, 0o600), "r+")
    except OSError as error:
        raise ConfigurationError(f"cannot lock port {port} in {folder}: {error}") from None


@contextmanager
def local_secret(port: int) -> Iterator[Path]:
    """Provide the settings with which processes join the stack at a port, and remove them."""
    folder = _folder()
    settings, users = folder / f"{port}.json", folder / f"{port}.users"
    password = secrets.token_hex(PASSWORD_BYTES)
    values = {
        "transport/auth/usrpwd/user": USER,
        "transport/auth/usrpwd/password": password,
        "transport/auth/usrpwd/dictionary_file": str(users),
    }
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_private(folder)
        write_private(users, f"{USER}:{password}\n".encode())
        write_private(settings, json.dumps(values).encode())
    except OSError as error:
        raise ConfigurationError(f"cannot write the stack's secret to {folder}: {error}") from None
    try:
        yield settings
    finally:
        for path in (settings, users):
            with contextlib.suppress(OSError):
                path.unlink()


def find_local_secret(endpoints: tuple[str, ...]) -> Path | None:
    """Return the settings of a running stack of this user; None where there are none."""
    for endpoint in endpoints:
        if (match := _LOCAL_ENDPOINT.fullmatch(endpoint)) is None:
            continue
        path = _folder() / f"{match[1]}.json"
        with contextlib.suppress(OSError):
            _check_private(path.parent)
            if path.is_file():
                return path
    return None


def _folder() -> Path:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and Path(runtime).is_dir() and os.access(runtime, os.W_OK):
        return Path(runtime) / "lariat"
    return Path("/tmp") / f"lariat-{os.getuid()}"


def _check_private(folder: Path) -> None:
    """Raise PermissionError where another user can have written into a folder."""
    state = folder.lstat()
    if not stat.S_ISDIR(state.st_mode) or state.st_uid != os.getuid() or state.st_mode & 0o077:
        raise PermissionError(
            f"{folder} must be a folder of this user's own, with mode 0700; make it so, or set "
            "XDG_RUNTIME_DIR to one that is"
        )
