"""Goals as files: two for each, in a folder beside the recordings.

`NAME.json` holds the whole goal, and `NAME.csv` its nodes below the `goal` of a scenario that it
makes ([goal_table.py](../../../lariat/scenario/goal_table.py)), which "Load shape" reads too.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from google.protobuf.json_format import MessageToJson, Parse

from lariat.files.bounded_file import read_file
from lariat.scenario.goal_table import goal_table
from services.recorder.private_folder import make_folder
from shared.door import Door
from shared.messages import Goal, SavedGoal, goal_of
from shared.messages.checks.task import check_goal

FOLDER = "goals"
"""Name of the folder inside that of the recordings."""
NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,39}")
"""Names of goals."""
MAX_GOALS = 50
"""Largest number of goals [-]."""
MAX_FILE_SIZE = 2**20
"""Largest size of a goal's file [bytes]."""


class GoalFolder:
    """Named goals of a folder of recordings."""

    def __init__(self, recordings: Path, door: Door) -> None:
        self._door = door
        self._recordings = recordings
        self._folder = recordings / FOLDER
        self._goals: dict[str, SavedGoal] = {}

    @property
    def goals(self) -> list[SavedGoal]:
        """Goals by name."""
        return [self._goals[name] for name in sorted(self._goals)]

    def load(self) -> None:
        """Read the goals; a file that is none is left out and logged."""
        for path in sorted(self._folder.glob("*.json"))[:MAX_GOALS]:
            with self._door.guard(f"{path} in the list of goals"):
                saved = Parse(read_file(path, MAX_FILE_SIZE), SavedGoal())
                if saved.name != path.stem or not NAME.fullmatch(saved.name):
                    raise ValueError(f"it holds the goal {saved.name[:100]!r}")
                check_goal(saved.goal)
                self._goals[saved.name] = saved

    def save(self, name: str, scenario: str, goal: Goal) -> None:
        """Save a goal; one that was saved under this name before is replaced."""
        if not NAME.fullmatch(name):
            raise ValueError(
                f"{name[:60]!r} is no name of a goal; take up to 40 small letters, digits, - and _"
            )
        if name not in self._goals and len(self._goals) >= MAX_GOALS:
            raise ValueError(f"{MAX_GOALS} goals are saved; delete one first")
        if not goal.positions:
            raise ValueError("the goal has no nodes yet; wait for the controller")
        saved = SavedGoal(name=name, scenario=scenario, goal=goal)
        make_folder(self._recordings)
        make_folder(self._folder)
        (self._folder / f"{name}.csv").write_text(goal_table(goal_of(goal), name, scenario))
        path = self._folder / f"{name}.json"
        part = path.with_suffix(".part")
        part.write_text(MessageToJson(saved, preserving_proto_field_name=True))
        os.replace(part, path)
        self._goals[name] = saved

    def delete(self, name: str) -> None:
        """Delete a goal."""
        if name not in self._goals:
            raise ValueError(f"there is no goal {name[:60]!r}")
        for ending in ("json", "csv"):
            (self._folder / f"{name}.{ending}").unlink(missing_ok=True)
        del self._goals[name]
