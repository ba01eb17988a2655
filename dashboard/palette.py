"""Colours of the page (dark theme); a colour has the same meaning everywhere."""

from __future__ import annotations

Color = tuple[int, int, int]
"""Red, green, blue, 0…255."""

# Page.
BRAND: Color = (38, 112, 196)
"""Main buttons, driven grippers."""
NEUTRAL: Color = (66, 74, 88)
"""Buttons for less frequent actions."""
BACKGROUND_TOP: Color = (38, 46, 58)
BACKGROUND_BOTTOM: Color = (14, 17, 22)

# Scene.
ROPE: Color = (250, 160, 30)
"""Perceived rope where its standard deviation is small."""
UNCERTAIN: Color = (226, 74, 74)
"""Perceived rope where its standard deviation is large."""
UNOBSERVED: Color = (150, 158, 170)
"""Perceived rope where it was estimated without an observation."""
PREDICTION: Color = (30, 130, 255)
PATH: Color = (150, 84, 255)
GOAL: Color = (40, 210, 120)
UNREACHABLE: Color = (240, 84, 84)
"""Preview of a goal that the rope cannot take."""
TRUTH: Color = (240, 120, 200)
"""Simulated true rope."""
OBSTACLE: Color = (128, 136, 148)
SUPPORT: Color = (124, 104, 76)
"""Obstacle that the rope may rest on."""
CAMERA: Color = (120, 130, 145)
GRIPPER_JAW: Color = (206, 213, 224)
GRID: Color = (52, 60, 72)
GRID_SECTION: Color = (82, 93, 110)
TABLE: Color = (24, 28, 35)

# States.
GOOD: Color = (64, 206, 132)
BUSY: Color = (92, 170, 255)
WARNING: Color = (246, 178, 70)
BAD: Color = (240, 84, 84)
QUIET: Color = (138, 147, 160)
"""Nothing happens."""


def css(color: Color, opacity: float = 1.0) -> str:
    """CSS notation of a colour."""
    return f"rgba({color[0]},{color[1]},{color[2]},{opacity:g})"


def linear(color: Color) -> Color:
    """Colour to assign to a line for it to appear as `color`.

    The renderer takes the colours of lines for linear light instead of sRGB.
    """
    red, green, blue = (round(255.0 * (c / 255.0) ** 2.2) for c in color)
    return red, green, blue
