"""Right to act: of all pages that are open, one has the controls; the others watch and may ask.

The first page that comes gets them, and keeps them through a reload. Whoever asks gets them when
the holder gives them, does not answer in time, or is gone. Every page may hold the arms.
"""

from __future__ import annotations

from collections import Counter
from typing import Literal

ANSWER_TIME = 15.0
"""Time that the holder has to answer a page that asks for the controls [s]."""
RELOAD_TIME = 4.0
"""Time for which the controls are kept for a page that has left [s]."""

Role = Literal["holder", "watcher", "free"]
"""Role of a page: it has the controls, another one has them, or nobody."""


class Controls:
    """Holder of the controls and the page that asks for them.

    Pages are named by the part of their address that the server gave them. Times are those of one
    monotonic clock [s].
    """

    def __init__(self) -> None:
        self._open: Counter[str] = Counter()
        self._holder = ""
        self._holder_left: float | None = None
        self._asker = ""
        self._asked = 0.0

    def enter(self, page: str, now: float) -> None:
        """Count a connection of a page, which gets the controls if nobody has them."""
        self.advance(now)
        self._open[page] += 1
        if page == self._holder:
            self._holder_left = None
        if not self._holder:
            self._give(page)

    def leave(self, page: str, now: float) -> None:
        """Uncount a connection of a page."""
        self._open[page] -= 1
        if self._open[page] > 0:
            return
        del self._open[page]
        if page == self._holder:
            self._holder_left = now
        if page == self._asker:
            self._asker = ""

    def ask(self, page: str, now: float) -> None:
        """Ask for the controls; a page gets them at once where nobody has them."""
        self.advance(now)
        if not self._holder:
            self._give(page)
        elif page != self._holder and not self._asker:
            self._asker, self._asked = page, now

    def answer(self, page: str, give: bool) -> None:
        """Take the holder's answer to the page that asks; other pages have no say."""
        if page != self._holder or not self._asker:
            return
        if give:
            self._give(self._asker)
        self._asker = ""

    def advance(self, now: float) -> None:
        """Give the controls to a page that was not answered, take them from one that is gone."""
        gone = self._holder_left is not None and now - self._holder_left > RELOAD_TIME
        unanswered = self._asker and now - self._asked > ANSWER_TIME
        if gone or unanswered:
            self._give(self._asker)

    def holds(self, page: str) -> bool:
        """Return whether a page has the controls."""
        return bool(page) and page == self._holder

    def role(self, page: str) -> Role:
        """Return the role of a page."""
        if not self._holder:
            return "free"
        return "holder" if page == self._holder else "watcher"

    def asks(self, page: str) -> bool:
        """Return whether a page waits for the holder's answer."""
        return bool(page) and page == self._asker

    @property
    def is_asked_for(self) -> bool:
        """Whether a page waits for the holder's answer."""
        return bool(self._asker)

    def _give(self, page: str) -> None:
        self._holder, self._holder_left = page, None
        if page == self._asker:
            self._asker = ""
