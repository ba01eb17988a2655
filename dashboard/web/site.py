"""Page of a process: viser on a private socket, and the web server in front of it."""

from __future__ import annotations

import viser

from dashboard import palette
from dashboard.options import DashboardOptions
from dashboard.web.cell_socket import Cell
from dashboard.web.private_viser import PrivateViser
from dashboard.web.web_server import WebServer
from lariat.plain_text import plain_text

NOTIFICATION_DURATION = 8.0
"""Time for which a notification is shown [s]."""


class Site:
    """viser server and web server, started and closed together."""

    def __init__(self, options: DashboardOptions, title: str, cell: Cell | None = None) -> None:
        """Start both.

        Args:
            options: Where the page is, and who may see it.
            title: Title of the browser's window.
            cell: Cell whose arms the page holds; None for a page that only shows.

        Raises:
            ConfigurationError: The port is taken, or the options admit nobody or too many.
        """
        self._private = PrivateViser(title)
        self.viser: viser.ViserServer = self._private.server
        """Elements of the page."""
        try:
            self._web_server = WebServer(options, self._private.path, title, cell)
        except BaseException:
            self._private.close()
            raise
        self.address: str = self._web_server.address
        """Address that a person opens."""

    def show_status(self, status: str) -> None:
        """Send a status, a JSON object, to the stop bar of every page."""
        self._web_server.show(status)

    def close(self) -> None:
        """Disconnect everybody and stop."""
        self._web_server.close()
        self._private.close()


def notify(server: viser.ViserServer, title: str, body: str) -> None:
    """Show a warning in every open browser."""
    for client in server.get_clients().values():
        client.add_notification(
            plain_text(title),
            plain_text(body),
            auto_close_seconds=NOTIFICATION_DURATION,
            color=palette.BAD,
        )
