"""Legend of the scene's colours."""

from __future__ import annotations

from dashboard import palette
from dashboard.scene.certainty import UNCERTAIN_SIGMA

LEGEND_ENTRIES = (
    (palette.ROPE, "rope, observed"),
    (palette.UNCERTAIN, f"rope, uncertain by {1e3 * UNCERTAIN_SIGMA:.0f} mm or more"),
    (palette.UNOBSERVED, "rope, not observed but estimated"),
    (palette.PREDICTION, "prediction (brighter is later)"),
    (palette.PATH, "planned path of the grips (dashed), and ropes along it"),
    (palette.GOAL, "goal (thinner than the rope)"),
    (palette.TRUTH, "true rope of the simulation (inside the perceived one)"),
    (palette.SUPPORT, "support: the rope may rest on it"),
)
"""Colours and their meanings."""


def legend_html() -> str:
    """HTML of the legend."""
    rows = "".join(
        f"<div style='display:flex;gap:.6em;align-items:center'><span style='width:1.1em;height:"
        f".35em;border-radius:.2em;background:{palette.css(color)}'></span>{text}</div>"
        for color, text in LEGEND_ENTRIES
    )
    return f"<div style='margin:.5em 1em;font-size:.8em;line-height:1.7;opacity:.9'>{rows}</div>"
