"""Entry of every process of the stack: runs a module of this clone, whatever else bears its name.

    python -P module_entry.py MODULE [ARGUMENT...]

`python -m services.sim` would run the first package `services` on the path: one in the current
folder, or one that PYTHONPATH or another distribution brings. Here the clone comes first.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
"""Folder of the clone."""


def command(module: str, *arguments: str) -> tuple[str, ...]:
    """Arguments of the Python interpreter that run a module of this clone."""
    return ("-P", str(Path(__file__).resolve()), module, *arguments)


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
