"""The sections of a scenario file: keys, units, bounds and defaults."""

from __future__ import annotations

from lariat.scenario.sections.clips import Clip
from lariat.scenario.sections.control import (
    CONTROL_METHODS,
    PATH_PLANNERS,
    STATE_ESTIMATORS,
    Control,
    PaperControl,
)
from lariat.scenario.sections.ends import DRIVERS, OWN_PROTOCOL_DRIVERS, End, Ends
from lariat.scenario.sections.goal import MIN_PART_NODES, Goal, Shape
from lariat.scenario.sections.limits import Limits
from lariat.scenario.sections.plant import Plant, Slip, TrueGrip, TrueGrips
from lariat.scenario.sections.quantities import (
    SIDES,
    Color,
    Meters,
    Position,
    Quaternion,
    Side,
    Vector,
)
from lariat.scenario.sections.rope import PlantRope, Rope
from lariat.scenario.sections.ros2 import Ros2, Ros2Topic
from lariat.scenario.sections.run import Event, Recording, Run
from lariat.scenario.sections.scene import Obstacle, Region, Waypoint
from lariat.scenario.sections.sensing import (
    PERCEPTION_METHODS,
    FlangeMarker,
    Sensing,
    check_resolution,
)

__all__ = [
    "CONTROL_METHODS",
    "DRIVERS",
    "MIN_PART_NODES",
    "OWN_PROTOCOL_DRIVERS",
    "PATH_PLANNERS",
    "PERCEPTION_METHODS",
    "SIDES",
    "STATE_ESTIMATORS",
    "Clip",
    "Color",
    "Control",
    "End",
    "Ends",
    "Event",
    "FlangeMarker",
    "Goal",
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
    "Ros2",
    "Ros2Topic",
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
