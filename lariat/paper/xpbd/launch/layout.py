"""Layout of the two arrays that the kernel works on, as in `lariat.rod.launch.layout`.

Slot 0 of a history is the initial state of a roll-out, slot t + 1 the state after step t. The tape
holds the inputs of every correction of a constraint, for the adjoint.
"""

from __future__ import annotations

from enum import IntEnum, auto


class Header(IntEnum):
    """Places of sizes and options in the integer array."""

    NODES = 0
    STEPS = auto()
    """Steps of the method: horizon times substeps."""
    SUBSTEPS = auto()
    ACTION_BLOCKS = auto()
    OBSTACLES = auto()
    ITERATIONS = auto()
    """J, sweeps over the constraints in each step."""
    TAPED = auto()
    """Whether the tape is written."""
    FIRST_NODE = auto()
    """First node that no grip places."""
    END_NODE = auto()
    FIRST_EDGE = auto()
    """First edge that no grip places."""
    END_EDGE = auto()
    LEFT_END = auto()
    """`EndHold` of the left end; that of the right end follows."""
    RIGHT_END = auto()
    CONTACT_LIMIT = auto()
    """Capacity for contacts in each step."""
    OBSTACLE_ROWS = auto()
    """Offset of the obstacles in the doubles."""
    STRIDE = auto()
    """Doubles of each rod."""


class Section(IntEnum):
    """Sections of a rod; the integer array holds their offsets from the start of the rod."""

    SCALARS = len(Header)
    REST_DARBOUX = auto()
    ACTIONS = auto()
    POSITIONS = auto()
    ORIENTATIONS = auto()
    VELOCITIES = auto()
    ANGULAR_VELOCITIES = auto()
    MULTIPLIERS = auto()
    CONTACT_MULTIPLIERS = auto()
    CONTACT_COUNTS = auto()
    CONTACTS = auto()
    PREDICTED_ORIENTATIONS = auto()
    STRETCH_TAPE = auto()
    BEND_TAPE = auto()
    CONTACT_TAPE = auto()
    COST_GRADIENT = auto()
    D_POSITIONS = auto()
    """Derivative of the cost with respect to the positions in the slot that the adjoint is at."""
    D_ORIENTATIONS = auto()
    D_VELOCITIES = auto()
    D_ANGULAR_VELOCITIES = auto()
    D_GRIPS = auto()
    D_NODES = auto()
    """Derivative of the cost with respect to the positions within a sweep."""
    D_EDGES = auto()
    D_NORMALS = auto()
    D_MULTIPLIERS = auto()
    D_CONTACT_MULTIPLIERS = auto()
    D_ACTIONS = auto()
    D_PARAMETERS = auto()


STEP_BLOCKS = len(Header) + len(Section)
"""Place in the integer array of the action block of the first step."""


class Scalar(IntEnum):
    """Places of a rod's constants in their section."""

    EDGE_LENGTH = 0
    STEP_DURATION = auto()
    GRAVITY_X = auto()
    GRAVITY_Y = auto()
    GRAVITY_Z = auto()
    RADIUS = auto()
    INVERSE_MASS = auto()
    INVERSE_INERTIA = auto()
    LINEAR_DAMPING = auto()
    ANGULAR_DAMPING = auto()
    BENDING_COMPLIANCE = auto()
    CONTACT_COMPLIANCE = auto()


class Parameter(IntEnum):
    """Places of the parameters' derivatives in their section."""

    MASS = 0
    INERTIA = auto()
    LINEAR_DAMPING = auto()
    ANGULAR_DAMPING = auto()
    BENDING_COMPLIANCE = auto()


STRETCH_TAPE_WIDTH = 8
"""Quaternion (4), change of the multiplier (3), factor of the normalization."""
BEND_TAPE_WIDTH = 13
"""Two quaternions (8), change of the multiplier (3), two factors of the normalization."""
CONTACT_WIDTH = 13
"""Node, row of the obstacle, whether the node enters it during the step, fraction of its ray up
to the entry, entry point (3), normal there (3), end of the ray (3)."""
CONTACT_TAPE_WIDTH = 5
"""Position of the node (3), change of the multiplier, whether the multiplier met its bound."""
PREDICTED_WIDTH = 5
"""Quaternion (4) and its norm before normalization."""
CONTACTS_PER_NODE = 3
"""Largest number of obstacles that a node touches in a step."""
