"""Tab of the checks of a cell: what `lariat check --live` prints, as the page has seen it."""

from __future__ import annotations

import viser

from dashboard import palette
from dashboard.markup import escaped, note_html, text_html
from shared.cell_checks import CellChecks, CheckResult

INTRODUCTION = (
    "What this page has seen of the cell since it began to listen. `lariat check FILE --live` "
    "prints the same. Nothing moves for a check: arm, approach, run and hold as usual."
)
MARKS = {"passed": "✓", "failed": "✗", "open": "○"}
"""Mark of a check by its outcome."""


class ChecksPanel:
    """List of checks with their results."""

    def __init__(self, gui: viser.GuiApi, checks: CellChecks) -> None:
        self._checks = checks
        gui.add_html(note_html(INTRODUCTION))
        self._list = gui.add_html("")

    def draw(self) -> None:
        """Draw the results."""
        self._list.content = list_html(self._checks.results())


def list_html(results: tuple[CheckResult, ...]) -> str:
    """HTML of results."""
    rows = []
    for result in results:
        color = f"color:{palette.text_css(palette.BAD)}" if result.outcome == "failed" else ""
        rows.append(
            f"<tr style='{color}'><td style='width:1.4em'>{escaped(MARKS[result.outcome])}</td>"
            f"<td>{escaped(result.title)}"
            f"<div style='opacity:.75'>{text_html(result.detail)}</div></td></tr>"
        )
    return (
        "<div style='margin:.4em 1em;font-size:.85em'>"
        f"<table style='border-spacing:0 .25em'>{''.join(rows)}</table></div>"
    )
