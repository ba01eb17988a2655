"""Start of Taichi: nothing is printed into results or progress bars."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_the_start_of_taichi_prints_nothing():
    program = "from lariat.kernel_cache import runtime; runtime.start()"
    silent = {f"ENABLE_{name}_HEADER_PRINT": "0" for name in ("TAICHI", "QUADRANTS")}
    environment = {**os.environ, **silent}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=environment,
    )
    assert (done.stdout, done.stderr) == ("", "")
