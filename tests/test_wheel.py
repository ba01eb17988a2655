"""The library's wheel holds `lariat` alone and works in an empty environment."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROGRAM = """
import numpy as np
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties

rod = Rod(RodProperties(length=0.45, diameter=0.008, linear_density=0.044, youngs_modulus=1e6), 20)
along_x = np.array([0.5, 0.5, 0.5, 0.5])
left, right = (Pose(np.array([x, 0.0, 0.3]), along_x) for x in (0.0, 0.4))
shape = rod.rest(left, right).state.positions
assert np.isfinite(shape).all(), shape
assert shape[10, 2] < 0.29, shape
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


def test_it_holds_the_library_alone(wheel: Path):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"lariat"}
    assert "lariat/py.typed" in names


def test_a_rod_hangs_in_an_empty_environment_in_a_folder_with_names_of_the_stack(
    wheel: Path, tmp_path: Path
):
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
    python = environment / "bin" / "python"
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel]
    subprocess.run(install, check=True)
    here = tmp_path / "here"
    for name in ("shared", "services", "stack"):
        (here / name).mkdir(parents=True)
        (here / name / "__init__.py").write_text("raise RuntimeError('shadowed')\n")
    (here / "program.py").write_text(PROGRAM)
    subprocess.run([python, "program.py"], check=True, cwd=here)
