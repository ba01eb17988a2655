"""The sections of a scenario file: keys, units, bounds and defaults."""

from __future__ import annotations

from shared.scenario.sections.control import (
    CONTROL_METHODS,
    PATH_PLANNERS,
    STATE_ESTIMATORS,
    Control,
    PaperControl,
)
from shared.scenario.sections.ends import (
    DRIVERS,
    OWN_PROTOCOL_DRIVERS,
    End,
    Ends,
)
from shared.scenario.sections.limits import (
    Limits,
)
from shared.scenario.sections.plant import (
    Plant,
    PlantRope,
    Slip,
    TrueGrip,
    TrueGrips,
)
from shared.scenario.sections.quantities import (
    SIDES,
    Color,
    Meters,
    Position,
    Quaternion,
    Side,
    Vector,
)
from shared.scenario.sections.rope import (
    Rope,
)
from shared.scenario.sections.run import (
    Event,
    Recording,
    Run,
)
from shared.scenario.sections.scene import (
    Obstacle,
    Region,
    Shape,
    Waypoint,
)
from shared.scenario.sections.sensing import (
    PERCEPTION_METHODS,
    FlangeMarker,
    Sensing,
    check_resolution,
)

__all__ = [
    "CONTROL_METHODS",
    "DRIVERS",
    "OWN_PROTOCOL_DRIVERS",
    "PATH_PLANNERS",
    "PERCEPTION_METHODS",
    "SIDES",
    "STATE_ESTIMATORS",
    "Color",
    "Control",
    "End",
    "Ends",
    "Event",
    "FlangeMarker",
    "Limits",
    "Meters",
    "Obstacle",
    "PaperControl",
    "Plant",
    "PlantRope",
    "Position",
    "Quaternion",
    "Recording",
    "Region",
    "Rope",
    "Run",
    "Sensing",
    "Shape",
    "Side",
    "Slip",
    "TrueGrip",
    "TrueGrips",
    "Vector",
    "Waypoint",
    "check_resolution",
]
