"""What the examples and notebooks print, with its bounds."""

from __future__ import annotations

import json
import re
from pathlib import Path

FACTS = {
    "02": (r"target by (\S+) mm", 0.0, 2.0),
    "04": (r"buckling: (\S+) of Euler's", 0.998, 1.003),
    "06": (r"mean error (\S+) mm", 0.0, 0.5),
    "07": (r"bending_stiffness: found (\S+),", 0.999 * 3.5e-4, 1.001 * 3.5e-4),  # [N m^2]
    "09": (r"(\d+) differences", 0.0, 0.0),
    "11": (r"ShapeServo: error (\S+) mm", 0.0, 5.0),
    "12": (r"Carried: error (\S+) mm", 0.0, 5.0),
    "13": (r"error (\S+) mm", 0.0, 1.0),
    "14": (r"scene 1: error (\S+) mm", 0.0, 10.0),
    "15": (r"error (\S+) mm", 0.0, 0.5),
    "16": (r"keep_out: broken by (\S+) m", 0.04, 0.06),
}
"""Fact that each example prints, and its bounds."""
NOTEBOOKS = {
    "identify": (r"stiffness: (\S+) ±", 0.9 * 0.007768, 1.1 * 0.007768),  # [m^4/s^2]
    "plan": (r"clearance (\S+) mm", 12.0, 40.0),
    "recording": (r"to (\S+) mm", 0.0, 1.0),
    "rope": (r"0.35 +0. +(\S+)\] m$", 0.449, 0.451),  # height of the grip [m]
    "run": (r"worst error (\S+) mm", 0.0, 3.0),
}
"""The same of each notebook."""
IN_THE_WHEEL = ("06", "15", "16", "rope", "identify", "plan")
"""Those that need the library alone; they run in an environment that has nothing else."""


def check(name: str, output: str) -> None:
    """Check what an example or notebook has printed.

    Args:
        name: Number of the example or name of the notebook.
        output: Its standard output.
    """
    pattern, low, high = (FACTS | NOTEBOOKS)[name]
    fact = re.search(pattern, output, re.MULTILINE)
    assert fact, pattern
    assert low <= float(fact[1]) <= high


def code_of(notebook: Path) -> str:
    """Return the code of all cells, as one program."""
    cells = json.loads(notebook.read_text())["cells"]
    return "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")
