"""Colours of the page, dark theme; one meaning a colour, everywhere."""

from __future__ import annotations

Color = tuple[int, int, int]
"""Red, green, blue, 0…255."""

BRAND: Color = (38, 112, 196)
NEUTRAL: Color = (66, 74, 88)
"""Of buttons that are rarely the next thing to press."""
SKY: Color = (38, 46, 58)
"""Top of the background."""
GROUND: Color = (14, 17, 22)
"""Bottom of the background."""

ROPE: Color = (250, 160, 30)
"""Rope as seen, precisely."""
VAGUE: Color = (226, 74, 74)
"""Rope as seen, where its standard deviation is large."""
BRIDGED: Color = (150, 158, 170)
"""Rope that was not seen, only bridged."""
PREDICTION: Color = (30, 130, 255)
PATH: Color = (150, 84, 255)
GOAL: Color = (40, 210, 120)
REFUSED: Color = (240, 84, 84)
TRUTH: Color = (240, 120, 200)
OBSTACLE: Color = (128, 136, 148)
SUPPORT: Color = (124, 104, 76)
SELECTED: Color = (190, 204, 226)
CAMERA: Color = (120, 130, 145)
GRID: Color = (52, 60, 72)
GRID_SECTION: Color = (82, 93, 110)
TABLE: Color = (24, 28, 35)

GOOD: Color = (64, 206, 132)
BUSY: Color = (92, 170, 255)
WARNING: Color = (246, 178, 70)
BAD: Color = (240, 84, 84)
QUIET: Color = (138, 147, 160)


def css(color: Color, opacity: float = 1.0) -> str:
    """The colour for HTML."""
    return f"rgba({color[0]},{color[1]},{color[2]},{opacity:g})"


def unlit(color: Color) -> Color:
    """What lines must be given to look like the colour: they take it for linear light."""
    red, green, blue = (round(255.0 * (c / 255.0) ** 2.2) for c in color)
    return red, green, blue
