"""Pages of the door itself, and the frame of viser's page."""

from __future__ import annotations

import html
from functools import cache
from pathlib import Path

import viser

STOP_BAR = Path(__file__).parent / "stop_bar"
"""Folder of the stop bar's script and style."""

_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;background:#14181f;color:#dde3ec;margin:12vh auto;"
    "max-width:34em;padding:0 1.5em}h1{font-size:1.4em}input,button{font:inherit;padding:.4em .8em;"
    "border-radius:.3em;border:1px solid #5d6b80;background:#222a35;color:inherit}"
    "code{background:#222a35;padding:.1em .3em}"
)


def refusal(title: str, text: str) -> str:
    """HTML of a refused request.

    Args:
        title: Statement, plain text.
        text: Reason and way out, HTML.
    """
    return _document(title, f"<h1>{html.escape(title)}</h1><p>{text}</p>")


def entrance(path: str) -> str:
    """HTML for someone who has just been admitted; it goes on to the page.

    A browser does not send the new cookie with a redirect of a link from another site, but does
    with a step that this page takes.
    """
    refresh = f'<meta http-equiv="refresh" content="0;url={html.escape(path)}">'
    return _document("Lariat", f'<p><a href="{html.escape(path)}">Open the page</a></p>', refresh)


def login(note: str = "") -> str:
    """HTML that asks for the password."""
    return _document(
        "Lariat",
        "<h1>Lariat</h1><form method=post action=/login>"
        "<input type=password name=password aria-label=Password autofocus required "
        "autocomplete=current-password> <button>Enter</button></form>"
        f"<p role=alert>{html.escape(note)}</p>",
    )


@cache
def page(with_stop_bar: bool) -> str:
    """HTML of viser's page, with the stop bar's script before all others.

    So its key handler is the first that sees a key.
    """
    text = (Path(viser.__file__).parent / "client/build/index.html").read_text()
    if not with_stop_bar:
        return text
    head = "<head>"
    if text.count(head) != 1:
        raise RuntimeError(f"viser {viser.__version__}: no place for the stop bar in its page")
    parts = '<script src="stop_bar.js"></script><link rel="stylesheet" href="stop_bar.css">'
    return text.replace(head, head + parts)


def _document(title: str, body: str, head: str = "") -> str:
    return (
        f'<!doctype html><html lang=en><head><meta charset=utf-8>{head}<meta name="viewport" '
        f'content="width=device-width,initial-scale=1"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body>{body}</body></html>"
    )
