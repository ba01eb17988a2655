"""Short names of shipped scenarios: `three-cylinders` is `scenarios/three-cylinders.toml`."""

from __future__ import annotations

from pathlib import Path

from lariat.configuration import ConfigurationError
from lariat.suggestion import did_you_mean, did_you_mean_file

_INSTALLED_FOLDER = Path(__file__).parent / "files"
SHIPPED_FOLDER = (
    _INSTALLED_FOLDER if _INSTALLED_FOLDER.is_dir() else Path(__file__).parents[2] / "scenarios"
)
"""Folder of the shipped scenarios: of the wheel, else of the clone."""


def shipped_names() -> tuple[str, ...]:
    """Return the short names of the shipped scenarios, in alphabetical order."""
    return tuple(sorted(path.stem for path in SHIPPED_FOLDER.glob("*.toml")))


def find(name_or_path: Path | str) -> Path:
    """Return the file of a scenario that is given by its path or its short name.

    Args:
        name_or_path: An existing file, or the name of a shipped scenario with or without `.toml`.

    Raises:
        ConfigurationError: There is no such file and no such shipped scenario.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    is_name = path.name == str(path)
    shipped_file = SHIPPED_FOLDER / path.with_suffix(".toml").name
    if is_name and path.suffix in ("", ".toml") and shipped_file.is_file():
        return shipped_file
    problem = "it is a folder" if path.is_dir() else "no such file"
    names = shipped_names()
    meant = did_you_mean(path.stem, names) if is_name else did_you_mean_file(path)
    shipped = f" shipped scenarios: {', '.join(names)}" if names else ""
    hint = f";{meant}{shipped}" if meant or shipped else ""
    raise ConfigurationError(f"cannot read scenario {path}: {problem}{hint}")
