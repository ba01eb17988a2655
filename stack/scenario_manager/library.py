"""Scenarios that a stack can start: the shipped ones, the one it was started with, saved ones.

A saved scenario `NAME` is the file `NAME/NAME.toml` in the folder of saved scenarios, beside the
CSV files that it names.
"""

from __future__ import annotations

import re
import shutil
from os.path import realpath
from pathlib import Path

from lariat.configuration import ConfigurationError
from lariat.files.bounded_file import path_inside
from lariat.scenario import SIDES, Scenario, load
from lariat.scenario.settings import with_settings
from lariat.scenario.shipped import SHIPPED_FOLDER
from shared.messages import ScenarioEntry

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,39}")
"""Names of saved scenarios."""
MAX_SAVED = 100
"""Largest number of saved scenarios [-]."""


class ScenarioLibrary:
    """Scenarios by their names."""

    def __init__(self, folder: Path, first: Path) -> None:
        """List the scenarios; the stack was started with the first."""
        self._folder = folder
        self._first = first
        self._paths: dict[str, Path] = {}
        self.entries: tuple[ScenarioEntry, ...] = ()
        """All scenarios that can be read: saved ones first, by name."""
        self.read()

    def read(self) -> None:
        """Read the folders again; a file that is no scenario is left out."""
        saved = {p.name: p / f"{p.name}.toml" for p in sorted(self._folder.glob("*"))}
        shipped = {p.stem: p for p in sorted(SHIPPED_FOLDER.glob("*.toml"))}
        self._paths = {**saved, **shipped}
        # realpath, unlike resolve, takes links that lead in a circle.
        if realpath(self._first) not in map(realpath, self._paths.values()):
            self._paths[str(self._first)] = self._first
        entries = []
        for name, path in self._paths.items():
            try:
                scenario = load(path)
            except ConfigurationError:
                continue
            entries.append(
                ScenarioEntry(
                    name=name,
                    description=scenario.description,
                    own=name in saved,
                    real_arms=real_arms(scenario),
                )
            )
        self.entries = tuple(entries)

    def find(self, name: str) -> Path:
        """Return the file of a scenario."""
        if name not in self._paths:
            raise ConfigurationError(f"there is no scenario {name!r}; choose one of the list")
        return self._paths[name]

    def name_of(self, path: Path) -> str:
        """Return the name of a scenario's file; empty for one that is not listed."""
        names = {realpath(p): name for name, p in self._paths.items()}
        return names.get(realpath(path), "")

    def save(self, scenario: Scenario, name: str) -> None:
        """Save a scenario; one that was saved under this name before is replaced."""
        if not NAME.fullmatch(name):
            raise ConfigurationError(
                f"{name!r} is no name of a scenario; take up to 40 small letters, digits, - and _"
            )
        if (SHIPPED_FOLDER / f"{name}.toml").exists():
            raise ConfigurationError(f"{name!r} is a shipped scenario; take another name")
        saved = [entry.name for entry in self.entries if entry.own]
        if name not in saved and len(saved) >= MAX_SAVED:
            raise ConfigurationError(f"{MAX_SAVED} scenarios are saved; delete one first")
        write(with_settings(scenario, [f'name="{name}"']), self._folder / name, name)
        self.read()

    def delete(self, name: str) -> None:
        """Delete a saved scenario with its folder."""
        if not any(entry.own and entry.name == name for entry in self.entries):
            raise ConfigurationError(f"there is no saved scenario {name!r}")
        shutil.rmtree(self._folder / name)
        self.read()


def write(scenario: Scenario, folder: Path, name: str) -> Path:
    """Write a scenario and the CSV files that it names to a folder, and return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    for name_of_file in scenario.shape_files:
        source, target = path_inside(scenario.folder, name_of_file), folder / name_of_file
        if realpath(source) != realpath(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    robots = {
        side: (scenario.folder / scenario.end(side).urdf).resolve()
        for side in SIDES
        if scenario.end(side).urdf
    }
    # A robot's description names meshes beside it, so that it stays where it is.
    settings = [f'ends.{side}.urdf="{path}"' for side, path in robots.items()]
    text = with_settings(scenario, settings).text
    path, part = folder / f"{name}.toml", folder / f"{name}.toml.part"
    part.write_text(text)
    part.replace(path)
    return path


def real_arms(scenario: Scenario) -> list[str]:
    """Return the addresses of the real arms that a scenario drives, each once."""
    return sorted({scenario.end(side).address for side in SIDES} - {""})
