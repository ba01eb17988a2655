"""Compilation of all kernels: `python requirements/kernels.py`, and into a FOLDER for images.

What is kept already is not compiled again.
"""

from __future__ import annotations

import os
import shutil
import sys
from multiprocessing.pool import ThreadPool
from pathlib import Path

from lariat.arms import path_kernel
from lariat.control.mpc import motion_kernels as controller_motion
from lariat.kernel_cache import cache, key
from lariat.kernel_cache.source import KernelSource
from lariat.paper.xpbd.launch import kernel_launch as xpbd
from lariat.perception.centerline import chain_fit
from lariat.rod.launch import machine_code as rod
from lariat.safety.motion import motion_kernels as gateway_motion
from lariat.simulation.camera import camera_kernels

SOURCES = (
    # The rod's takes longest.
    rod.SOURCE,
    xpbd.SOURCE,
    chain_fit.KERNEL,
    *camera_kernels.SOURCES,
    *path_kernel.SOURCES,
    *gateway_motion.SOURCES,
    *controller_motion.SOURCES.values(),
)
"""All kernels."""


def main(folder: Path | None) -> None:
    """Compile all kernels, and write their machine code into a new folder, if one is given."""
    with ThreadPool(os.cpu_count()) as pool:
        for count, name in enumerate(pool.imap_unordered(_compiled, SOURCES), 1):
            print(f"\rKernels: {count} of {len(SOURCES)} ({name})\033[K", end="", flush=True)
    print()
    if folder is None:
        return
    kept = key.cache_folder()
    folder.mkdir()
    shutil.copy(key.compiler_file(kept), folder)
    for source in SOURCES:
        shutil.copy(cache.kernel_path(kept, source.name, key.kernel_key(source)), folder)


def _compiled(source: KernelSource) -> str:
    cache.kernel(source)
    return source.name


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
