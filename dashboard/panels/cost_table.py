"""Cost of the present horizon by term, as bars."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping

from dashboard import palette


def cost_html(cost: Mapping[str, float]) -> str:
    """HTML bars of the terms, largest first; nothing without a finite term."""
    terms = [(name, value) for name, value in cost.items() if math.isfinite(value)]
    terms.sort(key=lambda term: -term[1])
    total = sum(max(value, 0.0) for _, value in terms)
    if not terms:
        return ""
    rows = "".join(
        f"<tr><td>{html.escape(name.replace('_', ' '))}</td>"
        f"<td style='text-align:right'>{value:.3g}</td>"
        f"<td style='width:45%'>{_bar(max(value, 0.0) / total if total > 0.0 else 0.0)}</td></tr>"
        for name, value in terms
    )
    head = "<div style='font-size:.85em;margin:.4em 1em 0'>Cost of the horizon by term</div>"
    style = "font-size:.78em;border-spacing:.7em .2em;font-variant-numeric:tabular-nums;width:100%"
    return f"{head}<table style='{style}'>{rows}</table>"


def _bar(share: float) -> str:
    return (
        f"<div style='height:.5em;border-radius:.2em;width:{100.0 * share:.0f}%;"
        f"background:{palette.css(palette.BUSY)}'></div>"
    )
