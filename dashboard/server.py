"""Web server of the page."""

from __future__ import annotations

import io
from contextlib import redirect_stdout

import viser

from dashboard import palette
from shared.configuration import ConfigurationError

NOTIFICATION_DURATION = 8.0
"""Time for which a notification is shown [s]."""


def start(host: str, port: int, title: str) -> viser.ViserServer:
    """Start a server at exactly this address.

    Args:
        host: Address to listen on.
        port: TCP port.
        title: Title of the browser's window.

    Raises:
        ConfigurationError: The port is taken.
    """
    try:
        # viser prints a banner even when not verbose; standard output is reserved for answers.
        with redirect_stdout(io.StringIO()):
            server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    except OSError as error:
        raise ConfigurationError(f"cannot serve at {host}:{port}: {error}") from error
    # viser silently takes the next free port.
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
    """Stop the server and its threads."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def notify(server: viser.ViserServer, title: str, body: str) -> None:
    """Show a warning in every open browser."""
    for client in server.get_clients().values():
        client.add_notification(
            title, body, auto_close_seconds=NOTIFICATION_DURATION, color=palette.BAD
        )
