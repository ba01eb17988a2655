"""Legend of the scene: what each shape and colour stands for."""

from __future__ import annotations

from typing import Literal, NamedTuple

from dashboard import palette
from dashboard.markup import escaped
from dashboard.palette import Color
from dashboard.scene.bending import LEAST_RADIUS
from dashboard.scene.certainty import UNCERTAIN_SIGMA

Shape = Literal["tube", "beads", "thin tube", "lines", "dashes", "block"]
"""Shape in which something is drawn, so that colours alone need not tell it."""


class LegendEntry(NamedTuple):
    """One line of the legend."""

    shape: Shape
    color: Color
    text: str


Coloring = Literal["certainty", "curvature"]
"""Quantity by which the perceived rope is coloured."""
COLORINGS: tuple[Coloring, ...] = ("certainty", "curvature")
"""All of them."""
ROPE_ENTRIES: dict[Coloring, tuple[LegendEntry, ...]] = {
    "certainty": (
        LegendEntry("tube", palette.ROPE, "rope, observed"),
        LegendEntry(
            "tube", palette.UNCERTAIN, f"rope, uncertain by {1e3 * UNCERTAIN_SIGMA:.0f} mm or more"
        ),
        LegendEntry("tube", palette.UNOBSERVED, "rope, not observed but estimated"),
    ),
    "curvature": (
        LegendEntry("tube", palette.STRAIGHT, "rope, straight"),
        LegendEntry(
            "tube", palette.BENT, f"rope, bent to a radius of {1e3 * LEAST_RADIUS:.0f} mm or less"
        ),
    ),
}
"""Lines about the perceived rope, by what it is coloured by."""
LEGEND_ENTRIES = (
    LegendEntry("beads", palette.UNCERTAIN, "beads: two standard deviations about each node"),
    LegendEntry("lines", palette.OTHER_ROPE, "other ropes (grey: remembered)"),
    LegendEntry("thin tube", palette.GOAL, "goal (thinner than the rope)"),
    LegendEntry("beads", palette.GOAL, "ends of what counts of a goal"),
    LegendEntry("thin tube", palette.FREE, "rest of that goal, which is free"),
    LegendEntry("thin tube", palette.TRUTH, "true rope of the simulation (inside the rope)"),
    LegendEntry("tube", palette.OPENED_RUN, "rope of an opened run, with its goal (thin)"),
    LegendEntry("lines", palette.PREDICTION, "prediction (brighter is later)"),
    LegendEntry("dashes", palette.PATH, "planned path of the grips"),
    LegendEntry("lines", palette.PATH, "ropes along the planned path"),
    LegendEntry("block", palette.OBSTACLE, "obstacle: the rope must not touch it"),
    LegendEntry("block", palette.SUPPORT, "support: the rope may rest on it"),
)
"""Lines below them."""


def legend_html(coloring: Coloring) -> str:
    """HTML of the legend."""
    rows = "".join(
        f"<div style='display:flex;gap:.7em;align-items:center'>{_swatch_html(e.shape, e.color)}"
        f"<span>{escaped(e.text)}</span></div>"
        for e in (*ROPE_ENTRIES[coloring], *LEGEND_ENTRIES)
    )
    return f"<div style='margin:.5em 1em;font-size:.8em;line-height:1.7;opacity:.9'>{rows}</div>"


def _swatch_html(shape: Shape, color: Color) -> str:
    """HTML of a sample of a shape."""
    css = palette.css(color)
    look = {
        "tube": f"height:.45em;border-radius:.25em;background:{css}",
        "beads": f"height:.8em;background:radial-gradient(circle,{css} 60%,transparent 62%) "
        "0 0/.8em .8em",
        "thin tube": f"height:.2em;border-radius:.1em;background:{css}",
        "lines": f"height:.5em;border:solid {css};border-width:1px 0",
        "dashes": f"height:0;border-top:2px dashed {css}",
        "block": f"height:.8em;border-radius:.15em;background:{css}",
    }[shape]
    return f"<span style='flex:none;width:1.6em;box-sizing:border-box;{look}'></span>"
