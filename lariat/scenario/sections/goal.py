"""Goals: shapes of a scenario's file, and goals with all nodes and grips, which runs work towards.

What of a goal counts is declared once, in `GoalTerms`; files, messages, controller, planner and
pages pass it on as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np
from jaxtyping import Bool, Float64

from lariat.configuration import Bounds
from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.scenario.entries import numbers
from lariat.scenario.sections.quantities import SIDES, Position, Quaternion, Side

MIN_PART_NODES = 3
"""Least number of nodes of a part that has a shape."""


@dataclass(frozen=True, kw_only=True)
class GoalTerms:
    """Terms of a goal: what of it counts, beside nodes and grips."""

    part: Annotated[tuple[float, float], Bounds(0.0, 20.0, "m")] | None = None
    """Ends of the part that counts, along the rope from the left grip; the rest is free. `nodes`
    then gives the part or a whole rope, `line` the grips of a rope at rest that has it."""
    ends_only: bool = False
    """Whether the ends' poses in `line` are the whole goal; the shape is free."""
    turns: Annotated[float, Bounds(-10.0, 10.0)] = 0.0
    """Twist of the right end relative to the left one, in whole turns."""
    route: tuple[str, ...] = ()
    """Clips through which the rope is laid and pegs that it passes between its ends in `line`, from
    left to right: the name of a clip, or `left of NAME` or `right of NAME` for an obstacle that the
    rope passes. What was laid stays laid."""

    def __post_init__(self) -> None:
        if self.route and self.leaves_free:
            raise ValueError(f"route and {self.leaves_free} exclude each other")
        if self.ends_only and self.part is not None:
            raise ValueError("ends_only and part exclude each other")

    @property
    def terms(self) -> dict[str, Any]:
        """Terms by name."""
        return {name: getattr(self, name) for name in TERMS}

    @property
    def leaves_free(self) -> str:
        """Name of the term that leaves something of the rope free; empty for a whole shape."""
        return "part" if self.part is not None else "ends_only" if self.ends_only else ""


TERMS = tuple(term.name for term in fields(GoalTerms))
"""Names of the terms."""


@dataclass(frozen=True)
class Shape(GoalTerms):
    """Shape of the rope, by two grips between which it rests, or by its nodes."""

    line: tuple[Position, Position] | None = None
    """Positions of the left and the right grip; the rope rests between them."""
    nodes: str | tuple[Position, ...] = ""
    """Rows x, y, z [m], left end first: themselves, or the name of their CSV file in the scenario's
    folder. In Python an array, which takes the place of `line`."""
    scale: Annotated[float, Bounds(1e-6, 1e6)] = 1.0
    """Factor of the numbers of `nodes`; 0.001 for millimetres."""
    left_orientation: Quaternion | None = None
    """Orientation of the left grip; by default along the rope."""
    right_orientation: Quaternion | None = None
    """Orientation of the right grip; by default along the rope."""

    def __post_init__(self) -> None:
        if isinstance(self.nodes, np.ndarray):
            if self.nodes.ndim != 2 or self.nodes.shape[1] != 3:
                raise ValueError(f"nodes have shape {self.nodes.shape}; give rows of x, y, z [m]")
            object.__setattr__(self, "nodes", tuple(map(tuple, self.nodes.astype(float).tolist())))
            object.__setattr__(self, "line", None)
        if (self.line is None) == (not self.nodes):
            raise ValueError("give either line = [[x, y, z], [x, y, z]] or nodes = 'FILE.csv'")
        if self.ends_only and self.line is None:
            raise ValueError("ends_only goes with line, the positions of both ends")
        if self.route and self.line is None:
            raise ValueError("route goes with line, the positions of both ends")
        super().__post_init__()
        if self.part is not None and self.part[0] >= self.part[1]:
            raise ValueError(f"part = {list(self.part)} ends before it begins")

    @property
    def leaves_grips_open(self) -> bool:
        """Whether it gives the nodes of a part only, which do not tell the grips."""
        return self.part is not None and bool(self.nodes)

    @property
    def file(self) -> str:
        """Name of the CSV file with the nodes; empty where there is none."""
        return self.nodes if isinstance(self.nodes, str) else ""


@dataclass(frozen=True)
class Goal(GoalTerms):
    """Wanted shape of the rope and the grips that go with it."""

    nodes: Float64[np.ndarray, "n 3"]
    """Nodes of the rope [m]; empty in a request for the rod at rest between the grips."""
    left: Pose
    """Left grip."""
    right: Pose
    """Right grip."""
    left_oriented: bool = False
    """Whether the orientation of the left grip is part of the goal."""
    right_oriented: bool = False
    """Whether the orientation of the right grip is part of the goal."""

    @property
    def grips(self) -> tuple[Pose, Pose]:
        """Left and right grip."""
        return self.left, self.right

    @property
    def oriented(self) -> tuple[bool, bool]:
        """Whether the orientations of the left and the right grip are part of the goal."""
        return self.left_oriented, self.right_oriented

    @property
    def counted(self) -> Bool[np.ndarray, "n"]:
        """Nodes whose distances from the goal count."""
        if self.ends_only:
            return polylines.ends_of(len(self.nodes))
        if self.part is not None:
            return polylines.within(self.nodes, *self.part)
        return np.ones(len(self.nodes), dtype=bool)

    @property
    def curve(self) -> Float64[np.ndarray, "k 3"]:
        """Nodes that are drawn [m].

        They are those that count; of a goal of the ends alone, the shape in which the rod would
        rest.
        """
        return self.nodes if self.ends_only else self.nodes[self.counted]

    def angle(self, nodes: Float64[np.ndarray, "n 3"]) -> float:
        """Return the largest angle of a rope's ends from a goal that they alone make up [rad].

        It is that of the tangents; a rotation about the rope's axis does not count. From a goal
        with a shape, the angle is zero.

        Args:
            nodes: Nodes of the rope [m].
        """
        if not self.ends_only or len(nodes) < 2:
            return 0.0
        grips = np.array([grip.orientation for grip in self.grips])
        angles = polylines.end_angles(nodes, grips)
        return float(np.max(angles, where=np.array(self.oriented), initial=0.0))

    def completed(self, shape: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
        """Return the nodes of the goal [m], of which those that do not count are a shape's."""
        return np.where(self.counted[:, None], self.nodes, shape)

    def entry(
        self, oriented: Sequence[Side], nodes: str | list[list[float]] = ""
    ) -> dict[str, Any]:
        """Return the `[goal]` of a scenario file, to which `Shape` is the way back.

        Args:
            oriented: Sides whose orientations it gives.
            nodes: The nodes, or the name of their table; without them, the grips give the shape.
        """
        line = [numbers(grip.position) for grip in self.grips]
        by_ends = self.ends_only or self.route or not nodes
        table: dict[str, Any] = {"line": line} if by_ends else {"nodes": nodes}
        for term in fields(GoalTerms):
            value = getattr(self, term.name)
            if value != term.default:
                table[term.name] = numbers(value) if term.name == "part" else value
        if self.route:
            table["route"] = list(self.route)
        grips = dict(zip(SIDES, self.grips, strict=True))
        return table | {f"{s}_orientation": numbers(grips[s].orientation) for s in oriented}
