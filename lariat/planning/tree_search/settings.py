"""Settings of the tree search."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PassageSettings:
    """Effort of the search for narrow passages."""

    points: int = 300
    """Number of points that are sampled in each obstacle."""
    pairs: int = 20000
    """Number of pairs of these points that are compared."""
    width_range: tuple[float, float] = (0.015, 0.35)
    """Range of the distance between such a pair of points [m]."""
    candidates: int = 120
    """Largest number of places that are improved."""
    directions: int = 16
    """Number of directions of the rope that are compared at a place."""
    probe_share: float = 0.2
    """Half length of the piece of rope whose room is compared, in rope lengths [-]."""
    open_share: float = 0.3
    """Distance before and behind a place at which the openness of the scene is compared, in rope
    lengths [-]."""
    probes: int = 13
    """Number of points of that piece."""
    improvements: int = 60
    """Number of random changes of a place and its direction."""
    place_sigmas: tuple[float, float] = (0.012, 0.0005)
    """Standard deviations of the first and the last change of place along each axis [m]."""
    direction_sigmas: tuple[float, float] = (0.2, 0.01)
    """Standard deviations of the first and the last change of direction [rad]."""
    max_shift: float = 0.1
    """Largest distance of an improved place from where it was found [m]."""
    min_distance: float = 0.06
    """Distance of two passages above which both are kept [m]."""
    min_angle: float = 0.5
    """Angle between two passages above which both are kept [rad]."""
    count: int = 12
    """Largest number of passages."""


@dataclass(frozen=True)
class ThreadSettings:
    """Motions lengthwise through narrow passages."""

    taut_share: float = 0.96
    """Distance of the grips, relative to the longest permitted one [-]: the gateway asks that the
    rope reaches round what lies between the grips."""
    mouth: float = 0.03
    """Room beyond the margin with which a passage ends [m]."""
    max_depth: float = 0.3
    """Largest distance of a mouth from the middle of its passage [m]."""
    depth_probes: int = 31
    """Number of places at which the room is compared on the way to a mouth."""
    per_iteration: int = 4
    """Number of threads whose mouths a tree seeks in an iteration; all of them in its first."""


@dataclass(frozen=True)
class TreeSearchSettings:
    """Resolution, effort and samples of the tree search."""

    edge_length: float = 0.03
    """Length of an edge of the coarse rope [m], as far as its number of nodes permits."""
    node_counts: tuple[int, int] = (16, 40)
    """Least and largest number of nodes of the coarse rope."""
    step: float = 0.025
    """Motion of a grip in one step of the rod, rotation included by its lever arm [m]."""
    steps_per_extension: int = 5
    """Number of steps by which a tree grows towards a sample."""
    batch: int = 16
    """Number of samples of an iteration, which are rolled out in one launch."""
    connections: int = 4
    """Number of new nodes of an iteration that the other tree tries to reach."""
    max_connection_extensions: int = 10
    """Largest number of extensions in a row towards a node of the other tree."""
    jump: float = 4.0
    """Motion of a rope's node in a step, in steps of the grips, above which the rope snaps over to
    another shape and the tree does not grow [-]."""
    same_shape: float = 0.02
    """Mean node distance below which two shapes between the same grips are the same [m]."""
    start_relaxation: float = 1e-3
    """Clearance by which a path may fall short of that of start and goal, near them [m]."""
    relaxation_slope: float = 0.5
    """Increase of the required clearance with the rope's distance from start or goal [-]."""
    taut_share: float = 0.5
    """Share of the samples with a taut rope [-]."""
    taut_range: tuple[float, float] = (0.9, 0.995)
    """Range of the grip distance of taut samples, relative to the longest permitted one."""
    slack_range: tuple[float, float] = (0.2, 0.97)
    """Range of the grip distance of other samples, relative to the longest permitted one."""
    passage_share: float = 0.4
    """Share of the samples that lie in narrow passages, where there are any [-]."""
    passing_range: float = 0.65
    """Largest distance of the rope's middle from a passage along the rope, in grip distances; ends
    before and behind it count as passing [-]."""
    passages: PassageSettings = PassageSettings()
    """Effort of the search for narrow passages."""
    threads: ThreadSettings = ThreadSettings()
    """Motions lengthwise through them."""
    tilt_share: float = 0.4
    """Share of the samples in which ends that rotate are tilted against the chord [-]."""
    tilt: float = 0.5
    """Standard deviation of such a tilt about each axis [rad]."""
    margin_around: float = 0.15
    """Distance around start, goal and obstacles in which samples lie [m]."""
    shortcut_rounds: int = 14
    """Number of rounds in which shortcuts are tried."""
    shortcut_batch: int = 12
    """Number of shortcuts of a round."""


TREE_SEARCH_SETTINGS = TreeSearchSettings()
"""Default settings of the tree search."""
