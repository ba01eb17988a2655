"""Pages of the web server itself, and the frame of viser's page."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from dashboard.markup import escaped

BROWSER = Path(__file__).parent / "browser"
"""Folder of the scripts and styles around viser's page."""
CELL_PARTS = tuple(
    f"{name}.{kind}"
    for name in ("stop_bar", "banner", "guide", "large_screen")
    for kind in ("js", "css")
)
"""Files of that folder for the page of a cell."""
PARTS = ("software_drawing.js", "keys.js")
"""Files of that folder for every page."""

_ICON = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'%3E"
    "%3Crect width='32' height='32' rx='7' fill='%2314181f'/%3E%3Cpath d='M5 9c8 0 6 15 13 15s5-15 "
    "9-15' fill='none' stroke='%23f6b246' stroke-width='4' stroke-linecap='round'/%3E%3C/svg%3E"
)
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;background:#14181f;color:#dde3ec;margin:12vh auto;"
    "max-width:34em;padding:0 1.5em}h1{font-size:1.4em}input,button{font:inherit;padding:.4em .8em;"
    "border-radius:.3em;border:1px solid #5d6b80;background:#222a35;color:inherit}"
    "code{background:#222a35;padding:.1em .3em}"
)


def refusal(title: str, text_html: str) -> str:
    """HTML of a refused request."""
    return _document(title, f"<h1>{escaped(title)}</h1><p>{text_html}</p>")


def entrance(path: str) -> str:
    """HTML for someone who has just been admitted; it goes on to the page.

    A browser does not send the new cookie with a redirect of a link from another site, but does
    with a step that this page takes.
    """
    refresh = f'<meta http-equiv="refresh" content="0;url={escaped(path)}">'
    return _document("Lariat", f'<p><a href="{escaped(path)}">Open the page</a></p>', refresh)


def login(note: str = "") -> str:
    """HTML that asks for the password."""
    return _document(
        "Lariat",
        "<h1>Lariat</h1><form method=post action=/login>"
        "<input type=password name=password aria-label=Password autofocus required "
        "autocomplete=current-password> <button>Enter</button></form>"
        f"<p role=alert>{escaped(note)}</p>",
    )


@cache
def page(title: str, with_cell: bool, nonce: str) -> str:
    """HTML of viser's page, with title and icon of this one.

    The scripts of a cell come before all others, so that the stop bar's key handler is the first
    that sees a key. viser's script unpacks another one, which it puts into the page. The nonce
    tells the page's own scripts from any that a text brings along.
    """
    # The web server starts before anybody imports this one, which takes longer.
    import viser

    text = (Path(viser.__file__).parent / "client/build/index.html").read_text()
    parts = ""
    for name in (*CELL_PARTS, *PARTS) if with_cell else PARTS:
        script = name.endswith(".js")
        parts += (
            f'<script src="{escaped(name)}"></script>'
            if script
            else f'<link rel="stylesheet" href="{escaped(name)}">'
        )
    for pattern, new in (
        (r'<link\s+rel="icon".*?/>', f'<link rel="icon" href="{_ICON}">'),
        (r"<title>.*?</title>", f"<title>{escaped(title)}</title>"),
        ("<head>", f"<head>{parts}"),
        ("<script data-p=", f'<script nonce="{escaped(nonce)}" data-p='),
        ('e.type="module";', f'e.type="module";e.nonce="{escaped(nonce)}";'),
    ):
        text, count = re.subn(pattern, lambda _, new=new: new, text, flags=re.DOTALL)
        if count != 1:
            raise RuntimeError(f"viser {viser.__version__}: no place for {new[:40]!r} in its page")
    return text


def _document(title: str, body_html: str, head_html: str = "") -> str:
    return (
        f'<!doctype html><html lang=en><head><meta charset=utf-8>{head_html}<meta name="viewport" '
        f'content="width=device-width,initial-scale=1"><title>{escaped(title)}</title>'
        f"<style>{_STYLE}</style></head><body>{body_html}</body></html>"
    )
