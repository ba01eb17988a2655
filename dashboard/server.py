"""The web server of the page."""

from __future__ import annotations

import io
from contextlib import redirect_stdout

import viser

from dashboard import palette
from shared.configuration import ConfigurationError


def start(host: str, port: int, title: str) -> viser.ViserServer:
    """A server at exactly this address.

    Raises:
        ConfigurationError: The port is taken.
    """
    try:
        # It prints a banner however quiet it is asked to be, and standard output is for answers.
        with redirect_stdout(io.StringIO()):
            server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    except OSError as error:
        raise ConfigurationError(f"cannot serve at {host}:{port}: {error}") from error
    # The library moves on to the next free port without a word.
    if server.get_port() != port:
        stop(server)
        raise ConfigurationError(
            f"port {port} of {host} is taken; stop what uses it or choose another with --port"
        )
    server.gui.configure_theme(
        dark_mode=True, show_logo=False, show_share_button=False, brand_color=palette.BRAND
    )
    return server


def stop(server: viser.ViserServer) -> None:
    """Ends the server and its threads."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def notify(server: viser.ViserServer, title: str, body: str) -> None:
    """Tells everyone who looks at the page what did not happen."""
    for client in server.get_clients().values():
        client.add_notification(title, body, auto_close_seconds=8.0, color=palette.BAD)
