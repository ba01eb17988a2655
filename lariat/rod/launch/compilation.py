"""Has Taichi write the kernel as assembly, and makes a library of that; a process of its own.

A process of its own, for Taichi writes into the folder that a process runs in, says what it does on
standard output, and has to be told before it starts. What comes out answers as Taichi's kernel
does, or it is not kept.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod.launch import layout, machine_code, taichi_runtime
from lariat.rod.launch.buffers import Sheet
from lariat.rod.launch.inputs import Wanted, opened
from lariat.rod.properties import RodProperties
from lariat.rod.rod import Rod

WITHIN = 1e-9
"""How far answers may differ, in parts of the largest of their kind [-]."""


def main() -> None:
    """Make the library that is named on the command line."""
    target = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        library = assembled(Path(folder))
        moved = target.with_suffix(f".{os.getpid()}")
        moved.write_bytes(library.read_bytes())
        # At once there or not at all, whoever looks.
        moved.replace(target)


def assembled(folder: Path) -> Path:
    """A library with the kernel, made and tried in a folder which this process runs in.

    Raises:
        ValueError: Taichi wrote no such kernel, or it does not answer as Taichi's own does.
    """
    taichi_runtime.start(writes_assembly=True)
    from lariat.rod.kernels import rollout

    sheets = trials()
    own = [sheet.doubles.copy() for sheet in sheets]
    for sheet, doubles in zip(sheets, own, strict=True):
        taichi_runtime.launch(rollout.roll, sheet.integers, doubles, sheet.sizes.batch)
    written = [path.read_text() for path in sorted(folder.glob("*.s"))]
    source, symbol = None, re.compile(r"^(roll_\w+_serial):$", re.MULTILINE)
    for text in written:
        if found := symbol.search(text):
            source = re.sub(rf"\b{found[1]}\b", machine_code.SYMBOL, text)
    if source is None:
        raise ValueError(f"Taichi wrote {len(written)} files and no serial kernel in them")
    (folder / "rod.s").write_text(source)
    for command in ("as -o rod.o rod.s", "ld -shared -z noexecstack -o rod.so rod.o"):
        subprocess.run(command.split(), check=True)
    run = machine_code.loaded(folder / "rod.so")
    for sheet, doubles in zip(sheets, own, strict=True):
        run(sheet.integers, sheet.doubles, sheet.sizes.batch)
        off = difference(sheet, doubles)
        if not off < WITHIN:
            raise ValueError(f"the library differs from Taichi's kernel by {off}")
    return folder / "rod.so"


def trials() -> list[Sheet]:
    """Launches that go through every part of the kernel."""
    properties = RodProperties(0.45, 0.008, 0.044, 1e6, internal_damping=0.01)
    bar = Obstacle(
        "capsule", (0.2, 0.0, 0.285), (0.7071, 0.7071, 0.0, 0.0), radius=0.01, height=1.0
    )
    scene = pack([bar, Obstacle("box", (0.3, 0.0, 0.2), size=(0.1, 0.1, 0.17))])
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.3, 0.3, (2, 3, 2, 6))
    cost = rng.standard_normal((2, 3, 12, 3))
    names = ("bending_stiffness", "length", "damping", "internal_damping")
    sheets = []
    for kinds, touches in (
        (layout.WANT_ADJOINT, False),
        (layout.WANT_SENSITIVITIES, False),
        (0, True),
    ):
        rod = Rod(properties, 12, scheme="sdirk2", self_contact=touches)
        state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
        wanted = Wanted(kinds, names if kinds else (), cost=cost if kinds else None)
        states = [state, replace(state, velocities=state.velocities + 0.1)]
        sheets.append(opened(rod, states, actions, 0.02, obstacles=scene, wanted=wanted))
    return sheets


def difference(sheet: Sheet, doubles: np.ndarray) -> float:
    """How far a launch's sheet is from what another wrote, in parts of each section's largest."""
    worst = 0.0
    answers = (
        layout.AT_POSITIONS,
        layout.AT_ORIENTATIONS,
        layout.AT_SENSITIVITIES_OUT,
        layout.AT_ACTIONS_OUT,
        layout.AT_PARAMETERS_OUT,
    )
    other = replace(
        sheet, doubles=doubles, rods=doubles[: sheet.rods.size].reshape(sheet.rods.shape)
    )
    for name in answers:
        here, there = sheet.section(name), other.section(name)
        if here.size:
            scale = np.abs(there).max() + 1e-300
            off = np.abs(here - there).max() / scale
            worst = max(worst, off if np.isfinite(off) else np.inf)
    return float(worst)


if __name__ == "__main__":
    main()
