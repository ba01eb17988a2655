"""Arms whose URDF and meshes the package `example-robot-data` carries, and arms of the guide."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path

from lariat.scenario import Scenario, load, parse


@dataclass(frozen=True)
class Robot:
    """Arm, and its place in the cell of `scenarios/fixed-end.toml`."""

    name: str
    urdf: str
    """URDF, in the package's folder of robots."""
    flange: str
    joint_count: int
    base_position: tuple[float, float, float]
    base_orientation: tuple[float, float, float, float]
    tool_position: tuple[float, float, float]
    tool_orientation: tuple[float, float, float, float]

    @property
    def path(self) -> Path:
        """File of the URDF."""
        suffix = f"example-robot-data/robots/{self.urdf}"
        files = distribution("example-robot-data").files or []
        return Path(str(next(f for f in files if str(f).endswith(suffix)).locate())).resolve()

    def settings(self, side: str) -> tuple[str, ...]:
        """Settings that put the simulated arm at one end."""
        return (
            f"ends.{side}.driver=simulated",
            f"ends.{side}.urdf={self.path}",
            f"ends.{side}.flange={self.flange}",
            f"ends.{side}.base_position={list(self.base_position)}",
            f"ends.{side}.base_orientation={list(self.base_orientation)}",
            f"ends.{side}.tool_position={list(self.tool_position)}",
            f"ends.{side}.tool_orientation={list(self.tool_orientation)}",
        )


UR5 = Robot(
    "UR5",
    "ur_description/urdf/ur5_robot.urdf",
    "tool0",
    6,
    (0.65, 0.0, 0.0),
    (0.0, 0.0, 0.0, 1.0),
    (0.0, 0.0, 0.12),
    (0.0, 1.0, 0.0, 0.0),
)
"""UR5 behind the rope's end, whose gripper points back along the rope."""
PANDA = Robot(
    "Panda",
    "panda_description/urdf/panda.urdf",
    "panda_hand_tcp",
    7,
    (0.65, 0.0, 0.0),
    (0.0, 0.0, 0.0, 1.0),
    (0.0, 0.0, 0.0),
    (0.5, -0.5, 0.5, -0.5),
)
"""Panda whose hand holds the rope from above."""


def board_with_arms() -> Scenario:
    """Scenario `harness-board` with the CR5s that the guide puts in the place of its ends."""
    guide = (Path(__file__).parents[1] / "docs" / "guide" / "scenes.md").read_text()
    (arms,) = re.findall(r'```toml\n(\[ends\.left\]\ndriver = "cr5".*?)```', guide, re.DOTALL)
    board, ends = (
        load("harness-board"),
        "[ends.left]\nrotates = true\n\n[ends.right]\nrotates = true\n",
    )
    assert board.text.count(ends) == 1
    return parse(board.text.replace(ends, arms), board.folder)
