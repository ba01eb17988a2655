"""Compilation of the kernel into a library, in a process of its own.

Taichi writes assembly into the folder that its process runs in, reports on standard output, and
must be configured before it starts: hence the separate process. The library is kept only if it
computes the same numbers as Taichi's own kernel.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod.initial_shapes import straight
from lariat.rod.launch import machine_code, taichi_runtime
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers, kernel_arrays
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.inputs import DerivativeRequest, pack_constants, prepare
from lariat.rod.launch.kernel_key import imported_sources, kernel_key, own_sources
from lariat.rod.launch.layout import Section
from lariat.rod.launch.sizes import Sizes
from lariat.rod.model import ImplicitRodModel
from lariat.rod.properties import RodProperties
from lariat.rod.rollout_spec import RolloutSpec

MAX_DEVIATION = 1e-9
"""Deviation from Taichi's kernel above which a library is rejected, relative to the largest number
of a section [-]."""


def main(folder: str) -> None:
    """Compile the kernel into a library in `folder`, named after the key of its sources."""
    with tempfile.TemporaryDirectory() as workspace:
        os.chdir(workspace)
        key, library = build_library(Path(workspace))
        target = machine_code.library_path(Path(folder), key)
        finished = target.with_suffix(f".{os.getpid()}")
        finished.write_bytes(library.read_bytes())
        # The file appears to other processes as a whole.
        finished.replace(target)


def build_library(folder: Path) -> tuple[str, Path]:
    """Compile the kernel and compare it with Taichi's; return the key and the library.

    Args:
        folder: Folder for all files, which must be the current one.

    Raises:
        ValueError: Taichi wrote no kernel, the library computes other numbers than Taichi, or a
            source changed meanwhile.
        CalledProcessError: The assembler or the linker failed.
    """
    key = kernel_key(own_sources())
    taichi_runtime.start(writes_assembly=True)
    from lariat.rod.kernels import rollout

    launches = trial_launches()
    expected = [launch.doubles.copy() for launch in launches]
    for launch, doubles in zip(launches, expected, strict=True):
        arrays = kernel_arrays(launch.integers, doubles)
        taichi_runtime.launch(rollout.roll_out, arrays, launch.sizes.batch)
    # Taichi has read the sources: what has changed since belongs to another key.
    if kernel_key(imported_sources()) != key:
        raise ValueError("a source of the kernel changed while it was compiled")
    (folder / "rod.s").write_text(_kernel_assembly(folder) + _key_assembly(key))
    for command in ("as -o rod.o rod.s", "ld -shared -z noexecstack -o rod.so rod.o"):
        subprocess.run(command.split(), check=True)
    library = folder / "rod.so"
    run = machine_code.load(library, key)
    for launch, doubles in zip(launches, expected, strict=True):
        run(launch.integers, launch.doubles, launch.sizes.batch)
        found = deviation(launch, doubles)
        if not found < MAX_DEVIATION:
            raise ValueError(f"the library deviates from Taichi's kernel by {found}")
    return key, library


def _kernel_assembly(folder: Path) -> str:
    """Return the kernel's assembly from the files that Taichi wrote, under `KERNEL_SYMBOL`."""
    written = [path.read_text() for path in sorted(folder.glob("*.s"))]
    symbol = re.compile(r"^(roll_out_\w+_serial):$", re.MULTILINE)
    for text in reversed(written):
        if found := symbol.search(text):
            return re.sub(rf"\b{found[1]}\b", machine_code.KERNEL_SYMBOL, text)
    raise ValueError(f"none of the {len(written)} files that Taichi wrote holds a serial kernel")


def _key_assembly(key: str) -> str:
    """Return the assembly of the text that holds the library's key."""
    return f'\n.section .rodata\n.asciz "{machine_code.KEY_MARKER}{key}"\n'


def trial_launches() -> list[LaunchBuffers[Sizes]]:
    """Return launches that together run every part of the kernel."""
    properties = RodProperties(0.45, 0.008, 0.044, 1e6, internal_damping=0.01)
    bar = Obstacle(
        "capsule", (0.2, 0.0, 0.285), (0.7071, 0.7071, 0.0, 0.0), radius=0.01, height=1.0
    )
    scene = pack([bar, Obstacle("box", (0.3, 0.0, 0.2), size=(0.1, 0.1, 0.17))])
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.3, 0.3, (2, 3, 2, 6))
    cost = rng.standard_normal((2, 3, 12, 3))
    names = ("bending_stiffness", "length", "damping", "internal_damping")
    launches = []
    for kinds, self_contact in (
        (Derivatives.ADJOINT, False),
        (Derivatives.SENSITIVITIES, False),
        (Derivatives(0), True),
    ):
        model = ImplicitRodModel(properties, 12, scheme="sdirk2", self_contact=self_contact)
        state = straight(model, (0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
        request = DerivativeRequest(
            kinds, names if kinds else (), d_cost_d_positions=cost if kinds else None
        )
        states = [state, replace(state, velocities=state.velocities + 0.1)]
        spec = RolloutSpec(states, actions, 0.02, obstacles=scene)
        launches.append(prepare(model, pack_constants(model), BufferPool(), spec, request))
    return launches


def deviation(launch: LaunchBuffers[Sizes], doubles: Float64[np.ndarray, "m"]) -> float:
    """Return the largest difference of a launch's results from others [-].

    Differences are relative to the largest number of their section.

    Args:
        launch: Launch with its results.
        doubles: Doubles of the same launch with other results.
    """
    worst = 0.0
    results = (
        Section.POSITIONS,
        Section.ORIENTATIONS,
        Section.SENSITIVITIES_OUT,
        Section.ACTIONS_OUT,
        Section.PARAMETERS_OUT,
    )
    other = replace(
        launch, doubles=doubles, rods=doubles[: launch.rods.size].reshape(launch.rods.shape)
    )
    for name in results:
        here, there = launch.section(name), other.section(name)
        if here.size:
            scale = np.abs(there).max() + 1e-300
            difference = np.abs(here - there).max() / scale
            worst = max(worst, difference if np.isfinite(difference) else np.inf)
    return float(worst)
