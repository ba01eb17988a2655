"""Colours of the page; a colour has the same meaning everywhere, in both themes."""

from __future__ import annotations

Color = tuple[int, int, int]
"""Red, green, blue, 0…255."""

# Page.
BRAND: Color = (38, 112, 196)
"""Main buttons, and grippers that move."""
NEUTRAL: Color = (66, 74, 88)
"""Buttons for less frequent actions."""
BACKGROUND_TOP: Color = (38, 46, 58)
"""Upper edge of the scene's background."""
BACKGROUND_BOTTOM: Color = (14, 17, 22)
"""Lower edge of the scene's background."""
LIGHT_TOP: Color = (238, 242, 247)
"""Upper edge of the background of the light theme."""
LIGHT_BOTTOM: Color = (188, 197, 209)
"""Lower edge of the background of the light theme."""

# Scene.
ROPE: Color = (250, 160, 30)
"""Perceived rope where its standard deviation is small."""
UNCERTAIN: Color = (226, 74, 74)
"""Perceived rope where its standard deviation is large."""
UNOBSERVED: Color = (150, 158, 170)
"""Perceived rope where it was estimated without an observation."""
STRAIGHT: Color = (44, 82, 190)
"""Perceived rope, coloured by its curvature, where it is straight."""
BENT: Color = (250, 228, 70)
"""Perceived rope, coloured by its curvature, where it is bent."""
OTHER_ROPE: Color = (232, 208, 80)
"""Rope beside the held one."""
PREDICTION: Color = (30, 130, 255)
"""Predicted ropes of the horizon."""
PATH: Color = (150, 84, 255)
"""Planned path of the grips, and ropes along it."""
GOAL: Color = (40, 210, 120)
"""Goal shape, and preview of a reachable goal."""
FREE: Color = (150, 158, 170)
"""Rest of a preview of which only a stretch counts."""
UNREACHABLE: Color = (240, 84, 84)
"""Preview of a goal that the rope cannot reach."""
TRUTH: Color = (240, 120, 200)
"""Simulated true rope."""
OPENED_RUN: Color = (240, 240, 240)
"""Rope of a recorded run that was opened."""
OBSTACLE: Color = (128, 136, 148)
"""Obstacle that the rope must not touch."""
SUPPORT: Color = (124, 104, 76)
"""Obstacle that the rope may rest on."""
REGION: Color = (70, 170, 150)
"""Edges of a region that the rope must not leave."""
CAMERA: Color = (120, 130, 145)
"""Frustum of the camera."""
GRIPPER_JAW: Color = (206, 213, 224)
"""Both jaws of a gripper."""
GRID: Color = (52, 60, 72)
"""Fine lines on the table."""
GRID_SECTION: Color = (82, 93, 110)
"""Coarse lines on the table."""
TABLE: Color = (24, 28, 35)
"""Table and other half spaces."""

# States.
GOOD: Color = (64, 206, 132)
"""Ready, reached, healthy."""
BUSY: Color = (92, 170, 255)
"""In motion."""
WARNING: Color = (246, 178, 70)
"""Needs attention."""
BAD: Color = (240, 84, 84)
"""Failed, refused, silent."""
QUIET: Color = (138, 147, 160)
"""Idle or unknown."""


def css(color: Color, opacity: float = 1.0) -> str:
    """CSS notation of a colour."""
    return f"rgba({color[0]},{color[1]},{color[2]},{opacity:g})"


def text_css(color: Color) -> str:
    """CSS notation of a text's colour, darker in the light theme."""
    red, green, blue = (round(0.55 * c) for c in color)
    return f"light-dark({css((red, green, blue))},{css(color)})"


def linear(color: Color) -> Color:
    """Colour that must be assigned to a line for it to appear as `color`.

    The renderer interprets the colours of lines as linear light instead of sRGB.
    """
    red, green, blue = (round(255.0 * (c / 255.0) ** 2.2) for c in color)
    return red, green, blue
