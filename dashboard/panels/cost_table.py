"""Cost of the present horizon by term, as bars."""

from __future__ import annotations

import math
from collections.abc import Mapping

from dashboard import palette
from dashboard.markup import escaped


def cost_html(cost: Mapping[str, float]) -> str:
    """HTML bars of the terms, largest first; nothing without a finite term."""
    terms = [(name, value) for name, value in cost.items() if math.isfinite(value)]
    terms.sort(key=lambda term: -term[1])
    total = sum(max(value, 0.0) for _, value in terms)
    if not terms:
        return ""
    rows = "".join(
        f"<tr><td>{escaped(name.replace('_', ' '))}</td>"
        f"<td style='text-align:right'>{value:.3g}</td>"
        f"<td style='width:45%'>{_bar_html(max(value, 0.0) / (total or 1.0))}</td></tr>"
        for name, value in terms
    )
    head = "<div style='font-size:.85em;margin:.4em 1em 0'>Cost of the horizon by term</div>"
    style = "font-size:.78em;border-spacing:.7em .2em;font-variant-numeric:tabular-nums;width:100%"
    return f"{head}<table style='{style}'>{rows}</table>"


def _bar_html(share: float) -> str:
    return (
        f"<div style='height:.5em;border-radius:.2em;width:{100.0 * share:.0f}%;"
        f"background:{palette.css(palette.BUSY)}'></div>"
    )
