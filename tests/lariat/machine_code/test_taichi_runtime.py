"""Start of Taichi: nothing is printed into results or progress bars."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_the_start_of_taichi_prints_nothing():
    program = "from lariat.machine_code import taichi_runtime; taichi_runtime.start()"
    environment = {**os.environ, "ENABLE_TAICHI_HEADER_PRINT": "0"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=environment,
    )
    assert (done.stdout, done.stderr) == ("", "")


PROGRAM = """
import numpy as np
import taichi as ti
from lariat.machine_code import taichi_runtime

@ti.kernel
def double(a: ti.types.ndarray(), n: int):
    for i in range(n):
        a[i] = 2.0 * i

taichi_runtime.start()
numbers = np.zeros(4)
double(numbers, 4)
assert numbers.tolist() == [0.0, 2.0, 4.0, 6.0]
"""


def test_kernels_run_where_the_home_folder_cannot_be_written(tmp_path: Path) -> None:
    program, home = tmp_path / "program.py", tmp_path / "home"
    program.write_text(PROGRAM)
    # A file in its place, which root cannot write either.
    home.touch()
    done = subprocess.run(
        [sys.executable, str(program)],
        capture_output=True,
        text=True,
        env={**os.environ, "HOME": str(home), "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
