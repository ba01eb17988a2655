"""Token and password of the page, from files that only their owner reads."""

from __future__ import annotations

import os
import secrets
import stat
from pathlib import Path

from lariat.configuration import ConfigurationError

TOKEN_BYTES = 24
"""Random bytes of a token."""
MIN_PASSWORD_LENGTH = 12
"""Least number of characters of a password."""
MAX_FILE_SIZE = 4096
"""Largest file of a secret [bytes]."""


def load_token(path: Path | None) -> str:
    """Return the token in a file, or a new one, which the file then holds."""
    token = secrets.token_urlsafe(TOKEN_BYTES)
    if path is None:
        return token
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return _first_line(path, TOKEN_BYTES)
    except OSError as error:
        raise ConfigurationError(f"token file {path}: {error.strerror}") from None
    with open(descriptor, "w") as file:
        file.write(token + "\n")
    return token


def load_password(path: Path) -> str:
    """Return the password in a file."""
    return _first_line(path, MIN_PASSWORD_LENGTH)


def _first_line(path: Path, min_length: int) -> str:
    try:
        with path.open("rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise ConfigurationError(f"{path} is not a regular file; name another one")
            content = file.read(MAX_FILE_SIZE)
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}") from None
    if status.st_mode & 0o007:
        raise ConfigurationError(f"{path} is readable by every user; run: chmod o= {path}")
    line = content.decode(errors="replace").partition("\n")[0].strip()
    if len(line) < min_length:
        raise ConfigurationError(
            f"the first line of {path} has {len(line)} characters; a secret needs {min_length}"
        )
    return line
