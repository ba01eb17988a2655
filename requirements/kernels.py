"""Compilation of the kernels of all images: `python requirements/kernels.py FOLDER`.

What is kept in `~/.cache/lariat` is not compiled again.
"""

from __future__ import annotations

import os
import shutil
import sys
from multiprocessing.pool import ThreadPool
from pathlib import Path

from lariat.arms import path_kernel
from lariat.control.mpc import motion_kernels as controller_motion
from lariat.machine_code import kernel_key, library
from lariat.perception.centerline import chain_fit
from lariat.rod.launch import machine_code as rod
from lariat.safety.motion import motion_kernels as gateway_motion
from lariat.simulation.camera import camera_kernels

SOURCES = (
    # The rod's takes longest.
    rod.SOURCE,
    chain_fit.KERNEL,
    *camera_kernels.SOURCES,
    *path_kernel.SOURCES,
    *gateway_motion.SOURCES,
    *controller_motion.SOURCES.values(),
)
"""All kernels whose machine code images hold."""


def main(folder: Path) -> None:
    """Write the machine code of all kernels into a new folder.

    Raises:
        RuntimeError: A kernel could not be compiled; a warning says why.
    """
    kept = kernel_key.library_folder()
    # A build that is repeated tries again.
    for failure in kept.glob("*.failed"):
        failure.unlink()
    with ThreadPool(os.cpu_count()) as pool:
        compiled = pool.map(library.compiled_kernel, SOURCES, chunksize=1)
    if not all(compiled):
        raise RuntimeError("a kernel could not be compiled: see the warning above")
    folder.mkdir()
    shutil.copy(kernel_key.version_file(kept), folder)
    for source in SOURCES:
        key = kernel_key.own_key(source)
        shutil.copy(library.library_path(kept, source.name, key), folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
