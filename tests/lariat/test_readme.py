"""The examples of the library's README run as written; importing the rod imports no extra."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import lariat

README = Path(lariat.__path__[0]) / "README.md"
EXTRAS = ("torch", "matplotlib", "scipy", "taichi")


def test_the_examples_of_the_readme_run_one_after_the_other(tmp_path: Path) -> None:
    examples = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert len(examples) == 2
    program = "\n".join(examples)
    found = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={
            "PYTHONPATH": str(README.parents[1]),
            "HOME": str(Path.home()),
            "PATH": "/usr/bin:/bin",
        },
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "(10, 2, 6)" in found
    assert found.splitlines()[-1] == "8"


def test_importing_the_rod_imports_no_extra() -> None:
    program = f"""
import sys
import lariat.geometry, lariat.rod, lariat.identification, lariat.paper.xpbd, lariat.trajectory
print([name for name in {EXTRAS} if name in sys.modules])
"""
    command = [sys.executable, "-c", program]
    found = subprocess.run(
        command, cwd=README.parents[1], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"
