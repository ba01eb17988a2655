"""Lock of every dependency with its hashes, for `make` and for each image: `make lock`.

`dev.txt` locks all that a clone installs; the file of an image is the part of it that the image
installs, and `build.txt` what installs the packages of this repository. PyTorch is left out,
because its build is the user's choice; its dependencies are locked.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

FOLDER = Path(__file__).parent
"""Folder of the locks."""
IMAGES = (
    "build",
    "router",
    "rod",
    "sim",
    "camera",
    "ros2",
    "perception",
    "network",
    "robot_gateway",
    "recorder",
    "dashboard",
    "cli",
)
"""Images and stages of their build with a lock of their own; planner and emulator take the lock of
`robot_gateway`, the controller that of `router`, or of `network`."""
EXTRAS = {"sim": "simulation", "network": "torch", "robot_gateway": "planning"}
"""Extra of an image, where its name is another one."""
COMPILING = ("all", "dev", "rod")
"""What translates kernels; images hold those that the stage `rod` has compiled."""
TRANSLATORS = ("quadrants", "taichi")
"""Beginnings of the library's requirements that translate kernels."""
BUILD_REQUIREMENTS = ("editables", "hatchling", "pip", "setuptools", "wheel")
"""Packages with which the packages of this repository are installed, without a build environment
from outside."""
HEADER = "# Made by `make lock` from pyproject.toml; not edited by hand.\n"
"""First line of a lock."""


def main() -> None:
    """Write all locks."""
    _lock("dev", requirements("dev"), None)
    for image in ("all", *IMAGES):
        _lock(image, requirements(image), FOLDER / "dev.txt")


def requirements(image: str) -> set[str]:
    """Return the requirements of an image or a stage of its build, of `all` or of `dev`."""
    if image == "build":
        return set(BUILD_REQUIREMENTS)
    project = tomllib.loads((FOLDER.parent / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    pending = [*project["dependencies"], *extras["bus"]]
    pending += extras.get(EXTRAS.get(image, image), ())
    kept: set[str] = set(BUILD_REQUIREMENTS) if image in ("all", "dev") else set()
    while pending:
        requirement = pending.pop()
        own = re.match(r"lariat\[(.*)\]", requirement)
        if own:
            pending += [each for name in own[1].split(",") for each in extras[name]]
        elif image in COMPILING or not requirement.startswith(TRANSLATORS):
            kept.add(requirement)
    return kept


def _lock(name: str, required: set[str], constraint: Path | None) -> None:
    source, target = FOLDER / f".{name}.in", FOLDER / f"{name}.txt"
    lines = sorted(required)
    if constraint is not None:
        lines.append(f"--constraint {constraint.name}")
    source.write_text("\n".join(lines) + "\n")
    # Locks once made are kept where they still fit: a lock is renewed by deleting it first.
    command = [sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--generate-hashes"]
    # One lock for every Python that Lariat runs on: markers say where an entry belongs.
    command += ["--universal", "--fork-strategy", "fewest", "--python-version", "3.11"]
    command += ["--no-header", "--no-annotate", "--output-file", str(target), str(source)]
    try:
        subprocess.run(command, check=True, cwd=FOLDER)
    finally:
        source.unlink()
    target.write_text(HEADER + without_torch(target.read_text()))
    print(f"{target}: {target.read_text().count('==')} packages")


def _entries(lock: str) -> list[str]:
    """Entries of a lock: a package's line, and the lines of its hashes; comments are left out."""
    lines = [line for line in lock.splitlines() if line and not line.startswith("#")]
    return re.split(r"\n(?=[A-Za-z0-9])", "\n".join(lines))


def without_torch(lock: str) -> str:
    """Return a lock without PyTorch and what only its GPU builds need."""
    kept = [
        e for e in _entries(lock) if not re.match(r"(torch|triton|nvidia-[\w-]+|cuda-[\w-]+)==", e)
    ]
    return "\n".join(kept).rstrip() + "\n"


if __name__ == "__main__":
    main()
