"""Results of the checklist, kept beside the cell's file: `cell.commissioning.json`."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from lariat.configuration import ConfigurationError
from lariat.files.bounded_file import read_file
from lariat.scenario import Scenario

PASSED, FAILED, OPEN = "passed", "failed", "open"
"""Outcomes of a step; one is open that has no meaning for the cell as it runs now."""
MAX_SIZE = 2**20
"""Largest file of results [bytes]."""


@dataclass(frozen=True)
class Result:
    """Result of one step."""

    outcome: str
    """One of `PASSED`, `FAILED` and `OPEN`."""
    detail: str
    """What was found."""
    when: str
    """Local time, ISO 8601."""
    settings: str
    """Fingerprint of the settings for which it holds."""


class CommissioningRecord:
    """Results of all steps by name, written with every change."""

    def __init__(self, path: Path) -> None:
        """Read what is there.

        Args:
            path: File of the results.

        Raises:
            ConfigurationError: The file is damaged.
        """
        self.path = path
        self.results: dict[str, Result] = {}
        if path.exists():
            try:
                rows = json.loads(read_file(path, MAX_SIZE))["steps"]
                self.results = {name: Result(**row) for name, row in rows.items()}
            except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
                raise ConfigurationError(
                    f"cannot read {path}: {error}; move it away to begin anew"
                ) from error

    def holds(self, name: str, settings: str) -> bool:
        """Return whether a step has passed with these settings."""
        result = self.results.get(name)
        return result is not None and result.outcome == PASSED and result.settings == settings

    def put(self, name: str, result: Result) -> None:
        """Keep the result of a step."""
        self.results[name] = result
        rows = {name: asdict(result) for name, result in self.results.items()}
        text = json.dumps({"version": 1, "steps": rows}, indent=2, ensure_ascii=False) + "\n"
        half = self.path.with_suffix(".part")
        half.write_text(text)
        half.replace(self.path)


def record_path(scenario_file: Path) -> Path:
    """Return the file of the results of a cell's file."""
    return scenario_file.with_suffix(".commissioning.json")


def fingerprint(scenario: Scenario, keys: tuple[str, ...]) -> str:
    """Return a fingerprint of sections of a scenario: a result holds as long as they stay."""
    text = repr([getattr(scenario, key) for key in keys])
    return hashlib.sha256(text.encode()).hexdigest()[:16]
