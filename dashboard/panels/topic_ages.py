"""Ages of the topics as their readers see them."""

from __future__ import annotations

from collections.abc import Mapping

from dashboard import palette
from dashboard.markup import escaped
from dashboard.subscriptions import STALE_AGE
from shared.messages import Health


def oldest_ages(health: Mapping[str, tuple[Health, float]]) -> dict[str, tuple[float, str]]:
    """Return the largest age of each topic, and the reader that sees it, of messages with ages."""
    ages: dict[str, tuple[float, str]] = {}
    for name, (message, _) in health.items():
        for key, milliseconds in message.input_age_ms.items():
            ages[key] = max(ages.get(key, (-1.0, "")), (1e-3 * milliseconds, name))
    return dict(sorted(ages.items()))


def ages_html(health: Mapping[str, tuple[Health, float]]) -> str:
    """HTML table of topics with their largest age, coloured from `STALE_AGE` on."""
    rows = []
    for key, (age, reader) in oldest_ages(health).items():
        color = palette.css(palette.WARNING if age > STALE_AGE else palette.QUIET)
        text = f"{1e3 * age:.0f} ms" if age < 1.0 else f"{age:.1f} s"
        rows.append(
            f"<tr><td>{escaped(key)}</td>"
            f"<td style='text-align:right;color:{color}'>{escaped(text)}</td>"
            f"<td style='opacity:.65'>{escaped(reader.replace('_', ' '))}</td></tr>"
        )
    if not rows:
        return ""
    style = "font-size:.78em;border-spacing:.7em .15em;font-variant-numeric:tabular-nums"
    head = "<div style='font-size:.85em;margin:.4em 1em 0'>Age of each topic, at its reader</div>"
    return f"{head}<table style='{style}'>{''.join(rows)}</table>"
