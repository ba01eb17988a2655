"""Page of a process: viser on a private socket, and the web server in front of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dashboard import palette
from dashboard.options import DashboardOptions
from dashboard.web.cell_socket import Cell
from dashboard.web.web_server import WebServer
from lariat.plain_text import plain_text

if TYPE_CHECKING:
    import viser

    from dashboard.web.private_viser import PrivateViser

NOTIFICATION_DURATION = 8.0
"""Time for which a notification is shown [s]."""


class Site:
    """Web server, and the viser server behind it once that is opened; both are closed together.

    The web server alone holds arms, so that they can be held before the page is built.
    """

    def __init__(self, options: DashboardOptions, title: str, cell: Cell | None = None) -> None:
        self._title = title
        self._private: PrivateViser | None = None
        self._web_server = WebServer(options, title, cell)
        self.address: str = self._web_server.address
        """Address that a person opens."""

    def open_viser(self) -> viser.ViserServer:
        """Start the viser server, whose elements are the page's."""
        # Its import takes longer than the start of the web server.
        from dashboard.web.private_viser import PrivateViser

        self._private = PrivateViser(self._title)
        self._web_server.open_page(self._private.path)
        return self._private.server

    def show_status(self, status: str) -> None:
        """Send a status, a JSON object, to the stop bar of every page."""
        self._web_server.show(status)

    def close(self) -> None:
        """Disconnect everybody and stop."""
        self._web_server.close()
        if self._private is not None:
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
